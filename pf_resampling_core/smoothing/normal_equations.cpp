#include "pf_resampling_core/smoothing/normal_equations.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Nothing else holds a landmark whose sightings were all taken away.
constexpr double kLandmarkInformation = 1e-9;  // 1/m^2
constexpr int kLeaf = 4;                       // poses that are eliminated in the order of time

// The place of a block in the upper triangle.
struct BlockPlace {
  int row, column, rows, columns;
};

}  // namespace

NormalEquations::NormalEquations(const SmoothingGraph& graph) {
  const int poses = static_cast<int>(graph.poses.size());
  const int landmarks = static_cast<int>(graph.landmarks.size());
  pose_at_.resize(graph.poses.size());
  order_poses(0, poses - 1);
  first_landmark_ = next_;
  constants_ = first_landmark_ + 2 * landmarks;
  pose_at_.back() = constants_ + kSensorConstants;
  const int size = pose_at_.back() + 3;
  for (const MotionFactor& motion : graph.motions) {
    motion_roots_.push_back(motion_root(motion, graph.noise.motion));
  }
  prior_places_ = prior_places(graph.prior);

  // The pattern: which rows each column of the upper triangle has.
  std::vector<BlockPlace> blocks;
  const auto put = [&](int row, int rows, int column, int columns) {
    if (row <= column) {
      blocks.push_back({row, column, rows, columns});
    } else {
      blocks.push_back({column, row, columns, rows});
    }
  };
  for (int pose = 0; pose < poses; ++pose) {
    const int at = pose_at_[static_cast<std::size_t>(pose)];
    put(at, 3, at, 3);
    put(at, 3, constants_, kSensorConstants);
    if (pose > 0) put(pose_at_[static_cast<std::size_t>(pose) - 1], 3, at, 3);
  }
  for (int landmark = 0; landmark < landmarks; ++landmark) {
    put(landmark_at(landmark), 2, landmark_at(landmark), 2);
    put(landmark_at(landmark), 2, constants_, kSensorConstants);
  }
  put(constants_, kSensorConstants, constants_, kSensorConstants);
  for (const SightingFactor& sighting : graph.sightings) {
    put(pose_at_[static_cast<std::size_t>(sighting.pose)], 3, landmark_at(sighting.landmark), 2);
  }
  std::vector<std::vector<int>> rows(static_cast<std::size_t>(size));
  for (const BlockPlace& block : blocks) {
    for (int column = block.column; column < block.column + block.columns; ++column) {
      for (int row = block.row; row < block.row + block.rows && row <= column; ++row) {
        rows[static_cast<std::size_t>(column)].push_back(row);
      }
    }
  }
  const GaussianPrior& prior = graph.prior;
  for (Eigen::Index j = 0; j < prior.size(); ++j) {
    for (Eigen::Index i = 0; i < prior.size(); ++i) {
      const int row = prior_places_[static_cast<std::size_t>(i)];
      const int column = prior_places_[static_cast<std::size_t>(j)];
      if (prior.information(i, j) != 0.0 && row <= column) {
        rows[static_cast<std::size_t>(column)].push_back(row);
      }
    }
  }
  hessian_.resize(size, size);
  Eigen::VectorXi sizes(size);
  for (int column = 0; column < size; ++column) {
    std::vector<int>& in_column = rows[static_cast<std::size_t>(column)];
    std::sort(in_column.begin(), in_column.end());
    in_column.erase(std::unique(in_column.begin(), in_column.end()), in_column.end());
    sizes[column] = static_cast<int>(in_column.size());
  }
  hessian_.reserve(sizes);
  for (int column = 0; column < size; ++column) {
    for (const int row : rows[static_cast<std::size_t>(column)]) hessian_.insert(row, column) = 0.0;
  }
  hessian_.makeCompressed();
  for (Eigen::Index j = 0; j < prior.size(); ++j) {
    for (Eigen::Index i = 0; i < prior.size(); ++i) {
      const int row = prior_places_[static_cast<std::size_t>(i)];
      const int column = prior_places_[static_cast<std::size_t>(j)];
      if (prior.information(i, j) != 0.0 && row <= column) {
        prior_slots_.push_back(slot_of(row, column));
      }
    }
  }
  gradient_.setZero(size);
  factor_.analyzePattern(hessian_);
}

