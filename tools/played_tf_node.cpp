// Hands on the transforms of a bag that is played, but for map -> odom: of that there may be one
// publisher, the filter beside which the bag is played. Private parameter: filter, the name of its
// node, whose frames these are.
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <string>

#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"
#include "src/node/node_support.hpp"

using namespace pf_resampling;

int main(int argc, char** argv) {
  ros::init(argc, argv, "played_tf");
  ros::NodeHandle node;
  const std::string filter = ros::NodeHandle("~").param<std::string>("filter", "fastslam");
  const FrameNames usual;
  const std::string map = without_slash(node.param(filter + "/frames/map", usual.map));
  const std::string odom = without_slash(node.param(filter + "/frames/odom", usual.odom));
  const ros::Publisher publisher = node.advertise<tf2_msgs::TFMessage>("/tf", kNodeInputQueue);
  const ros::Subscriber subscriber = node.subscribe<tf2_msgs::TFMessage>(
      "played/tf", kNodeInputQueue,
      [&](const tf2_msgs::TFMessage::ConstPtr& played) {
        tf2_msgs::TFMessage message = *played;
        auto& transforms = message.transforms;
        transforms.erase(std::remove_if(transforms.begin(), transforms.end(),
                                        [&](const geometry_msgs::TransformStamped& transform) {
                                          return without_slash(transform.header.frame_id) == map &&
                                                 without_slash(transform.child_frame_id) == odom;
                                        }),
                         transforms.end());
        if (!transforms.empty()) publisher.publish(message);
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  ros::spin();
  return 0;
}
