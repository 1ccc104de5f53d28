#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/table.hpp"
#include "tools/runs/filter_over_bag.hpp"
#include "tools/runs/particle_judge.hpp"

namespace pf_resampling {
namespace {

FastSlamPipelineOptions read_fastslam_options(const CommandLine& line) {
  FastSlamPipelineOptions options;
  apply_filter_options(line, &options);
  apply_run_parameters(line, parameters_of(&options));
  if (line.has("load-map")) options.map_file = line.text("load-map");
  require_separate(line.written(), {{options.map_file, "map_file/load " + options.map_file}});
  return options;
}

/// The errors of Kwak (2008), eqs. 5 and 6, over a run: means over the updates, and the last.
struct RunErrors {
  void add(const ParticleErrors& errors) {
    ++updates;
    position += errors.position_rms;
    last_position = errors.position_rms;
    if (errors.features == 0) return;
    ++with_features;
    feature += errors.feature_rms;
    last_feature = errors.feature_rms;
  }
  std::string text() const {
    std::string text =
        "errors of the particles (Kwak 2008, eqs. 5 and 6), mean over the updates and at the end: ";
    if (with_features > 0) {
      text += "landmarks " + fixed(feature / with_features, 3) + " m, " + fixed(last_feature, 3) +
              " m; ";
    }
    return text + "position " + fixed(position / updates, 3) + " m, " + fixed(last_position, 3) +
           " m";
  }
  int updates = 0, with_features = 0;
  double feature = 0.0, position = 0.0, last_feature = 0.0, last_position = 0.0;
};

/// Nothing if the bag does not carry what it takes, or has there what makes no sense: a run needs
/// no truth. Then `why` says so.
std::optional<ParticleJudge> judge_of(const rosbag::Bag& bag, const std::string& odom,
                                      bool frame_is_given, std::string* why) {
  try {
    ParticleJudge judge(bag, odom, frame_is_given);
    if (judge.can_judge()) return judge;
  } catch (const Error& error) {
    *why = error.what();
  }
  return std::nullopt;
}

/// As a list of landmarks, which can be loaded again.
std::string table_of(const LandmarkMap& map) {
  std::string table = "id,x,y,sigma\n";
  for (const Landmark& landmark : map.landmarks) {
    const double variance = 0.5 * (landmark.covariance[0] + landmark.covariance[3]);
    table += std::to_string(landmark.id) + "," + fixed(landmark.position.x, 6) + "," +
             fixed(landmark.position.y, 6) + "," + fixed(std::sqrt(std::max(0.0, variance)), 6) +
             "\n";
  }
  return table;
}

}  // namespace

int fastslam_over_bag(const CommandLine& line) {
  const FastSlamPipelineOptions options = read_fastslam_options(line);
  const FastSlamTopics topics = fastslam_topics(line);
  FilterOverBag run(line);
  if (run.is_only()) {
    require_fastslam_topics(run.in(), run.in_path(), topics, options.odometry_input.source,
                            options.tag_pattern.empty());
  }
  FastSlamSinks sinks;
  run.connect(&sinks);
  if (line.has("tum")) {
    sinks.final_path = [&](const auto& stamps, const auto& poses) { run.take_path(stamps, poses); };
  }
  // Without pictures, of the paths only the last is worth its place: it is what is believed at the
  // end.
  bool is_end = false;
  if (run.with_status()) {
    sinks.path = [&](const nav_msgs::Path& path) {
      if (run.with_pictures() || is_end) run.writer().write("/path", run.now(), path);
    };
  }
  LandmarkMap last_map;
  sinks.landmark_map = [&](const LandmarkMap& map) {
    last_map = map;
    if (run.with_status()) run.writer().write_latched("/landmark_map", run.now(), map);
  };
  const bool frame_is_given =
      has_topic(run.in(), topics.initial_pose) || !options.map_file.empty() || line.has("resume");
  std::string not_judged;
  const std::optional<ParticleJudge> judge =
      run.with_status() && run.is_only() && !line.has("start")
          ? judge_of(run.in(), topics.odom, frame_is_given, &not_judged)
          : std::nullopt;
  RunErrors errors;
  if (judge) {
    sinks.updated = [&](ros::Time stamp, FastSlam* filter) {
      auto judged = judge->judge(stamp, filter);
      if (!judged) return;
      judged->header.frame_id = options.frames.map;
      errors.add(*judged);
      run.writer().write("/particle_errors", run.now(), *judged);
    };
  }
  FastSlamPipeline pipeline(options, sinks);
  resume_if_wanted(line, read_fastslam_checkpoint, &pipeline);
  run.for_each_message(topics.inputs(options.frames.base), options.frames,
                       [&](const auto& message) { handle(message, &pipeline); });
  is_end = true;
  pipeline.guard("results", [&] { pipeline.publish_results(); });
  run.finish(pipeline);
  std::cout << save_checkpoint_if_wanted(line, &pipeline);
  if (line.has("map-csv")) write_file(line.text("map-csv"), table_of(last_map));
  if (line.has("save-map")) {
    std::cout << pipeline.save_map(line.text("save-map")) << "\n";
  }
  const FastSlamStatus& status = pipeline.filter().status();
  if (pipeline.not_believed() > 0) {
    std::cout << pipeline.not_believed()
              << " observations were rejected: they did not fit the map\n";
  }
  if (errors.updates > 0) std::cout << errors.text() << "\n";
  if (!not_judged.empty()) std::cout << "no errors of the particles: " << not_judged << "\n";
  run.report(pipeline.rejects(), std::to_string(status.updates) + " updates, " +
                                     std::to_string(status.renewals) + " renewals, " +
                                     std::to_string(status.particles) + " particles, " +
                                     std::to_string(pipeline.landmarks()) + " landmarks (" +
                                     to_string(pipeline.filter().association()) + "), " +
                                     strategy_of(options.filter.strategy));
  return 0;
}

void print_fastslam_parameters(const CommandLine& line) {
  FastSlamPipelineOptions options = read_fastslam_options(line);
  print_parameters(line, parameters_of(&options), FastSlamPipeline::live_parameters(&options));
}

}  // namespace pf_resampling
