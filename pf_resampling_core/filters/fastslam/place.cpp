// Where the robot is in its map.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

// Landmarks that tell where the map is: those that it began with.
constexpr std::size_t kMostFirstLandmarks = 20;
constexpr std::size_t kFewestFirstLandmarks = 2;

struct HeldLandmark {
  LandmarkRow row;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();    // over the particles
  Eigen::Matrix2d within = Eigen::Matrix2d::Zero();  // mean of the particles' own covariances
};

// Nothing unless most of the weight holds it.
std::optional<HeldLandmark> held_landmark(const LandmarkRow& row, const Eigen::ArrayXd& weight) {
  HeldLandmark landmark;
  landmark.row = row;
  double held = 0.0;
  for (Eigen::Index i = 0; i < weight.size(); ++i) {
    if (row.held[i] == 0) continue;
    held += weight[i];
    landmark.mean += weight[i] * row.mean(i);
    landmark.within += weight[i] * row.covariance(i);
  }
  if (held < 0.5) return std::nullopt;
  landmark.mean /= held;
  landmark.within /= held;
  return landmark;
}

Eigen::Vector2d across(const Eigen::Vector2d& v) {
  return {-v.y(), v.x()};
}

}  // namespace

// The beginning of a particle's map is laid on that of the mean map, to first order: shifted by the
// mean of its landmarks' deviations, and turned about their centre. Its pose goes with it; what
// remains is what it does not know of its place. Besides, a particle's map is not exact: its
// landmarks' own errors, which are independent given its path, shift and turn it in the same way.
PoseEstimate FastSlam::place() {
  PoseEstimate belief = estimate();
  const Eigen::Vector2d robot(belief.mean.x, belief.mean.y);
  const Eigen::ArrayXd& weight = particles_.weight;
  const Eigen::Index count = particles_.size();
  std::vector<HeldLandmark> first;
  for (const int row : rows()) {
    if (first.size() == kMostFirstLandmarks) break;
    if (const auto landmark = held_landmark(store_.row(row), weight)) first.push_back(*landmark);
  }
  if (first.size() < kFewestFirstLandmarks) return belief;

  const double share = 1.0 / static_cast<double>(first.size());
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const HeldLandmark& landmark : first) centre += share * landmark.mean;
  double inertia = 0.0;
  for (const HeldLandmark& landmark : first) inertia += (landmark.mean - centre).squaredNorm();
  if (!(inertia > 0.0)) return belief;

  const Eigen::Vector2d lever = across(robot - centre);
  Eigen::ArrayXXd left(count, 3);  // of each particle's deviation from the mean pose
  left.col(0) = particles_.x - robot.x();
  left.col(1) = particles_.y - robot.y();
  left.col(2) = particles_.heading.unaryExpr(
      [&](double heading) { return wrap_angle(heading - belief.mean.heading); });
  Eigen::Matrix3d of_maps = Eigen::Matrix3d::Zero();
  for (const HeldLandmark& landmark : first) {
    Eigen::Matrix<double, 3, 2> by_landmark;  // how the pose moves with the landmark
    by_landmark.row(2) = across(landmark.mean - centre).transpose() / inertia;
    by_landmark.topRows<2>() = share * Eigen::Matrix2d::Identity() + lever * by_landmark.row(2);
    of_maps += by_landmark * landmark.within * by_landmark.transpose();
    for (Eigen::Index i = 0; i < count; ++i) {
      if (landmark.row.held[i] == 0) continue;
      left.row(i) -= (by_landmark * (landmark.row.mean(i) - landmark.mean)).transpose().array();
    }
  }
  PoseEstimate place;
  place.mean = belief.mean;
  for (int k = 0; k < 3; ++k) left.col(k) -= (weight * left.col(k)).sum();
  place.covariance =
      left.matrix().transpose() * weight.matrix().asDiagonal() * left.matrix() + of_maps;
  return place;
}

}  // namespace pf_resampling
