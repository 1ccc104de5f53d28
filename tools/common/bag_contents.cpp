#include "tools/common/bag_contents.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/LandmarkMap.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <set>
#include <variant>

#include "beacon_mcl_node/beacon_checks.hpp"
#include "beacon_mcl_node/range_sensor.hpp"
#include "fastslam_node/tag_scans.hpp"
#include "pf_resampling_core/error.hpp"
#include "src/frames/static_frames.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/filter_topics.hpp"

namespace pf_resampling {
namespace {

template <typename Message>
double stamp_of(const rosbag::MessageInstance& instance, const Message& message) {
  return message.header.stamp.isZero() ? instance.getTime().toSec() : message.header.stamp.toSec();
}

StampedPose stamped_pose(double time, const geometry_msgs::Pose& pose) {
  return {time, to_pose2(pose)};
}

template <typename Stamped>
void sort_by_time(std::vector<Stamped>* list) {
  std::stable_sort(list->begin(), list->end(),
                   [](const Stamped& a, const Stamped& b) { return a.time < b.time; });
}

/// Calls handle(instance) for every message of a topic; a damaged chunk is an Error.
template <typename Handle>
void for_each_message(const rosbag::Bag& bag, const std::string& topic, const Handle& handle) {
  try {
    for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
      handle(instance);
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // damaged, or no memory for what it holds
    throw Error(bag.getFileName() + ": cannot read " + topic + ": " + error.what());
  }
}

/// The last message of a type on a topic; null if there is none.
template <typename Message>
typename Message::ConstPtr last_message(const rosbag::Bag& bag, const std::string& topic) {
  typename Message::ConstPtr last;
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    if (const auto message = message_in<Message>(instance)) last = message;
  });
  return last;
}

/// What errors begin with.
std::string place_of(const rosbag::Bag& bag, const std::string& topic) {
  return bag.getFileName() + ": " + topic;
}

/// The frames of /tf_static, and the names of those that are placed.
StaticFrames static_frames(const rosbag::Bag& bag, std::set<std::string>* names) {
  StaticFrames frames;
  for_each_message(bag, "/tf_static", [&](const rosbag::MessageInstance& instance) {
    const auto message = message_in<tf2_msgs::TFMessage>(instance);
    if (!message) return;
    for (const auto& transform : message->transforms) {
      if (frames.add(transform)) names->insert(without_slash(transform.child_frame_id));
    }
  });
  return frames;
}

StampedScan stamped_scan(double time, const LandmarkObservationArray& message) {
  StampedScan scan = {time, without_slash(message.header.frame_id), {}};
  for (const auto& seen : message.observations) {
    scan.landmarks.push_back(
        {seen.id, seen.range, seen.bearing, seen.range_variance, seen.bearing_variance});
  }
  return scan;
}

/// Makes scans of detections of tags, as they are seen from the middle of the robot.
class TagReader {
 public:
  explicit TagReader(const rosbag::Bag& bag) {
    std::set<std::string> names;
    on_robot_ = static_frames(bag, &names);
  }

  void take(const tf2_msgs::TFMessage& message, std::vector<StampedScan>* scans) {
    for (const auto& tag : message.transforms) tags_.take(tag, now_, &on_robot_);
    take_complete(now_, scans);
  }

  void finish(std::vector<StampedScan>* scans) { take_complete(ros::Time(2.0), scans); }

 private:
  // As if odometry stood still until the end: an image is complete when the next comes.
  const ros::Time now_{1.0};

  void take_complete(ros::Time now, std::vector<StampedScan>* scans) {
    for (const LandmarkObservationArray& seen : tags_.take_complete(now)) {
      StampedScan scan = stamped_scan(seen.header.stamp.toSec(), seen);
      const Eigen::Isometry3d camera = on_robot_.pose(frames_.base, scan.frame).value();
      for (SeenLandmark& tag : scan.landmarks) {
        const Eigen::Vector3d place =
            camera * Eigen::Vector3d(tag.range * std::cos(tag.bearing),
                                     tag.range * std::sin(tag.bearing), 0.0);
        tag.range = place.head<2>().norm();
        tag.bearing = std::atan2(place.y(), place.x());
      }
      scan.frame = frames_.base;
      scans->push_back(scan);
    }
  }

