#include "pf_resampling_core/smoothing/normal_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Nothing else holds a landmark whose sightings were all taken away.
constexpr double kLandmarkInformation = 1e-9;  // 1/m^2

Eigen::VectorXd difference_to_prior(const SmoothingGraph& graph) {
  const Pose2& prior = graph.prior.pose;
  const Pose2& first = graph.poses.front();
  Eigen::VectorXd difference(GaussianPrior::kSize);
  difference << first.x - prior.x, first.y - prior.y, wrap_angle(first.heading - prior.heading),
      graph.constants;
  return difference;
}

}  // namespace

NormalEquations::NormalEquations(const SmoothingGraph& graph)
    : poses_(static_cast<int>(graph.poses.size())),
      landmarks_(static_cast<int>(graph.landmarks.size())),
      blocks_(graph.poses.size()) {
  const int constants = poses_ + landmarks_;
  for (int pose = 0; pose < poses_; ++pose) {
    std::vector<int>& blocks = blocks_[static_cast<std::size_t>(pose)];
    blocks.push_back(pose);
    if (pose + 1 < poses_) blocks.push_back(pose + 1);
  }
  for (const SightingFactor& sighting : graph.sightings) {
    std::vector<int>& blocks = blocks_[static_cast<std::size_t>(sighting.pose)];
    const int landmark = poses_ + sighting.landmark;
    if (std::find(blocks.begin(), blocks.end(), landmark) == blocks.end()) {
      blocks.push_back(landmark);
    }
  }
  for (std::vector<int>& blocks : blocks_) blocks.push_back(constants);
  for (const MotionFactor& motion : graph.motions) {
    motion_roots_.push_back(motion_root(motion, graph.noise.motion));
  }
  std::vector<int> sizes(graph.poses.size(), 3);
  sizes.insert(sizes.end(), graph.landmarks.size(), 2);
  sizes.push_back(kSensorConstants);
  std::vector<std::vector<int>> terms = blocks_;
  terms.push_back({0, constants});
  root_ = MultifrontalCholesky(std::move(sizes), terms, {constants});
  gradient_.setZero(root_.size());
}

// One term of H for each pose: what the motion from it and the sightings from it say.
void NormalEquations::linearize(const SmoothingGraph& graph, double robust_width) {
  root_.clear();
  gradient_.setZero();
  auto sighting = graph.sightings.begin();
  for (int pose = 0; pose < poses_; ++pose) {
    const std::size_t i = static_cast<std::size_t>(pose);
    const std::vector<int>& blocks = blocks_[i];
    const bool is_last = pose + 1 == poses_;
    const Eigen::Index first_landmark = is_last ? 3 : 6;
    const Eigen::Index landmarks = static_cast<Eigen::Index>(blocks.size()) - (is_last ? 2 : 3);
    const Eigen::Index constants = first_landmark + 2 * landmarks;
    const Eigen::Index size = constants + kSensorConstants;
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    if (!is_last) {
      const MotionResidual r = motion_residual(graph.motions[i], motion_roots_[i], graph.poses[i],
                                               graph.poses[i + 1], graph.constants);
      Eigen::MatrixXd by_all = Eigen::MatrixXd::Zero(3, size);
      by_all.leftCols<3>() = r.by_from;
      by_all.middleCols<3>(3) = r.by_to;
      by_all.middleCols<kOdometryConstants>(constants) = r.by_constants;
      hessian.noalias() += by_all.transpose() * by_all;
      gradient.noalias() += by_all.transpose() * r.value;
    }
    for (; sighting != graph.sightings.end() && sighting->pose == pose; ++sighting) {
      SightingResidual r = sighting_residual(
          *sighting, graph.noise, graph.poses[i],
          graph.landmarks[static_cast<std::size_t>(sighting->landmark)], graph.constants);
      const double root = std::sqrt(robust_weight(r.value.squaredNorm(), robust_width));
      // Of pose, landmark and the sensor's constants.
      Eigen::Matrix<double, 2, 7> by_all;
      by_all << r.by_pose, r.by_landmark, r.by_constants;
      by_all *= root;
      const Eigen::Matrix<double, 7, 7> square = by_all.transpose() * by_all;
      const Eigen::Matrix<double, 7, 1> slope = by_all.transpose() * (root * r.value);
      const auto found = std::find(blocks.begin(), blocks.end(), poses_ + sighting->landmark);
      const Eigen::Index number = found - blocks.begin() - (is_last ? 1 : 2);
      const std::array<Eigen::Index, 3> places = {0, first_landmark + 2 * number,
                                                  constants + SensorConstant::range_scale};
      constexpr std::array<Eigen::Index, 3> kBegins = {0, 3, 5};
      constexpr std::array<Eigen::Index, 3> kSizes = {3, 2, 2};
      for (std::size_t a = 0; a < places.size(); ++a) {
        gradient.segment(places[a], kSizes[a]) += slope.segment(kBegins[a], kSizes[a]);
        for (std::size_t b = 0; b < places.size(); ++b) {
          hessian.block(places[a], places[b], kSizes[a], kSizes[b]) +=
              square.block(kBegins[a], kBegins[b], kSizes[a], kSizes[b]);
        }
      }
    }
    add(blocks, gradient, std::move(hessian));
  }
  for (int landmark = 0; landmark < landmarks_; ++landmark) {
    root_.add({poses_ + landmark}, kLandmarkInformation * Eigen::Matrix2d::Identity());
  }
  const auto& information = graph.prior.information;
  add({0, poses_ + landmarks_}, information * difference_to_prior(graph), information);
}

void NormalEquations::add(const std::vector<int>& blocks, const Eigen::VectorXd& gradient,
                          Eigen::MatrixXd hessian) {
  Eigen::Index at = 0;
  for (const int block : blocks) {
    const Eigen::Index size = root_.size_of(block);
    gradient_.segment(root_.at(block), size) += gradient.segment(at, size);
    at += size;
  }
  root_.add(blocks, std::move(hessian));
}

void NormalEquations::move(const Eigen::VectorXd& step, SmoothingGraph* graph) const {
  for (std::size_t i = 0; i < graph->poses.size(); ++i) {
    Pose2& pose = graph->poses[i];
    const int at = pose_at(static_cast<int>(i));
    pose = {pose.x + step[at], pose.y + step[at + 1], wrap_angle(pose.heading + step[at + 2])};
  }
  for (std::size_t l = 0; l < graph->landmarks.size(); ++l) {
    graph->landmarks[l] += step.segment<2>(landmark_at(static_cast<int>(l)));
  }
  graph->constants += step.segment<kSensorConstants>(constants_at());
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
  const Eigen::VectorXd difference = difference_to_prior(graph);
  return cost + 0.5 * difference.dot(graph.prior.information * difference);
}

}  // namespace pf_resampling
