#include "tools/checks/bag_survey.hpp"

#include <geometry_msgs/PointStamped.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <variant>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "beacon_mcl_node/range_sensor.hpp"
#include "fastslam_node/tag_scans.hpp"
#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/foreign_messages.hpp"
#include "src/messages/input_checks.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/progress_bar.hpp"

namespace pf_resampling {

namespace {

constexpr std::uint32_t kAfterTheBag = 1;  // s, when no tag comes any more
constexpr double kUnitQuaternion = 1e-3;   // largest deviation of the norm

/// No later than the latest that ROS can reckon with.
ros::Time after(const ros::Time& end) {
  return {std::min(end.sec + kAfterTheBag, 0x7fffffffU), end.nsec};
}

bool is_finite(const geometry_msgs::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

bool is_finite(const geometry_msgs::Pose& pose) {
  const auto& q = pose.orientation;
  return is_finite(pose.position) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z) && std::isfinite(q.w);
}

bool is_rotation(const geometry_msgs::Quaternion& q) {
  return std::abs(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w) - 1.0) < kUnitQuaternion;
}

class Surveyor {
 public:
  Surveyor(const rosbag::Bag& bag, const CheckedTopics& names,
           const CheckedConfiguration& configuration)
      : bag_(bag),
        names_(names),
        configuration_(configuration),
        beacon_names_(names_of(configuration.beacon_mcl)),
        tags_(FramePattern(configuration.fastslam.tag_pattern), configuration.fastslam.frames) {
    survey_.with_tags = !configuration.fastslam.tag_pattern.empty();
    survey_.odom.topic = names.odom;
    survey_.ranges.topic = names.ranges;
    survey_.landmarks.topic = names.landmarks;
    survey_.truth.topic = names.ground_truth;
  }

  BagSurvey survey() {
    survey_.topics = topics_of(bag_);
    const BagTopic* sensor_ranges = survey_.topic_named(names_.sensor_ranges);
    if (survey_.topic_named(names_.ranges) == nullptr && sensor_ranges != nullptr &&
        sensor_ranges->type == "sensor_msgs/Range") {
      survey_.ranges.topic = names_.sensor_ranges;
    }
    take_configuration();
    read();
    if (survey_.base_frames.size() == 1) survey_.base = *survey_.base_frames.begin();
    for (const auto& [frame, pose] : read_frames_on_robot(bag_, survey_.base)) {
      survey_.on_robot[frame] = pose;
    }
    find_below_robot();
    return std::move(survey_);
  }

 private:
  /// From what is on the robot down the tree of /tf; each frame once.
  void find_below_robot() {
    std::map<std::string, std::vector<std::string>> children;
    for (const auto& [parent, child] : survey_.transforms) children[parent].push_back(child);
    std::vector<std::string> next;
    for (const auto& [frame, pose] : survey_.on_robot) next.push_back(frame);
    while (!next.empty()) {
      const auto below = children.find(next.back());
      next.pop_back();
      if (below == children.end()) continue;
      for (const std::string& child : below->second) {
        if (survey_.on_robot.count(child) > 0) continue;
        if (survey_.below_robot.insert(child).second) next.push_back(child);
      }
    }
  }

  void take_configuration() {
    const BeaconMclPipelineOptions& beacon_mcl = configuration_.beacon_mcl;
    for (const Beacon& beacon : beacon_mcl.beacons) {
      geometry_msgs::Point& place = survey_.beacons[beacon.id];
      place.x = beacon.position.x();
      place.y = beacon.position.y();
      place.z = beacon.is_planar ? std::numeric_limits<double>::quiet_NaN() : beacon.position.z();
    }
    for (const auto& [frame, place] : beacon_mcl.antennas) {
      survey_.on_robot[frame] = Eigen::Isometry3d(Eigen::Translation3d(place));
    }
    for (const auto& [frame, place] : configuration_.fastslam.sensors) {
      survey_.on_robot[frame] =
          Eigen::Translation3d(place.x, place.y, 0.0) *
          Eigen::Isometry3d(Eigen::AngleAxisd(place.heading, Eigen::Vector3d::UnitZ()));
      on_robot_.add(configuration_.fastslam.frames.base, frame, {place.x, place.y, 0.0},
                    place.heading);
    }
  }

