#include "tools/checks/dry_run.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

constexpr int kParticles = 100;

/// `inputs_of` a pipeline are what it takes of the bag.
template <typename Pipeline, typename Options, typename InputsOf>
DryRun run(const rosbag::Bag& bag, Options options, typename Pipeline::Sinks sinks,
           const InputsOf& inputs_of) {
  options.filter.particles = std::min(options.filter.particles, kParticles);
  options.filter.strategy.renewal = Renewal::resampling;
  DryRun said;
  sinks.log = [&](LogLevel level, const std::string& text) {
    // What was rejected is counted; that a few particles get lost says nothing of the bag.
    const bool is_known =
        text.find(": rejected, ") != std::string::npos || text.rfind("lost", 0) == 0;
    if (level == LogLevel::warning && !is_known) said.remarks.push_back(text);
  };
  std::optional<Pipeline> pipeline;
  try {
    pipeline.emplace(options, sinks);
  } catch (const Error& error) {
    return {0, error.what(), {}, {}};
  }
  const auto inputs = inputs_of(*pipeline);
  for_each_in_order(bag, bag.getFileName(), names_of(inputs),
                    [&](const rosbag::MessageInstance& instance) {
                      if (const auto message = to_message(instance, inputs)) {
                        handle(*message, &*pipeline);
                      }
                    });
  said.used = pipeline->used();
  said.why_none = pipeline->why_none_used();
  for (const std::string& line : lines_of(pipeline->rejects())) said.remarks.push_back(line);
  return said;
}

void note(const LandmarkScan& scan, LandmarkSurvey* all) {
  all->observations += scan.observations.size();
  for (const RangeBearingObservation& seen : scan.observations) {
    if (seen.id >= 0) ++all->by_id[seen.id];
  }
}

}  // namespace

DryRun dry_run(const rosbag::Bag& bag, const BeaconMclTopics& topics,
               const BeaconMclPipelineOptions& options) {
  return run<BeaconMclPipeline>(bag, options, {}, [&](const auto& pipeline) {
    return topics.inputs(options.frames.base, pipeline.antenna());
  });
}

DryRun dry_run(const rosbag::Bag& bag, const FastSlamTopics& topics,
               const FastSlamPipelineOptions& options) {
  LandmarkSurvey seen;
  FastSlamSinks sinks;
  sinks.scan = [&](const LandmarkScan& scan) { note(scan, &seen); };
  DryRun said = run<FastSlamPipeline>(bag, options, sinks, [&](const auto& /*pipeline*/) {
    return topics.inputs(options.frames.base);
  });
  said.seen = std::move(seen);
  return said;
}

}  // namespace pf_resampling
