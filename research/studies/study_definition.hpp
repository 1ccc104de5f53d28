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
  /// beacon_mcl in a world: the filter is given the scale, bias and noise of each beacon.
  bool is_calibrated = false;
};

/// What makes the estimate of a trial.
enum class Estimator {
  filter,          ///< the study's, with the settings
  ekf_slam,        ///< one Gaussian over pose and map (EkfSlam)
  dead_reckoning,  ///< the odometry alone
};

struct StudyFilter {
  std::string name;  ///< once in a study
  Estimator estimator = Estimator::filter;
  Settings settings;  ///< on top of the study's
  /// Whether it is given the calibration of a problem: the fitted one, or that of its config.
  bool is_calibrated = true;
};

/// What of a study is the same for all problems and seeds.
struct StudyDefinition {
  StudiedFilter filter = StudiedFilter::fastslam;
  std::string preset;  ///< of the filter; empty: the defaults
  Settings settings;   ///< on top of the preset, for all filters
  std::vector<StudyFilter> filters;
};

}  // namespace pf_resampling