// The middle one last: the halves are then independent. The newest pose has its own place.
void NormalEquations::order_poses(int first, int last) {
  const int newest = static_cast<int>(pose_at_.size()) - 1;
  const auto place = [&](int pose) {
    if (pose == newest) return;
    pose_at_[static_cast<std::size_t>(pose)] = next_;
    next_ += 3;
  };
  if (last - first < kLeaf) {
    for (int pose = first; pose <= last; ++pose) place(pose);
    return;
  }
  const int middle = first + (last - first) / 2;
  order_poses(first, middle - 1);
  order_poses(middle + 1, last);
  place(middle);
}

std::vector<int> NormalEquations::prior_places(const GaussianPrior& prior) const {
  std::vector<int> places;
  for (int i = 0; i < 3; ++i) places.push_back(pose_at_.front() + i);
  for (int landmark = 0; landmark < static_cast<int>(prior.landmarks.size()); ++landmark) {
    places.push_back(landmark_at(landmark));
    places.push_back(landmark_at(landmark) + 1);
  }
  for (int i = 0; i < kSensorConstants; ++i) places.push_back(constants_ + i);
  return places;
}

Eigen::VectorXd NormalEquations::prior_difference(const SmoothingGraph& graph) const {
  const GaussianPrior& prior = graph.prior;
  Eigen::VectorXd difference(prior.size());
  const Pose2& first = graph.poses.front();
  difference.head<3>() << first.x - prior.pose.x, first.y - prior.pose.y,
      wrap_angle(first.heading - prior.pose.heading);
  for (std::size_t l = 0; l < prior.landmarks.size(); ++l) {
    difference.segment<2>(3 + 2 * static_cast<Eigen::Index>(l)) =
        graph.landmarks[l] - prior.landmarks[l];
  }
  difference.tail<kSensorConstants>() = graph.constants - prior.constants;
  return difference;
}

int NormalEquations::slot_of(int row, int column) const {
  const int* inner = hessian_.innerIndexPtr();
  const int* begin = inner + hessian_.outerIndexPtr()[column];
  const int* end = inner + hessian_.outerIndexPtr()[column + 1];
  return static_cast<int>(std::lower_bound(begin, end, row) - inner);
}

// Rows of a block follow each other in every column.
template <typename Block>
void NormalEquations::add(int row, int column, const Block& block) {
  if (row > column) {
    add(column, row, block.transpose().eval());
    return;
  }
  for (int j = 0; j < block.cols(); ++j) {
    double* value = hessian_.valuePtr() + slot_of(row, column + j);
    const int rows = row == column ? j + 1 : static_cast<int>(block.rows());
    for (int i = 0; i < rows; ++i) value[i] += block(i, j);
  }
}

