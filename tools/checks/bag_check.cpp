#include "bag_check.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bag_survey.hpp"
#include "common/bag.hpp"
#include "common/table.hpp"
#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

namespace {

constexpr double kLongDelay = 1.0;        // s, between stamp and bag time
constexpr double kUnitQuaternion = 1e-3;  // largest deviation of the norm
const char* const kOdometryType = "nav_msgs/Odometry";
const char* const kRangeType = "pf_resampling/BeaconRange";
const char* const kBeaconsType = "pf_resampling/BeaconArray";
const char* const kLandmarksType = "pf_resampling/LandmarkObservationArray";

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string joined(const std::set<std::string>& words) {
  return joined(std::vector<std::string>(words.begin(), words.end()), ", ");
}

std::string quoted(const std::string& frame) {
  return "'" + frame + "'";
}

class Checker {
 public:
  Checker(const rosbag::Bag& bag, const BagCheckTopics& names)
      : bag_(bag), names_(names), survey_(survey_bag(bag, names)) {}

  BagCheck check() {
    check_presence();
    for (const TopicSurvey* topic :
         {&survey_.odom, &survey_.ranges, &survey_.landmarks, &survey_.truth}) {
      check_topic(*topic);
    }
    check_times();
    check_frames();
    check_beacons();
    write_text();
    return std::move(result_);
  }

 private:
  /// "no /odom ..., /robot/odom could be it".
  void need(const std::string& name, const std::string& type, const std::string& role,
            const std::string& instead) {
    const BagTopic* topic = survey_.topic_named(name);
    if (topic != nullptr && topic->type == type) return;
    std::string problem = topic == nullptr ? "no " + name : name + " is a " + topic->type;
    problem += " (needed: " + type + ")";
    for (const BagTopic& other : survey_.topics) {
      if (other.type != type || other.name == name) continue;
      problem += ", " + other.name + " could be it (--" + role + " " + other.name +
                 "; for the node " + role + ":=" + other.name + ")";
    }
    result_.problems.push_back(problem + instead);
    is_missing_ = true;
  }

  void check_presence() {
    need(names_.odom, kOdometryType, "odom", "");
    need(names_.ranges, kRangeType, "ranges", "");
    need(names_.beacons, kBeaconsType, "beacons", " (or give the beacons in the configuration)");
    if (is_missing_) result_.problems.push_back("the bag has " + list_of(survey_.topics));
  }

  /// Stamps and numbers of one topic.
  void check_topic(const TopicSurvey& check) {
    const StampSummary stamps = check.stamps.summary();
    const auto remark = [&](std::size_t count, const std::string& what) {
      if (count > 0) {
        result_.remarks.push_back(check.topic + ": " + std::to_string(count) + " " + what);
      }
    };
    const BagTopic* topic = survey_.topic_named(check.topic);
    if (topic != nullptr && topic->messages > stamps.messages) {
      remark(topic->messages - stamps.messages, "messages of a type or version that is not read");
    }
    remark(stamps.zero, "messages without a stamp");
    remark(stamps.out_of_order, "stamps are before one that came earlier");
    remark(stamps.twice, "stamps are there twice");
    remark(check.not_finite, "values are not finite");
    remark(check.impossible, &check == &survey_.ranges || &check == &survey_.landmarks
                                 ? "ranges are not positive or variances negative"
                                 : "orientations are not unit quaternions");
    if (stamps.largest_delay > kLongDelay) {
      result_.remarks.push_back(check.topic + ": stamps and bag times differ by up to " +
                                fixed(stamps.largest_delay, 3) + " s");
    }
    if (check.frames.size() > 1 && &check != &survey_.ranges) {
      result_.remarks.push_back(check.topic + ": several frames: " + joined(check.frames));
    }
  }

  void check_times() {
    const StampSummary odom = survey_.odom.stamps.summary();
    const StampSummary ranges = survey_.ranges.stamps.summary();
    if (odom.messages > 0 && odom.messages == odom.zero) {
      result_.problems.push_back(names_.odom + " has no stamps");
    }
    if (ranges.messages > 0 && ranges.messages == ranges.zero) {
      result_.problems.push_back(names_.ranges + " has no stamps");
    }
    if (odom.messages > 0 && survey_.odom.not_finite + survey_.odom.impossible >= odom.messages) {
      result_.problems.push_back(names_.odom + " has no pose that can be used");
    }
    if (ranges.rate() <= 0.0 || odom.rate() <= 0.0) return;
    if (ranges.last < odom.first || ranges.first > odom.last) {
      result_.problems.push_back(names_.odom + " and " + names_.ranges + " are of different times");
    } else if (ranges.first < odom.first - 1.0 || ranges.last > odom.last + 1.0) {
      result_.remarks.push_back(names_.odom + " does not cover all of " + names_.ranges);
    }
  }

