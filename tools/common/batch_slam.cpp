#include "tools/common/batch_slam.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"

namespace pf_resampling {
namespace {

// s: between two poses of the graph the odometry turns by so little that its scales act on the
// chord.
constexpr double kLongestStep = 0.5;
constexpr double kOutlier = 4.0;  // standard deviations
// m or rad per sqrt(s): where none is stated for an axis, the problem would have no solution.
constexpr double kLeastNoise = 1e-4;
// The loss, in standard deviations, narrowed from solution to solution: at first every observation
// pulls, so that loops close from afar; at last misread ones hardly do.
constexpr std::array<double, 4> kLossWidths = {30.0, 10.0, 4.0, 2.0};
constexpr int kIterations = 100;

/// The data of a drive up to a time, as a graph. Its first pose is the origin.
class Drive {
 public:
  Drive(const BatchProblem& problem, const BatchNoise& noise)
      : problem_(problem), noise_(noise), scans_(problem.scans) {
    check_path(problem.odometry, "odometry");
    const double begin = problem.odometry.front().time;
    const double end = problem.odometry.back().time;
    if (!(end > begin)) throw Error("the odometry has no duration: it needs two stamps");
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
      throw Error("no landmark observation with an id: the batch solution needs known ids");
    }
    std::stable_sort(scans_.begin(), scans_.end(),
                     [](const StampedScan& a, const StampedScan& b) { return a.time < b.time; });
    SensorConstants sigma = SensorConstants::Zero();
    sigma[SensorConstant::distance_scale] = noise.distance_scale;
    sigma[SensorConstant::turn_scale] = noise.yaw_scale;
    graph.prior = prior_at(Pose2{}, sigma);
    graph.poses = {Pose2{}};
    times = {begin};
  }

  /// Poses up to `time`, by odometry as it is now believed; none is far from the next.
  void drive_to(double time) {
    const double last = times.back();
    const int steps = static_cast<int>(std::ceil((time - last) / kLongestStep));
    for (int step = 1; step <= steps; ++step) {
      const double next = step == steps ? time : last + (time - last) * step / steps;
      graph.motions.push_back(motion_between(times.back(), next));
      graph.poses.push_back(
          compose(graph.poses.back(), corrected_motion(graph.motions.back(), graph.constants)));
      times.push_back(next);
    }
  }

  /// From the newest pose.
  void see(const StampedScan& scan) {
    const auto sensor = problem_.sensors.find(scan.frame);
    if (sensor == problem_.sensors.end()) {
      throw Error("frame \"" + scan.frame + "\" of the landmarks is not connected to the robot: " +
                  "/tf_static in the bag has to connect it to base_link");
    }
    for (const SeenLandmark& seen : scan.landmarks) {
      const auto [landmark, is_new] = numbers_.emplace(seen.id, static_cast<int>(ids.size()));
      SightingFactor sighting;
      sighting.pose = static_cast<int>(graph.poses.size()) - 1;
      sighting.landmark = landmark->second;
      sighting.range = seen.range;
      sighting.bearing = seen.bearing;
      const double range_sigma = noise_.range + noise_.range_share * seen.range;
      sighting.range_variance =
          seen.range_variance > 0.0 ? seen.range_variance : range_sigma * range_sigma;
      sighting.bearing_variance =
          seen.bearing_variance > 0.0 ? seen.bearing_variance : noise_.bearing * noise_.bearing;
      sighting.sensor = sensor->second;
      if (is_new) {
        ids.push_back(seen.id);
        graph.landmarks.push_back(place_of(sighting));
      }
      graph.sightings.push_back(sighting);
    }
  }

  /// Where a sighting has its landmark.
  Eigen::Vector2d place_of(const SightingFactor& sighting) const {
    const Pose2 from =
        compose(graph.poses[static_cast<std::size_t>(sighting.pose)], sighting.sensor);
    const double direction = from.heading + sighting.bearing;
    return {from.x + sighting.range * std::cos(direction),
            from.y + sighting.range * std::sin(direction)};
  }

  /// Landmarks where the median of their sightings has them, which misread ids cannot carry away as
  /// they can the first.
  void place_landmarks() {
    std::vector<std::vector<double>> x(ids.size()), y(ids.size());
    for (const SightingFactor& sighting : graph.sightings) {
      const Eigen::Vector2d place = place_of(sighting);
      x[static_cast<std::size_t>(sighting.landmark)].push_back(place.x());
      y[static_cast<std::size_t>(sighting.landmark)].push_back(place.y());
    }
    for (std::size_t l = 0; l < ids.size(); ++l) {
      graph.landmarks[l] = {median(x[l]), median(y[l])};
    }
  }

  /// How many of the sightings from the pose `first` on are far from the estimate.
  int outliers(int first) const {
    int count = 0;
    for (auto s = graph.sightings.rbegin(); s != graph.sightings.rend() && s->pose >= first; ++s) {
      const SightingResidual residual = sighting_residual(
          *s, graph.noise, graph.poses[static_cast<std::size_t>(s->pose)],
          graph.landmarks[static_cast<std::size_t>(s->landmark)], graph.constants);
      if (residual.value.norm() > kOutlier) ++count;
    }
    return count;
  }

