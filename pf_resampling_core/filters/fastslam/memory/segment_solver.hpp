#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>

#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

namespace pf_resampling {

struct SegmentSolution {
  bool is_solved = false;
  double cost = 0.0;
  double log_determinant = 0.0;  ///< of the information on all unknowns

  /// Minus the logarithm of the evidence, but for a constant; infinite if it is not solved.
  double negative_log_evidence() const {
    return is_solved ? cost + 0.5 * log_determinant : std::numeric_limits<double>::infinity();
  }
};

/// Least cost, from the graph's estimate on: with damping, as many steps as it takes; segments are
/// condensed anew where they have moved or where their odometry turns out to be wrong. Unless it is
/// solved, nothing changes. `equations`, if given, is left factorised at the solution.
SegmentSolution solve(double robust_width, SegmentGraph* graph,
                      std::unique_ptr<SegmentEquations>* equations = nullptr);

/// Condenses segment `s` anew where the graph's estimate has it. False if that cannot be done.
bool relinearize(double robust_width, std::size_t s, SegmentGraph* graph);

/// Deviations of what a particle carries from the estimate: a row per particle; columns: two for
/// each landmark, the constants, the newest pose. What a Rao-Blackwellised particle keeps as a
/// covariance is taken out. Antithetic pairs.
Eigen::MatrixXd draw_deviations(const SegmentEquations& equations, const SegmentGraph& graph,
                                int particles, const RandomStream& stream);

}  // namespace pf_resampling
