#include <algorithm>
#include <cmath>
#include <iostream>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/runs/dry_run.hpp"
#include "tools/runs/filter_over_bag.hpp"

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

/// As a list of landmarks, which can be loaded again.
std::string table_of(const LandmarkMap& map) {
  std::string table = "id,x,y,sigma\n";
  for (const Landmark& landmark : map.landmarks) {
    const double variance = 0.5 * (landmark.covariance[0] + landmark.covariance[3]);
    table += std::to_string(landmark.id) + "," + std::to_string(landmark.position.x) + "," +
             std::to_string(landmark.position.y) + "," +
             std::to_string(std::sqrt(std::max(0.0, variance))) + "\n";
  }
  return table;
}

int dry_run_of_fastslam(const CommandLine& line, const FastSlamPipelineOptions& options) {
  nlohmann::json ids = nlohmann::json::array();
  FastSlamSinks sinks;
  sinks.scan = [&](const LandmarkScan& scan) {
    for (const RangeBearingObservation& seen : scan.observations) ids.push_back(seen.id);
  };
  return dry_run<FastSlamPipeline>(line, options, sinks, ids);
}

}  // namespace

int fastslam_over_bag(const CommandLine& line) {
  FastSlamPipelineOptions options = read_fastslam_options(line);
  if (line.get<bool>("dry-run")) return dry_run_of_fastslam(line, options);
  FilterOverBag run(line);
  options.deferred = run.is_flight();
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
  FastSlamPipeline pipeline(options, sinks);
  run.hand_all_to(&pipeline, options.frames);
  is_end = true;
  pipeline.guard("results", [&] { pipeline.publish_results(); });
  run.finish(&pipeline);
  if (line.has("map-csv")) write_file(line.text("map-csv"), table_of(last_map));
  if (line.has("save-map")) {
    std::cout << pipeline.save_map(line.text("save-map")) << "\n";
  }
  if (pipeline.not_believed() > 0) {
    std::cout << pipeline.not_believed()
              << " observations were rejected: they did not fit the map\n";
  }
  run.report(pipeline.rejects(), pipeline.filter().status(),
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
