#pragma once

#include <boost/make_shared.hpp>
#include <cmath>
#include <vector>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {

/// A drive on a circle of 6 m radius among four beacons at 1 m/s, with exact odometry at 10 Hz and
/// exact ranges to one beacon after another at 5 Hz: messages for tests, with the truth.
struct BeaconMclDrive {
  static constexpr double kStart = 100.0;  // s
  static constexpr double kRadius = 6.0;   // m

  static std::vector<Beacon> beacons() {
    std::vector<Beacon> beacons(4);
    const Eigen::Vector2d places[] = {{-10, -9}, {11, -10}, {9, 12}, {-11, 8}};
    for (int i = 0; i < 4; ++i) {
      beacons[static_cast<std::size_t>(i)].id = 10 + i;
      beacons[static_cast<std::size_t>(i)].position.head<2>() = places[i];
    }
    return beacons;
  }

  static Pose2 truth(ros::Time stamp) {
    const double angle = (stamp.toSec() - kStart) / kRadius;
    return {kRadius * std::sin(angle), -kRadius * std::cos(angle), wrap_angle(angle)};
  }

  static BeaconArray beacon_array() {
    BeaconArray array;
    array.header.stamp = ros::Time(kStart);
    array.header.frame_id = "map";
    for (const Beacon& beacon : beacons()) {
      BeaconPosition position;
      position.id = beacon.id;
      position.position.x = beacon.position.x();
      position.position.y = beacon.position.y();
      array.beacons.push_back(position);
    }
    return array;
  }

  /// Odometry has the truth at the start as its origin.
  static nav_msgs::Odometry odometry(ros::Time stamp) {
    nav_msgs::Odometry odometry;
    odometry.header.stamp = stamp;
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = "base_link";
    odometry.pose.pose = to_pose_message(relative(truth(ros::Time(kStart)), truth(stamp)));
    return odometry;
  }

  static BeaconRange range(ros::Time stamp, int beacon) {
    BeaconRange range;
    range.header.stamp = stamp;
    range.header.frame_id = "base_link";
    const Eigen::Vector3d place = beacons()[static_cast<std::size_t>(beacon)].position;
    const Pose2 pose = truth(stamp);
    range.beacon = 10 + beacon;
    range.range = std::hypot(place.x() - pose.x, place.y() - pose.y);
    range.variance = 0.01;
    return range;
  }

  static ros::Time at(double seconds) { return ros::Time(kStart) + ros::Duration(seconds); }

  /// What is observed next after `count` observations.
  static BeaconRange observation_at(ros::Time stamp, int count) { return range(stamp, count % 4); }

  /// All messages of `seconds`, in order of time.
  static std::vector<BeaconMclMessage> messages(double seconds) { return messages(0.0, seconds); }

  /// All messages after `begin` (from the very first, if that is 0) until `end`, s.
  static std::vector<BeaconMclMessage> messages(double begin, double end) {
    std::vector<BeaconMclMessage> all;
    if (begin == 0.0) all.emplace_back(boost::make_shared<BeaconArray>(beacon_array()));
    const int first = begin == 0.0 ? 0 : static_cast<int>(std::lround(10.0 * begin)) + 1;
    const int last = static_cast<int>(std::lround(10.0 * end));
    for (int step = first; step <= last; ++step) {
      const ros::Time stamp = ros::Time(kStart) + ros::Duration(0.1 * step);
      all.emplace_back(boost::make_shared<nav_msgs::Odometry>(odometry(stamp)));
      if (step % 2 == 0) {
        all.emplace_back(
            boost::make_shared<BeaconRange>(range(stamp + ros::Duration(0.04), (step / 2) % 4)));
      }
    }
    return all;
  }

  static BeaconMclPipelineOptions options() {
    BeaconMclPipelineOptions options;
    options.filter.particles = 400;
    return options;
  }
};

}  // namespace pf_resampling
