#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

struct SmoothingOptions {
  int iterations = 8;  ///< at most
  /// Of the Cauchy loss of sightings and ranges, in sigmas; 0: least squares.
  double robust_width = 0.0;
  /// The least by which a step is to lower the cost, half a sum of squares: the solution is where
  /// none does. Small against 1, which is what chance makes of the cost.
  double tolerance = 1e-4;
  bool with_belief = true;  ///< or the estimate and its cost alone
};

/// Why there is no solution.
enum class SmoothingFault {
  none,
  not_finite,
  not_positive_definite,
  not_converged,
};
std::string to_string(SmoothingFault fault);

/// What the smoothing posterior says of what a filter goes on with, by Laplace's approximation: a
/// Gaussian about the graph's estimate over the landmarks (two each), the radios (two each), the
/// constants and the newest pose, in this order; and what is left of it once the path (and the
/// sensor's constants) are given, when landmarks and the odometry's constants are independent.
struct JointBelief {
  Eigen::MatrixXd covariance;
  std::vector<Eigen::Matrix2d> landmarks_given_path;  ///< m^2
  /// A covariance.
  OdometryInformation odometry_given_path = OdometryInformation::Zero();
};

struct SmoothingResult {
  SmoothingFault fault = SmoothingFault::none;
  int iterations = 0;
  double cost = 0.0;             ///< half the sum of squares at the solution
  double log_determinant = 0.0;  ///< of the information on all unknowns there
  /// At the start of the last step, which is shorter than any that matters; empty if it was not
  /// asked for.
  JointBelief belief;
};

/// The most probable poses, landmarks, errors of radios and constants given all data of the graph
/// (Dellaert, Kaess 2006, "Square Root SAM"): Gauss-Newton with Levenberg's damping, from the
/// graph's estimate, which it improves. With a fault the graph's estimate is as it was. Throws
/// Error as check(graph) does.
SmoothingResult smooth(const SmoothingOptions& options, SmoothingGraph* graph);

/// Takes the oldest poses out of the graph, with their motions, sightings and ranges, and puts into
/// its prior what these say of all that stays (Schur complement), linearised at the graph's
/// estimate, which therefore should be a solution. Bounds what a long drive costs. False, changing
/// nothing, if what they say is not positive definite. Throws Error unless one pose is forgotten
/// and one stays.
bool forget_oldest(int poses, double robust_width, SmoothingGraph* graph);

/// Deviations of what a particle carries from the graph's estimate: a row per particle, columns as
/// in JointBelief. What a Rao-Blackwellised particle keeps as a covariance is taken out: they are
/// drawn from Σ - blockdiag(given path), as whole paths would give them. In antithetic pairs, so
/// that their mean is the estimate. Empty if the covariance is not one.
Eigen::MatrixXd draw_deviations(const JointBelief& belief, int particles,
                                const RandomStream& stream);

}  // namespace pf_resampling
