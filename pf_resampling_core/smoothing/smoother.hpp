#pragma once

#include <string>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

struct SmoothingOptions {
  int iterations = 8;  ///< at most
  /// Of the Cauchy loss of sightings, in sigmas; 0: least squares.
  double robust_width = 0.0;
  /// The least by which a step is to lower the cost, half a sum of squares: the solution is where
  /// none does. Small against 1, which is what chance makes of the cost.
  double tolerance = 1e-4;
};

/// Why there is no solution.
enum class SmoothingFault {
  none,
  not_finite,
  not_positive_definite,
  not_converged,
};
std::string to_string(SmoothingFault fault);

struct SmoothingResult {
  SmoothingFault fault = SmoothingFault::none;
  int iterations = 0;
  double cost = 0.0;             ///< half the sum of squares at the solution
  double log_determinant = 0.0;  ///< of the information on all unknowns there
};

/// The most probable poses, landmarks and constants given all data of the graph
/// (Dellaert, Kaess 2006, "Square Root SAM"): Gauss-Newton with Levenberg's damping, from the
/// graph's estimate, which it improves. With a fault, as for what is not finite, the graph's
/// estimate is as it was.
SmoothingResult smooth(const SmoothingOptions& options, SmoothingGraph* graph);

}  // namespace pf_resampling