  void check_frames() {
    for (const std::string& frame : survey_.base_frames) {
      if (frame.empty()) result_.problems.push_back(names_.odom + " names no child_frame_id");
    }
    if (!survey_.odom.frames.empty() && survey_.odom.frames.count("") > 0) {
      result_.problems.push_back(names_.odom + " names no frame_id");
    }
    for (const TopicSurvey* check : {&survey_.ranges, &survey_.landmarks}) {
      for (const std::string& frame : check->frames) {
        if (survey_.on_robot.count(frame) > 0) continue;
        const std::string what = check->topic + ": nothing in /tf_static places its frame " +
                                 quoted(frame) + " on " + quoted(survey_.base);
        if (check == &survey_.ranges) {
          result_.problems.push_back(what +
                                     " (or give it in the list `antennas` of the configuration)");
        } else {
          result_.remarks.push_back(what);
        }
      }
    }
    const auto expect = [&](const std::set<std::string>& frames, const std::string& usual,
                            const std::string& parameter) {
      for (const std::string& frame : frames) {
        if (frame.empty() || frame == usual) continue;
        result_.remarks.push_back("frame " + quoted(frame) + " instead of " + quoted(usual) +
                                  ": set the parameter " + parameter + " to it");
      }
    };
    expect(survey_.odom.frames, "odom", "odom_frame");
    expect(survey_.base_frames, "base_link", "base_frame");
    expect({survey_.beacon_frame}, "map", "map_frame");
    for (const auto& [parent, child] : survey_.transforms) {
      if (survey_.odom.frames.count(child) > 0) {
        result_.remarks.push_back("/tf places " + quoted(child) + " in " + quoted(parent) +
                                  ": another localization's; leave it out when playing the bag");
      }
    }
    if (!survey_.beacon_frame.empty() && !survey_.truth.frames.empty() &&
        survey_.truth.frames.count(survey_.beacon_frame) == 0) {
      result_.remarks.push_back(names_.beacons + " is in " + quoted(survey_.beacon_frame) + ", " +
                                names_.ground_truth + " in " + joined(survey_.truth.frames));
    }
  }

  void check_beacons() {
    if (survey_.topic_named(names_.beacons) == nullptr) return;
    for (const std::int32_t id : survey_.beacons_twice) {
      result_.problems.push_back("beacon " + std::to_string(id) + " is there twice in " +
                                 names_.beacons);
    }
    for (const auto& [id, position] : survey_.beacons) {
      if (std::isfinite(position.x + position.y + position.z)) continue;
      result_.problems.push_back("the position of beacon " + std::to_string(id) + " is not finite");
    }
    std::vector<std::string> unknown;
    std::size_t known = 0;
    for (const auto& [id, ranges] : survey_.ranges_by_beacon) {
      if (survey_.beacons.count(id) > 0) {
        ++known;
      } else {
        unknown.push_back(std::to_string(id));
      }
    }
    if (!unknown.empty()) {
      result_.remarks.push_back("ranges to beacons that are not in " + names_.beacons + ": " +
                                joined(unknown, ", "));
    }
    if (survey_.ranges_by_beacon.empty() && survey_.ranges.stamps.summary().messages > 0) {
      result_.problems.push_back(names_.ranges + " has no range that can be used");
    } else if (known == 0 && !survey_.ranges_by_beacon.empty()) {
      result_.problems.push_back("no range is to a beacon of " + names_.beacons);
    } else if (known > 0 && known < 3) {
      result_.remarks.push_back("ranges to only " + std::to_string(known) +
                                " known beacons: the pose may stay ambiguous");
    }
  }

  void write_text() {
    rosbag::View view(bag_);
    const double duration =
        view.size() > 0 ? (view.getEndTime() - view.getBeginTime()).toSec() : 0.0;
    result_.text = bag_.getFileName() + ": " + std::to_string(view.size()) + " messages, " +
                   fixed(duration, 1) + " s\n";
    write_topics();
    write_stamps();
    write_frames();
    write_ranges();
  }

  void write_topics() {
    Table table({"topic", "type", "messages", "latched"});
    for (const BagTopic& topic : survey_.topics) {
      table.add_row(
          {topic.name, topic.type, std::to_string(topic.messages), topic.latched ? "yes" : ""});
    }
    result_.text += "\n" + table.text();
  }

