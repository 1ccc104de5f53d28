// Stands in for batch_slam.cpp where Ceres is not installed.
#include "pf_resampling_core/error.hpp"
#include "tools/batch/batch_slam.hpp"

namespace pf_resampling {

bool has_batch_solver() {
  return false;
}

BatchSolution solve_batch(const BatchProblem& /*problem*/, const BatchNoise& /*noise*/) {
  throw Error(
      "the batch solution needs Ceres, which was missing when this was built: install libceres-dev "
      "and build again");
}

}  // namespace pf_resampling
