#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"

namespace pf_resampling {

/// Unknowns of a keyframe: pose in the map frame and error of the odometry's yaw rate.
struct KeyframeUnknown {
  enum Index : int { x, y, heading, yaw_rate_bias, count };
};
using KeyframeState = Eigen::Vector4d;

/// Unknowns that all radios share, and those of the robot.
struct CommonUnknown {
  enum Index : int {
    scale,           ///< relative error of all ranges
    bias,            ///< m, of all ranges
    distance_scale,  ///< measured over true distance of the odometry, less 1
    turn_scale,      ///< measured over true turn, less 1
    lever_x,         ///< m, true less stated place of the antenna on the robot
    lever_y,
    lever_z,
    height,  ///< m^2, of all radios whose height is not stated: its square over the antenna
    count
  };
};

/// Unknowns of each radio, which follow each other after the common ones.
struct RadioUnknown {
  enum Index : int {
    x,       ///< m, map frame
    y,       ///< m
    scale,   ///< beside the common one
    bias,    ///< m, beside the common one
    height,  ///< m^2, beside the common one, or beside the square of the stated one
    count
  };
};

/// First unknown of a radio among the constants.
inline int radio_at(int radio) {
  return CommonUnknown::count + radio * RadioUnknown::count;
}

/// Of a motion, what its correction takes; a range has no use for covariances.
struct CorrectableMotion {
  CorrectableMotion() = default;
  CorrectableMotion(const OdometryIncrement& motion)
      : mean(motion.mean),
        yaw_rate_sensitivity(motion.yaw_rate_sensitivity),
        turn_scale_sensitivity(motion.turn_scale_sensitivity) {}

  Pose2 mean;
  Eigen::Vector3d yaw_rate_sensitivity = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_scale_sensitivity = Eigen::Vector3d::Zero();
};

/// A range, and the motion since the keyframe before it.
struct HeldRange {
  int radio = 0;
  double range = 0.0;                                 ///< m
  double variance = 0.0;                              ///< m^2
  Eigen::Vector2d antenna = Eigen::Vector2d::Zero();  ///< m, on the robot
  std::optional<double> height;                       ///< m, of the radio over the antenna
  CorrectableMotion since;
};

/// All that a robot has measured: keyframes, the odometry between them, the ranges after each.
struct RangeGraph {
  std::vector<OdometryIncrement> motions;      ///< from a keyframe to the next
  std::vector<bool> slipped;                   ///< of each motion, whether the ranges say so
  std::vector<std::vector<HeldRange>> ranges;  ///< of each keyframe

  int keyframes() const { return static_cast<int>(ranges.size()); }
};

/// What is believed before there are data; standard deviations.
struct RangePrior {
  KeyframeState first = KeyframeState::Zero();
  KeyframeState first_sigma = KeyframeState::Ones();
  Eigen::VectorXd constants;        ///< CommonUnknown, then RadioUnknown of each radio
  Eigen::VectorXd constants_sigma;  ///< likewise
  double yaw_rate_walk = 1.3e-5;    ///< rad/s/sqrt(s): 1e-4 rad/s over a minute
  /// Of the distance scale, where it says how long a metre is: not solved for, in all covariances.
  double metre = 0.0;
};

/// Factors of the standard deviations that the data state, and the losses' widths.
struct RangeNoise {
  double range = 1.0;
  double translation = 1.0;
  double heading = 1.0;
  /// Standard deviations, of Cauchy's loss of ranges: that of Student's distribution with this
  /// number's square, less 1, degrees of freedom; see RangeLoss.
  double robust_width = 3.0;

  /// Of Gaussian ranges. The scale of a robust loss is found smaller than that: by 0.85 where the
  /// loss is 3 wide, by 0.98 at 8.
  double range_deviation() const {
    return range / std::sqrt(1.0 - 2.5 / (robust_width * robust_width));
  }
};

/// Of ranges: minus the logarithm of Student's distribution above a uniform floor, so that what is
/// wild hardly pulls, however many agree on it.
class RangeLoss {
 public:
  explicit RangeLoss(const RangeNoise& noise);
  struct Value {
    double cost = 0.0;    ///< 0 where the residual is
    double weight = 1.0;  ///< of its square, at most 1
  };
  /// `residual` in standard deviations; `variance`: m^2, as the range states it.
  Value at(double residual, double variance) const;
  /// Of Student's distribution for a variance of 1 m^2, but for a factor of the square root of π.
  double log_peak() const { return log_peak_; }

