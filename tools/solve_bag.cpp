// Least squares on all data of a drive, for evaluate_bag and survey_beacons: the path, and where
// landmarks are or what is wrong with radios, as JSON.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "beacon_mcl_node/beacon_file.hpp"
#include "beacon_mcl_node/pipeline_options.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/filter_associations.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/range_drive.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

CommandLine command_line() {
  CommandLine line("solve_bag",
                   "The path, and landmarks or radios, that fit all data of a drive best at once "
                   "(batch least squares), as JSON: m, rad, s. evaluate_bag and survey_beacons "
                   "print it for people.");
  line.positional("bag", "a bag with odometry, and landmarks or ranges");
  line.flag("online", "also solve at every scan of landmarks with the data up to then");
  line.flag("unlisted", "look for all beacons, whatever bag and configuration list");
  add_filter_options(&line);
  line.topic("odom", "/odom", "odometry");
  line.topic("landmarks", "/landmarks", "landmarks; 'none' for ranges");
  line.topic("ranges", "/ranges", "ranges, where nothing is in landmarks");
  line.topic("beacons", "/beacons", "beacons whose places are known, if any");
  line.example("solve_bag slam.bag > solution.json");
  return line;
}

json columns_of(const std::vector<StampedPose>& path) {
  json time = json::array(), x = json::array(), y = json::array(), heading = json::array();
  for (const StampedPose& pose : path) {
    time.push_back(pose.time);
    x.push_back(pose.pose.x);
    y.push_back(pose.pose.y);
    heading.push_back(pose.pose.heading);
  }
  return {{"time", time}, {"x", x}, {"y", y}, {"heading", heading}};
}

json to_json(const OnlineSolution& online) {
  return {{"path", columns_of(online.path)},
          {"solutions", online.solutions},
          {"refused", online.refused}};
}

/// Where no observation has an id: those of the landmarks that it is of by the filter's last path
/// and map. False if there are ids, or no such path and map.
bool take_ids_of_filter(const rosbag::Bag& bag, Recording* recording) {
  for (const StampedScan& scan : recording->scans) {
    for (const SeenLandmark& seen : scan.landmarks) {
      if (seen.id >= 0) return false;
    }
  }
  const auto path = read_path(bag, "/path");
  const auto map = read_landmark_map(bag, "/landmark_map");
  if (!path || path->empty() || !map || map->empty()) return false;
  recording->scans = associated_by({*path, *map}, *recording);
  return true;
}

json solution_of_landmarks(const rosbag::Bag& bag, const CommandLine& line) {
  const std::string odometry = line.topic("odom"), landmarks = line.topic("landmarks");
  require_topics(
      bag, bag.getFileName(),
      {{odometry, pose_types(), "--odom"}, {landmarks, landmark_types(), "--landmarks"}});
  Recording recording = read_recording(bag, odometry, "", landmarks);
  const bool has_ids_of_filter = take_ids_of_filter(bag, &recording);
  const BatchSolution solution = solve_batch(recording);
  json places = json::array();
  for (const PointLandmark& landmark : solution.landmarks) {
    places.push_back({landmark.id, landmark.position.x(), landmark.position.y()});
  }
  json result = {{"path", columns_of(solution.path)},
                 {"landmarks", places},
                 {"distance_scale", solution.distance_scale},
                 {"yaw_scale", solution.yaw_scale},
                 {"observations", solution.observations},
                 {"outliers", solution.outliers},
                 {"ids", has_ids_of_filter ? "filter" : "observations"},
                 {"ranges", nullptr}};
  if (line.get<bool>("online")) result["online"] = to_json(solve_online(recording));
  return result;
}

Recording drive_of(const rosbag::Bag& bag, const CommandLine& line) {
  BeaconMclPipelineOptions options;
  apply_filter_options(line, &options);
  const bool is_on_tf = options.odometry_input.source == OdometrySource::tf;
  const std::string odometry = is_on_tf ? "/tf" : line.topic("odom");
  const std::vector<std::string> types =
      is_on_tf ? std::vector<std::string>{"tf2_msgs/TFMessage"} : pose_types();
  require_topics(
      bag, bag.getFileName(),
      {{odometry, types, "--odom"}, {line.topic("ranges"), recorded_range_types(), "--ranges"}});
  Recording drive = read_recording(bag, odometry, line.topic("ranges"), "", options.frames);
  for (const auto& [frame, place] : options.antennas) {
    drive.frames[frame] = Eigen::Translation3d(place);
  }
  if (line.get<bool>("unlisted")) return drive;
  drive.beacons = options.beacons;
  if (drive.beacons.empty()) drive.beacons = read_beacons(bag, line.topic("beacons"));
  return drive;
}

