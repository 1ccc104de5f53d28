// Least squares on all data of a drive, for evaluate_bag and survey_beacons: the path, and where
// landmarks are or what is wrong with radios.
#include <nav_msgs/Path.h>
#include <rosbag/view.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "beacon_mcl_node/beacon_checks.hpp"
#include "beacon_mcl_node/beacon_file.hpp"
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "tools/common/batch_slam.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/range_drive.hpp"
#include "tools/runs/bag_inputs.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

// s without odometry: after a longer time, it is the clock that was set.
constexpr double kLongestSilence = 3600.0;
// m, up to which what is seen may be a landmark of the map.
constexpr double kSameLandmark = 1.0;

/// Keeps what it would give its filter, which gets nothing.
template <typename Pipeline>
class Recorder : public Pipeline {
 public:
  using Pipeline::handle;
  using Pipeline::Pipeline;

  void handle(const nav_msgs::Odometry& message) {
    variances_ = to_stamped_odometry(message).velocity_variances;
    Pipeline::handle(message);
  }
  // These would start the filter anew.
  void handle(const geometry_msgs::PoseWithCovarianceStamped& /*initial_pose*/) {}
  void handle(const BeaconArray& message) {
    if (const auto wrong = check(message, this->options_.frames, this->options_.max_beacons)) {
      return this->reject("beacons", *wrong);
    }
    recording_.beacons = to_beacons(message);
  }

  /// All of a bag. Throws Error that says why, if nothing would be used.
  Recording record(const CommandLine& line, const rosbag::Bag& bag) {
    const auto inputs = bag_inputs(line, this->options_.frames.base, this);
    for_each_in_order({&bag}, bag.getFileName(), names_of(inputs), [&](const auto& instance) {
      hand_over(instance, inputs, this);
      note_odometry();
    });
    require_used(bag, *this);
    const Eigen::Vector3d sigmas = (squares_ / duration_).cwiseSqrt();
    if (sigmas.allFinite() && sigmas.maxCoeff() > 0.0) recording_.odometry_noise = sigmas;
    return recording_;
  }

 private:
  using Observations = typename Pipeline::Observations;

  void update_filter(const OdometryIncrement& odometry, const Observations& /*used*/) override {
    reached_ = compose(reached_, odometry.mean);
  }

  void note_observations(ros::Time stamp, const Observations& used, double /*duration*/) override {
    if constexpr (std::is_same_v<Observations, LandmarkScan>) {
      recording_.scans.push_back({stamp.toSec(), used.sensor, used.observations});
    } else {
      recording_.ranges.push_back({stamp.toSec(), used});
      // Stated or not, least squares finds how large the errors are.
      for (RangeObservation& each : recording_.ranges.back().ranges) each.variance = 0.0;
    }
  }

  void note_odometry() {
    if (this->odometry_.empty()) return;
    std::vector<StampedPose>& path = recording_.odometry;
    const double time = this->odometry_.newest().toSec();
    const double step = path.empty() ? 0.0 : time - path.back().time;
    if (!path.empty() && step == 0.0) return;
    if (step < 0.0 || step > kLongestSilence) {
      throw Error("the odometry jumps by " + seconds_text(step) + " after " +
                  seconds_text(path.back().time) +
                  ", as if the clock was set: give a part of the recording (rosbag filter)");
    }
    path.push_back({time, compose(reached_, this->odometry_.since().mean)});
    if (!variances_.allFinite()) return;
    // Each variance is that of the mean velocity since the message before.
    squares_ += step * step * variances_;
    duration_ += step;
  }

  Recording recording_;
  Pose2 reached_;  // with the odometry that is used, in the frame of the first
  Eigen::Vector3d variances_ = Eigen::Vector3d::Zero(), squares_ = Eigen::Vector3d::Zero();
  double duration_ = 0.0;  // s
};

/// Where no observation has an id: those of the nearest landmarks by a filter's last path and map.
/// Returns whether there is such a filter.
bool take_ids_of_filter(const rosbag::Bag& bag, Recording* recording) {
  for (const StampedScan& scan : recording->scans) {
    for (const RangeBearingObservation& seen : scan.landmarks) {
      if (seen.id >= 0) return false;
    }
  }
  std::vector<StampedPose> corrections;  // of the odometry, which knows the turns between poses
  std::vector<Landmark> map;
  const std::vector<std::string> topics = {"/path", "/landmark_map"};
  rosbag::View view(bag, rosbag::TopicQuery(topics));
  for (const rosbag::MessageInstance& instance : view) {
    if (const auto path = message_in<nav_msgs::Path>(instance)) {
      corrections.clear();
      for (const geometry_msgs::PoseStamped& pose : path->poses) {
        const double time = pose.header.stamp.toSec();
        const Pose2 back = relative(pose_at(recording->odometry, time), {});
        corrections.push_back({time, compose(to_pose2(pose.pose), back)});
      }
    }
    if (const auto latest = message_in<LandmarkMap>(instance)) map = latest->landmarks;
  }
  if (corrections.empty() || map.empty()) return false;
  for (StampedScan& scan : recording->scans) {
    const Pose2 robot =
        compose(pose_at(corrections, scan.time), pose_at(recording->odometry, scan.time));
    for (RangeBearingObservation& seen : scan.landmarks) {
      const Eigen::Vector2d place =
          place_seen(compose(robot, scan.sensor), seen.range, seen.bearing);
      double nearest = kSameLandmark;
      for (const Landmark& landmark : map) {
        const double distance =
            std::hypot(landmark.position.x - place.x(), landmark.position.y - place.y());
        if (distance > nearest) continue;
        nearest = distance;
        seen.id = landmark.id;
      }
    }
  }
  return true;
}

