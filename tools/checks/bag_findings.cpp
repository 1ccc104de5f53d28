#include "tools/checks/bag_findings.hpp"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <utility>

#include "tools/checks/bag_survey.hpp"
#include "tools/checks/bag_tables.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {

namespace {

constexpr double kLongDelay = 1.0;  // s, between stamp and bag time
constexpr double kUpright = 0.9;    // how far a sensor's z axis may be off the robot's: cosine
const char* const kBeaconsType = "pf_resampling/BeaconArray";

using Lines = std::vector<std::string>;

std::string listed(const std::set<std::string>& words) {
  return joined(Lines(words.begin(), words.end()), ", ");
}

std::string quoted(const std::string& frame) {
  return "'" + frame + "'";
}

class Checker {
 public:
  Checker(const rosbag::Bag& bag, const CheckedTopics& names,
          const CheckedConfiguration& configuration)
      : bag_(bag),
        names_(names),
        configuration_(configuration),
        survey_(survey_bag(bag, names, configuration)) {
    for (const std::string& given : configuration.words) settings_ += " " + shell_word(given);
  }

  BagFindings check() {
    if (!configuration_.beacon_mcl_fault.empty()) {
      beacon_mcl()->push_back(configuration_.beacon_mcl_fault);
    }
    if (!configuration_.fastslam_fault.empty()) {
      fastslam()->push_back(configuration_.fastslam_fault);
    }
    check_presence();
    for (const TopicSurvey* topic :
         {&survey_.odom, &survey_.ranges, &survey_.landmarks, &survey_.truth}) {
      check_topic(*topic);
    }
    check_odometry();
    check_times(survey_.ranges, beacon_mcl());
    check_times(survey_.landmarks, fastslam());
    check_frames();
    check_beacons();
    check_landmarks();
    result_.text = tables_of(bag_, names_, survey_);
    result_.beacon_mcl.command = command("beacon_mcl");
    result_.fastslam.command = command("fastslam");
    return std::move(result_);
  }

 private:
  Lines* beacon_mcl() { return &result_.beacon_mcl.problems; }
  Lines* fastslam() { return &result_.fastslam.problems; }
  void remark(const std::string& text) { result_.remarks.push_back(text); }

  /// Options that could mend a verdict; each once.
  void advise(const Lines& words, FilterVerdict* verdict) {
    const auto& known = verdict->advice;
    if (std::search(known.begin(), known.end(), words.begin(), words.end()) != known.end()) return;
    verdict->advice.insert(verdict->advice.end(), words.begin(), words.end());
    ++verdict->advised;
  }

  /// "no /odom ..., /robot/odom could be it".
  void need(const std::string& name, const Lines& types, const std::string& role,
            const std::vector<FilterVerdict*>& by, const std::string& instead = "") {
    const BagTopic* topic = survey_.topic_named(name);
    const auto fits = [&](const BagTopic& other) {
      return std::find(types.begin(), types.end(), other.type) != types.end();
    };
    if (topic != nullptr && fits(*topic)) return;
    std::string problem = topic == nullptr ? "no " + name : name + " is a " + topic->type;
    problem += " (needed: " + types.front() + ")";
    bool is_first = true;
    for (const BagTopic& other : survey_.topics) {
      // Ground truth and what filters say are poses, too.
      const bool is_output = other.name == names_.ground_truth || other.name == "/pose" ||
                             other.name == "/initialpose" || other.name == "/amcl_pose";
      if (!fits(other) || other.name == name || is_output) continue;
      if (instead.empty() && std::exchange(is_first, false)) {
        for (FilterVerdict* verdict : by) advise({"--" + role, other.name}, verdict);
      }
      problem += ", " + other.name + " could be it (--" + role + " " + other.name +
                 "; for the node " + role + ":=" + other.name + ")";
    }
    for (FilterVerdict* verdict : by) verdict->problems.push_back(problem + instead);
  }

