// Range-beacon localization as a node.
#include <pf_resampling/SaveMap.h>

#include "beacon_mcl_node/beacon_file.hpp"
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "src/node/filter_node.hpp"

using namespace pf_resampling;

int main(int argc, char** argv) {
  return run_filter_node<BeaconMclPipeline>(
      argc, argv, "beacon_mcl",
      [](ros::NodeHandle* handle, BeaconMclPipeline::Options*, BeaconMclSinks* sinks) {
        const ros::Publisher map = handle->advertise<BeaconMap>("beacon_map", 1, true);
        sinks->beacon_map = [map](const BeaconMap& message) { map.publish(message); };
      },
      [](FilterNode<BeaconMclPipeline>* node) {
        node->serve("global_localization", [node] { node->pipeline().global_localization(); });
        node->serve<SaveMap>("save_beacons", [node](const SaveMap::Request& request) {
          return node->pipeline().save_beacons(node->path_to_write(request.file, kBeaconFile));
        });
      });
}