  void read() {
    rosbag::View view(bag_);
    ProgressBar progress("reading", view.size());
    std::uint64_t done = 0;
    try {
      for (const rosbag::MessageInstance& instance : view) {
        read(instance);
        progress.update(++done);
      }
      note_tags(after(newest_odometry_));
    } catch (const Error&) {
      throw;
    } catch (const rosbag::BagException& error) {
      throw Error(bag_.getFileName() + ": is damaged (" + error.what() + "); try: rosbag reindex " +
                  bag_.getFileName());
    } catch (const std::exception& error) {  // for instance no memory for what it holds
      throw Error(bag_.getFileName() + ": cannot be read to its end (" + error.what() + ")");
    }
  }

  void read(const rosbag::MessageInstance& instance) {
    const std::string& topic = instance.getTopic();
    if (topic == names_.odom) {
      read_odometry(instance);
    } else if (topic == names_.ranges) {
      read_range(instance);
    } else if (topic == survey_.ranges.topic) {
      read_sensor_range(instance);
    } else if (topic == names_.beacons) {
      read_beacons(instance);
    } else if (topic == names_.landmarks) {
      read_landmarks(instance);
    } else if (topic == names_.ground_truth) {
      read_truth(instance);
    } else if (topic == "/tf" || topic == "/tf_static") {
      read_transforms(instance);
    }
  }

  template <typename Header>
  void note_header(const rosbag::MessageInstance& instance, const Header& header,
                   TopicSurvey* check, std::int32_t sender = 0) {
    check->stamps.add(header.stamp, instance.getTime(), sender);
    check->frames.insert(without_slash(header.frame_id));
  }

  void read_odometry(const rosbag::MessageInstance& instance) {
    if (configuration_.odometry_source() != OdometrySource::topic) return;
    if (const auto odometry = message_in<nav_msgs::Odometry>(instance)) {
      note_odometry(*odometry, instance);
    } else if (const auto pose = message_in<geometry_msgs::PoseWithCovarianceStamped>(instance)) {
      note_odometry(to_odometry_message(*pose, configuration_.frames().base), instance);
    }
  }

  void note_odometry(const nav_msgs::Odometry& message, const rosbag::MessageInstance& instance) {
    const nav_msgs::Odometry* const odometry = &message;
    note_header(instance, odometry->header, &survey_.odom);
    if (!check(odometry->header.stamp)) {
      newest_odometry_ = odometry->header.stamp;
      note_tags(newest_odometry_);
    }
    survey_.base_frames.insert(without_slash(odometry->child_frame_id));
    if (!is_finite(odometry->pose.pose)) {
      ++survey_.odom.not_finite;
    } else if (!is_rotation(odometry->pose.pose.orientation)) {
      ++survey_.odom.impossible;
    }
  }

  void read_range(const rosbag::MessageInstance& instance) {
    if (is_of(foreign_range_types(), instance)) {
      note_range(range_in(*instance.instantiate<topic_tools::ShapeShifter>(), beacon_names_.antenna,
                          instance.getTime()),
                 instance);
    } else if (const auto range = message_in<BeaconRange>(instance)) {
      note_range(*range, instance);
    }
  }

  static bool is_of(const std::vector<std::string>& types,
                    const rosbag::MessageInstance& instance) {
    return std::find(types.begin(), types.end(), instance.getDataType()) != types.end();
  }