  void check_presence() {
    FilterVerdict* const beacon_mcl = &result_.beacon_mcl;
    FilterVerdict* const fastslam = &result_.fastslam;
    if (configuration_.odometry_source() == OdometrySource::topic) {
      need(names_.odom, odometry_types(), "odom", {beacon_mcl, fastslam}, odometry_on_tf());
    } else if (survey_.odom.stamps.summary().messages == 0) {
      const std::string problem = "nothing on /tf says where " +
                                  quoted(configuration_.frames().base) + " is in " +
                                  quoted(configuration_.frames().odom);
      beacon_mcl->problems.push_back(problem);
      fastslam->problems.push_back(problem);
    }
    check_imu();
    if (survey_.ranges.topic == names_.ranges) {
      std::string instead;
      for (const BagTopic& topic : survey_.topics) {
        if (topic.type != "sensor_msgs/Range") continue;
        if (instead.empty() && survey_.topic_named(names_.ranges) == nullptr) {
          advise({"--sensor-ranges", topic.name}, beacon_mcl);
        }
        instead += ", " + topic.name + " could be it (--sensor-ranges " + topic.name +
                   "; for the node sensor_ranges:=" + topic.name + ")";
      }
      need(names_.ranges, range_types(), "ranges", {beacon_mcl}, instead);
    } else {
      for (const std::string& frame : survey_.unnamed) {
        remark(survey_.ranges.topic + ": frame " + quoted(frame) +
               " does not name a beacon: change range_input/frame_pattern to fit it, or give it as "
               "`frame` in the list `beacons`");
      }
    }
    if (configuration_.beacon_mcl.beacons.empty()) {
      need(names_.beacons, {kBeaconsType}, "beacons", {beacon_mcl},
           " (or give the beacons in the configuration: --config beacons.yaml)");
    } else if (survey_.topic_named(names_.beacons) != nullptr) {
      remark(names_.beacons + " is ignored: the configuration has beacons");
    }
    if (!survey_.with_tags) {
      need(names_.landmarks, landmark_types(), "landmarks", {fastslam}, tags_instead());
    } else if (survey_.seen.scans == 0 && survey_.topic_named(names_.landmarks) == nullptr) {
      fastslam->problems.push_back(
          survey_.tag_fault.empty()
              ? "no " + names_.landmarks + ", and no frame in /tf has a name that fits " +
                    "landmark_input/tag_pattern " + configuration_.fastslam.tag_pattern
              : survey_.tag_fault);
    }
  }

  /// Transforms that could be odometry, where there is no such topic.
  std::string odometry_on_tf() {
    const BagTopic* topic = survey_.topic_named(names_.odom);
    for (const BagTopic& other : survey_.topics) {
      if (other.type == "nav_msgs/Odometry" && other.name != names_.ground_truth) return "";
    }
    if (topic != nullptr) return "";
    const FrameNames& frames = configuration_.frames();
    for (const auto& [parent, child] : survey_.transforms) {
      const bool is_named = child == frames.base || child == "base_footprint";
      if (!is_named || parent == frames.map) continue;
      Lines words = {"--set", "odometry_input/source=tf"};
      if (parent != frames.odom) words.insert(words.end(), {"--set", "frames/odom=" + parent});
      if (child != frames.base) words.insert(words.end(), {"--set", "frames/base=" + child});
      for (FilterVerdict* verdict : {&result_.beacon_mcl, &result_.fastslam}) {
        advise(words, verdict);
      }
      std::string text = ", " + quoted(parent) + " -> " + quoted(child) + " on /tf could be it (";
      for (const std::string& word : words)
        text += (&word == &words.front() ? "" : " ") + shell_word(word);
      return text + ")";
    }
    return "";
  }

  void check_imu() {
    if (configuration_.uses_imu()) {
      need(names_.imu, {"sensor_msgs/Imu"}, "imu", {&result_.beacon_mcl, &result_.fastslam});
      return;
    }
    for (const BagTopic& topic : survey_.topics) {
      if (topic.type != "sensor_msgs/Imu") continue;
      const std::string option =
          topic.name == CheckedTopics().imu ? "" : "--imu " + topic.name + " ";
      remark(
          topic.name + " is an IMU: " + option +
          "--set odometry_input/imu_heading=yaw_rate lets the robot turn as it says; orientation "
          "where it has a good one");
    }
  }

