#pragma once

#include <map>
#include <string>
#include <vector>

namespace pf_resampling {

/// Parameters by name, with their values as text.
using Settings = std::map<std::string, std::string>;

/// Which of the package's two filters a study is about.
enum class StudiedFilter { fastslam, beacon_mcl };

/// A world, in which every seed is another drive, or a recording, which is the same for all seeds.
struct StudyProblem {
  std::string name;
  std::string world;      ///< name or file; empty: it is a recording
  std::string bag;        ///< file; empty: it is a world
  double duration = 0.0;  ///< s, of a world in place of its own; 0: its own
  double clip = 0.2;      ///< share of the time, from the start, that errors of paths leave out
  std::string config;  ///< file of parameters and lists (calibration, beacons) on top of all else
  /// beacon_mcl in a world: the ranges' calibration is fitted to the truth of the drive with seed
  /// 0, which is none of the trials.
  bool is_calibrated = false;
};

/// What makes the estimate of a trial.
enum class Estimator {
  filter,          ///< the study's, with the settings
  ekf_slam,        ///< one Gaussian over pose and map (EkfSlam)
  dead_reckoning,  ///< the odometry alone
};

struct StudyFilter {
  std::string name;   ///< once in a study
  std::string group;  ///< of rows in a table
  Estimator estimator = Estimator::filter;
  Settings settings;  ///< on top of the study's
  /// Whether it is given the calibration of a problem: the fitted one, or that of its config.
  bool is_calibrated = true;
};

/// The most trials that a study may have, and the largest block.
constexpr int kMostTrials = 1000000;

/// A study: problems x filters x seeds.
struct StudyDefinition {
  std::string name;
  std::string title;
  StudiedFilter filter = StudiedFilter::fastslam;
  std::string preset;     ///< of the filter; empty: the defaults
  Settings settings;      ///< on top of the preset, for all filters
  int trials = 30;        ///< seeds 1 to this
  int block = 1;          ///< seeds whose results are kept in one file
  std::string reference;  ///< name of the filter that others are compared with
  std::vector<StudyProblem> problems;
  std::vector<StudyFilter> filters;
  bool times_schemes = false;  ///< whether the time of one resampling is measured over sizes
};

/// A study from YAML text, as research/studies/kwak.yaml explains it. `source` names the text in
/// errors; paths of files in it are relative to `folder`. Settings are checked by the filters
/// (study_trials.hpp). Throws Error naming source, line and key of what is unknown, missing or
/// makes no sense.
StudyDefinition parse_study(const std::string& text, const std::string& source,
                            const std::string& folder);

/// A study that comes with the package (kwak, mahmoud), by name, or a YAML file, by path. Throws
/// Error; for an unknown name the line lists those known.
StudyDefinition load_study(const std::string& name_or_path);

/// Throws Error for a definition that makes no sense, saying what.
void check(const StudyDefinition& definition);

}  // namespace pf_resampling
