#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/simulation/world.hpp"
#include "research/studies/compensation_variants.hpp"
#include "research/studies/report.hpp"

namespace pf_resampling {

/// The comparison of Kwak, Kim and Lee (2008, sections 4 and 5) on a simulated world: FastSLAM with
/// resampling and with compensation, each on the same drives.
struct CompensationStudyOptions {
  FastSlamOptions base;  ///< what the variants change; usually kwak2008_options()
  std::vector<CompensationVariant> variants;
  int drives = 100;  ///< with seeds 1 to this, of the drive and of the filter
  int jobs = 1;      ///< runs at a time; the result does not depend on it, but for processor_ms
};

/// What one run measures. Averages are over the scans of the drive, after each update.
struct CompensationFigures {
  double calls = 0.0;                  ///< resamplings or compensations
  double effective_sample_size = 0.0;  ///< before renewal, average over scans that saw any
  double distinct = 0.0;       ///< distinct particles (Kwak 2008, section 4.1), likewise, after
  double distinct_end = 0.0;   ///< at the end of the drive
  double feature_error = 0.0;  ///< Kwak (2008) eq. 5, average, m
  double feature_error_end = 0.0;
  double position_error = 0.0;     ///< Kwak (2008) eq. 6, average, m
  double map_error = 0.0;          ///< RMS of the weighted-mean map, average, m
  double map_error_aligned = 0.0;  ///< the same after the best turn and shift
  double map_error_end = 0.0;
  double pose_error = 0.0;   ///< distance of the weighted-mean position, average, m
  double map_inside = 0.0;   ///< share of true landmarks in the estimate's 95 % ellipse, average
  double pose_inside = 0.0;  ///< share of true positions in the estimate's 95 % ellipse
  /// Squared Mahalanobis distance of landmarks, over all of all scans: the median, for a single
  /// scan after which the particles are copies of one makes any average meaningless; 1.39 if
  /// honest.
  double map_nees = 0.0;
  double pose_nees = 0.0;     ///< likewise of positions
  double processor_ms = 0.0;  ///< of the filter alone, ms; by the clock, so different every time
};

/// Averages over the drives, one entry per scan.
struct CompensationCurves {
  std::vector<double> feature_error, map_error, distinct, effective_sample_size, map_inside;
};

struct CompensationCell {
  CompensationVariant variant;
  std::vector<CompensationFigures> runs;  ///< by seed
  CompensationCurves curves;

  std::vector<double> values(double CompensationFigures::*figure) const;
};

struct CompensationStudy {
  std::string world;
  CompensationStudyOptions options;
  std::vector<double> times;               ///< of the scans, s
  std::map<std::string, double> closures;  ///< name, s
  std::vector<CompensationCell> cells;

  /// Null if the study was made without that variant.
  const CompensationCell* find(const std::string& name) const;
};

/// Runs it. `progress` is called with the number of drives that are done. Throws Error on options
/// that make no sense and on a world without landmarks.
CompensationStudy run_compensation_study(const World& world,
                                         const CompensationStudyOptions& options,
                                         const std::function<void(std::uint64_t)>& progress);

/// A row per filter: averages over the drives with their standard errors, differences to RSR paired
/// by drive, and "curves", averages scan by scan.
StudyReport report_of(const CompensationStudy& study);

}  // namespace pf_resampling