  FrameNames frames_;
  TagScans tags_{FramePattern(""), frames_};
  StaticFrames on_robot_;
};

// Of a message of odometry, or of those of /tf that say where the robot is in its odometry.
std::vector<nav_msgs::Odometry> odometry_in(const rosbag::MessageInstance& instance,
                                            const FrameNames& frames) {
  if (const auto odometry = message_in<nav_msgs::Odometry>(instance)) return {*odometry};
  std::vector<nav_msgs::Odometry> result;
  const auto transforms = message_in<tf2_msgs::TFMessage>(instance);
  if (!transforms) return result;
  for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
    const bool is_odometry = without_slash(transform.child_frame_id) == frames.base &&
                             without_slash(transform.header.frame_id) == frames.odom;
    if (is_odometry) result.push_back(to_odometry_message(transform));
  }
  return result;
}

}  // namespace

std::vector<std::string> pose_types() {
  return {"geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry",
          "geometry_msgs/PoseStamped"};
}

std::vector<StampedPose> read_poses(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<StampedPose> poses;
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    if (const auto with_covariance =
            message_in<geometry_msgs::PoseWithCovarianceStamped>(instance)) {
      poses.push_back(
          stamped_pose(stamp_of(instance, *with_covariance), with_covariance->pose.pose));
    } else if (const auto odometry = message_in<nav_msgs::Odometry>(instance)) {
      poses.push_back(stamped_pose(stamp_of(instance, *odometry), odometry->pose.pose));
    } else if (const auto pose = message_in<geometry_msgs::PoseStamped>(instance)) {
      poses.push_back(stamped_pose(stamp_of(instance, *pose), pose->pose));
    }
  });
  sort_by_time(&poses);
  check_path(poses, place_of(bag, topic).c_str());
  return poses;
}

RecordedOdometry read_odometry(const rosbag::Bag& bag, const std::string& topic,
                               const FrameNames& frames) {
  RecordedOdometry result;
  int messages = 0;
  int rejected = 0;
  std::string why;
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    for (nav_msgs::Odometry& odometry : odometry_in(instance, frames)) {
      ++messages;
      if (odometry.header.stamp.isZero()) odometry.header.stamp = instance.getTime();
      FrameNames own;
      own.odom = odometry.header.frame_id;
      own.base = odometry.child_frame_id;
      if (const auto wrong = check(odometry, own)) {
        if (rejected++ == 0) why = wrong->detail;
      } else {
        result.poses.push_back(stamped_pose(odometry.header.stamp.toSec(), odometry.pose.pose));
      }
    }
  });
  if (messages == 0) return {read_poses(bag, topic), ""};
  if (rejected > 0) {
    result.left_out = std::to_string(rejected) + " of " + std::to_string(messages) +
                      " messages of " + topic + " left out, which filters reject; of the first, " +
                      why;
  }
  if (result.poses.empty()) throw Error(bag.getFileName() + ": " + result.left_out);
  sort_by_time(&result.poses);
  check_path(result.poses, place_of(bag, topic).c_str());
  return result;
}

std::vector<Beacon> read_beacons(const rosbag::Bag& bag, const std::string& topic) {
  const auto last = last_message<BeaconArray>(bag, topic);
  if (!last) return {};
  std::vector<Beacon> beacons = to_beacons(*last);
  for (const Beacon& beacon : beacons) {
    if (beacon.position.allFinite()) continue;
    throw Error(place_of(bag, topic) + ": the position of beacon " + std::to_string(beacon.id) +
                " is not finite");
  }
  return beacons;
}

std::vector<std::string> recorded_range_types() {
  std::vector<std::string> types = range_types();
  types.emplace_back("sensor_msgs/Range");
  return types;
}

