#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "research/studies/study_definition.hpp"

namespace pf_resampling {

/// In place of a figure that a trial does not have: distinct particles of EKF-SLAM, for instance.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

/// What one run of one filter gave.
struct Trial {
  std::vector<double> figures;              ///< in the order of Experiment::figures, or kNoFigure
  double processor_ms = kNoFigure;          ///< of the whole filter, by the clock
  std::vector<std::vector<double>> curves;  ///< in the order of Experiment::curves, over its times
};

/// Where somebody was, for drawings: of a filter, of dead reckoning, or the truth.
struct DrawnPath {
  std::string name;
  std::vector<EstimatedPose> poses;  ///< without covariances
};

/// A place of the world, true: of a landmark, a beacon, or the robot where it closes a loop.
struct DrawnPlace {
  std::string kind;  ///< landmark, beacon, closure
  std::string id;
  double x = 0.0;  ///< m, frame of the truth
  double y = 0.0;
};

/// A problem of a study, ready to be run with any seed.
struct Experiment {
  std::vector<std::string> figures;  ///< names
  std::vector<std::string> curves;   ///< names
  std::vector<double> times;         ///< of the curves' entries, s
  nlohmann::json about;              ///< duration, closures and the like
  std::vector<DrawnPlace> places;
  /// A trial per filter of the definition, in their order. Safe to be called by several threads.
  /// `paths`: where to put the paths that are drawn, or null.
  std::function<std::vector<Trial>(std::uint64_t seed, std::vector<DrawnPath>* paths)> run;
};

/// FastSLAM in a simulated world, by the figures of Kwak (2008, sections 4 and 5): N_eff, distinct
/// particles, eqs. 5 and 6, and what these leave out: the error of the weighted mean, and how far
/// its covariance can be believed. Throws Error for a world without landmarks and for settings that
/// make no sense.
Experiment landmark_experiment(const StudyDefinition& definition, const StudyProblem& problem);

/// Either filter on a path with truth: a recording, or beacons in a simulated world, by the figures
/// of Mahmoud (2012, Tables 1 to 3). Throws Error likewise.
Experiment path_experiment(const StudyDefinition& definition, const StudyProblem& problem);

/// What all filters of a study have in common: the value of every parameter of the filter itself.
/// Parameters of the ROS side that the study sets are not among them.
Settings parameters_of_all(const StudyDefinition& definition);

/// The one of the two that fits.
Experiment experiment_of(const StudyDefinition& definition, const StudyProblem& problem);

/// Processor time of this thread so far, s.
double processor_seconds();

}  // namespace pf_resampling
