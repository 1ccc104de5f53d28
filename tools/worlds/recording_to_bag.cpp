#include "tools/worlds/recording_to_bag.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <set>

#include "src/messages/conversions.hpp"

namespace pf_resampling {

namespace {

// s, by which beacons and frames precede all else: readers of bags see equal times in any order,
// and a range whose antenna is not yet known is lost.
constexpr double kHeadStart = 1e-3;

/// The recording's frames; those that its observations name and it does not place, at base_link.
std::vector<Recording::Frame> frames_of(const Recording& recording) {
  std::vector<Recording::Frame> frames = recording.frames;
  std::set<std::string> used;
  for (const auto& range : recording.ranges) used.insert(range.frame);
  if (!recording.landmark_observations.empty()) used.insert("sensor");
  for (const std::string& name : used) {
    const bool known = std::any_of(frames.begin(), frames.end(),
                                   [&](const auto& frame) { return frame.name == name; });
    if (!known) frames.push_back({name, 0.0, 0.0, 0.0, 0.0});
  }
  return frames;
}

template <typename Message>
Message stamped(ros::Time stamp, const std::string& frame) {
  Message message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  return message;
}

/// The height of beacons that have none of their own.
double height_of_antenna(const Recording& recording) {
  for (const auto& frame : recording.frames) {
    if (frame.name.compare(0, 7, "antenna") == 0) return frame.z;
  }
  return 0.0;
}

/// Makes the messages of one recording, each with its time shifted as a whole.
class Writer {
 public:
  Writer(const Recording& recording, BagWriter* bag) : recording_(recording), bag_(bag) {
    const double earliest =
        std::min({time_of(recording.truth, 0), time_of(recording.odometry, 0),
                  time_of(recording.ranges, 0), time_of(recording.landmark_observations, 0)});
    // A stamp of zero means none.
    if (earliest < 10.0 * kHeadStart) shift_ = 1.0 - std::floor(earliest);
    start_ = stamp_of(earliest - kHeadStart);
  }

  void write() {
    write_static();
    // Merged by time; at equal times truth, then odometry. (Readers of bags see equal times in any
    // order.)
    std::size_t truth = 0;
    std::size_t odometry = 0;
    std::size_t range = 0;
    std::size_t scan = 0;
    while (true) {
      const double truth_time = time_of(recording_.truth, truth);
      const double odometry_time = time_of(recording_.odometry, odometry);
      const double range_time = time_of(recording_.ranges, range);
      const double scan_time = time_of(recording_.landmark_observations, scan);
      const double next = std::min({truth_time, odometry_time, range_time, scan_time});
      if (std::isinf(next)) break;
      if (truth_time <= next) {
        write_truth(truth++);
      } else if (odometry_time <= next) {
        write_odometry(odometry++);
      } else if (range_time <= next) {
        write_range(range++);
      } else {
        scan = write_scan(scan);
      }
    }
  }

 private:
  template <typename Stamped>
  static double time_of(const std::vector<Stamped>& list, std::size_t index) {
    return index < list.size() ? list[index].time : std::numeric_limits<double>::infinity();
  }

  ros::Time stamp_of(double time) const { return ros::Time(time + shift_); }

  void write_static() {
    tf2_msgs::TFMessage transforms;
    for (const auto& frame : frames_of(recording_)) {
      auto transform = stamped<geometry_msgs::TransformStamped>(start_, "base_link");
      transform.child_frame_id = frame.name;
      transform.transform.translation.x = frame.x;
      transform.transform.translation.y = frame.y;
      transform.transform.translation.z = frame.z;
      transform.transform.rotation = to_quaternion_message(frame.yaw);
      transforms.transforms.push_back(transform);
    }
    if (!transforms.transforms.empty()) bag_->write_latched("/tf_static", start_, transforms);

    if (!recording_.beacons.empty()) {
      auto beacons = stamped<BeaconArray>(start_, "map");
      for (const auto& beacon : recording_.beacons) {
        BeaconPosition position;
        position.id = beacon.id;
        position.position.x = beacon.x;
        position.position.y = beacon.y;
        position.position.z = beacon.z.value_or(height_of_antenna(recording_));
        beacons.beacons.push_back(position);
      }
      bag_->write_latched("/beacons", start_, beacons);
    }

    if (!recording_.landmarks.empty()) {
      auto map = stamped<LandmarkMap>(start_, "map");
      for (const auto& landmark : recording_.landmarks) {
        Landmark message;
        message.id = landmark.id;
        message.position.x = landmark.x;
        message.position.y = landmark.y;
        map.landmarks.push_back(message);
      }
      bag_->write_latched("/ground_truth_landmarks", start_, map);
    }
  }

