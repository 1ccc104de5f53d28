#include "tools/batch/batch_slam.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"

namespace pf_resampling {
namespace {

// s: between two poses of the problem the odometry turns by so little that its scales act on the
// chord.
constexpr double kLongestStep = 0.5;
constexpr double kOutlier = 4.0;  // standard deviations
// m or rad per sqrt(s): where none is stated for an axis, the problem would have no solution.
constexpr double kLeastNoise = 1e-4;
// The loss, in standard deviations, narrowed from solution to solution: at first every observation
// pulls, so that loops close from afar; at last misread ones hardly do.
constexpr std::array<double, 4> kLossWidths = {30.0, 10.0, 4.0, 2.0};

using PoseBlock = std::array<double, 3>;  // x, y (m), heading (rad, not wrapped)
using PointBlock = std::array<double, 2>;
using ScaleBlock = std::array<double, 2>;  // true over measured distance, turn

/// The motion between two poses is that of the odometry, scaled.
struct OdometryCost {
  Pose2 motion;
  double along, across, heading;  // standard deviations

  template <typename T>
  bool operator()(const T* from, const T* to, const T* scales, T* residual) const {
    using std::cos;
    using std::sin;
    const T dx = to[0] - from[0];
    const T dy = to[1] - from[1];
    const T c = cos(from[2]);
    const T s = sin(from[2]);
    // The chord leaves the old heading by half the turn: so it does when the turn is scaled.
    const T more = T(0.5 * motion.heading) * (scales[1] - T(1.0));
    const T cm = cos(more);
    const T sm = sin(more);
    const T x = scales[0] * (cm * T(motion.x) - sm * T(motion.y));
    const T y = scales[0] * (sm * T(motion.x) + cm * T(motion.y));
    residual[0] = (c * dx + s * dy - x) / T(along);
    residual[1] = (c * dy - s * dx - y) / T(across);
    residual[2] = (to[2] - from[2] - scales[1] * T(motion.heading)) / T(heading);
    return true;
  }
};

struct ScalePrior {
  const BatchNoise* noise;

  template <typename T>
  bool operator()(const T* scales, T* residual) const {
    residual[0] = (scales[0] - T(1.0)) / T(noise->distance_scale);
    residual[1] = (scales[1] - T(1.0)) / T(noise->yaw_scale);
    return true;
  }
};

/// Range and bearing of a landmark from a sensor on the robot.
struct ObservationCost {
  Pose2 sensor;
  SeenLandmark seen;
  const BatchNoise* noise;

  double range_sigma() const {
    if (seen.range_variance > 0.0) return std::sqrt(seen.range_variance);
    return noise->range + noise->range_share * seen.range;
  }
  double bearing_sigma() const {
    return seen.bearing_variance > 0.0 ? std::sqrt(seen.bearing_variance) : noise->bearing;
  }

  template <typename T>
  bool operator()(const T* pose, const T* landmark, T* residual) const {
    using std::atan2;
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T c = cos(pose[2]);
    const T s = sin(pose[2]);
    const T dx = landmark[0] - pose[0];
    const T dy = landmark[1] - pose[1];
    const T x = c * dx + s * dy - T(sensor.x);
    const T y = c * dy - s * dx - T(sensor.y);
    // Turned so that the measured direction is ahead: then the error needs no wrapping.
    const double cb = std::cos(sensor.heading + seen.bearing);
    const double sb = std::sin(sensor.heading + seen.bearing);
    const T ahead = T(cb) * x + T(sb) * y;
    const T left = T(cb) * y - T(sb) * x;
    residual[0] = (sqrt(x * x + y * y + T(1e-12)) - T(seen.range)) / T(range_sigma());
    residual[1] = atan2(left, ahead) / T(bearing_sigma());
    return true;
  }
};

struct Observation {
  std::size_t pose;
  std::size_t landmark;
  ObservationCost cost;
};

/// All that is estimated.
struct State {
  std::vector<PoseBlock> poses;
  std::vector<PointBlock> landmarks;
  ScaleBlock scales = {1.0, 1.0};
};

class Batch {
 public:
  Batch(const BatchProblem& problem, const BatchNoise& noise)
      : problem_(problem), noise_(noise), loss_(nullptr, ceres::TAKE_OWNERSHIP) {
    check_path(problem.odometry, "odometry");
    place_poses();
    place_observations();
    connect();
  }

