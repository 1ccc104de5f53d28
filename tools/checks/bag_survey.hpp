#pragma once

#include <geometry_msgs/Point.h>
#include <ros/time.h>
#include <rosbag/bag.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/checks/bag_findings.hpp"
#include "tools/checks/units.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {

/// What was gathered of one topic, of the messages whose stamps filters do not reject as none.
struct TopicSurvey {
  std::string topic;
  std::set<std::string> frames;
  double newest = 0.0;          ///< s, the latest stamp; 0: none yet
  double longest_gap = 0.0;     ///< s, between the latest stamp and the next
  double longest_gap_at = 0.0;  ///< s, when it begins
  double largest_delay = 0.0;   ///< s, largest |bag time - stamp|

  void add(const ros::Time& stamp, const ros::Time& bag_time);
};

/// What is in a bag, before anything is judged.
struct BagSurvey {
  std::vector<BagTopic> topics;
  TopicSurvey odom;
  TopicSurvey ranges;  ///< of sensor_msgs/Range where there are no others
  TopicSurvey landmarks;
  std::set<std::string> base_frames;                         ///< child frames of the odometry
  std::set<std::pair<std::string, std::string>> transforms;  ///< parent and child, of /tf
  std::string beacon_frame;
  std::map<std::int32_t, geometry_msgs::Point> beacons;
  std::vector<TimedRange> timed_ranges;  ///< positive ones, as they came
  TurnComparison turns;                  ///< of the odometry

  /// The topic of that name; null if the bag has none.
  const BagTopic* topic_named(const std::string& name) const;
};

/// Reads a bag through. Throws Error if it is damaged.
BagSurvey survey_bag(const rosbag::Bag& bag, const CheckedTopics& names,
                     const CheckedConfiguration& configuration);

}  // namespace pf_resampling
