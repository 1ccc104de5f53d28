#include "tools/common/batch_slam.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"

namespace pf_resampling {
namespace {

constexpr double kRobustSightingWidth = 2.0;  // standard deviations: misread ids are far off
constexpr double kOutlyingSighting = 4.0;     // standard deviations
// m or rad per sqrt(s): where none is stated for an axis, the problem would have no solution.
constexpr double kLeastNoise = 1e-4;

// s: between two poses of the graph the odometry turns by so little that its scales act on the
// chord.
constexpr double kLongestStep = 0.5;
// More poses have equations of 2.4 GB; more landmarks, two matrices of 0.8 GB.
constexpr std::size_t kMostPoses = 100000;
constexpr std::size_t kMostLandmarks = 5000;
// The loss, in standard deviations, narrowed from solution to solution: at first every observation
// pulls, so that loops close from afar; at last misread ones hardly do.
constexpr std::array<double, 3> kLossWidths = {30.0, 10.0, 4.0};

GaussianPrior prior_of(const BatchNoise& noise) {
  SensorConstants sigma = SensorConstants::Zero();
  sigma[SensorConstant::distance_scale] = noise.distance_scale;
  sigma[SensorConstant::turn_scale] = noise.yaw_scale;
  return prior_at(Pose2{}, sigma);
}

// Of an even number of values the mean of the middle two; there has to be one.
double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// The data of a drive up to a time, as a graph. Its first pose is the origin.
class DriveAmongLandmarks {
 public:
  DriveAmongLandmarks(const Recording& recording, const BatchNoise& noise)
      : recording_(recording), noise_(noise) {
    if (recording.odometry.size() < 2) {
      throw Error("the odometry has no duration: it needs two stamps");
    }
    graph.prior = prior_of(noise);
    graph.poses = {graph.prior.pose};
    times_ = {recording.odometry.front().time};
    for (StampedScan scan : recording.scans) {
      std::vector<RangeBearingObservation>& seen = scan.landmarks;
      seen.erase(
          std::remove_if(seen.begin(), seen.end(), [](const auto& each) { return each.id < 0; }),
          seen.end());
      if (!seen.empty()) scans_.push_back(std::move(scan));
    }
    if (scans_.empty()) {
      throw Error(
          "no landmark observation with an id, and no filter's path and map to say which landmark "
          "it is of: the batch solution needs one or the other");
    }
  }
  DriveAmongLandmarks(const DriveAmongLandmarks&) = delete;
  DriveAmongLandmarks& operator=(const DriveAmongLandmarks&) = delete;

  /// From the newest pose.
  void see(const StampedScan& scan) {
    for (const RangeBearingObservation& seen : scan.landmarks) {
      const auto [landmark, is_new] = numbers_.emplace(seen.id, static_cast<int>(ids.size()));
      SightingFactor sighting;
      sighting.pose = newest();
      sighting.landmark = landmark->second;
      sighting.range = seen.range;
      sighting.bearing = seen.bearing;
      const double range_sigma = noise_.range + noise_.range_share * seen.range;
      sighting.range_variance =
          seen.range_variance > 0.0 ? seen.range_variance : range_sigma * range_sigma;
      sighting.bearing_variance =
          seen.bearing_variance > 0.0 ? seen.bearing_variance : noise_.bearing * noise_.bearing;
      sighting.sensor = scan.sensor;
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
    return place_seen(from, sighting.range, sighting.bearing);
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
      if (residual.value.norm() > kOutlyingSighting) ++count;
    }
    return count;
  }

  /// The odometry between two times.
  MotionFactor motion_between(double from, double to) const {
    MotionFactor motion;
    motion.mean = relative(pose_at(recording_.odometry, from), pose_at(recording_.odometry, to));
    const double duration = to - from;
    const double root = std::sqrt(duration);
    Eigen::Vector3d sigmas;
    if (recording_.odometry_noise) {
      sigmas = root * recording_.odometry_noise->cwiseMax(kLeastNoise);
    } else {
      const double of_way = std::sqrt(std::hypot(motion.mean.x, motion.mean.y));
      sigmas << std::hypot(noise_.along * of_way, noise_.standing * root),
          std::hypot(noise_.across * of_way, noise_.standing * root), noise_.heading * root;
    }
    motion.covariance.diagonal() = sigmas.cwiseAbs2();
    // The chord leaves the old heading by half the turn: so it does when the turn is scaled.
    const double half = 0.5 * motion.mean.heading;
    motion.sensitivity.col(SensorConstant::distance_scale) << motion.mean.x, motion.mean.y, 0.0;
    motion.sensitivity.col(SensorConstant::turn_scale) << -half * motion.mean.y,
        half * motion.mean.x, motion.mean.heading;
    return motion;
  }