  /// What frames with a number in /tf could be, as detectors of tags publish them.
  std::string tags_instead() {
    if (survey_.topic_named(names_.landmarks) != nullptr) return "";
    static const std::regex kNumbered("(.*\\D)(\\d+)");
    for (const auto& [parent, child] : survey_.transforms) {
      std::smatch match;
      const bool is_seen = parent != "map" && survey_.odom.frames.count(parent) == 0 &&
                           survey_.base_frames.count(parent) == 0;
      if (!is_seen || !std::regex_match(child, match, kNumbered)) continue;
      const std::string setting = "landmark_input/tag_pattern=" + match[1].str() + "(\\d+)";
      advise({"--set", setting}, &result_.fastslam);
      return ", " + quoted(child) + " on /tf could be a tag (--set " + shell_word(setting) + ")";
    }
    return "";
  }

  /// Stamps and numbers of one topic.
  void check_topic(const TopicSurvey& check) {
    const StampSummary stamps = check.stamps.summary();
    const auto count = [&](std::size_t messages, const std::string& what) {
      if (messages > 0) remark(check.topic + ": " + std::to_string(messages) + " " + what);
    };
    const BagTopic* topic = survey_.topic_named(check.topic);
    if (topic != nullptr && topic->messages > stamps.messages) {
      count(topic->messages - stamps.messages,
            "messages have a type or version that cannot be read");
    }
    count(stamps.zero, "messages without a stamp");
    count(stamps.impossible,
          "stamps that ROS cannot reckon with (of 2038 or later, or 1e9 nanoseconds or more)");
    count(stamps.out_of_order, "stamps are older than the one before");
    count(stamps.twice, "stamps appear twice");
    count(check.not_finite, "values are not finite");
    count(check.impossible, &check == &survey_.ranges || &check == &survey_.landmarks
                                ? "ranges are not positive or variances negative"
                                : "orientations are not unit quaternions");
    if (stamps.largest_delay > kLongDelay) {
      remark(check.topic + ": stamps and bag times differ by up to " +
             fixed(stamps.largest_delay, 3) + " s");
    }
    const bool is_sensor = &check == &survey_.ranges || &check == &survey_.landmarks;
    if (check.frames.size() > 1 && !is_sensor) {
      remark(check.topic + ": several frames: " + listed(check.frames));
    }
  }

  static std::string no_stamps(const StampSummary& stamps) {
    return stamps.impossible == 0 ? " has no stamps" : " has no stamps that can be used";
  }

  void check_odometry() {
    const StampSummary odom = survey_.odom.stamps.summary();
    const auto problem = [&](const std::string& what) {
      beacon_mcl()->push_back(survey_.odom.topic + what);
      fastslam()->push_back(survey_.odom.topic + what);
    };
    if (odom.messages > 0 && odom.usable() == 0) problem(no_stamps(odom));
    if (odom.messages > 0 && survey_.odom.not_finite + survey_.odom.impossible >= odom.messages) {
      problem(" has no pose that can be used");
    }
    if (survey_.base_frames.count("") > 0) problem(" names no child_frame_id");
    if (survey_.odom.frames.count("") > 0) problem(" names no frame_id");
  }

  /// Whether the odometry is of the time of the ranges, or of the landmarks.
  void check_times(const TopicSurvey& seen, Lines* problems) {
    const StampSummary odom = survey_.odom.stamps.summary();
    const StampSummary stamps = seen.stamps.summary();
    if (stamps.messages > 0 && stamps.usable() == 0) {
      problems->push_back(seen.topic + no_stamps(stamps));
    }
    if (stamps.rate() <= 0.0 || odom.rate() <= 0.0) return;
    if (stamps.last < odom.first || stamps.first > odom.last) {
      problems->push_back(survey_.odom.topic + " and " + seen.topic + " are of different times");
    } else if (stamps.first < odom.first - 1.0 || stamps.last > odom.last + 1.0) {
      remark(survey_.odom.topic + " does not cover all of " + seen.topic);
    }
  }

