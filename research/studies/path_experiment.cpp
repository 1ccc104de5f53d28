// Both filters on a path with truth, by the measures of Mahmoud et al. (2012, Tables 1 to 3).
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "pf_resampling_core/models/lost_error.hpp"
#include "research/studies/study_trials.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/worlds/recording_to_bag.hpp"
#include "tools/worlds/simulated_recording.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

constexpr double kDrawnPeriod = 1.0;  // s between poses of a path that is drawn

const char* const kAxes[] = {"cross_track", "along_track", "cartesian", "heading"};
const char* const kOthers[] = {"coverage95", "lost_share", "converged_after", "updates",
                               "renewals"};

/// A folder for one bag, gone with it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pf_resampling_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw Error("no folder can be made in " + std::filesystem::temp_directory_path().string());
    }
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// What the filter of a study is given on a drive, in its order, and what it is judged by.
struct PathDrive {
  std::vector<BeaconMclMessage> of_beacons;
  std::vector<FastSlamMessage> of_landmarks;
  std::vector<EstimatedPose> odometry;
  std::vector<TruePose> truth;
  std::vector<Beacon> beacons;
  std::vector<PointLandmark> landmarks;
};

template <typename Message>
std::vector<Message> messages_in(const rosbag::Bag& bag,
                                 const std::vector<FilterInput<Message>>& inputs) {
  std::vector<Message> messages;
  for_each_in_order(bag, bag.getFileName(), names_of(inputs),
                    [&](const rosbag::MessageInstance& instance) {
                      if (auto message = to_message(instance, inputs)) {
                        messages.push_back(std::move(*message));
                      }
                    });
  return messages;
}

/// Of a bag with the usual topics. Throws Error that names the file and what is missing.
PathDrive read_drive(const std::string& path, StudiedFilter filter) {
  const rosbag::Bag bag = open_bag(path);
  const bool is_of_beacons = filter == StudiedFilter::beacon_mcl;
  const NeededTopic observations = is_of_beacons ? NeededTopic{"/ranges", range_types(), ""}
                                                 : NeededTopic{"/landmarks", landmark_types(), ""};
  require_topics(
      bag, path,
      {{"/odom", odometry_types(), ""}, {"/ground_truth", truth_types(), ""}, observations});
  PathDrive drive;
  const std::string base = FrameNames().base;
  if (is_of_beacons) {
    drive.of_beacons = messages_in(bag, BeaconMclTopics().inputs(base, base));
  } else {
    drive.of_landmarks = messages_in(bag, FastSlamTopics().inputs(base));
  }
  drive.odometry = read_poses(bag, "/odom");
  drive.truth = truth_while_recording(read_truth(bag, "/ground_truth"), drive.odometry);
  drive.beacons = read_beacons(bag, "/beacons");
  drive.landmarks = read_landmark_map(bag, "/ground_truth_landmarks").value_or(drive.landmarks);
  return drive;
}

/// Through a bag, so that a simulated drive comes to the filter as a recorded one does.
PathDrive simulated_drive(const World& world, std::uint64_t seed, StudiedFilter filter) {
  const TemporaryFolder folder;
  const std::string bag = folder.file("drive.bag");
  write_recording(simulated_recording(world, seed), bag);
  return read_drive(bag, filter);
}

/// As the world has it.
std::map<int, RangeCalibration> calibration_of(const World& world) {
  std::map<int, RangeCalibration> calibration;
  for (const SimulatedBeacon& each : world.beacons) calibration[each.beacon.id] = each.errors;
  return calibration;
}

/// Estimates in order of time, and what the filter counted.
struct PathRun {
  std::vector<EstimatedPose> path;
  double updates = 0.0;
  double renewals = 0.0;
  double processor_ms = 0.0;
};

const BeaconMcl* filter_of(const BeaconMclPipeline& pipeline) {
  return pipeline.filter();  // none before the first beacons
}
const FastSlam* filter_of(const FastSlamPipeline& pipeline) {
  return &pipeline.filter();
}

template <typename Filter>
void count(const Filter* filter, PathRun* run) {
  if (filter == nullptr) return;
  run->updates = static_cast<double>(filter->status().updates);
  run->renewals = static_cast<double>(filter->status().renewals);
}