  /// Poses up to `time`, by odometry as it is now believed; none is far from the next.
  void drive_to(double time) {
    const double last = times_.back();
    const int steps = static_cast<int>(std::ceil((time - last) / kLongestStep));
    for (int step = 1; step <= steps; ++step) {
      const double next = step == steps ? time : last + (time - last) * step / steps;
      graph.motions.push_back(motion_between(times_.back(), next));
      graph.poses.push_back(newest_at(next));
      times_.push_back(next);
    }
  }

  /// The newest pose, brought to a time after it by odometry.
  Pose2 newest_at(double time) const {
    return compose(graph.poses.back(),
                   corrected_motion(motion_between(times_.back(), time), graph.constants));
  }

  /// At each of these stamps: from the pose before by odometry, and what is then missing to the
  /// pose after, in proportion to the time.
  std::vector<StampedPose> path_at(const std::vector<StampedPose>& stamps) const {
    std::vector<StampedPose> path;
    std::size_t before = 0;
    for (const StampedPose& stamp : stamps) {
      while (before + 2 < times_.size() && times_[before + 1] <= stamp.time) ++before;
      const auto by_odometry = [&](double time) {
        return compose(graph.poses[before],
                       corrected_motion(motion_between(times_[before], time), graph.constants));
      };
      const double share = (stamp.time - times_[before]) / (times_[before + 1] - times_[before]);
      const Pose2 missing = relative(by_odometry(times_[before + 1]), graph.poses[before + 1]);
      path.push_back(
          {stamp.time, compose(by_odometry(stamp.time),
                               {share * missing.x, share * missing.y, share * missing.heading})});
    }
    return path;
  }

  /// The cost, from the estimate as it is; nothing if there is no solution.
  std::optional<double> solve() {
    if (times_.size() > kMostPoses || ids.size() > kMostLandmarks) {
      throw Error("there are " + std::to_string(times_.size()) + " poses and " +
                  std::to_string(ids.size()) + " landmarks, and the batch solution takes " +
                  std::to_string(kMostPoses) + " and " + std::to_string(kMostLandmarks) +
                  " at most: give a part of the recording (rosbag filter)");
    }
    return smooth(kRobustSightingWidth, &graph);
  }

  /// With the loss at once, and with one that is narrowed to it; the better.
  std::optional<double> solve_both_ways() {
    SmoothingGraph narrowed = graph;
    const std::optional<double> direct = solve();
    for (const double width : kLossWidths) smooth(width, &narrowed);
    const std::optional<double> other = smooth(kRobustSightingWidth, &narrowed);
    if (!other || (direct && *direct <= *other)) return direct;
    graph = std::move(narrowed);
    return other;
  }

  int newest() const { return static_cast<int>(graph.poses.size()) - 1; }
  double newest_time() const { return times_.back(); }
  const std::vector<StampedScan>& scans() const { return scans_; }

  SmoothingGraph graph;
  std::vector<std::int32_t> ids;  ///< of the landmarks

 private:
  const Recording& recording_;
  BatchNoise noise_;
  std::vector<StampedScan> scans_;  // in order of time, with at least one landmark each
  std::vector<double> times_;       // of the poses, s
  std::map<std::int32_t, int> numbers_;
};

}  // namespace

BatchSolution solve_batch(const Recording& recording, const BatchNoise& noise) {
  DriveAmongLandmarks data(recording, noise);
  for (const StampedScan& scan : data.scans()) {
    data.drive_to(scan.time);
    data.see(scan);
  }
  data.drive_to(recording.odometry.back().time);
  data.place_landmarks();
  if (!data.solve_both_ways()) throw Error("the batch solution failed: nothing fits the data");
  const SmoothingGraph& graph = data.graph;
  BatchSolution solution;
  solution.path = data.path_at(recording.odometry);
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
  OnlineSolution solution;
  auto stamp = recording.odometry.begin();
  // Poses by odometry from the newest on, up to a time.
  const auto go_on = [&](const auto& is_before) {
    for (; stamp != recording.odometry.end() && is_before(stamp->time); ++stamp) {
      if (stamp->time - data.newest_time() > kLongestStep) data.drive_to(stamp->time);
      solution.path.push_back({stamp->time, data.newest_at(stamp->time)});
    }
  };
  for (const StampedScan& scan : data.scans()) {
    go_on([&](double time) { return time < scan.time; });
    data.drive_to(scan.time);
    data.see(scan);
    std::optional<double> cost = data.solve();
    // A loop that closes from afar looks like a misread id at first.
    if (!cost || data.outliers(data.newest()) > 0) cost = data.solve_both_ways();
    ++solution.solutions;
    if (!cost) ++solution.refused;
  }
  go_on([](double) { return true; });
  return solution;
}

}  // namespace pf_resampling
