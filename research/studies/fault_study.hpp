#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "research/studies/faults.hpp"

namespace pf_resampling {

/// What faults do to a filter, and what it says of them.
struct FaultStudyOptions {
  BeaconMclPipelineOptions beacon_mcl;  ///< used on drives with beacons
  FastSlamPipelineOptions fastslam;     ///< on the others
  double share = 0.4;                   ///< of the drive, before the fault
  int seed = 1;
  std::string only;  ///< part of the names of the faults wanted; empty: all
};

/// A run, second by second.
struct FaultRun {
  struct Sample {
    double time = 0.0;
    double error = 0.0;  ///< m
    double lost = 0.0;   ///< probability, as published
    /// The squared error in standard deviations of the published covariance, in the frame that this
    /// is stated in: that of beacons or of the robot's start, where nothing is to be found out.
    std::optional<double> normalized_squared;
    bool is_healthy = true;  ///< as published: Health::healthy
  };
  struct Alarm {
    double delay = 0.0;  ///< s after the fault
    std::string text;
  };
  std::vector<Sample> samples;
  std::optional<Alarm> alarm;  ///< the first diagnostic that was not there before the fault
  bool all_finite = true;      ///< whether all poses were
  bool is_in_map = false;      ///< whether errors are those in the filter's map
};

struct FaultResult {
  std::string name;
  double begin = 0.0, end = 0.0, last = 0.0;  ///< s, of the fault and of the drive
  FaultRun run;
};

struct FaultStudy {
  std::string recording;
  FaultStudyOptions options;
  double lost_error = 0.0;  ///< m
  bool is_in_map = false;   ///< errors are those in the filter's map
  std::vector<FaultResult> results;
};

/// The turn and shift that bring a map, and with it a robot that knows its place in it, to the
/// truth: by the landmarks of equal ids. Nothing below three of them.
std::optional<Pose2> map_to_truth(const std::vector<PointLandmark>& map,
                                  const std::vector<PointLandmark>& truth);

/// Runs it. An error is the distance to the true place. On a drive among landmarks the filter's
/// frame is its own: it is laid on the truth's by the filter's map of that moment, so that an error
/// is what the robot is wrong in its map, or, where landmarks have no ids or no true place, by the
/// path before the fault. Throws Error on options that make no sense.
FaultStudy run_fault_study(const std::string& recording, const RecordedDrive& drive,
                           const FaultStudyOptions& options);

/// All of it, as `study faults` takes it; a sample is the list of time, error, lost, whether the
/// truth is inside the 3-sigma region (null: not known), is_healthy.
nlohmann::json to_json(const FaultStudy& study);

}  // namespace pf_resampling
