#include "pf_resampling_core/smoothing/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pf_resampling_core/parameters/enum_names.hpp"
#include "pf_resampling_core/smoothing/normal_equations.hpp"

namespace pf_resampling {
namespace {

const EnumNames<SmoothingFault> kFaults{
    "smoothing fault",
    {{SmoothingFault::none, "none"},
     {SmoothingFault::not_finite, "not finite"},
     {SmoothingFault::not_positive_definite, "not positive definite"},
     {SmoothingFault::not_converged, "not converged"}}};

// Of the cost: a step that still promises more when the iterations are used up ends far from the
// solution.
constexpr double kFar = 0.5;
constexpr double kLeastDamping = 1e-6;
constexpr double kLargestDamping = 1e8;

// Cost, and where that is.
struct Iterate {
  double cost = std::numeric_limits<double>::infinity();
  SmoothingGraph graph;
};

// Along a step that goes downhill at first: all of it, or as much as lowers the cost.
bool search_line(const SmoothingOptions& options, const NormalEquations& equations,
                 const Eigen::VectorXd& step, Iterate* best) {
  for (const double share : {1.0, 0.5, 0.25, 0.125}) {
    SmoothingGraph moved = best->graph;
    equations.move(share * step, &moved);
    const double cost = equations.cost(moved, options.robust_width);
    if (cost < best->cost) {
      *best = {cost, std::move(moved)};
      return true;
    }
  }
  return false;
}

// Steps from the graph's estimate to the least cost. `is_factorized`: whether the equations are
// left factorised, without damping, so near to the solution that this makes no difference.
SmoothingFault descend(const SmoothingOptions& options, NormalEquations* equations, Iterate* best,
                       int* iterations, bool* is_factorized) {
  *is_factorized = false;
  double damping = 0.0;  // none as long as the steps are good
  double promise = 0.0;  // by how much the last step was to lower the cost
  best->cost = equations->cost(best->graph, options.robust_width);
  if (!std::isfinite(best->cost)) return SmoothingFault::not_finite;
  for (*iterations = 1; *iterations <= options.iterations; ++*iterations) {
    equations->linearize(best->graph, options.robust_width);
    if (!equations->gradient().allFinite()) return SmoothingFault::not_finite;
    for (bool is_better = false; !is_better;) {
      if (damping > kLargestDamping) return SmoothingFault::not_converged;
      const bool is_definite = equations->factorize(damping);
      if (is_definite) {
        const Eigen::VectorXd step = equations->step();
        promise = -0.5 * step.dot(equations->gradient());
        is_better = search_line(options, *equations, step, best);
        if (promise < options.tolerance) {
          *is_factorized = damping == 0.0;
          return SmoothingFault::none;
        }
      }
      damping = is_better ? 0.1 * damping : std::max(kLeastDamping, 10.0 * damping);
      if (damping < kLeastDamping) damping = 0.0;
    }
  }
  return promise < kFar ? SmoothingFault::none : SmoothingFault::not_converged;
}

}  // namespace

std::string to_string(SmoothingFault fault) {
  return kFaults.name(fault);
}

SmoothingResult smooth(const SmoothingOptions& options, SmoothingGraph* graph) {
  SmoothingResult result;
  NormalEquations equations(*graph);
  Iterate best;
  best.graph = *graph;
  bool is_factorized = false;
  result.fault = descend(options, &equations, &best, &result.iterations, &is_factorized);
  result.cost = best.cost;
  if (result.fault != SmoothingFault::none) return result;
  if (!is_factorized) {
    equations.linearize(best.graph, options.robust_width);
    if (!equations.factorize(0.0)) {
      result.fault = SmoothingFault::not_positive_definite;
      return result;
    }
  }
  result.log_determinant = equations.log_determinant();
  if (!std::isfinite(result.log_determinant) || !are_plausible(best.graph.constants)) {
    result.fault = SmoothingFault::not_finite;
    return result;
  }
  *graph = std::move(best.graph);
  return result;
}

}  // namespace pf_resampling
