#pragma once

#include <Eigen/SparseCore>
#include <optional>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// The most probable poses, landmarks and constants given all data of the graph
/// (Dellaert, Kaess 2006, "Square Root SAM"): Levenberg and Marquardt's steps from the graph's
/// estimate, which they improve. `robust_width`: of the Cauchy loss of sightings, in sigmas; 0:
/// least squares. Returns the cost, half the sum of squares at the solution; nothing, with the
/// graph's estimate as it was, if there is none or the graph is not finite.
std::optional<double> smooth(double robust_width, SmoothingGraph* graph);

/// The information on all unknowns at the graph's estimate: three of each pose, two of each
/// landmark, the constants.
Eigen::SparseMatrix<double> information_of(const SmoothingGraph& graph, double robust_width);

}  // namespace pf_resampling
