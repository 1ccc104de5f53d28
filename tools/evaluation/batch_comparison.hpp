#pragma once

#include <rosbag/bag.h>

#include "tools/common/evaluation_report.hpp"
#include "tools/evaluation/evaluation_request.hpp"
#include "tools/evaluation/recorded_run.hpp"

namespace pf_resampling {

/// Whether the batch solution is that of ranges to beacons: there are no observations of landmarks.
bool is_of_ranges(const rosbag::Bag& bag, const EvaluationRequest& request);

/// The least-squares solution of the bag's odometry and observations, or of odometry and ranges,
/// judged as the estimate is. `run` is in the truth's frame; `evaluation` is that of its estimate.
/// Throws Error: the bag does not hold what it takes, or too much of it.
BatchComparison compare_with_batch(const rosbag::Bag& bag, const RecordedRun& run,
                                   const EvaluationRequest& request, const Evaluation& evaluation);

}  // namespace pf_resampling