  void check_frames() {
    check_sensor_frames(survey_.ranges, "antennas", beacon_mcl());
    check_sensor_frames(survey_.landmarks, "sensors", fastslam());
    const auto expect = [&](const std::set<std::string>& frames, const std::string& usual,
                            const std::string& parameter) {
      for (const std::string& frame : frames) {
        if (frame.empty() || frame == usual) continue;
        remark("frame " + quoted(frame) + " instead of " + quoted(usual) + ": set the parameter " +
               parameter + " to it");
        if (frames.size() == 1) settings_ += " --set " + shell_word(parameter + "=" + frame);
      }
    };
    const FrameNames& configured = configuration_.frames();
    expect(survey_.odom.frames, configured.odom, "frames/odom");
    expect(survey_.base_frames, configured.base, "frames/base");
    expect({survey_.beacon_frame}, configured.map, "frames/map");
    for (const auto& [parent, child] : survey_.transforms) {
      if (survey_.odom.frames.count(child) > 0) {
        remark("/tf places " + quoted(child) + " in " + quoted(parent) +
               ": that is from another localization; leave it out when you play the bag");
      }
    }
    if (!survey_.beacon_frame.empty() && !survey_.truth.frames.empty() &&
        survey_.truth.frames.count(survey_.beacon_frame) == 0) {
      remark(names_.beacons + " is in " + quoted(survey_.beacon_frame) + ", " +
             names_.ground_truth + " in " + listed(survey_.truth.frames));
    }
  }

  void check_sensor_frames(const TopicSurvey& seen, const std::string& list, Lines* problems) {
    for (const std::string& frame : seen.frames) {
      if (!survey_.places_on_robot(frame)) {
        problems->push_back(seen.topic + ": nothing in /tf_static places its frame " +
                            quoted(frame) + " on " + quoted(survey_.base) +
                            " (or give it in the list `" + list + "` of the configuration)");
        continue;
      }
      const auto place = survey_.on_robot.find(frame);
      if (&seen == &survey_.landmarks && !survey_.with_tags && place != survey_.on_robot.end() &&
          place->second.linear()(2, 2) < kUpright) {
        problems->push_back(seen.topic + ": the z axis of its frame " + quoted(frame) +
                            " does not point up, so bearings are not in the plane");
      }
    }
  }

  void check_beacons() {
    if (survey_.ranges_by_beacon.empty() && survey_.ranges.stamps.summary().messages > 0) {
      beacon_mcl()->push_back(survey_.ranges.topic + " has no range that can be used");
    }
    const bool is_configured = !configuration_.beacon_mcl.beacons.empty();
    if (survey_.topic_named(names_.beacons) == nullptr && !is_configured) return;
    const std::string where = is_configured ? "the configuration" : names_.beacons;
    for (const std::int32_t id : survey_.beacons_twice) {
      beacon_mcl()->push_back("beacon " + std::to_string(id) + " is there twice in " + where);
    }
    for (const auto& [id, position] : survey_.beacons) {
      // A height that is not a number says: as high as the antenna.
      const double height = std::isnan(position.z) ? 0.0 : position.z;
      if (std::isfinite(position.x + position.y + height)) continue;
      beacon_mcl()->push_back("the position of beacon " + std::to_string(id) + " is not finite");
    }
    Lines unknown;
    std::size_t known = 0;
    for (const auto& [id, ranges] : survey_.ranges_by_beacon) {
      if (survey_.beacons.count(id) > 0) {
        ++known;
      } else {
        unknown.push_back(std::to_string(id));
      }
    }
    if (!unknown.empty()) {
      remark("ranges to beacons that are not in " + where + ": " + joined(unknown, ", "));
    }
    if (known == 0 && !survey_.ranges_by_beacon.empty()) {
      beacon_mcl()->push_back("no range is to a beacon of " + where);
    } else if (known > 0 && known < 3) {
      remark("ranges to only " + std::to_string(known) +
             " known beacons: the pose may stay ambiguous");
    }
  }