json to_json(const std::vector<StampedPose>& path) {
  json rows = json::array();
  for (const auto& [time, pose] : path) rows.push_back({time, pose.x, pose.y, pose.heading});
  return rows;
}

json to_json(const OnlineSolution& online) {
  return {
      {"path", to_json(online.path)}, {"solutions", online.solutions}, {"refused", online.refused}};
}

json row_of(int id, const Eigen::Vector2d& place,
            const Eigen::Matrix2d& covariance = Eigen::Matrix2d::Zero()) {
  return {id, place.x(), place.y(), covariance(0, 0), covariance(0, 1), covariance(1, 1)};
}

json solution_of_landmarks(const CommandLine& line, const rosbag::Bag& bag) {
  FastSlamPipelineOptions options;
  apply_filter_options(line, &options);
  options.filter = FastSlamPipelineOptions().filter;  // it takes what has ids and what has none
  options.map_file.clear();
  Recorder<FastSlamPipeline> recorder(options, {});
  Recording recording = recorder.record(line, bag);
  const bool has_ids_of_filter = take_ids_of_filter(bag, &recording);
  const BatchSolution solution = solve_batch(recording);
  json places = json::array();
  for (const PointLandmark& landmark : solution.landmarks) {
    places.push_back(row_of(landmark.id, landmark.position));
  }
  json result = {{"path", to_json(solution.path)},
                 {"landmarks", places},
                 {"distance_scale", solution.distance_scale},
                 {"yaw_scale", solution.yaw_scale},
                 {"observations", solution.observations},
                 {"outliers", solution.outliers},
                 {"ids", has_ids_of_filter ? "filter" : "observations"},
                 {"left_out", lines_of(recorder.rejects())},
                 {"ranges", nullptr}};
  if (line.get<bool>("online")) result["online"] = to_json(solve_online(recording));
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
      places.push_back(row_of(radio.id, place.position, place.covariance));
    }
  }
  for (const Beacon& beacon : listed) {
    known.push_back(row_of(beacon.id, beacon.position.head<2>()));
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

json solution_of_ranges(const CommandLine& line, const rosbag::Bag& bag) {
  BeaconMclPipelineOptions options;
  apply_filter_options(line, &options);
  options.filter = BeaconMclPipelineOptions().filter;
  options.filter.beacon_positions = BeaconPositions::estimated;  // it takes ranges to any beacon
  const std::vector<Beacon> configured = std::exchange(options.beacons, {});
  Recorder<BeaconMclPipeline> recorder(options, {});
  Recording drive = recorder.record(line, bag);
  if (!configured.empty()) drive.beacons = configured;
  if (line.get<bool>("unlisted")) drive.beacons.clear();
  const RangeSolution solution = solve_ranges(drive);
  const RangeMemory& memory = solution.memory;
  const RangeMemory::Newest newest = memory.newest(memory.modes().front());
  const std::string path = bag.getFileName();
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
  return {{"path", to_json(solution.path)},
          {"online", to_json(solution.online)},
          {"distance_scale", scale_of(CommonUnknown::distance_scale)},
          {"yaw_scale", scale_of(CommonUnknown::turn_scale)},
          {"observations", solution.ranges},
          {"outliers", solution.outliers},
          {"ids", "observations"},
          {"left_out", lines_of(recorder.rejects())},
          {"ranges",
           {{"radios", radios},
            {"remarks", remarks},
            {"sigma", memory.noise().range},
            {"translation_factor", memory.noise().translation},
            {"heading_factor", memory.noise().heading},
            {"yaw_rate_bias", newest.mean[KeyframeUnknown::yaw_rate_bias]}}},
          {"survey", survey_of(path.substr(path.rfind('/') + 1), memory, drive.beacons, newest)}};
}

int solve_drive(const std::vector<std::string>& arguments) {
  CommandLine line("solve_drive",
                   "The path, and landmarks or radios, that fit all data of a drive best at once "
                   "(batch least squares), for evaluate_bag and survey_beacons.\nIt takes what the "
                   "filter would take of the bag, and writes JSON: m, rad, s.");
  line.positional("in.bag", "bag to read");
  add_filter_options(&line);
  for (const char* input : {"odom", "imu", "ranges", "sensor-ranges", "beacons", "landmarks"}) {
    line.option<std::string>(input, "TOPIC", "as that of run_bag");
  }
  line.flag("by-ranges",
            "solve by ranges to beacons, as beacon_mcl; else by landmarks, as fastslam");
  line.flag("unlisted", "by ranges: look for all beacons, whatever bag and configuration list");
  line.flag("online", "by landmarks: also solve at every observation, with the data up to then");
  line.example("solve_drive mrclam.bag > mrclam.json");
  if (!line.parse(arguments)) return 0;
  const rosbag::Bag bag = open_bag(line.text("in.bag"));
  const json solution = line.get<bool>("by-ranges") ? solution_of_ranges(line, bag)
                                                    : solution_of_landmarks(line, bag);
  // What the bag's name says may be of any encoding.
  std::puts(solution.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("solve_drive", argc, argv, pf_resampling::solve_drive);
}
