#include "tools/common/batch_slam.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"

namespace pf_resampling {
namespace {

constexpr double kRobustSightingWidth = 2.0;  // standard deviations: misread ids are far off
constexpr double kOutlyingSighting = 4.0;     // standard deviations
// m or rad per sqrt(s): where none is stated for an axis, the problem would have no solution.
constexpr double kLeastNoise = 1e-4;

GaussianPrior prior_of(const BatchNoise& noise) {
  SensorConstants sigma = SensorConstants::Zero();
  sigma[SensorConstant::distance_scale] = noise.distance_scale;
  sigma[SensorConstant::turn_scale] = noise.yaw_scale;
  return prior_at(Pose2{}, sigma);
}

/// The data of a drive up to a time, as a graph. Its first pose is the origin.
class DriveAmongLandmarks {
 public:
  DriveAmongLandmarks(const Recording& recording, const BatchNoise& noise)
      : drive(
            recording.odometry, [this](double from, double to) { return motion_between(from, to); },
            prior_of(noise), kRobustSightingWidth),
        recording_(recording),
        noise_(noise),
        scans_(recording.scans) {
    const double begin = recording.odometry.front().time;
    const double end = recording.odometry.back().time;
    const auto is_of_no_use = [&](StampedScan& scan) {
      std::vector<SeenLandmark>& seen = scan.landmarks;
      seen.erase(std::remove_if(seen.begin(), seen.end(),
                                [](const SeenLandmark& landmark) {
                                  return landmark.id < 0 || !std::isfinite(landmark.range) ||
                                         !std::isfinite(landmark.bearing);
                                }),
                 seen.end());
      return seen.empty() || !(scan.time >= begin && scan.time <= end);
    };
    scans_.erase(std::remove_if(scans_.begin(), scans_.end(), is_of_no_use), scans_.end());
    if (scans_.empty()) {
      throw Error(
          "no landmark observation with an id, and no filter's path and map to say which landmark "
          "it is of: the batch solution needs one or the other");
    }
    std::stable_sort(scans_.begin(), scans_.end(),
                     [](const StampedScan& a, const StampedScan& b) { return a.time < b.time; });
    check_size(recording.odometry, times());
    std::set<std::int32_t> known;
    for (const StampedScan& scan : scans_) {
      for (const SeenLandmark& seen : scan.landmarks) known.insert(seen.id);
    }
    if (known.size() > kMostBatchLandmarks) {
      throw Error(std::to_string(known.size()) + " landmarks: the batch solution takes " +
                  std::to_string(kMostBatchLandmarks) +
                  " at most; give a part of the recording (rosbag filter)");
    }
  }
  DriveAmongLandmarks(const DriveAmongLandmarks&) = delete;
  DriveAmongLandmarks& operator=(const DriveAmongLandmarks&) = delete;

  /// From the newest pose.
  void see(const StampedScan& scan) {
    const auto sensor = recording_.frames.find(scan.frame);
    if (sensor == recording_.frames.end()) {
      throw Error("frame \"" + scan.frame + "\" of the landmarks is not connected to the robot: " +
                  "/tf_static in the bag has to connect it to base_link");
    }
    for (const SeenLandmark& seen : scan.landmarks) {
      const auto [landmark, is_new] = numbers_.emplace(seen.id, static_cast<int>(ids.size()));
      SightingFactor sighting;
      sighting.pose = drive.newest();
      sighting.landmark = landmark->second;
      sighting.range = seen.range;
      sighting.bearing = seen.bearing;
      const double range_sigma = noise_.range + noise_.range_share * seen.range;
      sighting.range_variance =
          seen.range_variance > 0.0 ? seen.range_variance : range_sigma * range_sigma;
      sighting.bearing_variance =
          seen.bearing_variance > 0.0 ? seen.bearing_variance : noise_.bearing * noise_.bearing;
      sighting.sensor = to_pose2(sensor->second);
      if (is_new) {
        ids.push_back(seen.id);
        drive.graph.landmarks.push_back(place_of(sighting));
      }
      drive.graph.sightings.push_back(sighting);
    }
  }

  /// Where a sighting has its landmark.
  Eigen::Vector2d place_of(const SightingFactor& sighting) const {
    const Pose2 from =
        compose(drive.graph.poses[static_cast<std::size_t>(sighting.pose)], sighting.sensor);
    const double direction = from.heading + sighting.bearing;
    return {from.x + sighting.range * std::cos(direction),
            from.y + sighting.range * std::sin(direction)};
  }