  void write_truth(std::size_t index) {
    const auto& truth = recording_.truth[index];
    const ros::Time stamp = stamp_of(truth.time);
    auto pose = stamped<geometry_msgs::PoseStamped>(stamp, "map");
    pose.pose = to_pose_message(truth.pose);
    bag_->write("/ground_truth", stamp, pose);
  }

  void write_odometry(std::size_t index) {
    const auto& now = recording_.odometry[index];
    auto message = stamped<nav_msgs::Odometry>(stamp_of(now.time), "odom");
    message.child_frame_id = "base_link";
    message.pose.pose = to_pose_message(now.pose);
    if (index > 0) {
      const auto& before = recording_.odometry[index - 1];
      const double duration = now.time - before.time;
      if (duration > 0.0) {
        const Pose2 motion = relative(before.pose, now.pose);
        message.twist.twist.linear.x = motion.x / duration;
        message.twist.twist.linear.y = motion.y / duration;
        message.twist.twist.angular.z = motion.heading / duration;
        message.twist.covariance[0] = now.twist_variances[0];
        message.twist.covariance[7] = now.twist_variances[1];
        message.twist.covariance[35] = now.twist_variances[2];
      }
    }
    bag_->write("/odom", message.header.stamp, message);

    geometry_msgs::TransformStamped transform;
    transform.header = message.header;
    transform.child_frame_id = message.child_frame_id;
    transform.transform.translation.x = now.pose.x;
    transform.transform.translation.y = now.pose.y;
    transform.transform.rotation = message.pose.pose.orientation;
    tf2_msgs::TFMessage transforms;
    transforms.transforms.push_back(transform);
    bag_->write("/tf", message.header.stamp, transforms);
  }

  void write_range(std::size_t index) {
    const auto& range = recording_.ranges[index];
    auto message = stamped<BeaconRange>(stamp_of(range.time), range.frame);
    message.beacon = range.beacon;
    message.range = range.range;
    message.variance = range.variance;
    bag_->write("/ranges", message.header.stamp, message);
  }

  /// Writes the scan that begins at `first`; returns where the next one begins.
  std::size_t write_scan(std::size_t first) {
    const auto& all = recording_.landmark_observations;
    auto scan = stamped<LandmarkObservationArray>(stamp_of(all[first].time), "sensor");
    std::size_t next = first;
    for (; next < all.size() && all[next].time <= all[first].time; ++next) {
      LandmarkObservation message;
      message.id = all[next].id;
      message.range = all[next].range;
      message.bearing = all[next].bearing;
      message.range_variance = all[next].range_variance;
      message.bearing_variance = all[next].bearing_variance;
      scan.observations.push_back(message);
    }
    bag_->write("/landmarks", scan.header.stamp, scan);
    return next;
  }

  const Recording& recording_;
  BagWriter* bag_;
  double shift_ = 0.0;
  ros::Time start_;
};

}  // namespace

void write_recording(const Recording& recording, BagWriter* bag) {
  Writer(recording, bag).write();
}

void write_recording(const Recording& recording, const std::string& path) {
  BagWriter bag(path);
  write_recording(recording, &bag);
  bag.finish();
}

void write_and_report(const Recording& recording, const std::string& name,
                      const std::string& path) {
  write_recording(recording, path);
  std::cout << name << "\n" << report(recording) << "wrote " << path << "\n";
}

}  // namespace pf_resampling
