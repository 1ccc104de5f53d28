#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

/// Where the robot truly was, in the map frame. Many references (a tachymeter, a single GPS
/// antenna) know no heading.
struct TruePose {
  double time = 0.0;              ///< s
  double x = 0.0;                 ///< m
  double y = 0.0;                 ///< m
  std::optional<double> heading;  ///< rad
};

/// Where somebody believes it was: a filter, or dead reckoning (covariance zero).
struct EstimatedPose {
  double time = 0.0;  ///< s
  Pose2 pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of (x, y, heading): m^2, m rad, rad^2
};

/// Throws Error unless the path, called `name` in the message, is not empty, finite and in order of
/// time (equal stamps are allowed).
void check_path(const std::vector<TruePose>& path, const char* name);
void check_path(const std::vector<EstimatedPose>& path, const char* name);

/// The path of what sits at `place` on the robot, an antenna for instance, with its covariances.
std::vector<EstimatedPose> path_of_place(std::vector<EstimatedPose> path, const Pose2& place);

/// The longest gap in time, s, that is bridged by interpolation where the caller does not say:
/// three times the median interval of the path, at least 1 s.
double usual_max_gap(const std::vector<EstimatedPose>& path);
double usual_max_gap(const std::vector<TruePose>& path);

/// The path at `time`: positions and covariance linear, heading along the shorter arc. Nothing
/// outside the path's span or inside a gap longer than max_gap (s). A true heading is interpolated
/// where both neighbours have one. The path is in order of time.
std::optional<EstimatedPose> interpolate(const std::vector<EstimatedPose>& path, double time,
                                         double max_gap);
std::optional<TruePose> interpolate(const std::vector<TruePose>& path, double time, double max_gap);

/// Diagonal of the bounding box of the path, m: the scale on which errors are large or small.
double extent_diagonal(const std::vector<TruePose>& path);

/// Direction, rad, that splits an error at each true pose into along-track and cross-track: the
/// true heading where it is known (Mahmoud section IV: "orthogonal to the true heading"), else the
/// direction of travel. The latter comes from chords of at least 2 % of extent_diagonal(), so that
/// noise of a standing reference does not turn it, and is held while the robot stands; a robot in
/// reverse only flips its sign, which no absolute error sees. Nothing at all if the truth never
/// moves.
std::vector<std::optional<double>> track_directions(const std::vector<TruePose>& truth);

/// Dead reckoning as a path in the map frame: `odometry` (poses in its own frame) moved rigidly so
/// that it agrees with the truth at the first true pose it covers. Position always; heading as the
/// truth's, or, where that is unknown, by the rotation about that position that fits the first 10 %
/// of the true path best (least squares). Throws Error if the two do not overlap in time.
std::vector<EstimatedPose> align_at_start(const std::vector<EstimatedPose>& odometry,
                                          const std::vector<TruePose>& truth);

}  // namespace pf_resampling
