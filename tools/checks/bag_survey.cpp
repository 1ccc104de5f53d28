#include "tools/checks/bag_survey.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "beacon_mcl_node/beacon_checks.hpp"
#include "beacon_mcl_node/range_sensor.hpp"
#include "fastslam_node/tag_scans.hpp"
#include "src/messages/conversions.hpp"
#include "src/messages/foreign_messages.hpp"
#include "src/odometry/input_checks.hpp"
#include "tools/common/progress_bar.hpp"

namespace pf_resampling {

namespace {

/// Looks at the messages as the filters get them.
class Surveyor {
 public:
  Surveyor(const rosbag::Bag& bag, const CheckedTopics& names,
           const CheckedConfiguration& configuration)
      : bag_(bag),
        names_(names),
        configuration_(configuration),
        beacon_names_(names_of(configuration.beacon_mcl)),
        tags_(FramePattern(configuration.fastslam.tag_pattern), configuration.fastslam.frames) {
    survey_.topics = topics_of(bag_);
    const bool is_on_tf = configuration.odometry_source() == OdometrySource::tf;
    survey_.odom.topic = is_on_tf ? "/tf (odometry)" : names.odom;
    const BagTopic* sensor_ranges = survey_.topic_named(names_.sensor_ranges);
    const bool has_others = survey_.topic_named(names_.ranges) != nullptr ||
                            sensor_ranges == nullptr || sensor_ranges->type != "sensor_msgs/Range";
    survey_.ranges.topic = has_others ? names.ranges : names.sensor_ranges;
    survey_.landmarks.topic = names.landmarks;
  }

  BagSurvey survey() {
    note_beacons(to_message(configuration_.beacon_mcl.beacons, ""));
    read();
    return std::move(survey_);
  }

 private:
  void read() {
    const std::string& base = configuration_.frames().base;
    const auto of_beacon_mcl = names_.inputs(base, beacon_names_.antenna);
    const auto of_fastslam = names_.of_fastslam().inputs(base);
    ProgressBar progress("reading", rosbag::View(bag_).size());
    std::uint64_t done = 0;
    for_each_in_order(bag_, bag_.getFileName(), {}, [&](const rosbag::MessageInstance& instance) {
      progress.update(++done);
      const auto note_it = [&](const auto& message) { note(*message, instance); };
      if (instance.getTopic() == names_.landmarks) {
        if (const auto message = pf_resampling::to_message(instance, of_fastslam)) {
          std::visit(note_it, *message);
        }
      } else if (const auto message = pf_resampling::to_message(instance, of_beacon_mcl)) {
        std::visit(note_it, *message);
      }
    });
  }

  template <typename Message>
  void note(const Message& /*of no interest*/, const rosbag::MessageInstance& /*instance*/) {}

  void note_header(const std_msgs::Header& header, const rosbag::MessageInstance& instance,
                   TopicSurvey* topic) {
    topic->add(header.stamp, instance.getTime());
    topic->frames.insert(without_slash(header.frame_id));
  }

  void note(const nav_msgs::Odometry& odometry, const rosbag::MessageInstance& instance) {
    if (configuration_.odometry_source() == OdometrySource::topic)
      note_odometry(odometry, instance);
  }

  void note_odometry(const nav_msgs::Odometry& odometry, const rosbag::MessageInstance& instance) {
    note_header(odometry.header, instance, &survey_.odom);
    survey_.base_frames.insert(without_slash(odometry.child_frame_id));
    survey_.turns.add(to_pose2(odometry.pose.pose));
  }

  void note(const BeaconRange& range, const rosbag::MessageInstance& instance) {
    note_header(range.header, instance, &survey_.ranges);
    note_range(range);
  }

  void note_range(const BeaconRange& range) {
    if (!std::isfinite(range.range) || range.range <= 0.0) return;
    const double time = 1e-9 * static_cast<double>(range.header.stamp.toNSec());
    survey_.timed_ranges.push_back({time, range.beacon, range.range});
  }

  void note(const sensor_msgs::Range& message, const rosbag::MessageInstance& instance) {
    if (survey_.ranges.topic != names_.sensor_ranges) return;
    survey_.ranges.add(message.header.stamp, instance.getTime());
    if (const auto range = read_range(message, beacon_names_).range) note_range(*range);
  }

  void note(const BeaconArray& beacons, const rosbag::MessageInstance& /*instance*/) {
    if (!configuration_.beacon_mcl.beacons.empty()) return;
    survey_.beacon_frame = without_slash(beacons.header.frame_id);
    note_beacons(beacons);
  }

  void note_beacons(const BeaconArray& beacons) {
    survey_.beacons.clear();
    for (const auto& beacon : beacons.beacons) survey_.beacons.emplace(beacon.id, beacon.position);
  }

  void note(const LandmarkObservationArray& scan, const rosbag::MessageInstance& instance) {
    note_header(scan.header, instance, &survey_.landmarks);
  }

  void note(const tf2_msgs::TFMessage& message, const rosbag::MessageInstance& instance) {
    const FrameNames& frames = configuration_.frames();
    for (const auto& transform : message.transforms) {
      const std::string parent = without_slash(transform.header.frame_id);
      const std::string child = without_slash(transform.child_frame_id);
      if (tags_.is_tag(transform)) {
        if (!is_detected_tag(child)) survey_.landmarks.topic = "/tf (tags)";
        note_header(transform.header, instance, &survey_.landmarks);
        continue;
      }
      if (configuration_.odometry_source() == OdometrySource::tf && child == frames.base &&
          parent == frames.odom) {
        note_odometry(to_odometry_message(transform), instance);
      }
      if (instance.getTopic() != "/tf_static") survey_.transforms.emplace(parent, child);
    }
  }

  const rosbag::Bag& bag_;
  const CheckedTopics& names_;
  const CheckedConfiguration& configuration_;
  const BeaconNames beacon_names_;
  const TagScans tags_;
  BagSurvey survey_;
};

}  // namespace

void TopicSurvey::add(const ros::Time& stamp, const ros::Time& bag_time) {
  if (check(stamp)) return;
  const double time = stamp.toSec();
  largest_delay = std::max(largest_delay, std::abs(time - bag_time.toSec()));
  if (newest > 0.0 && time - newest > longest_gap) {
    longest_gap = time - newest;
    longest_gap_at = newest;
  }
  newest = std::max(newest, time);
}

const BagTopic* BagSurvey::topic_named(const std::string& name) const {
  const auto found = std::find_if(topics.begin(), topics.end(),
                                  [&](const BagTopic& topic) { return topic.name == name; });
  return found == topics.end() ? nullptr : &*found;
}

BagSurvey survey_bag(const rosbag::Bag& bag, const CheckedTopics& names,
                     const CheckedConfiguration& configuration) {
  return Surveyor(bag, names, configuration).survey();
}

}  // namespace pf_resampling