  BatchSolution solve() {
    // From dead reckoning, with the final loss at once and with one that is narrowed; the better.
    const State start = state_;
    optimize(kLossWidths.back());
    const State direct = state_;
    const double direct_cost = cost();
    state_in_place(start);
    for (const double width : kLossWidths) optimize(width);
    if (cost() > direct_cost) state_in_place(direct);
    return solution();
  }

 private:
  static ceres::Problem::Options problem_options() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  Pose2 odometry_at(double time) const {
    const auto pose = interpolate(problem_.odometry, time, std::numeric_limits<double>::infinity());
    return pose->pose;
  }

  /// One pose per scan that odometry covers, and more between those far apart.
  void place_poses() {
    const double begin = problem_.odometry.front().time;
    const double end = problem_.odometry.back().time;
    std::vector<double> times = {begin, end};
    for (const StampedScan& scan : problem_.scans) {
      if (scan.time >= begin && scan.time <= end) times.push_back(scan.time);
    }
    std::sort(times.begin(), times.end());
    times_ = {begin};
    for (const double time : times) {
      const double last = times_.back();
      const int steps = static_cast<int>(std::ceil((time - last) / kLongestStep));
      for (int step = 1; step <= steps; ++step) {
        times_.push_back(step == steps ? time : last + (time - last) * step / steps);
      }
    }
    if (times_.size() < 2) throw Error("the odometry has no duration: it needs two stamps");
    const Pose2 first = odometry_at(begin);
    double heading = 0.0;
    for (const double time : times_) {
      const Pose2 pose = relative(first, odometry_at(time));
      heading += wrap_angle(pose.heading - heading);
      state_.poses.push_back({pose.x, pose.y, heading});
    }
  }

  void place_observations() {
    std::map<std::int32_t, std::size_t> known;
    std::vector<std::vector<double>> x, y;  // of each landmark, as each observation has it
    for (const StampedScan& scan : problem_.scans) {
      const auto at = std::lower_bound(times_.begin(), times_.end(), scan.time);
      if (at == times_.end() || *at > scan.time) continue;
      const auto index = static_cast<std::size_t>(at - times_.begin());
      const auto sensor = problem_.sensors.find(scan.frame);
      if (sensor == problem_.sensors.end()) {
        throw Error("frame \"" + scan.frame +
                    "\" of the landmarks is not connected to the robot: " +
                    "/tf_static in the bag has to connect it to base_link");
      }
      const PoseBlock& pose = state_.poses[index];
      const Pose2 from = compose({pose[0], pose[1], pose[2]}, sensor->second);
      for (const SeenLandmark& seen : scan.landmarks) {
        if (seen.id < 0 || !std::isfinite(seen.range) || !std::isfinite(seen.bearing)) continue;
        const auto [landmark, is_new] = known.emplace(seen.id, ids_.size());
        if (is_new) {
          ids_.push_back(seen.id);
          x.emplace_back();
          y.emplace_back();
        }
        observations_.push_back({index, landmark->second, {sensor->second, seen, &noise_}});
        const double direction = from.heading + seen.bearing;
        x[landmark->second].push_back(from.x + seen.range * std::cos(direction));
        y[landmark->second].push_back(from.y + seen.range * std::sin(direction));
      }
    }
    // The median by dead reckoning, which misread ids cannot carry away as they can the first.
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      state_.landmarks.push_back({median(x[i]), median(y[i])});
    }
    if (observations_.empty()) {
      throw Error("no landmark observation with an id: the batch solution needs known ids");
    }
  }

  void connect() {
    ceres_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ScalePrior, 2, 2>(new ScalePrior{&noise_}), nullptr,
        state_.scales.data());
    for (std::size_t i = 1; i < times_.size(); ++i) {
      ceres_.AddResidualBlock(new ceres::AutoDiffCostFunction<OdometryCost, 3, 3, 3, 2>(
                                  new OdometryCost(odometry_cost(i))),
                              nullptr, state_.poses[i - 1].data(), state_.poses[i].data(),
                              state_.scales.data());
    }
    for (const Observation& observation : observations_) {
      ceres_.AddResidualBlock(new ceres::AutoDiffCostFunction<ObservationCost, 2, 3, 2>(
                                  new ObservationCost(observation.cost)),
                              &loss_, state_.poses[observation.pose].data(),
                              state_.landmarks[observation.landmark].data());
    }
    ceres_.SetParameterBlockConstant(state_.poses[0].data());
  }

