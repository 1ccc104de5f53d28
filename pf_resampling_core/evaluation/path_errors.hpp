#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "pf_resampling_core/evaluation/stamped_path.hpp"

namespace pf_resampling {

struct PathErrorOptions {
  /// Share of the truth's time span, from its start, that is left out of the errors and coverages
  /// (Mahmoud section IV: "the first 5000 steps are clipped, giving the filter time to converge");
  /// in [0, 1).
  double clip = 0.0;
  /// Longest gap of the estimate that is interpolated across, s; 0: usual_max_gap().
  double max_gap = 0.0;
};

/// Throws Error for an option outside its range, naming it, its value and its range.
void check_options(const PathErrorOptions& options);

/// A robot whose heading is further off than this, rad, is lost: 30 degrees, as
/// unknown_heading_probability() has it.
inline constexpr double kLostHeading = kPi / 6.0;

/// Of the absolute values of an error, as in the Tables 1 to 3 of Mahmoud: all truth poses count
/// the same.
struct AbsoluteErrors {
  int count = 0;  ///< truth poses at which the error is defined; the rest has no meaning if 0
  double mean = 0.0;
  double max = 0.0;
  double std = 0.0;  ///< of the absolute value about its mean (divisor: count)
  double rms = 0.0;
  double median = 0.0;
};
AbsoluteErrors absolute_errors(const std::vector<double>& errors);

/// The 3-sigma region of a place is where normalized_squared() is at most this: 98.9 % if Gaussian.
inline constexpr double kThreeSigmaSquared = 9.0;

/// Squared length of an error in x and y in standard deviations; infinite if `covariance` has no
/// inverse.
double normalized_squared(const Eigen::Matrix2d& covariance, const Eigen::Vector2d& error);

/// The error at one true pose: estimate minus truth.
struct PathErrorSample {
  double time = 0.0;                  ///< s
  bool is_clipped = false;            ///< in the part that the summaries leave out
  double cartesian = 0.0;             ///< m, distance
  std::optional<double> cross_track;  ///< m, positive to the left of track_directions()
  std::optional<double> along_track;  ///< m, positive ahead
  std::optional<double> heading;      ///< rad, in [-pi, pi]; only where the truth has a heading
  double cross_track_sigma = 0.0;     ///< m, by the estimate's covariance
  double along_track_sigma = 0.0;     ///< m, likewise
  double heading_sigma = 0.0;         ///< rad, likewise
  double position_sigma = 0.0;        ///< m, along the long axis of the error ellipse of (x, y)
  /// Squared Mahalanobis distance of the error of (x, y), and of (x, y, heading), in the estimate's
  /// covariance; infinite where that is not positive definite.
  double normalized_squared = 0.0;
  std::optional<double> normalized_squared_pose;
};

/// How far a path is from the truth, at the stamps of the truth.
struct PathErrors {
  AbsoluteErrors cross_track;  ///< m
  AbsoluteErrors along_track;  ///< m
  AbsoluteErrors cartesian;    ///< m
  AbsoluteErrors heading;      ///< rad

  /// Shares of the (unclipped) truth poses with the truth inside the estimate's own region; nothing
  /// if the estimate states no covariance. A singular covariance contains nothing.
  std::optional<double> coverage95;        ///< 95 % ellipse of (x, y): chi-square, 2 dof, 5.991
  std::optional<double> coverage95_pose;   ///< 95 % ellipsoid of (x, y, heading): 3 dof, 7.815
  std::optional<double> coverage_3sigma;   ///< 3-sigma ellipse of (x, y): 98.9 % if Gaussian
  std::optional<double> normalized_error;  ///< mean of normalized_squared: 2 if consistent

  /// Time from the first true pose, s, to the first moment from which the Cartesian error stays
  /// below lost_error, and that of the heading below kLostHeading where the truth has one, for at
  /// least 10 s or, later than 10 s before the end, to the end. Nothing if that never happens. The
  /// clipped part counts here.
  std::optional<double> converged_after;
  /// Share of the (unclipped) true poses at which the robot did not know where it was: Cartesian
  /// error above lost_error, or no estimate.
  double lost_share = 0.0;
  /// Whether the run was lost: whether that share is above a tenth, never counting the first fifth
  /// of the time. A run that loses itself for a while and recovers soon is not lost; one that ends
  /// lost, or whose figures are made by the time it was lost, is.
  bool lost = false;
  double lost_error = 0.0;  ///< m, the bound: lost_error() of the area that the robot drove in

  double duration = 0.0;  ///< s, of the truth
  int truth_poses = 0;    ///< unclipped
  int uncovered = 0;      ///< of these: without an estimate (outside its span, or in a gap)
  std::vector<PathErrorSample> samples;  ///< clipped ones as well
};

/// Errors of `estimate`, interpolated at every true pose. Both in the map frame and in order of
/// time. Throws Error for options outside their ranges, paths that are empty, not finite or out of
/// order, and if no unclipped true pose is covered.
PathErrors evaluate_path(const std::vector<TruePose>& truth,
                         const std::vector<EstimatedPose>& estimate,
                         const PathErrorOptions& options = {});

}  // namespace pf_resampling