  void note_range(const BeaconRange& message, const rosbag::MessageInstance& instance) {
    const BeaconRange* const range = &message;
    note_header(instance, range->header, &survey_.ranges, range->beacon);
    if (!std::isfinite(range->range) || !std::isfinite(range->variance)) {
      ++survey_.ranges.not_finite;
    } else if (range->range <= 0.0 || range->variance < 0.0) {
      ++survey_.ranges.impossible;
    } else {
      survey_.ranges_by_beacon[range->beacon].push_back(range->range);
    }
  }

  void read_sensor_range(const rosbag::MessageInstance& instance) {
    const auto message = message_in<sensor_msgs::Range>(instance);
    if (message == nullptr) return;
    const std::optional<int> beacon = beacon_names_.id_of(message->header.frame_id);
    survey_.ranges.stamps.add(message->header.stamp, instance.getTime(), beacon.value_or(-1));
    if (!beacon) {
      survey_.unnamed.insert(without_slash(message->header.frame_id));
      return;
    }
    const RangeReading reading = pf_resampling::read_range(*message, beacon_names_);
    if (reading.rejection) {
      ++(reading.rejection->reason == RejectReason::not_finite ? survey_.ranges.not_finite
                                                               : survey_.ranges.impossible);
    } else if (reading.range && reading.range->range > 0.0) {
      survey_.ranges_by_beacon[*beacon].push_back(reading.range->range);
    }
  }

  void read_beacons(const rosbag::MessageInstance& instance) {
    const auto beacons = message_in<BeaconArray>(instance);
    if (beacons == nullptr || !configuration_.beacon_mcl.beacons.empty()) return;
    survey_.beacon_frame = without_slash(beacons->header.frame_id);
    survey_.beacons.clear();
    survey_.beacons_twice.clear();
    for (const auto& beacon : beacons->beacons) {
      if (!survey_.beacons.emplace(beacon.id, beacon.position).second) {
        survey_.beacons_twice.push_back(beacon.id);
      }
    }
  }

  void read_landmarks(const rosbag::MessageInstance& instance) {
    if (const auto scan = message_in<LandmarkObservationArray>(instance)) {
      note_header(instance, scan->header, &survey_.landmarks);
      note_scan(*scan);
    } else if (is_of(foreign_landmark_types(), instance)) {
      const auto seen = landmarks_in(*instance.instantiate<topic_tools::ShapeShifter>());
      if (const auto* tags = std::get_if<tf2_msgs::TFMessage>(&seen)) {
        survey_.with_tags = true;
        for (const auto& tag : tags->transforms) read_tag(tag, instance.getTime());
      } else {
        note_header(instance, std::get<LandmarkObservationArray>(seen).header, &survey_.landmarks);
        note_scan(std::get<LandmarkObservationArray>(seen));
      }
    }
  }

  void note_scan(const LandmarkObservationArray& scan) {
    ++survey_.seen.scans;
    for (const auto& seen : scan.observations) {
      if (!std::isfinite(seen.range) || !std::isfinite(seen.bearing) ||
          !std::isfinite(seen.range_variance) || !std::isfinite(seen.bearing_variance)) {
        ++survey_.landmarks.not_finite;
      } else if (seen.range <= 0.0 || seen.range_variance < 0.0 || seen.bearing_variance < 0.0) {
        ++survey_.landmarks.impossible;
      } else {
        note_landmark(seen);
      }
    }
  }

  void note_landmark(const LandmarkObservation& seen) {
    LandmarkSurvey& all = survey_.seen;
    const bool is_first = all.ranges.empty();
    all.least_bearing = is_first ? seen.bearing : std::min(all.least_bearing, seen.bearing);
    all.largest_bearing = is_first ? seen.bearing : std::max(all.largest_bearing, seen.bearing);
    all.ranges.push_back(seen.range);
    if (seen.id >= 0) ++all.by_id[seen.id];
  }