template <typename Pipeline, typename Sinks, typename Message, typename Options>
PathRun run_pipeline(const std::vector<Message>& messages, const Options& options) {
  PathRun run;
  Sinks sinks;
  sinks.estimate = [&run](ros::Time stamp, const PoseEstimate& estimate) {
    run.path.push_back({stamp.toSec(), estimate.mean, estimate.covariance});
  };
  const double begin = processor_seconds();
  Pipeline pipeline(options, sinks);
  for (const Message& message : messages) handle(message, &pipeline);
  run.processor_ms = 1e3 * (processor_seconds() - begin);
  count(filter_of(pipeline), &run);
  std::stable_sort(run.path.begin(), run.path.end(),
                   [](const EstimatedPose& a, const EstimatedPose& b) { return a.time < b.time; });
  return run;
}

/// Laid on the truth where it starts: the frame of a map is that of the robot's start.
std::vector<EstimatedPose> laid_on_truth(const std::vector<EstimatedPose>& path,
                                         const std::vector<TruePose>& truth) {
  const Pose2 start = align_at_start(path, truth).front().pose;
  return moved(path, compose(start, relative(path.front().pose, {})));
}

std::vector<double> figures_of(const PathErrors& errors, bool states_belief) {
  std::vector<double> figures = {states_belief ? (errors.lost ? 1.0 : 0.0) : kNoFigure};
  for (const AbsoluteErrors* axis :
       {&errors.cross_track, &errors.along_track, &errors.cartesian, &errors.heading}) {
    const bool is_known = axis->count > 0;
    figures.push_back(is_known ? axis->mean : kNoFigure);
    figures.push_back(is_known ? axis->max : kNoFigure);
    figures.push_back(is_known ? axis->std : kNoFigure);
  }
  figures.push_back(states_belief ? errors.coverage95.value_or(kNoFigure) : kNoFigure);
  figures.push_back(errors.lost_share);
  figures.push_back(errors.converged_after.value_or(kNoFigure));
  return figures;
}

std::vector<std::string> figure_names() {
  std::vector<std::string> names = {"lost"};
  for (const char* axis : kAxes) {
    for (const char* part : {"_mean", "_max", "_std"}) names.push_back(std::string(axis) + part);
  }
  for (const char* other : kOthers) names.emplace_back(other);
  return names;
}

/// A run that never gave a pose is lost, and has no errors.
Trial judged(const PathDrive& drive, const PathRun& run, const PathErrorOptions& options,
             bool states_belief) {
  Trial trial;
  const bool has_errors = !run.path.empty() && run.path.back().time >= drive.truth.front().time;
  if (has_errors) {
    trial.figures = figures_of(evaluate_path(drive.truth, run.path, options), states_belief);
  } else {
    trial.figures.assign(figure_names().size() - 2, kNoFigure);
    trial.figures.front() = 1.0;
  }
  trial.figures.push_back(states_belief ? run.updates : kNoFigure);
  trial.figures.push_back(states_belief ? run.renewals : kNoFigure);
  trial.processor_ms = states_belief ? run.processor_ms : kNoFigure;
  return trial;
}

DrawnPath drawn(const std::string& name, const std::vector<EstimatedPose>& poses) {
  DrawnPath path{name, {}};
  for (const EstimatedPose& pose : poses) {
    if (!path.poses.empty() && pose.time - path.poses.back().time < kDrawnPeriod) continue;
    path.poses.push_back(pose);
  }
  return path;
}

DrawnPath drawn_truth(const std::vector<TruePose>& truth) {
  std::vector<EstimatedPose> poses;
  for (const TruePose& pose : truth) {
    poses.push_back(
        {pose.time, {pose.x, pose.y, pose.heading.value_or(0.0)}, Eigen::Matrix3d::Zero()});
  }
  return drawn("truth", poses);
}

template <typename Options>
std::vector<Options> options_of(const StudyDefinition& study, const StudyProblem& problem) {
  std::vector<Options> all;
  for (const StudyFilter& filter : study.filters) {
    Options options;
    Configuration values;
    if (!study.preset.empty()) values.values["preset"] = study.preset;
    for (const Settings& settings : {study.settings, filter.settings}) {
      for (const auto& [name, value] : settings) values.values[name] = value;
    }
    try {
      apply(values, &options);
      if (!problem.config.empty()) {
        Configuration config = read_configuration(problem.config);
        if (!filter.is_calibrated) config.calibration.clear();
        apply(config, &options);
      }
    } catch (const Error& error) {
      throw Error("filter " + filter.name + ": " + error.what());
    }
    all.push_back(options);
  }
  return all;
}

}  // namespace

