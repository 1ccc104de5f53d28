#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "beacon_mcl_node/messages_in_memory.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "research/studies/report.hpp"

namespace pf_resampling {

/// The comparison of Mahmoud et al. (2012, section IV, Tables 1 to 3): resampling schemes, with and
/// without excitation, on one recording, each with the same seeds.
struct ResamplingStudyOptions {
  BeaconMclPipelineOptions pipeline;  ///< the study itself sets scheme, excitation, seed, threads
  std::vector<ResamplingScheme> schemes;
  std::vector<Excitation> excitations;
  int seeds = 30;  ///< 1 to this
  int jobs = 1;    ///< runs at a time; the result does not depend on it
  PathErrorOptions errors;
};

/// The five schemes of their tables, in their order: residual systematic (RSR), stratified,
/// residual, systematic, multinomial.
std::vector<ResamplingScheme> schemes_of_mahmoud();

struct StudyRun {
  int seed = 0;
  bool has_errors = false;  ///< false: the filter never gave a pose
  PathErrors errors;        ///< without its samples
};

struct StudyCell {
  ResamplingScheme scheme = ResamplingScheme::systematic;
  Excitation excitation = Excitation::none;
  std::vector<StudyRun> runs;  ///< by seed

  static bool is_lost(const StudyRun& run) { return !run.has_errors || run.errors.lost; }
  int lost() const;
};

struct ResamplingStudy {
  std::string recording;
  ResamplingStudyOptions options;
  PathErrors dead_reckoning;
  std::vector<StudyCell> cells;  ///< excitation by excitation, scheme by scheme

  const StudyCell& cell(ResamplingScheme scheme, Excitation excitation) const;
};

/// Runs it. `progress` is called with the number of runs that are done. Throws Error on options
/// that make no sense.
ResamplingStudy run_resampling_study(const std::string& recording,
                                     const std::vector<BeaconMclMessage>& messages,
                                     const std::vector<TruePose>& truth,
                                     const std::vector<EstimatedPose>& odometry,
                                     const ResamplingStudyOptions& options,
                                     const std::function<void(std::uint64_t)>& progress);

/// A row per excitation and scheme. Figures are averages over the runs that were not lost, with
/// their standard errors; differences of the mean Cartesian error to systematic resampling, and to
/// the first excitation, are paired by seed. The first row is dead reckoning.
StudyReport report_of(const ResamplingStudy& study);

}  // namespace pf_resampling