  /// The odometry between two times.
  MotionFactor motion_between(double from, double to) const {
    MotionFactor motion;
    motion.mean = relative(odometry_at(from), odometry_at(to));
    const double duration = to - from;
    double along, across;
    double heading = noise_.heading * std::sqrt(duration);
    if (problem_.odometry_noise) {
      const StatedOdometryNoise& stated = *problem_.odometry_noise;
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

  /// The oldest leave once there are half as many poses more than `window`.
  void bound(int window, double robust_width) {
    const int surplus = static_cast<int>(graph.poses.size()) - window;
    if (2 * surplus <= window || !forget_oldest(surplus, robust_width, &graph)) return;
    times.erase(times.begin(), times.begin() + surplus);
  }

  const std::vector<StampedScan>& scans() const { return scans_; }

  SmoothingGraph graph;
  std::vector<double> times;      ///< of the poses
  std::vector<std::int32_t> ids;  ///< of the landmarks

 private:
  Pose2 odometry_at(double time) const {
    return interpolate(problem_.odometry, time, std::numeric_limits<double>::infinity())->pose;
  }

  const BatchProblem& problem_;
  BatchNoise noise_;
  std::vector<StampedScan> scans_;  // in order of time, with at least one landmark each
  std::map<std::int32_t, int> numbers_;
};

SmoothingResult smooth_narrowing(SmoothingGraph* graph) {
  SmoothingResult result;
  for (const double width : kLossWidths) result = smooth({kIterations, width}, graph);
  return result;
}

/// With the final loss at once and with one that is narrowed; the better.
SmoothingResult smooth_both_ways(SmoothingGraph* graph) {
  SmoothingGraph narrowed = *graph;
  const SmoothingResult direct = smooth({kIterations, kLossWidths.back()}, graph);
  const SmoothingResult other = smooth_narrowing(&narrowed);
  if (other.fault != SmoothingFault::none) return direct;
  if (direct.fault == SmoothingFault::none && direct.cost <= other.cost) return direct;
  *graph = std::move(narrowed);
  return other;
}

EstimatedPose stamped(double time, const Pose2& pose) {
  EstimatedPose estimate;
  estimate.time = time;
  estimate.pose = pose;
  return estimate;
}

/// At each stamp of the odometry: from the pose before by the scaled odometry, and what is then
/// missing to the pose after, in proportion to the time.
std::vector<EstimatedPose> path_of(const Drive& drive, const std::vector<EstimatedPose>& odometry) {
  const SmoothingGraph& graph = drive.graph;
  const std::vector<double>& times = drive.times;
  std::vector<EstimatedPose> path;
  std::size_t before = 0;
  for (const EstimatedPose& stamp : odometry) {
    while (before + 2 < times.size() && times[before + 1] <= stamp.time) ++before;
    const auto by_odometry = [&](double time) {
      return compose(graph.poses[before],
                     corrected_motion(drive.motion_between(times[before], time), graph.constants));
    };
    const double share = (stamp.time - times[before]) / (times[before + 1] - times[before]);
    const Pose2 missing = relative(by_odometry(times[before + 1]), graph.poses[before + 1]);
    path.push_back(stamped(
        stamp.time, compose(by_odometry(stamp.time),
                            {share * missing.x, share * missing.y, share * missing.heading})));
  }
  return path;
}

}  // namespace

BatchSolution solve_batch(const BatchProblem& problem, const BatchNoise& noise) {
  Drive drive(problem, noise);
  for (const StampedScan& scan : drive.scans()) {
    drive.drive_to(scan.time);
    drive.see(scan);
  }
  drive.drive_to(problem.odometry.back().time);
  drive.place_landmarks();
  const SmoothingResult result = smooth_both_ways(&drive.graph);
  if (result.fault != SmoothingFault::none) {
    throw Error("the batch solution failed: " + to_string(result.fault));
  }
  const SmoothingGraph& graph = drive.graph;
  BatchSolution solution;
  solution.path = path_of(drive, problem.odometry);
  for (std::size_t l = 0; l < drive.ids.size(); ++l) {
    PointLandmark landmark;
    landmark.id = drive.ids[l];
    landmark.position = graph.landmarks[l];
    solution.landmarks.push_back(landmark);
  }
  solution.distance_scale = 1.0 / (1.0 + graph.constants[SensorConstant::distance_scale]);
  solution.yaw_scale = 1.0 / (1.0 + graph.constants[SensorConstant::turn_scale]);
  solution.observations = static_cast<int>(graph.sightings.size());
  solution.outliers = drive.outliers(0);
  return solution;
}

OnlineSolution solve_online(const BatchProblem& problem, const BatchNoise& noise, int window) {
  Drive drive(problem, noise);
  OnlineSolution solution;
  auto stamp = problem.odometry.begin();
  // Poses by odometry from the newest on, up to a time.
  const auto go_on = [&](const auto& is_before) {
    for (; stamp != problem.odometry.end() && is_before(stamp->time); ++stamp) {
      if (stamp->time - drive.times.back() > kLongestStep) drive.drive_to(stamp->time);
      const MotionFactor motion = drive.motion_between(drive.times.back(), stamp->time);
      solution.path.push_back(stamped(
          stamp->time,
          compose(drive.graph.poses.back(), corrected_motion(motion, drive.graph.constants))));
    }
  };
  for (const StampedScan& scan : drive.scans()) {
    go_on([&](double time) { return time < scan.time; });
    drive.drive_to(scan.time);
    drive.see(scan);
    SmoothingResult result = smooth({kIterations, kLossWidths.back()}, &drive.graph);
    const int newest = static_cast<int>(drive.graph.poses.size()) - 1;
    // A loop that closes from afar looks like a misread id at first.
    if (result.fault != SmoothingFault::none || drive.outliers(newest) > 0) {
      result = smooth_both_ways(&drive.graph);
    }
    ++solution.solutions;
    if (result.fault != SmoothingFault::none) ++solution.refused;
    drive.bound(window, kLossWidths.back());
  }
  go_on([](double) { return true; });
  return solution;
}

}  // namespace pf_resampling
