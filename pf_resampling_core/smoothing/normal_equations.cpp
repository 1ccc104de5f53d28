#include "pf_resampling_core/smoothing/normal_equations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Nothing else holds a landmark whose sightings were all taken away.
constexpr double kLandmarkInformation = 1e-9;  // 1/m^2
// Poses of a segment, at least.
constexpr int kShortest = 12;

// The longer the drive, the longer the segments: so many cuts are left that they cost no more.
int segment_length(int poses) {
  return std::max(kShortest, static_cast<int>(0.5 * std::sqrt(poses)));
}

std::size_t to_size(int number) {
  return static_cast<std::size_t>(number);
}

// Lower triangle of the Cholesky factor of a matrix of which only that is given. False if it is not
// positive definite.
bool factorize_in_place(Eigen::MatrixXd* matrix) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(*matrix);
  return factor.info() == Eigen::Success;
}

}  // namespace

NormalEquations::NormalEquations(const SmoothingGraph& graph) {
  cut_into_segments(static_cast<int>(graph.poses.size()));
  constants_ = first_landmark_ + 2 * static_cast<int>(graph.landmarks.size());
  pose_at_.back() = constants_ + kSensorConstants;
  const int size = pose_at_.back() + 3;
  for (const MotionFactor& motion : graph.motions) {
    motion_roots_.push_back(motion_root(motion, graph.noise.motion));
  }
  prior_places_ = prior_places(graph.prior);
  find_borders(graph);
  of_rest_.resize(size - rest_, size - rest_);
  gradient_.setZero(size);
}

// The first pose is a cut: the prior joins it with the landmarks. The newest has its own place.
void NormalEquations::cut_into_segments(int poses) {
  const int length = segment_length(poses);
  const auto is_cut = [&](int pose) { return pose % (length + 1) == 0; };
  pose_at_.resize(to_size(poses));
  segment_of_.assign(to_size(poses), -1);
  int next = 0;
  for (int pose = 0; pose + 1 < poses; ++pose) {
    if (is_cut(pose)) continue;
    if (is_cut(pose - 1)) {
      segments_.emplace_back();
      segments_.back().at = next;
    }
    segment_of_[to_size(pose)] = static_cast<int>(segments_.size()) - 1;
    segment_at_.push_back(segment_of_[to_size(pose)]);
    pose_at_[to_size(pose)] = next;
    next += 3;
  }
  rest_ = next;
  for (int pose = 0; pose + 1 < poses; pose += length + 1) {
    pose_at_[to_size(pose)] = next;
    next += 3;
  }
  first_landmark_ = next;
}

void NormalEquations::find_borders(const SmoothingGraph& graph) {
  std::vector<std::set<std::pair<int, int>>> blocks(segments_.size());  // first unknown, number
  std::vector<int> sizes(segments_.size(), 0);
  const int poses = static_cast<int>(graph.poses.size());
  for (int pose = 0; pose < poses; ++pose) {
    const int segment = segment_of_[to_size(pose)];
    if (segment < 0) continue;
    sizes[to_size(segment)] += 3;
    for (const int neighbour : {pose - 1, pose + 1}) {
      if (segment_of_[to_size(neighbour)] < 0) {
        blocks[to_size(segment)].emplace(pose_at_[to_size(neighbour)], 3);
      }
    }
  }
  for (const SightingFactor& sighting : graph.sightings) {
    const int segment = segment_of_[to_size(sighting.pose)];
    if (segment >= 0) blocks[to_size(segment)].emplace(landmark_at(sighting.landmark), 2);
  }
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    Segment& segment = segments_[s];
    blocks[s].emplace(constants_, kSensorConstants);
    for (const auto& [at, count] : blocks[s]) {
      for (int i = 0; i < count; ++i) segment.border.push_back(at + i);
    }
    segment.own.resize(sizes[s], sizes[s]);
    segment.coupling.resize(sizes[s], static_cast<Eigen::Index>(segment.border.size()));
  }
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

// Of blocks beside the diagonal the one below it counts.
template <typename Block>
void NormalEquations::add(int row, int column, const Block& block) {
  if (row < column) {
    add(column, row, block.transpose().eval());
  } else if (column >= rest_) {
    of_rest_.block(row - rest_, column - rest_, block.rows(), block.cols()) += block;
  } else {
    Segment& segment = segments_[to_size(segment_at_[to_size(column / 3)])];
    const int own = column - segment.at;
    if (row < rest_) {
      segment.own.block(row - segment.at, own, block.rows(), block.cols()) += block;
    } else {
      const auto place = std::lower_bound(segment.border.begin(), segment.border.end(), row);
      segment.coupling.block(own, place - segment.border.begin(), block.cols(), block.rows()) +=
          block.transpose();
    }
  }
}

