#pragma once

#include <geometry_msgs/Point.h>
#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/checks/bag_findings.hpp"
#include "tools/checks/stamps.hpp"
#include "tools/checks/units.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {

/// What was gathered of one topic.
struct TopicSurvey {
  std::string topic;
  StampCheck stamps;
  std::set<std::string> frames;
};

/// What is in a bag, before anything is judged.
struct BagSurvey {
  std::vector<BagTopic> topics;
  TopicSurvey odom;
  TopicSurvey ranges;  ///< of sensor_msgs/Range where there are no others
  TopicSurvey landmarks;
  std::set<std::string> base_frames;                  ///< child frames of the odometry
  std::string base = "base_link";                     ///< the one child frame, if there is one
  std::map<std::string, Eigen::Isometry3d> on_robot;  ///< /tf_static, from `base`
  std::set<std::pair<std::string, std::string>> transforms;  ///< parent and child, of /tf
  std::string beacon_frame;
  std::map<std::int32_t, geometry_msgs::Point> beacons;
  std::map<std::int32_t, std::vector<double>> ranges_by_beacon;  ///< positive ones, m
  std::vector<TimedRange> timed_ranges;                          ///< the same as they came
  TurnComparison turns;                                          ///< of the odometry

  /// The topic of that name; null if the bag has none.
  const BagTopic* topic_named(const std::string& name) const;
};

/// Reads a bag through. Throws Error if it is damaged.
BagSurvey survey_bag(const rosbag::Bag& bag, const CheckedTopics& names,
                     const CheckedConfiguration& configuration);

}  // namespace pf_resampling
