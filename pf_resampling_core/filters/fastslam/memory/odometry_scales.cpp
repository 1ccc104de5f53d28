#include "pf_resampling_core/filters/fastslam/memory/odometry_scales.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr double kLongest = 1.0;     // s from one sighting to the other
constexpr std::size_t kMost = 2000;  // pairs, the newest
constexpr std::size_t kFewest = 60;
constexpr int kRounds = 15;
constexpr double kRobustWidth = 2.0;    // standard deviations, as the pairs scatter
constexpr double kUnknownScale = 10.0;  // standard deviation of a scale that nothing is known of
// Smaller errors are left to the prior; and how well others have to be known.
constexpr double kGross = 0.4;
constexpr double kLargest = 10.0;  // beyond that, consecutive poses say nothing
// How much less the pairs have to scatter: odometry that is noisy, or late, looks too long, too.
constexpr double kLessScatter = 0.85;
constexpr double kReversed = -0.5;
constexpr double kSignificant = 6.0;

/// A landmark seen twice: where it was on the robot, and how the odometry moved between.
struct Pair {
  Pose2 measured;
  Eigen::Vector2d first, second;
  Eigen::Matrix2d root;  ///< of the information of their difference
};

Eigen::Matrix2d rotation(double angle) {
  return Eigen::Rotation2Dd(angle).toRotationMatrix();
}

Eigen::Vector2d on_robot(const SightingFactor& sighting) {
  return place_seen(sighting.sensor, sighting.range, sighting.bearing);
}

Eigen::Matrix2d covariance(const SightingFactor& sighting) {
  const Eigen::Matrix2d turned = rotation(sighting.sensor.heading + sighting.bearing);
  const Eigen::Vector2d variances(sighting.range_variance,
                                  sighting.range * sighting.range * sighting.bearing_variance);
  return turned * variances.asDiagonal() * turned.transpose();
}

void add_pairs(const Segment& segment, std::vector<Pair>* pairs) {
  std::vector<Pose2> poses;
  std::vector<double> times;
  for (const MotionFactor& motion : segment.motions) {
    poses.push_back(poses.empty() ? motion.mean : compose(poses.back(), motion.mean));
    times.push_back((times.empty() ? 0.0 : times.back()) + motion.duration());
  }
  // Each with the oldest of the same landmark that is not too old: the robot has moved most since.
  std::vector<std::deque<const SightingFactor*>> before(segment.landmarks.size());
  for (const SightingFactor& now : segment.sightings) {
    std::deque<const SightingFactor*>& recent = before[static_cast<std::size_t>(now.landmark)];
    const std::size_t to = static_cast<std::size_t>(now.pose);
    const auto pose_of = [](const SightingFactor* seen) {
      return static_cast<std::size_t>(seen->pose);
    };
    while (!recent.empty() && times[to] - times[pose_of(recent.front())] > kLongest) {
      recent.pop_front();
    }
    if (!recent.empty() && recent.front()->pose < now.pose) {
      const SightingFactor& first = *recent.front();
      const Eigen::LLT<Eigen::Matrix2d> root(covariance(first) + covariance(now));
      pairs->push_back({relative(poses[pose_of(&first)], poses[to]), on_robot(first), on_robot(now),
                        root.matrixL().solve(Eigen::Matrix2d::Identity())});
    }
    recent.push_back(&now);
  }
}

}  // namespace

// Robust least squares in the two scales s (true over measured distance and turn),
//   s₀·R((s₁ − 1)·θ/2)·t + R(s₁·θ)·p₂ = p₁,
// with the motion (t, θ) as measured and the landmark at p₁ and then p₂ on the robot.
Eigen::Vector2d gross_odometry_scales(const SegmentGraph& graph, const Segment& open) {
  std::vector<Pair> pairs;
  add_pairs(open, &pairs);
  for (std::size_t s = graph.segments.size(); s-- > 0 && pairs.size() < kMost;) {
    if (graph.segments[s]->has_data()) add_pairs(*graph.segments[s], &pairs);
  }
  if (pairs.size() < kFewest) return Eigen::Vector2d::Zero();
  Eigen::Vector2d scales = Eigen::Vector2d::Ones();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double scatter = 0.0;
  double scatter_as_measured = 0.0;
  std::vector<Eigen::Vector2d> errors(pairs.size());
  std::vector<Eigen::Matrix2d> by_scales(pairs.size());
  std::vector<double> sizes(pairs.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [measured, first, second, root] = pairs[i];
      const double half = 0.5 * measured.heading;
      const Eigen::Vector2d moved =
          rotation((scales[1] - 1.0) * half) * Eigen::Vector2d(measured.x, measured.y);
      const Eigen::Vector2d turned = rotation(scales[1] * measured.heading) * second;
      const auto across = [](const Eigen::Vector2d& v) { return Eigen::Vector2d(-v.y(), v.x()); };
      errors[i] = root * (scales[0] * moved + turned - first);
      by_scales[i].col(0) = root * moved;
      by_scales[i].col(1) =
          root * (half * scales[0] * across(moved) + measured.heading * across(turned));
      sizes[i] = errors[i].norm();
    }
    std::vector<double> sorted = sizes;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    constexpr double kMedian = 1.177;  // of the length of a normal vector in the plane
    scatter = std::max(1e-6, *middle / kMedian);
    if (round == 0) scatter_as_measured = scatter;
    Eigen::Matrix2d information = Eigen::Matrix2d::Identity() / (kUnknownScale * kUnknownScale);
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double weight = robust_weight(sizes[i] * sizes[i] / (scatter * scatter), kRobustWidth) /
                            (scatter * scatter);
      information += weight * by_scales[i].transpose() * by_scales[i];
      gradient += weight * by_scales[i].transpose() * errors[i];
    }
    const Eigen::LDLT<Eigen::Matrix2d> root(information);
    scales -= root.solve(gradient);
    covariance = root.solve(Eigen::Matrix2d::Identity());
  }
  Eigen::Vector2d gross = Eigen::Vector2d::Zero();
  // Noise and delay turn no sign.
  const bool is_reversed = scales[1] < kReversed;
  if (!is_reversed && scatter > kLessScatter * scatter_as_measured) return gross;
  for (int k = 0; k < 2; ++k) {
    const double error = scales[k] - 1.0;
    const double sigma = std::sqrt(covariance(k, k));
    const double size = std::abs(scales[k]);
    if (size > 1.0 / kLargest && size < kLargest && std::abs(error) > kGross &&
        std::abs(error) > kSignificant * sigma)
      gross[k] = error;
  }
  return gross;
}

}  // namespace pf_resampling