 private:
  double width_squared_;
  double log_peak_;
  double floor_;  // over the peak, at a variance of 1 m^2
};

struct RangeEstimate {
  std::vector<KeyframeState> keyframes;
  Eigen::VectorXd constants;
  std::vector<bool> takes_part;  ///< of each radio, whether its ranges do
};

inline Pose2 pose_of(const KeyframeState& state) {
  return {state[0], state[1], state[2]};
}

/// The motion, without the errors of the odometry that the estimate knows; the yaw-rate bias is
/// that of the keyframe it begins at.
Pose2 corrected_motion(const CorrectableMotion& motion, const KeyframeState& from,
                       const Eigen::VectorXd& constants);

/// Where that motion ends.
KeyframeState moved(const KeyframeState& from, const OdometryIncrement& motion,
                    const Eigen::VectorXd& constants);

/// All keyframes as odometry alone has them, from this first one.
std::vector<KeyframeState> driven_by_odometry(const RangeGraph& graph, const KeyframeState& first,
                                              const Eigen::VectorXd& constants);

/// A range's residual, in standard deviations, and its derivatives by the keyframe, the common
/// unknowns and those of its radio.
struct HeldRangeResidual {
  double value = 0.0;
  Eigen::Matrix<double, 1, KeyframeUnknown::count> by_keyframe;
  Eigen::Matrix<double, 1, CommonUnknown::count> by_common;
  Eigen::Matrix<double, 1, RadioUnknown::count> by_radio;
};

/// (1 + scale)·d + bias − range, d = √(|antenna − radio|² + h²), h² that of the stated height less
/// lever_z, or else the common unknown, and the radio's own.
HeldRangeResidual residual_of(const HeldRange& range, const RangeNoise& noise,
                              const KeyframeState& keyframe, const Eigen::VectorXd& constants);

/// Residual of a motion and of the walk of the yaw-rate bias, in standard deviations, and its
/// derivatives by both keyframes, and by distance and turn scale.
struct HeldMotionResidual {
  Eigen::Vector4d value;
  Eigen::Matrix4d by_from;
  Eigen::Matrix4d by_to;
  Eigen::Matrix<double, 4, 2> by_scales;
  double log_slip = 0.0;  ///< logarithm of the factor by which slip widens the deviations, in all
};
HeldMotionResidual residual_of(const OdometryIncrement& motion, const RangeNoise& noise,
                               double yaw_rate_walk, const KeyframeState& from,
                               const KeyframeState& to, const Eigen::VectorXd& constants);

/// What least squares says at its solution.
struct RangeBelief {
  bool is_usable = false;  ///< finite, positive definite
  double cost = 0.0;       ///< half the sum of squares, robust, of data, past and prior
  /// Logarithm of the probability of the data (Laplace's approximation), but for a constant of the
  /// data alone.
  double log_evidence = 0.0;
  /// Of the newest keyframe, then the constants.
  Eigen::MatrixXd covariance;
};

/// What the data before a keyframe say of it and the constants, the prior of the constants left
/// out: a quadratic about the estimate at which it was linearized.
struct RangePast {
  int keyframe = 0;
  KeyframeState state = KeyframeState::Zero();
  Eigen::VectorXd constants;
  Eigen::MatrixXd information;  ///< of keyframe and constants; lower triangle
  Eigen::VectorXd gradient;
  double log_evidence = 0.0;  ///< of those data, at that estimate
};

/// What a past says where a radio is another one from then on: all that it was is integrated over,
/// with its prior of then.
RangePast without_radio(int radio, const RangePrior& prior, RangePast past);

/// m^2, of the position of each keyframe (with a past, from its keyframe on), given all data. Empty
/// if they are not enough.
std::vector<Eigen::Matrix2d> position_covariances(const RangeGraph& graph, const RangePrior& prior,
                                                  const RangeNoise& noise,
                                                  const std::optional<RangePast>& past,
                                                  const RangeEstimate& estimate);

/// Gauss and Newton's method with Levenberg's damping: keyframes are eliminated from the oldest to
/// the newest (block tridiagonal with a border of the constants), O(keyframes · constants²). Ends
/// with a step that is to save less than `tolerance`. `past`, if any: in place of data before its
/// keyframe, which do not move. `kept`, if any: gets what the data before its keyframe say. Gives
/// up, not usable, where the logarithm of the evidence will hardly come to `least_evidence`.
RangeBelief solve(const RangeGraph& graph, const RangePrior& prior, const RangeNoise& noise,
                  int iterations, double tolerance, const std::optional<RangePast>& past,
                  RangeEstimate* estimate, RangePast* kept = nullptr,
                  double least_evidence = -std::numeric_limits<double>::infinity());

}  // namespace pf_resampling
