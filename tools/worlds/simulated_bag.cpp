#include "tools/worlds/simulated_bag.hpp"

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

#include "pf_resampling_core/simulation/simulate.hpp"
#include "src/messages/conversions.hpp"
#include "tools/common/bag_writer.hpp"

namespace pf_resampling {
namespace {

// s, by which beacons and frames precede all else: readers of bags see equal times in any order,
// and a range whose antenna is not yet known is lost.
constexpr double kHeadStart = 1e-3;

ros::Time stamp_of(double time) {
  return ros::Time(1.0 + time);
}

template <typename Message>
Message stamped(ros::Time stamp, const std::string& frame) {
  Message message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  return message;
}

class Writer {
 public:
  Writer(const World& world, const SimulatedDrive& drive, bool with_ids, BagWriter* bag)
      : world_(world), drive_(drive), with_ids_(with_ids), bag_(bag) {}

  // At equal times truth, then odometry, ranges, scans.
  void write() {
    write_frames();
    write_maps();
    for (std::size_t i = 0; i < drive_.odometry.size(); ++i) {
      write_observations(drive_.odometry[i].time);
      write_odometry(i);
    }
    write_observations(std::numeric_limits<double>::infinity());
  }

 private:
  geometry_msgs::TransformStamped transform(ros::Time stamp, const std::string& parent,
                                            const std::string& child) const {
    auto transform = stamped<geometry_msgs::TransformStamped>(stamp, parent);
    transform.child_frame_id = child;
    transform.transform.rotation.w = 1.0;
    return transform;
  }

  void write_frames() {
    tf2_msgs::TFMessage transforms;
    if (world_.ranges.rate > 0.0) {
      transforms.transforms.push_back(transform(start_, "base_link", "antenna"));
      auto& place = transforms.transforms.back().transform.translation;
      place.x = world_.ranges.antenna.x();
      place.y = world_.ranges.antenna.y();
      place.z = world_.ranges.antenna.z();
    }
    if (world_.landmark_sensor.period > 0.0) {
      transforms.transforms.push_back(transform(start_, "base_link", "sensor"));
    }
    if (!transforms.transforms.empty()) bag_->write_latched("/tf_static", start_, transforms);
  }

  void write_maps() {
    auto beacons = stamped<BeaconArray>(start_, "map");
    for (const SimulatedBeacon& each : world_.beacons) {
      BeaconPosition beacon;
      beacon.id = each.beacon.id;
      beacon.position.x = each.beacon.position.x();
      beacon.position.y = each.beacon.position.y();
      beacon.position.z = each.beacon.position.z();
      beacons.beacons.push_back(beacon);
    }
    if (!beacons.beacons.empty()) bag_->write_latched("/beacons", start_, beacons);
    auto map = stamped<LandmarkMap>(start_, "map");
    for (const Eigen::Vector2d& place : world_.landmarks) {
      Landmark landmark;
      landmark.id = static_cast<std::int32_t>(map.landmarks.size());
      landmark.position.x = place.x();
      landmark.position.y = place.y();
      map.landmarks.push_back(landmark);
    }
    if (!map.landmarks.empty()) bag_->write_latched("/ground_truth_landmarks", start_, map);
  }

  // Those before `end`.
  void write_observations(double end) {
    while (true) {
      const double range = range_ < drive_.ranges.size() ? drive_.ranges[range_].time : end;
      const double scan = scan_ < drive_.scans.size() ? drive_.scans[scan_].time : end;
      if (!(std::min(range, scan) < end)) return;
      range <= scan ? write_range(drive_.ranges[range_++]) : write_scan(drive_.scans[scan_++]);
    }
  }

  void write_odometry(std::size_t index) {
    const SimulatedDrive::Odometry& now = drive_.odometry[index];
    const ros::Time stamp = stamp_of(now.time);
    auto truth = stamped<geometry_msgs::PoseStamped>(stamp, "map");
    truth.pose = to_pose_message(now.truth);
    bag_->write("/ground_truth", stamp, truth);

    auto message = stamped<nav_msgs::Odometry>(stamp, "odom");
    message.child_frame_id = "base_link";
    message.pose.pose = to_pose_message(now.pose);
    if (index > 0) {
      const SimulatedDrive::Odometry& before = drive_.odometry[index - 1];
      const double duration = now.time - before.time;
      const Pose2 motion = relative(before.pose, now.pose);
      message.twist.twist.linear.x = motion.x / duration;
      message.twist.twist.linear.y = motion.y / duration;
      message.twist.twist.angular.z = motion.heading / duration;
      // Of the mean over the step, of noise that is white for each control.
      const double root = std::sqrt(world_.drive.control_period);
      const auto variance = [&](double sigma) { return root * sigma * (root * sigma) / duration; };
      message.twist.covariance[0] = variance(world_.odometry.speed_sigma);
      message.twist.covariance[7] = variance(world_.odometry.lateral_sigma);
      message.twist.covariance[35] = variance(world_.odometry.yaw_rate_sigma);
    }
    bag_->write("/odom", stamp, message);

    tf2_msgs::TFMessage transforms;
    transforms.transforms.push_back(transform(stamp, "odom", "base_link"));
    transforms.transforms[0].transform.translation.x = now.pose.x;
    transforms.transforms[0].transform.translation.y = now.pose.y;
    transforms.transforms[0].transform.rotation = message.pose.pose.orientation;
    bag_->write("/tf", stamp, transforms);
  }

  void write_range(const SimulatedDrive::Range& range) {
    auto message = stamped<BeaconRange>(stamp_of(range.time), "antenna");
    message.beacon = range.beacon;
    message.range = range.range;
    bag_->write("/ranges", message.header.stamp, message);
  }

  void write_scan(const SimulatedDrive::Scan& scan) {
    const SimulatedLandmarkSensor& sensor = world_.landmark_sensor;
    auto message = stamped<LandmarkObservationArray>(stamp_of(scan.time), "sensor");
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      LandmarkObservation observation;
      observation.id = with_ids_ ? seen.id : -1;
      observation.range = seen.range;
      observation.bearing = seen.bearing;
      observation.range_variance = sensor.range_sigma * sensor.range_sigma;
      observation.bearing_variance = sensor.bearing_sigma * sensor.bearing_sigma;
      message.observations.push_back(observation);
    }
    bag_->write("/landmarks", message.header.stamp, message);
  }

  const World& world_;
  const SimulatedDrive& drive_;
  const bool with_ids_;
  BagWriter* const bag_;
  const ros::Time start_ = stamp_of(-kHeadStart);
  std::size_t range_ = 0, scan_ = 0;  // the next
};

}  // namespace

void write_simulated_bag(const World& world, std::uint64_t seed, bool with_ids,
                         const std::string& path) {
  const SimulatedDrive drive = simulate(world, seed);
  BagWriter bag(path);
  Writer(world, drive, with_ids, &bag).write();
  bag.finish();
}

}  // namespace pf_resampling
