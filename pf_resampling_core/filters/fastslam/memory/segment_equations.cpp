#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"

namespace pf_resampling {
namespace {

Eigen::Vector2d rotated(double angle, const Eigen::Vector2d& v) {
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
}

Eigen::Vector2d place(const Pose2& pose) {
  return {pose.x, pose.y};
}

}  // namespace

SegmentEquations::SegmentEquations(const SegmentGraph& graph, const std::vector<int>* last)
    : bases_(graph.segments.size()), landmarks_(graph.landmarks.size()) {
  std::vector<int> sizes(bases_, 3);
  sizes.insert(sizes.end(), landmarks_, 2);
  sizes.push_back(kSensorConstants);
  std::vector<std::vector<int>> blocks;
  for (std::size_t s = 0; s < bases_; ++s) blocks.push_back(blocks_of(s, *graph.segments[s]));
  const std::vector<bool> are_seen = seen_landmarks(graph);
  for (std::size_t l = 0; l < landmarks_; ++l) {
    if (!are_seen[l]) unseen_.push_back(static_cast<int>(l));
  }
  // The constants behind all: they touch everything.
  std::vector<int> last_blocks;
  if (last != nullptr) {
    last_blocks.push_back(static_cast<int>(bases_) - 1);
    for (const int landmark : *last) last_blocks.push_back(static_cast<int>(bases_) + landmark);
  }
  last_blocks.push_back(static_cast<int>(sizes.size()) - 1);
  root_ = MultifrontalCholesky(std::move(sizes), blocks, last_blocks);
  last_at_ = root_.at(last_blocks.front());
  gradient_.setZero(root_.size());
}

// Of a segment: base, unless that is the first and known, end, tracks, constants.
std::vector<int> SegmentEquations::blocks_of(std::size_t s, const Segment& segment) const {
  std::vector<int> blocks;
  if (s > 0) blocks.push_back(static_cast<int>(s) - 1);
  blocks.push_back(static_cast<int>(s));
  for (const int landmark : segment.landmarks) {
    blocks.push_back(static_cast<int>(bases_) + landmark);
  }
  blocks.push_back(static_cast<int>(bases_ + landmarks_));
  return blocks;
}

double SegmentEquations::linearize(const SegmentGraph& graph) {
  root_.take_back(0);
  gradient_.setZero();
  landmark_information_.assign(landmarks_, Eigen::Matrix2d::Zero());
  odometry_information_.setZero();
  double cost = 0.0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    cost += add(graph, s, *graph.segments[s], 1.0);
  }
  for (const int landmark : unseen_) {
    landmark_information_[static_cast<std::size_t>(landmark)].setIdentity();
    root_.add({static_cast<int>(bases_) + landmark}, Eigen::Matrix2d::Identity());
  }
  const SensorConstants prior = constants_information(graph);
  root_.add({static_cast<int>(bases_ + landmarks_)}, prior.asDiagonal());
  odometry_information_.diagonal() += prior.head<kOdometryConstants>();
  const SensorConstants off = graph.constants - graph.constants_mean;
  gradient_.segment<kSensorConstants>(constants_at()) += prior.cwiseProduct(off);
  return cost + 0.5 * off.dot(prior.cwiseProduct(off));
}

