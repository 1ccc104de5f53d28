#include "beacon_mcl_node/beacon_checks.hpp"
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/runs/dry_run.hpp"
#include "tools/runs/filter_over_bag.hpp"

namespace pf_resampling {
namespace {

BeaconMclPipelineOptions read_beacon_mcl_options(const CommandLine& line) {
  BeaconMclPipelineOptions options;
  apply_filter_options(line, &options);
  apply_run_parameters(line, parameters_of(&options));
  return options;
}

int dry_run_of_beacon_mcl(const CommandLine& line, const BeaconMclPipelineOptions& options) {
  nlohmann::json ranges = nlohmann::json::array();
  BeaconMclSinks sinks;
  sinks.ranges = [&](ros::Time stamp, const std::vector<RangeObservation>& used) {
    for (const auto& each : used) ranges.push_back({stamp.toSec(), each.beacon, each.range});
  };
  return dry_run<BeaconMclPipeline>(line, options, sinks, ranges);
}

}  // namespace

int beacon_mcl_over_bag(const CommandLine& line) {
  BeaconMclPipelineOptions options = read_beacon_mcl_options(line);
  if (line.get<bool>("dry-run")) return dry_run_of_beacon_mcl(line, options);
  FilterOverBag run(line);
  options.deferred = run.is_flight();
  if (!options.beacons.empty()) {
    run.write_beacons(line.topic("beacons"), to_message(options.beacons, options.frames.map));
  }
  BeaconMclSinks sinks;
  run.connect(&sinks);
  if (run.with_status()) {
    sinks.beacon_map = [&](const BeaconMap& map) {
      run.writer().write_latched("/beacon_map", run.now(), map);
    };
  }
  BeaconMclPipeline pipeline(options, sinks);
  run.hand_all_to(&pipeline, options.frames);
  run.finish(&pipeline);
  run.report(pipeline.rejects(), pipeline.filter()->status(), strategy_of(options.filter.strategy));
  return 0;
}

void print_beacon_mcl_parameters(const CommandLine& line) {
  BeaconMclPipelineOptions options = read_beacon_mcl_options(line);
  print_parameters(line, parameters_of(&options), BeaconMclPipeline::live_parameters(&options));
}

}  // namespace pf_resampling
