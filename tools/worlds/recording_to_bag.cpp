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
#include <limits>

#include "src/messages/conversions.hpp"

namespace pf_resampling {

namespace {

// s, by which beacons and frames precede all else: readers of bags see equal times in any order,
// and a range whose antenna is not yet known is lost.
constexpr double kHeadStart = 1e-3;

template <typename Message>
Message stamped(ros::Time stamp, const std::string& frame) {
  Message message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  return message;
}

/// Makes the messages of one recording, each with its time shifted as a whole.
class Writer {
 public:
  Writer(const Recording& recording, BagWriter* bag) : recording_(recording), bag_(bag) {
    const double earliest = std::min({time_of(recording.truth, 0), time_of(recording.odometry, 0),
                                      time_of(recording.ranges, 0), time_of(recording.scans, 0)});
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
      const double scan_time = time_of(recording_.scans, scan);
      const double next = std::min({truth_time, odometry_time, range_time, scan_time});
      if (std::isinf(next)) break;
      if (truth_time <= next) {
        write_truth(truth++);
      } else if (odometry_time <= next) {
        write_odometry(odometry++);
      } else if (range_time <= next) {
        write_range(range++);
      } else {
        write_scan(scan++);
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
    for (const auto& [name, place] : recording_.frames) {
      auto transform = stamped<geometry_msgs::TransformStamped>(start_, "base_link");
      transform.child_frame_id = name;
      transform.transform.translation.x = place.translation().x();
      transform.transform.translation.y = place.translation().y();
      transform.transform.translation.z = place.translation().z();
      transform.transform.rotation = to_quaternion_message(to_pose2(place).heading);
      transforms.transforms.push_back(transform);
    }
    if (!transforms.transforms.empty()) bag_->write_latched("/tf_static", start_, transforms);

    if (!recording_.beacons.empty()) {
      auto beacons = stamped<BeaconArray>(start_, "map");
      for (const Beacon& beacon : recording_.beacons) {
        BeaconPosition position;
        position.id = beacon.id;
        position.position.x = beacon.position.x();
        position.position.y = beacon.position.y();
        position.position.z = beacon.position.z();
        beacons.beacons.push_back(position);
      }
      bag_->write_latched("/beacons", start_, beacons);
    }

    if (!recording_.landmarks.empty()) {
      auto map = stamped<LandmarkMap>(start_, "map");
      for (const auto& landmark : recording_.landmarks) {
        Landmark message;
        message.id = landmark.id;
        message.position.x = landmark.position.x();
        message.position.y = landmark.position.y();
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
        if (recording_.odometry_noise) {
          // Of the mean over the step.
          const StatedOdometryNoise& noise = *recording_.odometry_noise;
          message.twist.covariance[0] = noise.along * noise.along / duration;
          message.twist.covariance[7] = noise.across * noise.across / duration;
          message.twist.covariance[35] = noise.heading * noise.heading / duration;
        }
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
    bag_->write("/ranges", message.header.stamp, message);
  }

  void write_scan(std::size_t index) {
    const StampedScan& scan = recording_.scans[index];
    auto message = stamped<LandmarkObservationArray>(stamp_of(scan.time), scan.frame);
    for (const SeenLandmark& seen : scan.landmarks) {
      LandmarkObservation observation;
      observation.id = seen.id;
      observation.range = seen.range;
      observation.bearing = seen.bearing;
      observation.range_variance = seen.range_variance;
      observation.bearing_variance = seen.bearing_variance;
      message.observations.push_back(observation);
    }
    bag_->write("/landmarks", message.header.stamp, message);
  }

  const Recording& recording_;
  BagWriter* bag_;
  double shift_ = 0.0;
  ros::Time start_;
};

}  // namespace

void write_recording(const Recording& recording, const std::string& path) {
  BagWriter bag(path);
  Writer(recording, &bag).write();
  bag.finish();
}

}  // namespace pf_resampling