double SegmentEquations::add(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                             double times) {
  const CondensedSegment& condensed = *segment.condensed;
  const Eigen::Index size = segment.size();
  std::array<double, kDataKinds> weights = weights_of(graph, s, segment);
  for (double& weight : weights) weight *= times;
  const Eigen::VectorXd e = difference(graph, s, segment);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  double cost = 0.0;
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
  for (std::size_t kind = 0; kind < kDataKinds; ++kind) {
    if (condensed.information[kind].size() == 0) continue;
    information += weights[kind] * condensed.information[kind];
    pull += weights[kind] * condensed.gradient[kind];
    cost += weights[kind] * condensed.cost[kind];
  }
  const Eigen::VectorXd by_e = information * e;
  cost += e.dot(pull) + 0.5 * e.dot(by_e);
  pull += by_e;
  // Into directions of the map: the segment's axes turned by its heading.
  const Pose2& base = graph.bases[s];
  const double cosine = std::cos(base.heading);
  const double sine = std::sin(base.heading);
  const Eigen::Index tracks = static_cast<Eigen::Index>(segment.tracks.size());
  for (Eigen::Index k = -1; k < tracks; ++k) {
    const Eigen::Index at = k < 0 ? 0 : 3 + 2 * k;
    const Eigen::VectorXd first = information.col(at);
    information.col(at) = cosine * first - sine * information.col(at + 1);
    information.col(at + 1) = sine * first + cosine * information.col(at + 1);
  }
  for (Eigen::Index k = -1; k < tracks; ++k) {
    const Eigen::Index at = k < 0 ? 0 : 3 + 2 * k;
    const Eigen::RowVectorXd first = information.row(at);
    information.row(at) = cosine * first - sine * information.row(at + 1);
    information.row(at + 1) = sine * first + cosine * information.row(at + 1);
    pull.segment<2>(at) = rotated(base.heading, pull.segment<2>(at));
  }
  // How y, so turned, follows the base.
  Eigen::Matrix<double, Eigen::Dynamic, 3> by_base = Eigen::MatrixXd::Zero(size, 3);
  const auto arm = [&](Eigen::Index at, const Eigen::Vector2d& to) {
    by_base(at, 0) = by_base(at + 1, 1) = -1.0;
    by_base(at, 2) = to.y() - base.y;
    by_base(at + 1, 2) = base.x - to.x();
  };
  arm(0, place(graph.bases[s + 1]));
  by_base(2, 2) = -1.0;
  for (Eigen::Index k = 0; k < tracks; ++k) {
    arm(3 + 2 * k,
        graph.landmarks[static_cast<std::size_t>(segment.landmarks[static_cast<std::size_t>(k)])]);
  }
  if (s > 0) gradient_.segment<3>(base_at(s)).noalias() += by_base.transpose() * pull;
  gradient_.segment<3>(base_at(s + 1)) += pull.head<3>();
  for (Eigen::Index k = 0; k < tracks; ++k) {
    const std::size_t landmark =
        static_cast<std::size_t>(segment.landmarks[static_cast<std::size_t>(k)]);
    gradient_.segment<2>(landmark_at(landmark)) += pull.segment<2>(3 + 2 * k);
    for (Eigen::Index other = 0; other < tracks; ++other) {
      // Two tracks may be of one landmark.
      if (segment.landmarks[static_cast<std::size_t>(other)] !=
          segment.landmarks[static_cast<std::size_t>(k)]) {
        continue;
      }
      landmark_information_[landmark] += information.block<2, 2>(3 + 2 * k, 3 + 2 * other);
    }
  }
  gradient_.segment<kSensorConstants>(constants_at()) += pull.tail<kSensorConstants>();
  odometry_information_ += information.bottomRightCorner<kSensorConstants, kSensorConstants>()
                               .topLeftCorner<kOdometryConstants, kOdometryConstants>();
  if (s == 0) {
    root_.add(blocks_of(s, segment), std::move(information));
    return cost;
  }
  Eigen::MatrixXd all(size + 3, size + 3);
  all.bottomRightCorner(size, size) = information;
  for (Eigen::Index c = 0; c < 3; ++c) {
    all.col(c).tail(size).noalias() = information * by_base.col(c);
  }
  all.topRightCorner(3, size) = all.bottomLeftCorner(size, 3).transpose();
  all.topLeftCorner(3, 3).noalias() = by_base.transpose() * all.bottomLeftCorner(size, 3);
  root_.add(blocks_of(s, segment), std::move(all));
  return cost;
}

Eigen::MatrixXd SegmentEquations::to_segment(const SegmentGraph& graph, std::size_t s,
                                             const Segment& segment,
                                             const Eigen::MatrixXd& directions) const {
  Eigen::MatrixXd values(segment.size(), directions.cols());
  const Pose2& base = graph.bases[s];
  Eigen::Matrix2d to_base;
  to_base << std::cos(base.heading), std::sin(base.heading), -std::sin(base.heading),
      std::cos(base.heading);
  Eigen::MatrixXd by_base = Eigen::MatrixXd::Zero(3, directions.cols());
  if (s > 0) by_base = directions.middleRows<3>(base_at(s));
  const auto turn = [&](Eigen::Index at, const Eigen::Vector2d& to, int global) {
    const Eigen::Vector2d across(base.y - to.y(), to.x() - base.x);
    values.middleRows<2>(at) = to_base * (directions.middleRows<2>(global) - by_base.topRows<2>() -
                                          across * by_base.row(2));
  };
  turn(0, place(graph.bases[s + 1]), base_at(s + 1));
  values.row(2) = directions.row(base_at(s + 1) + 2) - by_base.row(2);
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
    turn(3 + 2 * static_cast<Eigen::Index>(k), graph.landmarks[landmark], landmark_at(landmark));
  }
  values.bottomRows<kSensorConstants>() = directions.middleRows<kSensorConstants>(constants_at());
  return values;
}

