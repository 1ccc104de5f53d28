#include "tools/common/batch_ranges.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Wide, as the noise is found together with it: most ranges count as of Gaussian noise.
constexpr double kRobustRangeWidth = 3.0;  // standard deviations
constexpr double kOutlyingRange = 4.0;     // standard deviations
constexpr double kLeastMotionNoise =
    1e-4;  // m or rad per sqrt(s), where none is stated for an axis
// Of the search for the noise: factors tried, and how small it may be found, as exact data have
// none.
constexpr double kSteps[] = {4.0, 2.0, 1.4};
constexpr double kLeastSigma = 1e-3;  // m
constexpr double kLeastFactor = 1e-2;
constexpr double kSolvedEvery = 10.0;       // s
constexpr std::size_t kMostBeacons = 1000;  // the filter's limit, too

/// What takes part: ranges that can be used, in order of time, and the beacons that they are of.
RangeProblem part_of_use(RangeProblem problem) {
  check_path(problem.odometry, "odometry");
  const double begin = problem.odometry.front().time;
  const double end = problem.odometry.back().time;
  std::set<int> known, heard;
  for (const Beacon& beacon : problem.beacons) known.insert(beacon.id);
  const auto is_of_no_use = [&](const StampedRange& range) {
    return known.count(range.beacon) == 0 || !std::isfinite(range.range) || !(range.range > 0.0) ||
           !(range.time >= begin && range.time <= end);
  };
  std::vector<StampedRange>& ranges = problem.ranges;
  ranges.erase(std::remove_if(ranges.begin(), ranges.end(), is_of_no_use), ranges.end());
  if (ranges.empty()) {
    throw Error(
        "no range to a known beacon while there is odometry: the batch solution needs "
        "ranges and the places of their beacons");
  }
  std::stable_sort(ranges.begin(), ranges.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  for (const StampedRange& range : ranges) heard.insert(range.beacon);
  std::vector<Beacon>& beacons = problem.beacons;
  beacons.erase(std::remove_if(beacons.begin(), beacons.end(),
                               [&](const Beacon& beacon) { return heard.count(beacon.id) == 0; }),
                beacons.end());
  if (beacons.size() > kMostBeacons) {
    throw Error("ranges to " + std::to_string(beacons.size()) +
                " beacons: the batch solution takes " + std::to_string(kMostBeacons) +
                " at most; give fewer in the list of beacons");
  }
  return problem;
}

/// The data of a drive up to a time, as a graph; the problem is the part of use.
class DriveAmongRadios {
 public:
  DriveAmongRadios(const RangeProblem& problem, const RangeBatchNoise& noise,
                   const RangeBatchScales& scales)
      : drive(
            problem.odometry, [this](double from, double to) { return motion_between(from, to); },
            prior_of(problem, noise), kRobustRangeWidth),
        problem_(problem),
        noise_(noise),
        scales_(scales) {
    for (std::size_t b = 0; b < problem.beacons.size(); ++b) {
      numbers_[problem.beacons[b].id] = static_cast<int>(b);
    }
    for (const StampedRange& range : problem.ranges) {
      if (times_.empty() || range.time > times_.back()) times_.push_back(range.time);
    }
    check_size(problem.odometry, times_);
  }
  DriveAmongRadios(const DriveAmongRadios&) = delete;
  DriveAmongRadios& operator=(const DriveAmongRadios&) = delete;

  /// Times that have ranges, ascending.
  const std::vector<double>& times() const { return times_; }

  /// The ranges up to the newest pose's time that are not there yet, from that pose.
  void hear() {
    const std::vector<StampedRange>& ranges = problem_.ranges;
    for (; heard_ < ranges.size() && ranges[heard_].time <= drive.times.back(); ++heard_) {
      const StampedRange& heard = ranges[heard_];
      const auto antenna = problem_.antennas.find(heard.frame);
      if (antenna == problem_.antennas.end()) {
        throw Error("frame \"" + heard.frame + "\" of the ranges is not connected to the robot: " +
                    "/tf_static in the bag has to connect it to base_link");
      }
      RangeFactor range;
      range.pose = drive.newest();
      range.radio = numbers_.at(heard.beacon);
      const Beacon& beacon = problem_.beacons[static_cast<std::size_t>(range.radio)];
      range.beacon = beacon.position.head<2>();
      range.antenna = antenna->second.head<2>();
      range.height = beacon.is_planar ? 0.0 : beacon.position.z() - antenna->second.z();
      range.range = heard.range;
      range.variance = scales_.sigma * scales_.sigma;
      drive.graph.ranges.push_back(range);
    }
  }

  /// In standard deviations, of the ranges from the pose `first` on.
  std::vector<double> residuals(int first) const {
    std::vector<double> values;
    const SmoothingGraph& graph = drive.graph;
    for (auto r = graph.ranges.rbegin(); r != graph.ranges.rend() && r->pose >= first; ++r) {
      values.push_back(
          std::abs(range_residual(*r, graph.noise, graph.poses[static_cast<std::size_t>(r->pose)],
                                  graph.radios[static_cast<std::size_t>(r->radio)])
                       .value));
    }
    return values;
  }

  int outliers(int first) const {
    const std::vector<double> values = residuals(first);
    return static_cast<int>(std::count_if(values.begin(), values.end(),
                                          [](double value) { return value > kOutlyingRange; }));
  }

  /// Takes the noise of all data as so large.
  void set_scales(const RangeBatchScales& scales) {
    const double translation = scales.translation / scales_.translation;
    const double heading = scales.heading / scales_.heading;
    for (MotionFactor& motion : drive.graph.motions) scale(translation, heading, &motion);
    for (RangeFactor& range : drive.graph.ranges) range.variance = scales.sigma * scales.sigma;
    scales_ = scales;
  }
  const RangeBatchScales& scales() const { return scales_; }

  BatchDrive drive;

 private:
  static GaussianPrior prior_of(const RangeProblem& problem, const RangeBatchNoise& noise) {
    SensorConstants sigma = SensorConstants::Zero();
    sigma[SensorConstant::distance_scale] = noise.distance_scale;
    sigma[SensorConstant::turn_scale] = noise.yaw_scale;
    sigma[SensorConstant::yaw_rate] = noise.yaw_rate;
    return prior_among_radios(problem.start, noise.start, sigma,
                              static_cast<int>(problem.beacons.size()), noise.radios);
  }

  MotionFactor motion_between(double from, double to) const {
    OdometryIncrement increment;
    Pose2 last = odometry_at(from);
    double time = from;
    const auto go_to = [&](double next, const Pose2& pose) {
      if (!(next > time)) return;
      append(noise_.odometry, relative(last, pose), next - time, &increment);
      last = pose;
      time = next;
    };
    const auto& odometry = problem_.odometry;
    auto stamp = std::upper_bound(odometry.begin(), odometry.end(), from,
                                  [](double t, const auto& pose) { return t < pose.time; });
    for (; stamp != odometry.end() && stamp->time < to; ++stamp) go_to(stamp->time, stamp->pose);
    go_to(to, odometry_at(to));

    MotionFactor motion;
    motion.mean = increment.mean;
    motion.covariance = increment.covariance;
    motion.sensitivity.col(SensorConstant::distance_scale) = increment.distance_scale_sensitivity;
    motion.sensitivity.col(SensorConstant::turn_scale) = increment.turn_scale_sensitivity;
    motion.sensitivity.col(SensorConstant::yaw_rate) = increment.yaw_rate_sensitivity;
    if (problem_.odometry_noise) {
      const StatedOdometryNoise& stated = *problem_.odometry_noise;
      const double root = std::sqrt(to - from);
      const Eigen::Vector3d sigmas(stated.along, stated.across, stated.heading);
      motion.covariance = (root * sigmas.cwiseMax(kLeastMotionNoise)).cwiseAbs2().asDiagonal();
    }
    scale(scales_.translation, scales_.heading, &motion);
    return motion;
  }

  static void scale(double translation, double heading, MotionFactor* motion) {
    const Eigen::Vector3d factors(translation, translation, heading);
    motion->covariance = (factors.asDiagonal() * motion->covariance * factors.asDiagonal()).eval();
  }

  Pose2 odometry_at(double time) const {
    return interpolate(problem_.odometry, time, std::numeric_limits<double>::infinity())->pose;
  }

  const RangeProblem& problem_;
  RangeBatchNoise noise_;
  RangeBatchScales scales_;
  std::vector<double> times_;
  std::size_t heard_ = 0;
  std::map<int, int> numbers_;  // of the beacons
};

RangeSolution solution_of(const DriveAmongRadios& data, const RangeProblem& problem) {
  const SmoothingGraph& graph = data.drive.graph;
  RangeSolution solution;
  solution.path = data.drive.path_at(problem.odometry);
  for (std::size_t b = 0; b < problem.beacons.size(); ++b) {
    RangeCalibration radio;
    radio.scale = 1.0 + graph.radios[b][0];
    radio.bias = graph.radios[b][1];
    solution.radios.emplace_back(problem.beacons[b].id, radio);
  }
  solution.distance_scale = 1.0 / (1.0 + graph.constants[SensorConstant::distance_scale]);
  solution.yaw_scale = 1.0 / (1.0 + graph.constants[SensorConstant::turn_scale]);
  solution.yaw_rate_bias = -graph.constants[SensorConstant::yaw_rate];
  solution.ranges = static_cast<int>(graph.ranges.size());
  solution.outliers = data.outliers(0);
  solution.scales = data.scales();
  return solution;
}

/// Logarithm of how probable the data and the factors of the odometry's noise are, but for a
/// constant; moves the graph to its solution. Nothing if there is none.
std::optional<double> log_evidence(double spread, DriveAmongRadios* data) {
  const SmoothingResult result = data->drive.solve_both_ways();
  const SmoothingGraph& graph = data->drive.graph;
  if (result.fault != SmoothingFault::none) return std::nullopt;
  const double log_translation = std::log(data->scales().translation) / spread;
  const double log_heading = std::log(data->scales().heading) / spread;
  double log_normalizer = -0.5 * (log_translation * log_translation + log_heading * log_heading);
  for (const MotionFactor& motion : graph.motions) {
    log_normalizer += motion_root(motion, 1.0).diagonal().array().log().sum();
  }
  for (const RangeFactor& range : graph.ranges) log_normalizer -= 0.5 * std::log(range.variance);
  return log_normalizer - result.cost - 0.5 * result.log_determinant;
}

/// The noise under which the data are most probable.
void find_scales(double spread, DriveAmongRadios* data) {
  std::optional<double> best = log_evidence(spread, data);
  most_probable_scales(data->scales(), [&](const RangeBatchScales& scales) {
    const RangeBatchScales before = data->scales();
    const SmoothingGraph solution = data->drive.graph;
    data->set_scales(scales);
    const std::optional<double> evidence = log_evidence(spread, data);
    if (evidence && (!best || *evidence > *best)) {
      best = evidence;
      return true;
    }
    data->set_scales(before);
    data->drive.graph = solution;
    return false;
  });
}

}  // namespace