  void write_stamps() {
    Table table({"stamps", "from s", "to s", "rate Hz", "period s", "longest gap s", "at s", "gaps",
                 "out of order", "twice", "zero", "off bag time s"});
    for (const TopicSurvey* check :
         {&survey_.odom, &survey_.ranges, &survey_.landmarks, &survey_.truth}) {
      const StampSummary stamps = check->stamps.summary();
      if (stamps.messages == 0) continue;
      table.add_row({check->topic, fixed(stamps.first, 3), fixed(stamps.last, 3),
                     fixed(stamps.rate(), 2), fixed(stamps.median_period, 3),
                     fixed(stamps.longest_gap, 3), fixed(stamps.longest_gap_at, 3),
                     std::to_string(stamps.gaps), std::to_string(stamps.out_of_order),
                     std::to_string(stamps.twice), std::to_string(stamps.zero),
                     fixed(stamps.largest_delay, 3)});
    }
    if (!table.empty()) {
      result_.text += "\n" + table.text() + "  (period: the median; gaps: longer than " +
                      fixed(kGapFactor, 0) + " of it)\n";
    }
  }

  void write_frames() {
    Table table({"frames", "x m", "y m", "z m", "yaw deg"});
    const auto place = [&](const std::string& topic, const std::string& frame) {
      const auto found = survey_.on_robot.find(frame);
      if (found == survey_.on_robot.end()) {
        table.add_row({topic + ": " + frame + " on " + survey_.base, "?", "?", "?", "?"});
        return;
      }
      const Eigen::Vector3d position = found->second.translation();
      const Eigen::Vector3d ahead = found->second.linear().col(0);
      table.add_row({topic + ": " + frame + " on " + survey_.base, fixed(position.x(), 3),
                     fixed(position.y(), 3), fixed(position.z(), 3),
                     fixed(std::atan2(ahead.y(), ahead.x()) * 180.0 / kPi, 1)});
    };
    for (const std::string& frame : survey_.odom.frames) {
      table.add_row({names_.odom + ": " + joined(survey_.base_frames) + " in " + frame});
    }
    for (const std::string& frame : survey_.ranges.frames) place(names_.ranges, frame);
    for (const std::string& frame : survey_.landmarks.frames) place(names_.landmarks, frame);
    if (!survey_.beacon_frame.empty())
      table.add_row({names_.beacons + ": " + survey_.beacon_frame});
    for (const std::string& frame : survey_.truth.frames)
      table.add_row({names_.ground_truth + ": " + frame});
    if (!table.empty()) result_.text += "\n" + table.text();
  }

  void write_ranges() {
    Table table({"beacon", "x m", "y m", "z m", "ranges", "min m", "median m", "max m"});
    std::set<std::int32_t> ids;
    for (const auto& [id, position] : survey_.beacons) ids.insert(id);
    for (const auto& [id, ranges] : survey_.ranges_by_beacon) ids.insert(id);
    for (const std::int32_t id : ids) {
      std::vector<std::string> row = {std::to_string(id)};
      const auto beacon = survey_.beacons.find(id);
      if (beacon == survey_.beacons.end()) {
        row.insert(row.end(), {"?", "?", "?"});
      } else {
        row.insert(row.end(), {fixed(beacon->second.x, 3), fixed(beacon->second.y, 3),
                               fixed(beacon->second.z, 3)});
      }
      const auto ranges = survey_.ranges_by_beacon.find(id);
      if (ranges == survey_.ranges_by_beacon.end()) {
        row.push_back("0");
      } else {
        std::vector<double> sorted = ranges->second;
        std::sort(sorted.begin(), sorted.end());
        row.insert(row.end(), {std::to_string(sorted.size()), fixed(sorted.front(), 2),
                               fixed(sorted[sorted.size() / 2], 2), fixed(sorted.back(), 2)});
      }
      table.add_row(row);
    }
    if (!table.empty()) result_.text += "\n" + table.text();
    const BagTopic* truth = survey_.topic_named(names_.ground_truth);
    result_.text += "\n  ground truth: " + (truth == nullptr ? "none" : truth->type) + "\n";
  }

  const rosbag::Bag& bag_;
  const BagCheckTopics& names_;
  const BagSurvey survey_;
  BagCheck result_;
  bool is_missing_ = false;
};

}  // namespace

std::string BagCheck::verdict() const {
  return "ready for beacon_mcl: " + (problems.empty() ? "yes" : "no: " + joined(problems, "; "));
}

BagCheck check_bag(const rosbag::Bag& bag, const BagCheckTopics& topics) {
  return Checker(bag, topics).check();
}

}  // namespace pf_resampling