void NormalEquations::linearize(const SmoothingGraph& graph, double robust_width,
                                const std::vector<int>& left_out) {
  std::fill(hessian_.valuePtr(), hessian_.valuePtr() + hessian_.nonZeros(), 0.0);
  gradient_.setZero();
  landmarks_given_path_.assign(graph.landmarks.size(),
                               kLandmarkInformation * Eigen::Matrix2d::Identity());
  odometry_given_path_.setZero();
  // Finding a block's place takes longer than computing it, so blocks are summed up before.
  using ByConstants = Eigen::Matrix<double, 3, kSensorConstants>;
  std::vector<Eigen::Matrix3d> of_poses(graph.poses.size(), Eigen::Matrix3d::Zero());
  std::vector<ByConstants> of_poses_and_constants(graph.poses.size(), ByConstants::Zero());
  std::vector<Eigen::Matrix2d> of_landmarks_and_sensor(graph.landmarks.size(),
                                                       Eigen::Matrix2d::Zero());
  Eigen::Matrix2d of_sensor = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    const MotionResidual r = motion_residual(graph.motions[i], motion_roots_[i], graph.poses[i],
                                             graph.poses[i + 1], graph.constants);
    of_poses[i] += r.by_from.transpose() * r.by_from;
    of_poses[i + 1] += r.by_to.transpose() * r.by_to;
    add(pose_at_[i], pose_at_[i + 1], (r.by_from.transpose() * r.by_to).eval());
    of_poses_and_constants[i].leftCols<kOdometryConstants>() +=
        r.by_from.transpose() * r.by_constants;
    of_poses_and_constants[i + 1].leftCols<kOdometryConstants>() +=
        r.by_to.transpose() * r.by_constants;
    odometry_given_path_ += r.by_constants.transpose() * r.by_constants;
    gradient_.segment<3>(pose_at_[i]) += r.by_from.transpose() * r.value;
    gradient_.segment<3>(pose_at_[i + 1]) += r.by_to.transpose() * r.value;
    gradient_.segment<kOdometryConstants>(constants_) += r.by_constants.transpose() * r.value;
  }
  const int sensor = constants_ + SensorConstant::range_scale;
  for (std::size_t s = 0; s < graph.sightings.size(); ++s) {
    if (std::binary_search(left_out.begin(), left_out.end(), static_cast<int>(s))) continue;
    const SightingFactor& sighting = graph.sightings[s];
    const std::size_t pose = static_cast<std::size_t>(sighting.pose);
    const std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
    SightingResidual r = sighting_residual(sighting, graph.noise, graph.poses[pose],
                                           graph.landmarks[landmark], graph.constants);
    const double root = std::sqrt(robust_weight(r.value.squaredNorm(), robust_width));
    r.value *= root;
    r.by_pose *= root;
    r.by_landmark *= root;
    r.by_constants *= root;
    of_poses[pose] += r.by_pose.transpose() * r.by_pose;
    of_poses_and_constants[pose].rightCols<2>() += r.by_pose.transpose() * r.by_constants;
    add(pose_at_[pose], landmark_at(sighting.landmark),
        (r.by_pose.transpose() * r.by_landmark).eval());
    landmarks_given_path_[landmark] += r.by_landmark.transpose() * r.by_landmark;
    of_landmarks_and_sensor[landmark] += r.by_landmark.transpose() * r.by_constants;
    of_sensor += r.by_constants.transpose() * r.by_constants;
    gradient_.segment<3>(pose_at_[pose]) += r.by_pose.transpose() * r.value;
    gradient_.segment<2>(landmark_at(sighting.landmark)) += r.by_landmark.transpose() * r.value;
    gradient_.segment<2>(sensor) += r.by_constants.transpose() * r.value;
  }
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    add(pose_at_[i], pose_at_[i], of_poses[i]);
    add(pose_at_[i], constants_, of_poses_and_constants[i]);
  }
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    const int at = landmark_at(static_cast<int>(l));
    add(at, at, landmarks_given_path_[l]);
    add(at, sensor, of_landmarks_and_sensor[l]);
  }
  add(constants_, constants_, odometry_given_path_);
  add(sensor, sensor, of_sensor);
  add_prior(graph);
}

void NormalEquations::add_prior(const SmoothingGraph& graph) {
  const GaussianPrior& prior = graph.prior;
  const Eigen::VectorXd slope = prior.gradient + prior.information * prior_difference(graph);
  std::size_t next = 0;
  for (Eigen::Index j = 0; j < prior.size(); ++j) {
    const int column = prior_places_[static_cast<std::size_t>(j)];
    gradient_[column] += slope[j];
    for (Eigen::Index i = 0; i < prior.size(); ++i) {
      const int row = prior_places_[static_cast<std::size_t>(i)];
      if (prior.information(i, j) != 0.0 && row <= column) {
        hessian_.valuePtr()[prior_slots_[next++]] += prior.information(i, j);
      }
    }
  }
  for (std::size_t l = 0; l < prior.landmarks_given_path.size(); ++l) {
    landmarks_given_path_[l] += prior.landmarks_given_path[l];
  }
  odometry_given_path_ += prior.odometry_given_path;
}

bool NormalEquations::factorize(double damping) {
  if (damping == 0.0) {
    factor_.factorize(hessian_);
  } else {
    Sparse damped = hessian_;
    for (int i = 0; i < size(); ++i) {
      // The diagonal is the last of its column's upper triangle.
      damped.valuePtr()[damped.outerIndexPtr()[i + 1] - 1] *= 1.0 + damping;
    }
    factor_.factorize(damped);
  }
  return factor_.info() == Eigen::Success;
}

double NormalEquations::log_determinant() const {
  const Sparse& lower = factor_.matrixL().nestedExpression();
  return 2.0 * lower.diagonal().array().log().sum();
}

Eigen::VectorXd NormalEquations::step() const {
  return -factor_.solve(gradient_);
}

