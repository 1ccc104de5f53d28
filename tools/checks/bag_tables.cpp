#include "tools/checks/bag_tables.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {

namespace {

std::string degrees(double radians) {
  return fixed(radians * 180.0 / kPi, 1);
}

std::string topics_table(const BagSurvey& survey) {
  Table table({"topic", "type", "messages", "latched"});
  for (const BagTopic& topic : survey.topics) {
    table.add_row(
        {topic.name, topic.type, std::to_string(topic.messages), topic.latched ? "yes" : ""});
  }
  return "\n" + table.text();
}

std::string stamps_table(const BagSurvey& survey) {
  Table table({"stamps", "from s", "to s", "rate Hz", "period s", "longest gap s", "at s", "gaps",
               "off bag time s"});
  for (const TopicSurvey* topic : {&survey.odom, &survey.ranges, &survey.landmarks}) {
    const StampSummary stamps = topic->stamps.summary();
    if (stamps.messages == 0) continue;
    table.add_row({topic->topic, fixed(stamps.first, 3), fixed(stamps.last, 3),
                   fixed(stamps.rate(), 2), fixed(stamps.median_period, 3),
                   fixed(stamps.longest_gap, 3), fixed(stamps.longest_gap_at, 3),
                   std::to_string(stamps.gaps), fixed(stamps.largest_delay, 3)});
  }
  if (table.empty()) return "";
  return "\n" + table.text() + "  (period: the median; gaps: longer than " + fixed(kGapFactor, 0) +
         " of it)\n";
}

std::string frames_table(const CheckedTopics& names, const BagSurvey& survey) {
  Table table({"frames", "x m", "y m", "z m", "yaw deg"});
  const auto place = [&](const std::string& topic, const std::string& frame) {
    const auto found = survey.on_robot.find(frame);
    if (found == survey.on_robot.end()) {
      table.add_row({topic + ": " + frame + " on " + survey.base, "?", "?", "?", "?"});
      return;
    }
    const Eigen::Vector3d position = found->second.translation();
    const Eigen::Vector3d ahead = found->second.linear().col(0);
    table.add_row({topic + ": " + frame + " on " + survey.base, fixed(position.x(), 3),
                   fixed(position.y(), 3), fixed(position.z(), 3),
                   degrees(std::atan2(ahead.y(), ahead.x()))});
  };
  const std::string bases = joined({survey.base_frames.begin(), survey.base_frames.end()}, ", ");
  for (const std::string& frame : survey.odom.frames) {
    table.add_row({survey.odom.topic + ": " + bases + " in " + frame});
  }
  for (const std::string& frame : survey.ranges.frames) place(names.ranges, frame);
  for (const std::string& frame : survey.landmarks.frames) place(survey.landmarks.topic, frame);
  if (!survey.beacon_frame.empty()) table.add_row({names.beacons + ": " + survey.beacon_frame});
  return table.empty() ? "" : "\n" + table.text();
}

/// "min", "median" and "max" of a list that is not empty.
std::vector<std::string> spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {fixed(values.front(), 2), fixed(values[values.size() / 2], 2), fixed(values.back(), 2)};
}

std::string ranges_table(const BagSurvey& survey) {
  Table table({"beacon", "x m", "y m", "z m", "ranges", "min m", "median m", "max m"});
  std::set<std::int32_t> ids;
  for (const auto& [id, position] : survey.beacons) ids.insert(id);
  for (const auto& [id, ranges] : survey.ranges_by_beacon) ids.insert(id);
  for (const std::int32_t id : ids) {
    std::vector<std::string> row = {std::to_string(id)};
    const auto beacon = survey.beacons.find(id);
    if (beacon == survey.beacons.end()) {
      row.insert(row.end(), {"?", "?", "?"});
    } else {
      row.insert(row.end(), {fixed(beacon->second.x, 3), fixed(beacon->second.y, 3),
                             fixed(beacon->second.z, 3)});
    }
    const auto ranges = survey.ranges_by_beacon.find(id);
    if (ranges == survey.ranges_by_beacon.end()) {
      row.push_back("0");
    } else {
      row.push_back(std::to_string(ranges->second.size()));
      for (const std::string& cell : spread_of(ranges->second)) row.push_back(cell);
    }
    table.add_row(row);
  }
  return table.empty() ? "" : "\n" + table.text();
}

std::string landmarks_table(const LandmarkSurvey& seen) {
  if (seen.scans == 0) return "";
  Table table({"landmark observations", "scans", "with id", "ids", "seen once", "min m", "median m",
               "max m", "from deg", "to deg"});
  std::vector<std::string> row = {std::to_string(seen.ranges.size()), std::to_string(seen.scans),
                                  std::to_string(seen.with_id()), std::to_string(seen.by_id.size()),
                                  std::to_string(seen.seen_once())};
  if (!seen.ranges.empty()) {
    for (const std::string& cell : spread_of(seen.ranges)) row.push_back(cell);
    row.push_back(degrees(seen.least_bearing));
    row.push_back(degrees(seen.largest_bearing));
  }
  table.add_row(row);
  return "\n" + table.text();
}

}  // namespace

std::string tables_of(const rosbag::Bag& bag, const CheckedTopics& names, const BagSurvey& survey,
                      const LandmarkSurvey& seen) {
  rosbag::View view(bag);
  const double duration = view.size() > 0 ? (view.getEndTime() - view.getBeginTime()).toSec() : 0.0;
  const BagTopic* truth = survey.topic_named(names.ground_truth);
  std::string text = bag.getFileName() + ": " + std::to_string(view.size()) + " messages, " +
                     fixed(duration, 1) + " s\n" + topics_table(survey) + stamps_table(survey) +
                     frames_table(names, survey) + ranges_table(survey) + landmarks_table(seen);
  text += "\n  ground truth: " + (truth == nullptr ? "none" : truth->type);
  if (survey.topic_named("/ground_truth_landmarks") != nullptr) text += ", and of the landmarks";
  return text + "\n";
}

}  // namespace pf_resampling
