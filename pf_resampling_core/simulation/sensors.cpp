#include "pf_resampling_core/simulation/sensors.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Which numbers of an observation's random stream serve what. Ranges and landmark scans count their
// observations separately, so they take different parts of the streams; normal number i uses the
// uniforms i and i ^ 1.
constexpr std::uint64_t kRangeNoise = 0;
constexpr std::uint64_t kRangeKind = 2;
constexpr std::uint64_t kRangeOutlier = 3;
constexpr std::uint64_t kFirstLandmark = 16;

}  // namespace

SimulatedOdometry::SimulatedOdometry(const OdometryErrors& errors, double control_period,
                                     std::uint64_t seed)
    : errors_(errors),
      control_period_(control_period),
      seed_(seed),
      yaw_rate_bias_(errors.yaw_rate_bias) {}

void SimulatedOdometry::advance(const Control& truth, std::uint32_t step) {
  double noise[4];
  RandomStream(seed_, RandomPurpose::simulation_motion, step).fill_normal(0, 4, noise);
  measured_.speed = errors_.distance_scale * truth.speed + errors_.speed_sigma * noise[0];
  measured_.yaw_rate =
      errors_.yaw_scale * truth.yaw_rate + yaw_rate_bias_ + errors_.yaw_rate_sigma * noise[1];
  const double lateral_speed = errors_.lateral_sigma * noise[2];
  pose_ = compose(pose_,
                  arc_motion(measured_.speed, lateral_speed, measured_.yaw_rate, control_period_));
  yaw_rate_bias_ += errors_.yaw_rate_bias_drift * std::sqrt(control_period_) * noise[3];
}

std::optional<double> measure_range(const RangeSensorOptions& options,
                                    const SimulatedBeacon& beacon, const Pose2& pose,
                                    std::uint64_t seed, std::uint32_t observation) {
  const Pose2 antenna = compose(pose, {options.antenna.x(), options.antenna.y(), 0.0});
  const Eigen::Vector3d offset =
      beacon.beacon.position - Eigen::Vector3d(antenna.x, antenna.y, options.antenna.z());
  const double distance = offset.norm();
  if (options.range_max > 0.0 && distance > options.range_max) return std::nullopt;

  const RandomStream stream(seed, RandomPurpose::simulation_observation, observation);
  const double kind = stream.uniform(kRangeKind);
  if (kind < options.outlier_share) return options.outlier_max * stream.uniform(kRangeOutlier);
  double range = beacon.errors.scale * distance + beacon.errors.bias +
                 beacon.errors.sigma * stream.normal(kRangeNoise);
  if (kind < options.outlier_share + options.reflected_share) {
    range -= options.reflected_excess_mean * std::log(stream.uniform(kRangeOutlier));
  }
  return std::max(range, 0.0);
}

std::vector<SimulatedLandmarkObservation> observe_landmarks(
    const SimulatedLandmarkSensor& options, const std::vector<Eigen::Vector2d>& landmarks,
    const Pose2& pose, std::uint64_t seed, std::uint32_t scan) {
  const RandomStream stream(seed, RandomPurpose::simulation_observation, scan);
  std::vector<SimulatedLandmarkObservation> observations;
  for (std::size_t id = 0; id < landmarks.size(); ++id) {
    const Eigen::Vector2d seen = seen_from(pose, landmarks[id]);
    const double range = std::hypot(seen.x(), seen.y());
    const double bearing = std::atan2(seen.y(), seen.x());
    if (range > options.range_max || std::abs(bearing) > options.field_of_view / 2.0) continue;
    double noise[2];
    stream.fill_normal(kFirstLandmark + 2 * id, 2, noise);
    observations.push_back({static_cast<int>(id),
                            std::max(range + options.range_sigma * noise[0], 0.0),
                            wrap_angle(bearing + options.bearing_sigma * noise[1])});
  }
  return observations;
}

}  // namespace pf_resampling
