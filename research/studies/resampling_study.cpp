#include "research/studies/resampling_study.hpp"

#include <algorithm>
#include <mutex>

#include "pf_resampling_core/error.hpp"
#include "research/studies/for_each_index.hpp"

namespace pf_resampling {
namespace {

void check(const ResamplingStudyOptions& options) {
  if (options.seeds < 1) {
    throw Error("seeds is " + std::to_string(options.seeds) + ": it has to be at least 1");
  }
  if (options.jobs < 1) {
    throw Error("jobs is " + std::to_string(options.jobs) + ": it has to be at least 1");
  }
  if (options.schemes.empty() || options.excitations.empty()) {
    throw Error("a study needs at least one scheme and one excitation");
  }
  check_options(options.errors);
  validate(options.pipeline.filter);
}

std::vector<EstimatedPose> to_path(const std::vector<StampedEstimate>& estimates) {
  std::vector<EstimatedPose> path;
  path.reserve(estimates.size());
  for (const StampedEstimate& estimate : estimates) {
    path.push_back({estimate.stamp.toSec(), estimate.estimate.mean, estimate.estimate.covariance});
  }
  std::stable_sort(path.begin(), path.end(),
                   [](const EstimatedPose& a, const EstimatedPose& b) { return a.time < b.time; });
  return path;
}

void run(const std::vector<BeaconMclMessage>& messages, const std::vector<TruePose>& truth,
         const ResamplingStudyOptions& options, const StudyCell& cell, StudyRun* result) {
  BeaconMclPipelineOptions pipeline = options.pipeline;
  pipeline.seed = result->seed;
  pipeline.filter.threads = 1;
  pipeline.filter.strategy.resampling.scheme = cell.scheme;
  pipeline.filter.strategy.excitation.method = cell.excitation;
  const std::vector<EstimatedPose> path = to_path(run_over_messages(messages, pipeline).estimates);
  if (path.empty() || path.back().time < truth.front().time) return;
  result->errors = evaluate_path(truth, path, options.errors);
  result->errors.samples = {};
  result->has_errors = true;
}

}  // namespace

std::vector<ResamplingScheme> schemes_of_paper_m() {
  return {ResamplingScheme::residual_then_systematic, ResamplingScheme::stratified,
          ResamplingScheme::residual, ResamplingScheme::systematic, ResamplingScheme::multinomial};
}

int StudyCell::lost() const {
  return static_cast<int>(std::count_if(runs.begin(), runs.end(), is_lost));
}

const StudyCell& ResamplingStudy::cell(ResamplingScheme scheme, Excitation excitation) const {
  const auto found = std::find_if(cells.begin(), cells.end(), [&](const StudyCell& cell) {
    return cell.scheme == scheme && cell.excitation == excitation;
  });
  if (found == cells.end()) {
    throw Error("the study has no " + to_string(scheme) + " with excitation " +
                to_string(excitation));
  }
  return *found;
}

ResamplingStudy run_resampling_study(const std::string& recording,
                                     const std::vector<BeaconMclMessage>& messages,
                                     const std::vector<TruePose>& truth,
                                     const std::vector<EstimatedPose>& odometry,
                                     const ResamplingStudyOptions& options,
                                     const std::function<void(std::uint64_t)>& progress) {
  check(options);
  ResamplingStudy study;
  study.recording = recording;
  study.options = options;
  study.dead_reckoning = evaluate_path(truth, align_at_start(odometry, truth), options.errors);
  study.dead_reckoning.samples = {};
  for (const Excitation excitation : options.excitations) {
    for (const ResamplingScheme scheme : options.schemes) {
      StudyCell cell;
      cell.scheme = scheme;
      cell.excitation = excitation;
      cell.runs.resize(static_cast<std::size_t>(options.seeds));
      for (int seed = 1; seed <= options.seeds; ++seed) {
        cell.runs[static_cast<std::size_t>(seed - 1)].seed = seed;
      }
      study.cells.push_back(cell);
    }
  }

  const std::size_t seeds = static_cast<std::size_t>(options.seeds);
  std::uint64_t done = 0;
  std::mutex progress_mutex;
  for_each_index(study.cells.size() * seeds, options.jobs, [&](std::size_t i) {
    StudyCell& cell = study.cells[i / seeds];
    run(messages, truth, options, cell, &cell.runs[i % seeds]);
    const std::lock_guard<std::mutex> lock(progress_mutex);
    progress(++done);
  });
  return study;
}

}  // namespace pf_resampling