std::vector<StampedRange> read_ranges(const rosbag::Bag& bag, const std::string& topic) {
  BeaconMclTopics topics;
  topics.ranges = topic;
  const auto inputs = topics.inputs("", "");
  const BeaconNames names = names_of(BeaconMclPipelineOptions());
  std::vector<StampedRange> ranges;
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    const auto take = [&](const BeaconRange& range) {
      ranges.push_back({stamp_of(instance, range), without_slash(range.header.frame_id),
                        range.beacon, range.range});
    };
    if (const auto sensor_range = message_in<sensor_msgs::Range>(instance)) {
      if (const auto range = read_range(*sensor_range, names).range) take(*range);
    } else if (const auto message = to_message(instance, inputs)) {
      if (const auto* range = std::get_if<BeaconRange::ConstPtr>(&*message)) take(**range);
    }
  });
  sort_by_time(&ranges);
  return ranges;
}

std::optional<std::vector<PointLandmark>> read_landmark_map(const rosbag::Bag& bag,
                                                            const std::string& topic) {
  const auto last = last_message<LandmarkMap>(bag, topic);
  if (!last) return std::nullopt;
  std::vector<PointLandmark> landmarks;
  for (const Landmark& message : last->landmarks) {
    landmarks.push_back({message.id, {message.position.x, message.position.y}});
    if (landmarks.back().position.allFinite()) continue;
    throw Error(place_of(bag, topic) + ": landmark " + std::to_string(message.id) +
                " is not finite");
  }
  return landmarks;
}

std::optional<std::vector<StampedPose>> read_path(const rosbag::Bag& bag,
                                                  const std::string& topic) {
  const auto last = last_message<nav_msgs::Path>(bag, topic);
  if (!last) return std::nullopt;
  std::vector<StampedPose> poses;
  for (const geometry_msgs::PoseStamped& pose : last->poses) {
    poses.push_back(stamped_pose(pose.header.stamp.toSec(), pose.pose));
  }
  sort_by_time(&poses);
  if (!poses.empty()) check_path(poses, place_of(bag, topic).c_str());
  return poses;
}

std::vector<StampedScan> read_landmark_scans(const rosbag::Bag& bag, const std::string& topic) {
  FastSlamTopics topics;
  topics.landmarks = topic;
  const auto inputs = topics.inputs("");
  std::vector<StampedScan> scans;
  TagReader tags(bag);
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    const auto message = to_message(instance, inputs);
    if (!message) return;
    if (const auto* scan = std::get_if<LandmarkObservationArray::ConstPtr>(&*message)) {
      scans.push_back(stamped_scan(stamp_of(instance, **scan), **scan));
    } else if (const auto* seen = std::get_if<tf2_msgs::TFMessage::ConstPtr>(&*message)) {
      tags.take(**seen, &scans);
    }
  });
  tags.finish(&scans);
  sort_by_time(&scans);
  return scans;
}

std::optional<StatedOdometryNoise> read_odometry_noise(const rosbag::Bag& bag,
                                                       const std::string& topic) {
  Eigen::Array3d variance = Eigen::Array3d::Zero();  // of all steps together
  double duration = 0.0;
  std::optional<double> last;
  for_each_message(bag, topic, [&](const rosbag::MessageInstance& instance) {
    const auto odometry = message_in<nav_msgs::Odometry>(instance);
    if (!odometry) return;
    const double time = stamp_of(instance, *odometry);
    const double step = time - last.value_or(time);
    last = time;
    const auto& covariance = odometry->twist.covariance;
    const Eigen::Array3d stated(covariance[0], covariance[7], covariance[35]);
    if (!stated.allFinite()) return;
    variance += step * step * stated;
    duration += step;
  });
  if (!(duration > 0.0) || !variance.allFinite() || (variance < 0.0).any() ||
      !(variance > 0.0).any()) {
    return std::nullopt;
  }
  const Eigen::Array3d sigma = (variance / duration).sqrt();
  return StatedOdometryNoise{sigma[0], sigma[1], sigma[2]};
}

std::map<std::string, Eigen::Isometry3d> read_frames_on_robot(const rosbag::Bag& bag,
                                                              const std::string& base) {
  std::set<std::string> names = {base};
  const StaticFrames on_robot = static_frames(bag, &names);
  std::map<std::string, Eigen::Isometry3d> frames;
  for (const std::string& name : names) {
    if (const auto pose = on_robot.pose(base, name)) frames[name] = *pose;
  }
  return frames;
}

}  // namespace pf_resampling
