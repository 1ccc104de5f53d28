#include "tools/checks/bag_findings.hpp"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <utility>

#include "tools/checks/bag_survey.hpp"
#include "tools/checks/dry_run.hpp"
#include "tools/checks/units.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/text.hpp"

namespace pf_resampling {

namespace {

constexpr double kLongDelay = 1.0;  // s, between stamp and bag time
constexpr double kLongGap = 1.5;    // s, without odometry; recordings pause for a second
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
    for (const TopicSurvey* topic : {&survey_.odom, &survey_.ranges, &survey_.landmarks}) {
      const double delay = topic->largest_delay;
      if (delay > kLongDelay) {
        remark(topic->topic + ": stamps and bag times differ by up to " + fixed(delay, 3) + " s");
      }
    }
    check_frames();
    check_odometry();
    check_beacons();
    if (beacon_mcl()->empty()) {
      take(dry_run(bag_, names_, configuration_.beacon_mcl), &result_.beacon_mcl);
    }
    if (fastslam()->empty()) {
      const DryRun run = dry_run(bag_, names_.of_fastslam(), configuration_.fastslam);
      take(run, &result_.fastslam);
      check_landmarks(run.seen);
    }
    result_.beacon_mcl.command = command("beacon_mcl");
    result_.fastslam.command = command("fastslam");
    return std::move(result_);
  }

 private:
  Lines* beacon_mcl() { return &result_.beacon_mcl.problems; }
  Lines* fastslam() { return &result_.fastslam.problems; }
  void remark(const std::string& text) {
    auto& known = result_.remarks;
    if (std::find(known.begin(), known.end(), text) == known.end()) known.push_back(text);
  }

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
    } else if (survey_.base_frames.empty()) {
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
    }
    if (configuration_.beacon_mcl.beacons.empty()) {
      need(names_.beacons, {kBeaconsType}, "beacons", {beacon_mcl},
           " (or give the beacons in the configuration: --config beacons.yaml)");
    } else if (survey_.topic_named(names_.beacons) != nullptr) {
      remark(names_.beacons + " is ignored: the configuration has beacons");
    }
    if (configuration_.fastslam.tag_pattern.empty()) {
      need(names_.landmarks, landmark_types(), "landmarks", {fastslam}, tags_instead());
    } else if (survey_.landmarks.frames.empty() &&
               survey_.topic_named(names_.landmarks) == nullptr) {
      fastslam->problems.push_back("no " + names_.landmarks +
                                   ", and no frame in /tf has a name that fits "
                                   "landmark_input/tag_pattern " +
                                   configuration_.fastslam.tag_pattern);
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
      remark(topic.name + " is an IMU: " + option +
             "--set odometry_input/imu_heading=yaw_rate takes the turns from it, orientation its "
             "heading, if it has a good one");
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

  void check_odometry() {
    if (survey_.base_frames.count("") > 0) {
      remark(survey_.odom.topic + " names no child_frame_id: it is taken as that of " +
             quoted(configuration_.frames().base) + " (frames/base)");
    }
    if (survey_.odom.longest_gap > kLongGap) {
      remark(survey_.odom.topic + ": nothing came for " + fixed(survey_.odom.longest_gap, 3) +
             " s after " + fixed(survey_.odom.longest_gap_at, 3) + " s");
    }
    if (survey_.turns.in_degrees()) {
      remark(survey_.odom.topic +
             ": it turns about 57 times as much as its path: is the heading in degrees? It has to "
             "be in radians");
    }
  }

  void take(const DryRun& run, FilterVerdict* verdict) {
    if (run.used == 0) {
      verdict->problems.push_back(run.why_none);
      return;
    }
    for (const std::string& line : run.remarks) remark(line);
  }

  void check_frames() {
    const auto expect = [&](const std::set<std::string>& frames, std::string FrameNames::*name,
                            const std::string& parameter) {
      const std::string usual = configuration_.frames().*name;
      for (const std::string& frame : frames) {
        if (frame.empty() || frame == usual) continue;
        remark("frame " + quoted(frame) + " instead of " + quoted(usual) + ": set the parameter " +
               parameter + " to it");
        if (frames.size() > 1) continue;
        settings_ += " --set " + shell_word(parameter + "=" + frame);
        configuration_.beacon_mcl.frames.*name = frame;
        configuration_.fastslam.frames.*name = frame;
      }
    };
    expect(survey_.odom.frames, &FrameNames::odom, "frames/odom");
    expect(survey_.base_frames, &FrameNames::base, "frames/base");
    expect({survey_.beacon_frame}, &FrameNames::map, "frames/map");
    for (const auto& [parent, child] : survey_.transforms) {
      if (survey_.odom.frames.count(child) > 0) {
        remark("/tf places " + quoted(child) + " in " + quoted(parent) +
               ": that is from another localization; leave it out when you play the bag");
      }
    }
  }

  void check_beacons() {
    std::set<std::int32_t> known;
    for (const TimedRange& range : survey_.timed_ranges) {
      if (survey_.beacons.count(range.beacon) > 0) known.insert(range.beacon);
    }
    if (!known.empty() && known.size() < 3) {
      remark("ranges to only " + std::to_string(known.size()) +
             " known beacons: the pose may stay ambiguous");
    }
    if (const auto unit = unit_of_ranges(survey_.timed_ranges, survey_.beacons)) {
      beacon_mcl()->push_back(survey_.ranges.topic + ": ranges are about " + unit->times +
                              " for the distances between the beacons, as if " + unit->as_if +
                              ": both have to be in metres");
    }
    const auto& antennas = configuration_.beacon_mcl.antennas;
    const bool is_used = std::any_of(antennas.begin(), antennas.end(), [&](const auto& antenna) {
      return survey_.ranges.frames.count(antenna.first) > 0;
    });
    if (!antennas.empty() && !is_used && !survey_.ranges.frames.empty()) {
      const std::string& first = antennas.begin()->first;
      remark("the list `antennas` places " + quoted(first) + ", but " + survey_.ranges.topic +
             " is measured from " + listed(survey_.ranges.frames) + ": --set range_input/antenna=" +
             first + " says that it is (for drivers that name no frame)");
    }
  }

  void check_landmarks(const LandmarkSurvey& seen) {
    if (seen.observations == 0) return;
    if (seen.by_id.empty()) {
      remark(survey_.landmarks.topic +
             ": without ids; the filter associates them by their positions");
    }
    const auto is_seen_once = [](const auto& landmark) { return landmark.second == 1; };
    if (!seen.by_id.empty() && std::all_of(seen.by_id.begin(), seen.by_id.end(), is_seen_once)) {
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
  CheckedConfiguration configuration_;
  const BagSurvey survey_;
  std::string settings_;  // options of run_bag: those given, and for frames of other names
  BagFindings result_;
};

}  // namespace

FastSlamTopics CheckedTopics::of_fastslam() const {
  FastSlamTopics topics;
  topics.odom = odom;
  topics.imu = imu;
  topics.landmarks = landmarks;
  return topics;
}

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