Experiment path_experiment(const StudyDefinition& study, const StudyProblem& problem) {
  World world;
  PathDrive recorded;
  if (!problem.world.empty()) {
    world = load_world(problem.world);
    if (problem.duration > 0.0) world.duration = problem.duration;
    if (world.beacons.empty()) throw Error("world " + world.name + " has no beacons");
    recorded = simulated_drive(world, 1, study.filter);
  } else {
    recorded = read_drive(problem.bag, study.filter);
  }
  const bool is_of_beacons = study.filter == StudiedFilter::beacon_mcl;
  std::vector<BeaconMclPipelineOptions> beacon_mcl;
  std::vector<FastSlamPipelineOptions> fastslam;
  if (is_of_beacons) {
    beacon_mcl = options_of<BeaconMclPipelineOptions>(study, problem);
    if (problem.is_calibrated) {
      const auto calibration = calibration_of(world);
      for (std::size_t f = 0; f < beacon_mcl.size(); ++f) {
        if (study.filters[f].is_calibrated) beacon_mcl[f].calibration = calibration;
      }
    }
  } else {
    fastslam = options_of<FastSlamPipelineOptions>(study, problem);
  }
  PathErrorOptions errors;
  errors.clip = problem.clip;

  Experiment experiment;
  experiment.figures = figure_names();
  experiment.about = {{"duration", recorded.truth.back().time - recorded.truth.front().time},
                      {"clip", problem.clip},
                      {"lost_error", lost_error(extent_diagonal(recorded.truth))}};
  for (const Beacon& beacon : recorded.beacons) {
    experiment.places.push_back(
        {"beacon", std::to_string(beacon.id), beacon.position.x(), beacon.position.y()});
  }
  for (const PointLandmark& landmark : recorded.landmarks) {
    experiment.places.push_back(
        {"landmark", std::to_string(landmark.id), landmark.position.x(), landmark.position.y()});
  }
  const bool is_world = !problem.world.empty();
  experiment.run = [=, filter = study.filter, filters = study.filters](
                       std::uint64_t seed, std::vector<DrawnPath>* paths) {
    PathDrive simulated;
    if (is_world) simulated = simulated_drive(world, seed, filter);
    const PathDrive& drive = is_world ? simulated : recorded;
    if (paths != nullptr) paths->push_back(drawn_truth(drive.truth));
    std::vector<Trial> trials;
    for (std::size_t f = 0; f < filters.size(); ++f) {
      if (filters[f].estimator == Estimator::ekf_slam) {  // it reads no messages
        trials.emplace_back();
        trials.back().figures.assign(figure_names().size(), kNoFigure);
        continue;
      }
      PathRun run;
      const bool is_filter = filters[f].estimator == Estimator::filter;
      if (!is_filter) {
        run.path = align_at_start(drive.odometry, drive.truth);
      } else if (is_of_beacons) {
        BeaconMclPipelineOptions options = beacon_mcl[f];
        options.seed = static_cast<int>(seed);
        options.filter.threads = 1;
        run = run_pipeline<BeaconMclPipeline, BeaconMclSinks>(drive.of_beacons, options);
      } else {
        FastSlamPipelineOptions options = fastslam[f];
        options.seed = static_cast<int>(seed);
        run = run_pipeline<FastSlamPipeline, FastSlamSinks>(drive.of_landmarks, options);
        if (!run.path.empty()) run.path = laid_on_truth(run.path, drive.truth);
      }
      trials.push_back(judged(drive, run, errors, is_filter));
      if (paths != nullptr) paths->push_back(drawn(filters[f].name, run.path));
    }
    return trials;
  };
  return experiment;
}

Experiment experiment_of(const StudyDefinition& study, const StudyProblem& problem) {
  if (study.filter == StudiedFilter::beacon_mcl || problem.world.empty()) {
    return path_experiment(study, problem);
  }
  return landmark_experiment(study, problem);
}

}  // namespace pf_resampling
