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

/// Squared error, in standard deviations, of the odometry of a segment as a whole: three degrees of
/// freedom. Where wheels slipped it is large. 0 where the data are gone. `uncertainty`: covariance
/// of the motion that the graph says was driven. `distance`: m, how far off its end is.
double slip_square(const SegmentGraph& graph, std::size_t segment,
                   const Eigen::Matrix3d& uncertainty = Eigen::Matrix3d::Zero(),
                   double* distance = nullptr);

}  // namespace pf_resampling