/// For people who look for radios.
json survey_of(const std::string& bag, const RangeMemory& memory, const std::vector<Beacon>& listed,
               const RangeMemory::Newest& newest) {
  json lines = json::array(), known = json::array(), places = json::array(),
       constants = json::array();
  for (const RadioKnowledge& radio : memory.radios()) {
    const std::string remark = remark_on(radio, listed);
    lines.push_back(remark.empty() ? place_in_words(radio) : remark);
    if (radio.account == RadioAccount::as_listed) continue;
    for (const RadioPlace& place : radio.places) {
      const Eigen::Matrix2d& covariance = place.covariance;
      places.push_back({{"id", radio.id},
                        {"x", place.position.x()},
                        {"y", place.position.y()},
                        {"covariance", {covariance(0, 0), covariance(0, 1), covariance(1, 1)}}});
    }
  }
  for (const Beacon& beacon : listed) {
    known.push_back({{"id", beacon.id}, {"x", beacon.position.x()}, {"y", beacon.position.y()}});
  }
  constexpr int kConstants = KeyframeUnknown::count;
  for (const int at :
       {kConstants + CommonUnknown::distance_scale, kConstants + CommonUnknown::turn_scale,
        static_cast<int>(KeyframeUnknown::yaw_rate_bias), kConstants + CommonUnknown::lever_x,
        kConstants + CommonUnknown::lever_x + 1, kConstants + CommonUnknown::lever_x + 2}) {
    constants.push_back({newest.mean[at], std::sqrt(newest.covariance(at, at))});
  }
  const std::string name = bag.substr(bag.find_last_of('/') + 1);
  return {{"radios", lines},
          {"listed", known},
          {"places", places},
          {"constants", constants},  // mean and standard deviation, in the order above
          {"file", beacon_file(name, memory)}};
}

json solution_of_ranges(const rosbag::Bag& bag, const CommandLine& line) {
  const Recording drive = drive_of(bag, line);
  const RangeSolution solution = solve_ranges(drive);
  const RangeMemory& memory = solution.memory;
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  json radios = json::array(), remarks = json::array();
  for (const RadioKnowledge& radio : memory.radios()) {
    if (radio.ranges > 0) {
      radios.push_back({{"beacon", radio.id},
                        {"scale", radio.calibration.scale},
                        {"bias", radio.calibration.bias}});
    }
    const std::string remark = remark_on(radio, drive.beacons);
    if (!remark.empty()) remarks.push_back(remark);
  }
  const auto scale_of = [&](CommonUnknown::Index of) {
    return 1.0 + newest.mean[KeyframeUnknown::count + of];
  };
  return {{"path", columns_of(solution.path)},
          {"online", to_json(solution.online)},
          {"distance_scale", scale_of(CommonUnknown::distance_scale)},
          {"yaw_scale", scale_of(CommonUnknown::turn_scale)},
          {"observations", solution.ranges},
          {"outliers", solution.outliers},
          {"ids", "observations"},
          {"ranges",
           {{"radios", radios},
            {"remarks", remarks},
            {"sigma", memory.noise().range},
            {"translation_factor", memory.noise().translation},
            {"heading_factor", memory.noise().heading},
            {"yaw_rate_bias", newest.mean[KeyframeUnknown::yaw_rate_bias]}}},
          {"survey", survey_of(bag.getFileName(), memory, drive.beacons, newest)}};
}

int solve_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const rosbag::Bag bag = open_bag(line.text("bag"));
  const json solution = naming(line.text("bag"), [&] {
    const bool is_of_ranges =
        line.text("landmarks") == "none" ||
        (!has_topic(bag, line.topic("landmarks")) && has_topic(bag, line.topic("ranges")));
    return is_of_ranges ? solution_of_ranges(bag, line) : solution_of_landmarks(bag, line);
  });
  // What a bag or its name says may be of any encoding.
  std::puts(solution.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("solve_bag", argc, argv, pf_resampling::solve_bag);
}
