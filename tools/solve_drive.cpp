// Least squares on all data of a drive, for evaluate_bag and survey_beacons, which read the bag:
// the path, and where landmarks are or what is wrong with radios. JSON in, JSON out.
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "beacon_mcl_node/beacon_file.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/range_drive.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

/// As tools/evaluation/drive.py writes it.
Recording recording_of(const json& drive) {
  Recording recording;
  const json& odometry = drive.at("odometry");
  for (std::size_t i = 0; i < odometry.at("time").size(); ++i) {
    recording.odometry.push_back(
        {odometry["time"][i], {odometry["x"][i], odometry["y"][i], odometry["heading"][i]}});
  }
  const json& noise = drive.at("odometry_noise");
  if (!noise.is_null()) recording.odometry_noise = {noise[0], noise[1], noise[2]};
  for (const auto& [name, place] : drive.at("frames").items()) {
    recording.frames[name] = Eigen::Translation3d(place[0], place[1], place[2]) *
                             Eigen::AngleAxisd(place[3], Eigen::Vector3d::UnitZ());
  }
  for (const json& range : drive.at("ranges")) {
    recording.ranges.push_back({range[0], range[1], range[2], range[3]});
  }
  for (const json& beacon : drive.at("beacons")) {
    const bool is_planar = beacon[3].is_null();
    recording.beacons.push_back(
        {beacon[0], {beacon[1], beacon[2], is_planar ? 0.0 : beacon[3].get<double>()}, is_planar});
    recording.beacons.back().sigma = beacon[4];
  }
  for (const json& scan : drive.at("scans")) {
    recording.scans.push_back({scan[0], scan[1], {}});
    for (const json& seen : scan[2]) {
      recording.scans.back().landmarks.push_back({seen[0], seen[1], seen[2], seen[3], seen[4]});
    }
  }
  return recording;
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

json solution_of_landmarks(const Recording& recording, bool is_online) {
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
                 {"ranges", nullptr}};
  if (is_online) result["online"] = to_json(solve_online(recording));
  return result;
}

/// For people who look for radios.
json survey_of(const std::string& name, const RangeMemory& memory,
               const std::vector<Beacon>& listed, const RangeMemory::Newest& newest) {
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
  return {{"radios", lines},
          {"listed", known},
          {"places", places},
          {"constants", constants},  // mean and standard deviation, in the order above
          {"file", beacon_file(name, memory)}};
}

json solution_of_ranges(const Recording& drive, const std::string& name) {
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
          {"ranges",
           {{"radios", radios},
            {"remarks", remarks},
            {"sigma", memory.noise().range},
            {"translation_factor", memory.noise().translation},
            {"heading_factor", memory.noise().heading},
            {"yaw_rate_bias", newest.mean[KeyframeUnknown::yaw_rate_bias]}}},
          {"survey", survey_of(name, memory, drive.beacons, newest)}};
}

int solve_drive(const std::vector<std::string>& arguments) {
  CommandLine line("solve_drive",
                   "The path, and landmarks or radios, that fit all data of a drive best at once "
                   "(batch least squares).\nReads the drive from standard input, as "
                   "tools/evaluation/drive.py writes it, and writes JSON: m, rad, s.");
  if (!line.parse(arguments)) return 0;
  const json drive = json::parse(std::cin);
  const Recording recording = recording_of(drive);
  const json solution = drive.at("is_of_ranges")
                            ? solution_of_ranges(recording, drive.at("name"))
                            : solution_of_landmarks(recording, drive.at("online"));
  // What the bag's name says may be of any encoding.
  std::puts(solution.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("solve_drive", argc, argv, pf_resampling::solve_drive);
}
