// Range-beacon localization as a node.
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "src/node/filter_node.hpp"

int main(int argc, char** argv) {
  using pf_resampling::BeaconMclPipeline;
  return pf_resampling::run_filter_node<BeaconMclPipeline>(
      argc, argv, "beacon_mcl",
      [](ros::NodeHandle*, BeaconMclPipeline::Options*, BeaconMclPipeline::Sinks*) {},
      [](auto* node) {
        node->serve("global_localization", [node] { node->pipeline().global_localization(); });
      });
}