  void read_truth(const rosbag::MessageInstance& instance) {
    const auto note_pose = [&](const auto& header, const geometry_msgs::Pose& pose) {
      note_header(instance, header, &survey_.truth);
      if (!is_finite(pose)) ++survey_.truth.not_finite;
    };
    if (const auto pose = message_in<geometry_msgs::PoseStamped>(instance)) {
      note_pose(pose->header, pose->pose);
    } else if (const auto point = message_in<geometry_msgs::PointStamped>(instance)) {
      note_header(instance, point->header, &survey_.truth);
      if (!is_finite(point->point)) ++survey_.truth.not_finite;
    } else if (const auto odometry = message_in<nav_msgs::Odometry>(instance)) {
      note_pose(odometry->header, odometry->pose.pose);
    } else if (const auto with_covariance =
                   message_in<geometry_msgs::PoseWithCovarianceStamped>(instance)) {
      note_pose(with_covariance->header, with_covariance->pose.pose);
    }
  }

  void read_transforms(const rosbag::MessageInstance& instance) {
    const auto message = message_in<tf2_msgs::TFMessage>(instance);
    if (message == nullptr) return;
    for (const auto& transform : message->transforms) {
      if (tags_.is_tag(transform)) {
        read_tag(transform, instance.getTime());
        continue;
      }
      on_robot_.add(transform);
      const FrameNames& frames = configuration_.frames();
      if (configuration_.odometry_source() == OdometrySource::tf &&
          without_slash(transform.child_frame_id) == frames.base &&
          without_slash(transform.header.frame_id) == frames.odom) {
        survey_.odom.topic = "/tf (odometry)";
        note_odometry(to_odometry_message(transform), instance);
      }
      if (instance.getTopic() == "/tf_static") continue;
      survey_.transforms.emplace(without_slash(transform.header.frame_id),
                                 without_slash(transform.child_frame_id));
    }
  }

  void read_tag(const geometry_msgs::TransformStamped& tag, ros::Time time) {
    if (!id_of_detected_tag(tag.child_frame_id)) survey_.landmarks.topic = "/tf (tags)";
    survey_.landmarks.frames.insert(without_slash(tag.header.frame_id));
    if (const auto rejection = tags_.take(tag, newest_odometry_, &on_robot_)) {
      survey_.tag_fault = rejection->detail;
    } else {
      const auto number = static_cast<std::int32_t>(tags_seen_.size());
      survey_.landmarks.stamps.add(tag.header.stamp, time,
                                   tags_seen_.emplace(tag.child_frame_id, number).first->second);
    }
  }

  void note_tags(ros::Time odometry) {
    for (const LandmarkObservationArray& scan : tags_.take_complete(odometry)) note_scan(scan);
  }

  const rosbag::Bag& bag_;
  const CheckedTopics& names_;
  const CheckedConfiguration& configuration_;
  const BeaconNames beacon_names_;
  TagScans tags_;
  std::map<std::string, std::int32_t> tags_seen_;  // each with a number
  StaticFrames on_robot_;
  ros::Time newest_odometry_;
  BagSurvey survey_;
};

}  // namespace

std::size_t LandmarkSurvey::with_id() const {
  std::size_t count = 0;
  for (const auto& [id, times] : by_id) count += times;
  return count;
}

std::size_t LandmarkSurvey::seen_once() const {
  return static_cast<std::size_t>(std::count_if(
      by_id.begin(), by_id.end(), [](const auto& landmark) { return landmark.second == 1; }));
}

const BagTopic* BagSurvey::topic_named(const std::string& name) const {
  const auto found = std::find_if(topics.begin(), topics.end(),
                                  [&](const BagTopic& topic) { return topic.name == name; });
  return found == topics.end() ? nullptr : &*found;
}

bool BagSurvey::places_on_robot(const std::string& frame) const {
  return on_robot.count(frame) > 0 || below_robot.count(frame) > 0;
}

BagSurvey survey_bag(const rosbag::Bag& bag, const CheckedTopics& names,
                     const CheckedConfiguration& configuration) {
  return Surveyor(bag, names, configuration).survey();
}

}  // namespace pf_resampling