void NormalEquations::linearize(const SmoothingGraph& graph, double robust_width) {
  for (Segment& segment : segments_) {
    segment.own.setZero();
    segment.coupling.setZero();
  }
  of_rest_.setZero();
  gradient_.setZero();
  // Finding a block's place may take longer than computing it, so blocks are summed up before.
  using ByConstants = Eigen::Matrix<double, 3, kSensorConstants>;
  std::vector<Eigen::Matrix3d> of_poses(graph.poses.size(), Eigen::Matrix3d::Zero());
  std::vector<ByConstants> of_poses_and_constants(graph.poses.size(), ByConstants::Zero());
  std::vector<Eigen::Matrix2d> of_landmarks(graph.landmarks.size(),
                                            kLandmarkInformation * Eigen::Matrix2d::Identity());
  std::vector<Eigen::Matrix2d> of_landmarks_and_sensor(graph.landmarks.size(),
                                                       Eigen::Matrix2d::Zero());
  Eigen::Matrix2d of_sensor = Eigen::Matrix2d::Zero();
  OdometryInformation of_odometry = OdometryInformation::Zero();
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
    of_odometry += r.by_constants.transpose() * r.by_constants;
    gradient_.segment<3>(pose_at_[i]) += r.by_from.transpose() * r.value;
    gradient_.segment<3>(pose_at_[i + 1]) += r.by_to.transpose() * r.value;
    gradient_.segment<kOdometryConstants>(constants_) += r.by_constants.transpose() * r.value;
  }
  const int sensor = constants_ + SensorConstant::range_scale;
  for (const SightingFactor& sighting : graph.sightings) {
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
    of_landmarks[landmark] += r.by_landmark.transpose() * r.by_landmark;
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
    add(at, at, of_landmarks[l]);
    add(at, sensor, of_landmarks_and_sensor[l]);
  }
  add(constants_, constants_, of_odometry);
  add(sensor, sensor, of_sensor);
  add_prior(graph);
}

void NormalEquations::add_prior(const SmoothingGraph& graph) {
  const GaussianPrior& prior = graph.prior;
  const Eigen::VectorXd slope = prior.gradient + prior.information * prior_difference(graph);
  for (Eigen::Index j = 0; j < prior.size(); ++j) {
    const int column = prior_places_[static_cast<std::size_t>(j)];
    gradient_[column] += slope[j];
    for (Eigen::Index i = 0; i < prior.size(); ++i) {
      const int row = prior_places_[static_cast<std::size_t>(i)];
      if (row >= column) of_rest_(row - rest_, column - rest_) += prior.information(i, j);
    }
  }
}

bool NormalEquations::factorize(double damping) {
  rest_root_ = of_rest_;
  rest_root_.diagonal() *= 1.0 + damping;
  Eigen::MatrixXd sum;
  for (Segment& segment : segments_) {
    segment.own_root = segment.own;
    segment.own_root.diagonal() *= 1.0 + damping;
    if (!factorize_in_place(&segment.own_root)) return false;
    segment.eliminated = segment.coupling;
    segment.own_root.triangularView<Eigen::Lower>().solveInPlace(segment.eliminated);
    const Eigen::Index border = segment.eliminated.cols();
    sum.setZero(border, border);
    sum.selfadjointView<Eigen::Lower>().rankUpdate(segment.eliminated.transpose());
    for (Eigen::Index j = 0; j < border; ++j) {
      const int column = segment.border[static_cast<std::size_t>(j)] - rest_;
      for (Eigen::Index i = j; i < border; ++i) {
        rest_root_(segment.border[static_cast<std::size_t>(i)] - rest_, column) -= sum(i, j);
      }
    }
  }
  return factorize_in_place(&rest_root_);
}

double NormalEquations::log_determinant() const {
  double sum = rest_root_.diagonal().array().log().sum();
  for (const Segment& segment : segments_) sum += segment.own_root.diagonal().array().log().sum();
  return 2.0 * sum;
}

// factor⁻¹·right
Eigen::MatrixXd NormalEquations::forward(Eigen::MatrixXd right) const {
  for (const Segment& segment : segments_) {
    auto own = right.middleRows(segment.at, segment.size());
    segment.own_root.triangularView<Eigen::Lower>().solveInPlace(own);
    const Eigen::MatrixXd passed_on = segment.eliminated.transpose() * own;
    for (std::size_t i = 0; i < segment.border.size(); ++i) {
      right.row(segment.border[i]) -= passed_on.row(static_cast<Eigen::Index>(i));
    }
  }
  auto rest = right.bottomRows(size() - rest_);
  rest_root_.triangularView<Eigen::Lower>().solveInPlace(rest);
  return right;
}

// factor⁻ᵀ·right
Eigen::MatrixXd NormalEquations::backward(Eigen::MatrixXd right) const {
  auto rest = right.bottomRows(size() - rest_);
  rest_root_.triangularView<Eigen::Lower>().transpose().solveInPlace(rest);
  for (const Segment& segment : segments_) {
    Eigen::MatrixXd at_border(segment.eliminated.cols(), right.cols());
    for (std::size_t i = 0; i < segment.border.size(); ++i) {
      at_border.row(static_cast<Eigen::Index>(i)) = right.row(segment.border[i]);
    }
    auto own = right.middleRows(segment.at, segment.size());
    own.noalias() -= segment.eliminated * at_border;
    segment.own_root.triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  return right;
}

Eigen::VectorXd NormalEquations::step() const {
  return -backward(forward(gradient_));
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

Eigen::Index NormalEquations::trailing_size() const {
  return size() - first_landmark_;
}

Eigen::MatrixXd NormalEquations::trailing_root() const {
  const Eigen::Index trailing = trailing_size();
  return rest_root_.bottomRightCorner(trailing, trailing).triangularView<Eigen::Lower>();
}

Eigen::VectorXd NormalEquations::trailing_gradient() const {
  return trailing_root() * forward(gradient_).bottomRows(trailing_size());
}

}  // namespace pf_resampling