void SegmentEquations::from_segment(const SegmentGraph& graph, std::size_t s,
                                    const Segment& segment,
                                    const Eigen::Ref<const Eigen::MatrixXd>& values,
                                    Eigen::Ref<Eigen::MatrixXd> directions) const {
  const Pose2& base = graph.bases[s];
  Eigen::Matrix2d to_map;
  to_map << std::cos(base.heading), -std::sin(base.heading), std::sin(base.heading),
      std::cos(base.heading);
  Eigen::MatrixXd by_base = Eigen::MatrixXd::Zero(3, values.cols());
  const auto turn = [&](Eigen::Index at, const Eigen::Vector2d& to, int global) {
    const Eigen::MatrixXd turned = to_map * values.middleRows<2>(at);
    directions.middleRows<2>(global) += turned;
    by_base.topRows<2>() -= turned;
    by_base.row(2) -= Eigen::RowVector2d(base.y - to.y(), to.x() - base.x) * turned;
  };
  turn(0, place(graph.bases[s + 1]), base_at(s + 1));
  directions.row(base_at(s + 1) + 2) += values.row(2);
  by_base.row(2) -= values.row(2);
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
    turn(3 + 2 * static_cast<Eigen::Index>(k), graph.landmarks[landmark], landmark_at(landmark));
  }
  if (s > 0) directions.middleRows<3>(base_at(s)) += by_base;
  directions.middleRows<kSensorConstants>(constants_at()) += values.bottomRows<kSensorConstants>();
}

double SegmentEquations::linearize_gradient(const SegmentGraph& graph) {
  gradient_.setZero();
  double cost = 0.0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const CondensedSegment& condensed = *segment.condensed;
    const std::array<double, kDataKinds> weights = weights_of(graph, s, segment);
    const Eigen::VectorXd e = difference(graph, s, segment);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(segment.size());
    for (std::size_t kind = 0; kind < kDataKinds; ++kind) {
      if (condensed.information[kind].size() == 0) continue;
      const Eigen::VectorXd by_e = weights[kind] * (condensed.information[kind] * e);
      cost += weights[kind] * (condensed.cost[kind] + e.dot(condensed.gradient[kind])) +
              0.5 * e.dot(by_e);
      pull += weights[kind] * condensed.gradient[kind] + by_e;
    }
    from_segment(graph, s, segment, pull, gradient_);
  }
  const SensorConstants prior = constants_information(graph);
  const SensorConstants off = graph.constants - graph.constants_mean;
  gradient_.segment<kSensorConstants>(constants_at()) += prior.cwiseProduct(off);
  return cost + 0.5 * off.dot(prior.cwiseProduct(off));
}

void SegmentEquations::add_to_landmarks(double sigma) {
  const Eigen::Matrix2d information = Eigen::Matrix2d::Identity() / (sigma * sigma);
  for (std::size_t l = 0; l < landmarks_; ++l) {
    root_.add({static_cast<int>(bases_ + l)}, information);
  }
}

void SegmentEquations::take_back(const Mark& mark) {
  root_.take_back(mark.added);
  gradient_ = mark.gradient;
}

void SegmentEquations::move(const Eigen::VectorXd& step, SegmentGraph* graph) const {
  for (std::size_t b = 1; b < graph->bases.size(); ++b) {
    const Eigen::Vector3d by = step.segment<3>(base_at(b));
    Pose2& pose = graph->bases[b];
    pose = {pose.x + by.x(), pose.y + by.y(), wrap_angle(pose.heading + by.z())};
  }
  for (std::size_t l = 0; l < graph->landmarks.size(); ++l) {
    graph->landmarks[l] += step.segment<2>(landmark_at(l));
  }
  const SensorConstants by = step.segment<kSensorConstants>(constants_at());
  for (int k = 0; k < kSensorConstants; ++k) {
    double& constant = graph->constants[k];
    const bool is_scale = k == SensorConstant::distance_scale || k == SensorConstant::turn_scale ||
                          k == SensorConstant::range_scale;
    // A scale stays positive: its logarithm is what moves.
    constant =
        is_scale ? (1.0 + constant) * std::exp(by[k] / (1.0 + constant)) - 1.0 : constant + by[k];
  }
}

Eigen::MatrixXd SegmentEquations::covariance_of(const std::vector<int>& landmarks) const {
  std::vector<int> blocks;
  for (const int landmark : landmarks) blocks.push_back(static_cast<int>(bases_) + landmark);
  return root_.covariance_of(blocks);
}

std::pair<Eigen::VectorXd, Eigen::MatrixXd> SegmentEquations::condensed_to_last() const {
  const Eigen::MatrixXd root = root_.trailing_root(last_at_);
  return {root * root_.forward(gradient_).bottomRows(root.rows()), root * root.transpose()};
}

void SegmentEquations::draw(int count, const RandomStream& stream, Eigen::MatrixXd* draws,
                            Eigen::MatrixXd* pulled) const {
  Eigen::MatrixXd normals(size(), count);
  stream.fill_normal(0, size() * count, normals.data());
  *pulled = root_.times_root(normals);
  *draws = root_.backward(std::move(normals));
}

}  // namespace pf_resampling
