#pragma once

#include <boost/make_shared.hpp>
#include <cmath>
#include <vector>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {

/// A drive on a circle of 6 m radius at 1 m/s from the origin of the map, among landmarks inside
/// and outside of it, with exact odometry at 10 Hz and exact scans at 5 Hz, each `kLate` after a
/// message of odometry: messages for tests, with the truth.
struct FastSlamDrive {
  static constexpr double kStart = 100.0;  // s
  static constexpr double kRadius = 6.0;   // m
  static constexpr double kReach = 7.0;    // m that the sensor sees
  static constexpr double kLate = 0.04;    // s

  /// Id: place in the list.
  static std::vector<Eigen::Vector2d> landmarks() {
    std::vector<Eigen::Vector2d> places;
    for (int k = 0; k < 12; ++k) {
      const double angle = 2.0 * kPi * k / 12.0;
      const double radius = k % 2 == 0 ? 9.0 : 3.0;
      places.emplace_back(radius * std::sin(angle), kRadius - radius * std::cos(angle));
    }
    return places;
  }

  static Pose2 truth(ros::Time stamp) {
    const double angle = (stamp.toSec() - kStart) / kRadius;
    return {kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), wrap_angle(angle)};
  }

  static nav_msgs::Odometry odometry(ros::Time stamp) {
    nav_msgs::Odometry odometry;
    odometry.header.stamp = stamp;
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = "base_link";
    odometry.pose.pose = to_pose_message(truth(stamp));
    return odometry;
  }

  /// A landmark as a sensor at `sensor` on the robot sees it.
  static LandmarkObservation observation(ros::Time stamp, int id, const Pose2& sensor = {}) {
    const Pose2 eye = compose(truth(stamp), sensor);
    const Eigen::Vector2d offset =
        landmarks()[static_cast<std::size_t>(id)] - Eigen::Vector2d(eye.x, eye.y);
    LandmarkObservation seen;
    seen.id = id;
    seen.range = offset.norm();
    seen.bearing = wrap_angle(std::atan2(offset.y(), offset.x()) - eye.heading);
    return seen;
  }

  /// All within reach.
  static LandmarkObservationArray scan(ros::Time stamp, const Pose2& sensor = {}) {
    LandmarkObservationArray scan;
    scan.header.stamp = stamp;
    scan.header.frame_id = "base_link";
    for (std::size_t id = 0; id < landmarks().size(); ++id) {
      const LandmarkObservation seen = observation(stamp, static_cast<int>(id), sensor);
      if (seen.range < kReach) scan.observations.push_back(seen);
    }
    return scan;
  }

  /// What is observed next after any number of observations.
  static LandmarkObservationArray observation_at(ros::Time stamp, int /*count*/) {
    return scan(stamp);
  }

  static ros::Time at(double seconds) { return ros::Time(kStart) + ros::Duration(seconds); }

  /// All messages from `from` to `until` (s since the start, odometry at both), in the order in
  /// which they come.
  static std::vector<FastSlamMessage> messages(double from, double until, double late = kLate) {
    std::vector<FastSlamMessage> all;
    const int last = static_cast<int>(std::lround(10.0 * until));
    for (int step = static_cast<int>(std::lround(10.0 * from)); step <= last; ++step) {
      const ros::Time stamp = at(0.1 * step);
      all.emplace_back(boost::make_shared<nav_msgs::Odometry>(odometry(stamp)));
      if (step % 2 == 0) {
        all.emplace_back(
            boost::make_shared<LandmarkObservationArray>(scan(stamp + ros::Duration(late))));
      }
    }
    return all;
  }
  static std::vector<FastSlamMessage> messages(double seconds) { return messages(0.0, seconds); }

  /// Noise of its own, so that nothing here depends on the defaults.
  static FastSlamPipelineOptions options() {
    FastSlamPipelineOptions options("fast");
    options.filter.particles = 60;
    options.filter.odometry = OdometryNoise{0.03, 0.03, 0.01, 0.03, 0.002, 0.0, 0.004};
    options.filter.sensor.range_sigma = 0.1;
    options.filter.sensor.bearing_sigma = 0.02;
    return options;
  }
};

}  // namespace pf_resampling