  /// Landmarks where the median of their sightings has them, which misread ids cannot carry away as
  /// they can the first.
  void place_landmarks() {
    std::vector<std::vector<double>> x(ids.size()), y(ids.size());
    for (const SightingFactor& sighting : drive.graph.sightings) {
      const Eigen::Vector2d place = place_of(sighting);
      x[static_cast<std::size_t>(sighting.landmark)].push_back(place.x());
      y[static_cast<std::size_t>(sighting.landmark)].push_back(place.y());
    }
    for (std::size_t l = 0; l < ids.size(); ++l) {
      drive.graph.landmarks[l] = {median(x[l]), median(y[l])};
    }
  }

  /// How many of the sightings from the pose `first` on are far from the estimate.
  int outliers(int first) const {
    int count = 0;
    for (auto s = drive.graph.sightings.rbegin();
         s != drive.graph.sightings.rend() && s->pose >= first; ++s) {
      const SightingResidual residual = sighting_residual(
          *s, drive.graph.noise, drive.graph.poses[static_cast<std::size_t>(s->pose)],
          drive.graph.landmarks[static_cast<std::size_t>(s->landmark)], drive.graph.constants);
      if (residual.value.norm() > kOutlyingSighting) ++count;
    }
    return count;
  }

  /// The odometry between two times.
  MotionFactor motion_between(double from, double to) const {
    MotionFactor motion;
    motion.mean = relative(pose_at(recording_.odometry, from), pose_at(recording_.odometry, to));
    const double duration = to - from;
    double along, across;
    double heading = noise_.heading * std::sqrt(duration);
    if (recording_.odometry_noise) {
      const StatedOdometryNoise& stated = *recording_.odometry_noise;
      const double root = std::sqrt(duration);
      along = std::max(stated.along, kLeastNoise) * root;
      across = std::max(stated.across, kLeastNoise) * root;
      heading = std::max(stated.heading, kLeastNoise) * root;
    } else {
      const double root = std::sqrt(std::hypot(motion.mean.x, motion.mean.y));
      const double standing = noise_.standing * std::sqrt(duration);
      along = std::hypot(noise_.along * root, standing);
      across = std::hypot(noise_.across * root, standing);
    }
    motion.covariance.diagonal() << along * along, across * across, heading * heading;
    // The chord leaves the old heading by half the turn: so it does when the turn is scaled.
    const double half = 0.5 * motion.mean.heading;
    motion.sensitivity.col(SensorConstant::distance_scale) << motion.mean.x, motion.mean.y, 0.0;
    motion.sensitivity.col(SensorConstant::turn_scale) << -half * motion.mean.y,
        half * motion.mean.x, motion.mean.heading;
    return motion;
  }

  const std::vector<StampedScan>& scans() const { return scans_; }
  /// Of the scans.
  std::vector<double> times() const {
    std::vector<double> times;
    for (const StampedScan& scan : scans_) times.push_back(scan.time);
    return times;
  }

  BatchDrive drive;
  std::vector<std::int32_t> ids;  ///< of the landmarks

 private:
  const Recording& recording_;
  BatchNoise noise_;
  std::vector<StampedScan> scans_;  // in order of time, with at least one landmark each
  std::map<std::int32_t, int> numbers_;
};

}  // namespace

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

BatchSolution solve_batch(const Recording& recording, const BatchNoise& noise) {
  DriveAmongLandmarks data(recording, noise);
  for (const StampedScan& scan : data.scans()) {
    data.drive.drive_to(scan.time);
    data.see(scan);
  }
  data.drive.drive_to(recording.odometry.back().time);
  data.place_landmarks();
  const SmoothingResult result = data.drive.solve_both_ways();
  if (result.fault != SmoothingFault::none) {
    throw Error("the batch solution failed: " + to_string(result.fault));
  }
  const SmoothingGraph& graph = data.drive.graph;
  BatchSolution solution;
  solution.path = data.drive.path_at(recording.odometry);
  for (std::size_t l = 0; l < data.ids.size(); ++l) {
    PointLandmark landmark;
    landmark.id = data.ids[l];
    landmark.position = graph.landmarks[l];
    solution.landmarks.push_back(landmark);
  }
  solution.distance_scale = 1.0 / (1.0 + graph.constants[SensorConstant::distance_scale]);
  solution.yaw_scale = 1.0 / (1.0 + graph.constants[SensorConstant::turn_scale]);
  solution.observations = static_cast<int>(graph.sightings.size());
  solution.outliers = data.outliers(0);
  return solution;
}

OnlineSolution solve_online(const Recording& recording, const BatchNoise& noise) {
  DriveAmongLandmarks data(recording, noise);
  return solve_along(
      recording.odometry, data.times(), [&](std::size_t i) { data.see(data.scans()[i]); },
      [&] { return data.outliers(data.drive.newest()) > 0; }, &data.drive);
}

}  // namespace pf_resampling
