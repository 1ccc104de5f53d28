#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/batch_drive.hpp"

namespace pf_resampling {

/// What least squares believes before it has seen the data.
struct RangeBatchNoise {
  OdometryNoise odometry;        ///< where the recording states none: what the filter believes
  double odometry_spread = 0.5;  ///< of the logarithm of its factors, as the filter has it
  Eigen::Vector3d start = {10.0, 10.0, kPi};  ///< m, m, rad: of the first pose
  RadioPrior radios;
  double distance_scale = 0.01;  ///< true over measured distance, about 1
  double yaw_scale = 0.01;       ///< true over measured turn, about 1
  double yaw_rate = 0.01;        ///< rad/s, of the odometry
};

/// How large the noise is, as found from the data.
struct RangeBatchScales {
  /// m, of the ranges, as the robust loss takes it: 0.85 of the standard deviation of Gaussian
  /// noise.
  double sigma = 1.0;
  double translation = 1.0;  ///< factor of the standard deviation of the odometry's distances
  double heading = 1.0;      ///< of its headings
};

/// The noise under which data are most probable: a search from `best` on, one kind after the other.
/// `is_better`: whether they are more probable with this noise than with the best so far, which it
/// then is.
RangeBatchScales most_probable_scales(
    RangeBatchScales best, const std::function<bool(const RangeBatchScales&)>& is_better);

/// Everything there is to know where a robot was that measured ranges to known beacons.
struct RangeProblem {
  std::vector<EstimatedPose> odometry;                ///< in a frame of its own
  std::optional<StatedOdometryNoise> odometry_noise;  ///< if the recording states it
  std::vector<StampedRange> ranges;                   ///< those of other beacons are left out
  std::map<std::string, Eigen::Vector3d> antennas;    ///< where a range's frame sits on the robot
  std::vector<Beacon> beacons;
  Pose2 start;  ///< map frame, where the solution begins to look
};

struct RangeSolution {
  std::vector<EstimatedPose> path;  ///< at the stamps of the odometry; map frame
  std::vector<std::pair<int, RangeCalibration>> radios;  ///< by id, of beacons that were heard
  double distance_scale = 1.0;                           ///< measured over true
  double yaw_scale = 1.0;
  double yaw_rate_bias = 0.0;  ///< rad/s, measured less true
  RangeBatchScales scales;
  int ranges = 0;    ///< that took part
  int outliers = 0;  ///< of these, farther off than 4 standard deviations
};

/// The path, scale and bias of each radio and errors of the odometry that fit all data best at
/// once, with a robust loss. The noise is that under which the data are most probable (evidence by
/// Laplace's approximation). Throws Error if there is no solution, no range, a range's frame that
/// is nowhere on the robot, or more than memory can be expected to hold (check_size(); 1,000
/// beacons that were heard).
RangeSolution solve_ranges(const RangeProblem& problem, const RangeBatchNoise& noise = {});

/// What can be known while the robot drives, on the same model and with this noise: solved anew at
/// every time that has ranges, with all data up to then, and from there by odometry. Once there are
/// half as many poses more than `window`, the oldest are solved for no more, and what they say
/// stays as a Gaussian. Throws Error as solve_ranges() does.
OnlineSolution solve_ranges_online(const RangeProblem& problem, const RangeBatchScales& scales,
                                   const RangeBatchNoise& noise = {}, int window = 500);

}  // namespace pf_resampling