RangeBatchScales most_probable_scales(
    RangeBatchScales best, const std::function<bool(const RangeBatchScales&)>& is_better) {
  const auto search = [&](double RangeBatchScales::*scale, double least, double step) {
    for (const double factor : {step, 1.0 / step}) {
      RangeBatchScales tried = best;
      tried.*scale *= factor;
      while (tried.*scale > least && is_better(tried)) {
        best = tried;
        tried.*scale *= factor;
      }
    }
  };
  // That of the ranges first, and well: where it is taken as too small, the odometry has to explain
  // the rest, and seems as noisy as that.
  for (const double step : kSteps) search(&RangeBatchScales::sigma, kLeastSigma, step);
  for (const double step : kSteps) {
    search(&RangeBatchScales::heading, kLeastFactor, step);
    search(&RangeBatchScales::translation, kLeastFactor, step);
    search(&RangeBatchScales::sigma, kLeastSigma, kSteps[2]);
  }
  return best;
}

RangeSolution solve_ranges(const RangeProblem& whole, const RangeBatchNoise& noise) {
  const RangeProblem problem = part_of_use(whole);
  DriveAmongRadios data(problem, noise, {});
  // On the way, so that the odometry goes on from where the ranges have the robot.
  double solved = -std::numeric_limits<double>::infinity();
  for (const double time : data.times()) {
    data.drive.drive_to(time);
    data.hear();
    if (time < solved + kSolvedEvery) continue;
    data.drive.solve_both_ways();
    solved = time;
  }
  data.drive.drive_to(problem.odometry.back().time);
  find_scales(noise.odometry_spread, &data);
  const SmoothingResult result = data.drive.solve_both_ways();
  if (result.fault != SmoothingFault::none) {
    throw Error("the batch solution failed: " + to_string(result.fault));
  }
  return solution_of(data, problem);
}

OnlineSolution solve_ranges_online(const RangeProblem& whole, const RangeBatchScales& scales,
                                   const RangeBatchNoise& noise, int window) {
  const RangeProblem problem = part_of_use(whole);
  DriveAmongRadios data(problem, noise, scales);
  return solve_along(
      problem.odometry, data.times(), [&](std::size_t) { data.hear(); },
      [&] { return data.outliers(data.drive.newest()) > 0; }, window, &data.drive);
}

}  // namespace pf_resampling
