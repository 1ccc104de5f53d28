// FastSLAM as a node.
#include <pf_resampling/LoadMap.h>
#include <pf_resampling/SaveMap.h>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "src/node/filter_node.hpp"

using namespace pf_resampling;

int main(int argc, char** argv) {
  return run_filter_node<FastSlamPipeline>(
      argc, argv, "fastslam",
      [](ros::NodeHandle* handle, FastSlamPipelineOptions* options, FastSlamSinks* sinks) {
        options->starts_without_map = true;
        const ros::Publisher map = handle->advertise<LandmarkMap>("landmark_map", 1, true);
        sinks->landmark_map = [map](const LandmarkMap& message) { map.publish(message); };
      },
      [](FilterNode<FastSlamPipeline>* node) {
        node->serve("global_localization", [node] { node->pipeline().global_localization(); });
        node->serve<SaveMap>("save_map", [node](const SaveMap::Request& request) {
          return node->pipeline().save_map(node->path_to_write(request.file, kMapFile));
        });
        node->serve<LoadMap>("load_map", [node](const LoadMap::Request& request) {
          std::string done = node->pipeline().load_map(node->path_of(request.file), request.frozen);
          node->publish_parameters();  // map/frozen
          return done;
        });
      });
}
