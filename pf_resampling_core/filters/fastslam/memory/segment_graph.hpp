#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment.hpp"

namespace pf_resampling {

/// A whole drive: its segments, and the present estimate of all that they speak of.
struct SegmentGraph {
  std::vector<std::shared_ptr<const Segment>> segments;  ///< shared by copies of the graph
  /// m, rad, map frame: of each segment, and behind them the newest pose. The first is the frame:
  /// it is known.
  std::vector<Pose2> bases;
  std::vector<Eigen::Vector2d> landmarks;  ///< m
  SensorConstants constants = SensorConstants::Zero();
  /// Of their prior: 0 but for an odometry whose scale is grossly wrong.
  SensorConstants constants_mean = SensorConstants::Zero();
  SensorConstants constants_sigma = SensorConstants::Zero();
  NoiseScales noise;
  /// Weight of the odometry of each segment; see slip_square().
  std::vector<double> motion_shares;

  const Pose2& newest() const { return bases.back(); }
};

/// y of a segment that stands at place `s` of the graph, at the graph's estimate, less where it was
/// condensed.
Eigen::VectorXd difference(const SegmentGraph& graph, std::size_t s, const Segment& segment);

/// A segment's data without what they are condensed to, moved to the graph's estimate.
Segment at_estimate(const SegmentGraph& graph, std::size_t s);

/// Poses of segment `s` in the frame of its base, at the graph's estimate. Where the data are gone,
/// those between share in how far the end has moved.
std::vector<Pose2> poses_of(const SegmentGraph& graph, std::size_t s);

/// Weights of a segment's kinds of data at place `s` under the graph's noise and motion shares,
/// relative to those that it was condensed with.
std::array<double, kDataKinds> weights_of(const SegmentGraph& graph, std::size_t s,
                                          const Segment& segment);

/// Information of the prior of the constants.
SensorConstants constants_information(const SegmentGraph& graph);

/// How far the motion in segments [first, end) is from its odometry (x, y, heading; in the frame of
/// the first base), the odometry's covariance, and what wheels that may have slipped add to that.
/// Zero where data are gone.
struct OdometryError {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d slip_covariance = Eigen::Matrix3d::Zero();

  /// In standard deviations, with `more` covariance; three degrees of freedom.
  double square(const Eigen::Matrix3d& more) const;
};
OdometryError odometry_error(const SegmentGraph& graph, std::size_t first, std::size_t end);

/// The square of one segment's with the covariance of the odometry alone: large where wheels
/// slipped.
double slip_square(const SegmentGraph& graph, std::size_t segment);

}  // namespace pf_resampling