  /// Between pose i - 1 and pose i.
  OdometryCost odometry_cost(std::size_t i) const {
    const Pose2 motion = relative(odometry_at(times_[i - 1]), odometry_at(times_[i]));
    const double duration = times_[i] - times_[i - 1];
    if (problem_.odometry_noise) {
      const StatedOdometryNoise& stated = *problem_.odometry_noise;
      const double root = std::sqrt(duration);
      return {motion, std::max(stated.along, kLeastNoise) * root,
              std::max(stated.across, kLeastNoise) * root,
              std::max(stated.heading, kLeastNoise) * root};
    }
    const double root = std::sqrt(std::hypot(motion.x, motion.y));
    const double standing = noise_.standing * std::sqrt(duration);
    return {motion, std::hypot(noise_.along * root, standing),
            std::hypot(noise_.across * root, standing), noise_.heading * std::sqrt(duration)};
  }

  /// The same numbers at the addresses that the problem knows.
  void state_in_place(const State& state) {
    std::copy(state.poses.begin(), state.poses.end(), state_.poses.begin());
    std::copy(state.landmarks.begin(), state.landmarks.end(), state_.landmarks.begin());
    state_.scales = state.scales;
  }

  /// Solves from the present state.
  void optimize(double loss_width) {
    loss_.Reset(new ceres::CauchyLoss(loss_width), ceres::TAKE_OWNERSHIP);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 100;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_, &summary);
    if (!summary.IsSolutionUsable()) throw Error("the batch solution failed: " + summary.message);
  }

  /// Half the sum of squares, robust.
  double cost() {
    double cost = 0.0;
    ceres_.Evaluate({}, &cost, nullptr, nullptr, nullptr);
    return cost;
  }

  BatchSolution solution() const {
    BatchSolution solution;
    solution.observations = static_cast<int>(observations_.size());
    for (const Observation& observation : observations_) {
      double residual[2];
      observation.cost(state_.poses[observation.pose].data(),
                       state_.landmarks[observation.landmark].data(), residual);
      if (std::hypot(residual[0], residual[1]) > kOutlier) ++solution.outliers;
    }
    solution.distance_scale = 1.0 / state_.scales[0];
    solution.yaw_scale = 1.0 / state_.scales[1];
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      PointLandmark landmark;
      landmark.id = ids_[i];
      landmark.position << state_.landmarks[i][0], state_.landmarks[i][1];
      solution.landmarks.push_back(landmark);
    }
    solution.path = path();
    return solution;
  }

  /// At each stamp of the odometry: from the pose before by the scaled odometry, and what is then
  /// missing to the pose after, in proportion to the time.
  std::vector<EstimatedPose> path() const {
    const auto scaled = [this](const Pose2& motion) {
      const Pose2 turned =
          compose({0.0, 0.0, 0.5 * motion.heading * (state_.scales[1] - 1.0)}, motion);
      return Pose2{state_.scales[0] * turned.x, state_.scales[0] * turned.y,
                   state_.scales[1] * motion.heading};
    };
    const auto pose_of = [this](std::size_t i) {
      return Pose2{state_.poses[i][0], state_.poses[i][1], wrap_angle(state_.poses[i][2])};
    };
    std::vector<EstimatedPose> path;
    std::size_t before = 0;
    for (const EstimatedPose& odometry : problem_.odometry) {
      while (before + 2 < times_.size() && times_[before + 1] <= odometry.time) ++before;
      const Pose2 start = odometry_at(times_[before]);
      const double duration = times_[before + 1] - times_[before];
      const double share = (odometry.time - times_[before]) / duration;
      const Pose2 end =
          compose(pose_of(before), scaled(relative(start, odometry_at(times_[before + 1]))));
      const Pose2 missing = relative(end, pose_of(before + 1));
      const Pose2 here = compose(pose_of(before), scaled(relative(start, odometry.pose)));
      EstimatedPose pose;
      pose.time = odometry.time;
      pose.pose = compose(here, {share * missing.x, share * missing.y, share * missing.heading});
      path.push_back(pose);
    }
    return path;
  }

  const BatchProblem& problem_;
  BatchNoise noise_;
  std::vector<double> times_;
  std::vector<std::int32_t> ids_;  // of the landmarks
  std::vector<Observation> observations_;
  State state_;
  ceres::LossFunctionWrapper loss_;
  ceres::Problem ceres_ = ceres::Problem(problem_options());
};

}  // namespace

bool has_batch_solver() {
  return true;
}

BatchSolution solve_batch(const BatchProblem& problem, const BatchNoise& noise) {
  return Batch(problem, noise).solve();
}

}  // namespace pf_resampling
