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
#include "tools/common/bag.hpp"

namespace pf_resampling {

/// What was gathered of one topic.
struct TopicSurvey {
  std::string topic;
  StampCheck stamps;
  std::set<std::string> frames;
  std::size_t not_finite = 0;
  std::size_t impossible = 0;  ///< quaternions not of length 1, ranges <= 0, variances < 0
};

/// What was gathered of the landmark observations that can be used.
struct LandmarkSurvey {
  std::size_t scans = 0;                      ///< messages; also those without an observation
  std::map<std::int32_t, std::size_t> by_id;  ///< how often each id was seen
  std::vector<double> ranges;                 ///< m, of all
  double least_bearing = 0.0;                 ///< rad
  double largest_bearing = 0.0;               ///< rad

  std::size_t with_id() const;
  /// How many ids were seen in no more than one observation.
  std::size_t seen_once() const;
};

/// What is in a bag, before anything is judged.
struct BagSurvey {
  std::vector<BagTopic> topics;
  TopicSurvey odom;
  TopicSurvey ranges;  ///< of sensor_msgs/Range where there are no others
  TopicSurvey landmarks;
  TopicSurvey truth;
  std::set<std::string> base_frames;                  ///< child frames of the odometry
  std::string base = "base_link";                     ///< the one child frame, if there is one
  std::map<std::string, Eigen::Isometry3d> on_robot;  ///< /tf_static, from `base`
  std::set<std::pair<std::string, std::string>> transforms;  ///< parent and child, of /tf
  std::set<std::string> below_robot;                         ///< frames that those place on it
  std::string beacon_frame;
  std::map<std::int32_t, geometry_msgs::Point> beacons;
  std::vector<std::int32_t> beacons_twice;
  std::set<std::string> unnamed;  ///< frames of sensor_msgs/Range that are no beacon's by default
  std::map<std::int32_t, std::vector<double>> ranges_by_beacon;  ///< those that can be used, m
  LandmarkSurvey seen;
  bool with_tags = false;  ///< landmarks are tags on /tf, as the configuration says
  std::string tag_fault;   ///< why the latest of them that cannot be used cannot; empty: all can

  /// The topic of that name; null if the bag has none.
  const BagTopic* topic_named(const std::string& name) const;
  /// Whether /tf_static, or else /tf, says where a frame is on the robot.
  bool places_on_robot(const std::string& frame) const;
};

/// Reads a bag through. Throws Error if it is damaged.
BagSurvey survey_bag(const rosbag::Bag& bag, const CheckedTopics& names,
                     const CheckedConfiguration& configuration);

}  // namespace pf_resampling