void NormalEquations::move(const Eigen::VectorXd& step, SmoothingGraph* graph) const {
  for (std::size_t i = 0; i < graph->poses.size(); ++i) {
    Pose2& pose = graph->poses[i];
    const int at = pose_at_[i];
    pose = {pose.x + step[at], pose.y + step[at + 1], wrap_angle(pose.heading + step[at + 2])};
  }
  for (std::size_t l = 0; l < graph->landmarks.size(); ++l) {
    graph->landmarks[l] += step.segment<2>(landmark_at(static_cast<int>(l)));
  }
  graph->constants += step.segment<kSensorConstants>(constants_);
}

double NormalEquations::cost(const SmoothingGraph& graph, double robust_width) const {
  double cost = 0.0;
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    cost += 0.5 * motion_residual(graph.motions[i], motion_roots_[i], graph.poses[i],
                                  graph.poses[i + 1], graph.constants)
                      .value.squaredNorm();
  }
  for (const SightingFactor& sighting : graph.sightings) {
    const SightingResidual r = sighting_residual(
        sighting, graph.noise, graph.poses[static_cast<std::size_t>(sighting.pose)],
        graph.landmarks[static_cast<std::size_t>(sighting.landmark)], graph.constants);
    cost += robust_cost(r.value.squaredNorm(), robust_width);
  }
  const Eigen::VectorXd difference = prior_difference(graph);
  return cost + 0.5 * difference.dot(graph.prior.information * difference) +
         graph.prior.gradient.dot(difference);
}

InformationParts NormalEquations::information_along(const SmoothingGraph& graph,
                                                    double robust_width,
                                                    const std::vector<int>& left_out,
                                                    const Directions& directions) const {
  InformationParts parts;
  for (std::size_t i = 0; i < graph.motions.size(); ++i) {
    const MotionResidual r = motion_residual(graph.motions[i], motion_roots_[i], graph.poses[i],
                                             graph.poses[i + 1], graph.constants);
    const Eigen::Matrix<double, 3, 2> moved =
        r.by_from * directions.middleRows<3>(pose_at_[i]) +
        r.by_to * directions.middleRows<3>(pose_at_[i + 1]) +
        r.by_constants * directions.middleRows<kOdometryConstants>(constants_);
    parts.motions += moved.transpose() * moved;
  }
  for (std::size_t s = 0; s < graph.sightings.size(); ++s) {
    if (std::binary_search(left_out.begin(), left_out.end(), static_cast<int>(s))) continue;
    const SightingFactor& sighting = graph.sightings[s];
    const std::size_t pose = static_cast<std::size_t>(sighting.pose);
    const SightingResidual r = sighting_residual(
        sighting, graph.noise, graph.poses[pose],
        graph.landmarks[static_cast<std::size_t>(sighting.landmark)], graph.constants);
    const Eigen::Matrix2d moved =
        r.by_pose * directions.middleRows<3>(pose_at_[pose]) +
        r.by_landmark * directions.middleRows<2>(landmark_at(sighting.landmark)) +
        r.by_constants * directions.middleRows<2>(constants_ + SensorConstant::range_scale);
    const double weight = robust_weight(r.value.squaredNorm(), robust_width);
    parts.ranges += weight * moved.row(0).transpose() * moved.row(0);
    parts.bearings += weight * moved.row(1).transpose() * moved.row(1);
  }
  const GaussianPrior& prior = graph.prior;
  Directions of_prior(prior.size(), 2);
  for (Eigen::Index i = 0; i < prior.size(); ++i) {
    of_prior.row(i) = directions.row(prior_places_[static_cast<std::size_t>(i)]);
  }
  parts.prior = of_prior.transpose() * prior.information * of_prior;
  return parts;
}

Eigen::Index NormalEquations::trailing_size() const {
  return size() - first_landmark_;
}

Eigen::MatrixXd NormalEquations::trailing_root() const {
  const Eigen::Index trailing = trailing_size();
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(trailing, trailing);
  const Sparse& lower = factor_.matrixL().nestedExpression();
  for (Eigen::Index column = 0; column < trailing; ++column) {
    for (Sparse::InnerIterator entry(lower, first_landmark_ + column); entry; ++entry) {
      root(entry.row() - first_landmark_, column) = entry.value();
    }
  }
  return root;
}

Eigen::VectorXd NormalEquations::trailing_gradient() const {
  const Eigen::VectorXd eliminated = factor_.matrixL().solve(gradient_);
  return trailing_root() * eliminated.tail(trailing_size());
}

}  // namespace pf_resampling