  void check_landmarks() {
    const LandmarkSurvey& seen = survey_.seen;
    if (seen.scans == 0) return;
    if (seen.ranges.empty()) {
      fastslam()->push_back(survey_.landmarks.topic + " has no observation that can be used");
      return;
    }
    const std::size_t with_id = seen.with_id();
    if (with_id == 0) {
      remark(survey_.landmarks.topic +
             ": without ids; the filter finds out which landmark is which by where they are");
    } else if (with_id < seen.ranges.size()) {
      remark(survey_.landmarks.topic + ": " + std::to_string(seen.ranges.size() - with_id) +
             " of " + std::to_string(seen.ranges.size()) +
             " observations have no id and are rejected while ids are used (association/method "
             "mutual_exclusion takes all observations and ignores ids)");
    }
    if (with_id > 0 && seen.seen_once() == seen.by_id.size()) {
      remark(survey_.landmarks.topic +
             ": no id is seen twice, so no landmark can correct the odometry (association/method "
             "mutual_exclusion ignores ids)");
    }
  }

  /// What runs a filter on this bag.
  std::string command(const std::string& filter) const {
    const CheckedTopics usual;
    std::string text = "rosrun pf_resampling run_bag " + filter + " " +
                       shell_word(bag_.getFileName()) + " out.bag";
    const auto option = [&](const char* name, const std::string& topic,
                            const std::string& default_topic) {
      if (topic != default_topic) text += std::string(" --") + name + " " + shell_word(topic);
    };
    option("odom", names_.odom, usual.odom);
    option("imu", names_.imu, usual.imu);
    if (filter == "fastslam") {
      option("landmarks", names_.landmarks, usual.landmarks);
    } else {
      option("ranges", names_.ranges, usual.ranges);
      option("sensor-ranges", names_.sensor_ranges, usual.sensor_ranges);
      option("beacons", names_.beacons, usual.beacons);
    }
    return text + settings_;
  }

  const rosbag::Bag& bag_;
  const CheckedTopics& names_;
  const CheckedConfiguration& configuration_;
  const BagSurvey survey_;
  std::string settings_;  // options of run_bag: those given, and for frames of other names
  BagFindings result_;
};

}  // namespace

std::string FilterVerdict::text() const {
  return "ready for " + filter + ": " + (is_ready() ? "yes" : "no: " + joined(problems, "; "));
}

BagFindings findings_of(const rosbag::Bag& bag, const CheckedTopics& topics,
                        const CheckedConfiguration& configuration) {
  return Checker(bag, topics, configuration).check();
}

CheckedConfiguration configuration_of(const CommandLine& line) {
  CheckedConfiguration configuration;
  const auto apply_to = [&](auto* options, std::string* fault) {
    try {
      apply_filter_options(line, options);
    } catch (const Error& error) {
      *fault = error.what();
    }
  };
  apply_to(&configuration.beacon_mcl, &configuration.beacon_mcl_fault);
  apply_to(&configuration.fastslam, &configuration.fastslam_fault);
  if (!configuration.beacon_mcl_fault.empty() && !configuration.fastslam_fault.empty()) {
    throw Error("beacon_mcl: " + configuration.beacon_mcl_fault +
                "; fastslam: " + configuration.fastslam_fault);
  }
  for (const char* option : {"config", "set"}) {
    if (!line.has(option)) continue;
    for (const std::string& value : line.get<std::vector<std::string>>(option)) {
      configuration.words.insert(configuration.words.end(), {std::string("--") + option, value});
    }
  }
  return configuration;
}

std::string shell_word(const std::string& text) {
  const bool is_plain = text.find_first_of(" '\"$&;()<>|*?\\`!#") == std::string::npos;
  return is_plain ? text : "'" + text + "'";
}

}  // namespace pf_resampling
