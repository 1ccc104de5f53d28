// How a BeaconMcl population comes to be: about a pose, over an area, or from the ranges.

#include <algorithm>
#include <cmath>
#include <set>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/beacon_mcl/checks.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {
namespace {

// Candidates per particle that is drawn from the ranges, and the fewest.
constexpr int kCandidatesPerParticle = 16;
constexpr int kFewestCandidates = 4000;
constexpr int kMostCandidates = 1000000;  // a second or two
// Ranges kept for that at the most; enough for two rounds of a dozen beacons.
constexpr std::size_t kRecentRanges = 24;

}  // namespace

void BeaconMcl::remember(const RangeObservation& range) {
  if (finds_beacons()) return;
  if (!progress_.first_range_time) progress_.first_range_time = progress_.time;
  progress_.ranges.push_back({range, progress_.dead_reckoning, progress_.time});
  const double window = std::max(options_.recovery.window, options_.initialization.patience);
  while (progress_.ranges.size() > kRecentRanges ||
         progress_.ranges.front().time < progress_.time - window)
    progress_.ranges.erase(progress_.ranges.begin());
}

void BeaconMcl::initialize_when_possible() {
  if (progress_.ranges.empty()) return;
  if (options_.initialization.method != Initialization::from_ranges) return;
  std::set<int> heard;
  for (const RecentRange& recent : progress_.ranges) heard.insert(recent.observation.beacon);
  const int wanted = std::min(options_.initialization.beacons, static_cast<int>(beacons_.size()));
  const double waited = progress_.time - progress_.first_range_time.value_or(progress_.time);
  const bool patient = waited < options_.initialization.patience;
  if (static_cast<int>(heard.size()) < wanted && patient) return;
  initialize_from_ranges();
}

void BeaconMcl::global_localization() {
  ++progress_.step;
  if (finds_beacons()) {
    particles_ = BeaconMclParticles{};
    start_memory();
  } else if (options_.initialization.method == Initialization::uniform ||
             progress_.ranges.empty()) {
    initialize_uniform();
  } else {
    initialize_from_ranges();
  }
}

void BeaconMcl::initialize_gaussian(const Pose2& mean, const Eigen::Matrix3d& covariance) {
  checks::check_pose(mean, covariance);
  ++progress_.step;
  const bool first = !is_initialized();
  resize_columns(options_.particles, &particles_);
  draw_poses({mean, covariance}, stream(RandomPurpose::initialization), 0, particles_.size(),
             &particles_.x, &particles_.y, &particles_.heading);
  begin_population(first);
}

void BeaconMcl::initialize_uniform() {
  const bool first = !is_initialized();
  Eigen::Vector2d low = beacons_.front().position.head<2>();
  Eigen::Vector2d high = low;
  for (const Beacon& beacon : beacons_) {
    low = low.cwiseMin(beacon.position.head<2>());
    high = high.cwiseMax(beacon.position.head<2>());
  }
  const double margin = options_.initialization.area_margin * (high - low).norm();
  for (int axis = 0; axis < 2; ++axis) {
    // One beacon, or all in a line, still need room about them: as far as the ranges go.
    const bool is_flat = high[axis] - low[axis] + margin <= 0.0;
    low[axis] -= is_flat ? options_.ranges.maximum_range : margin;
    high[axis] += is_flat ? options_.ranges.maximum_range : margin;
  }
  resize_columns(options_.particles, &particles_);
  const RandomStream uniforms = stream(RandomPurpose::initialization);
  for (Eigen::Index i = 0; i < particles_.size(); ++i) {
    const std::uint64_t index = 4 * static_cast<std::uint64_t>(i);
    particles_.put(i, {low[0] + (high[0] - low[0]) * uniforms.uniform(index),
                       low[1] + (high[1] - low[1]) * uniforms.uniform(index + 1),
                       kPi * (2.0 * uniforms.uniform(index + 2) - 1.0)});
  }
  begin_population(first);
}

void BeaconMcl::initialize_from_ranges() {
  const bool first = !is_initialized();
  const std::vector<Pose2> poses = propose_from_ranges(options_.particles);
  resize_columns(options_.particles, &particles_);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    particles_.put(static_cast<Eigen::Index>(i), poses[i]);
  }
  begin_population(first);
}

// Weights, ancestry and, the first time, the Kalman filters of a new population.
void BeaconMcl::begin_population(bool first) {
  reset_weights();
  particles_.ancestor =
      Eigen::ArrayXi::LinSpaced(particles_.size(), 0, static_cast<int>(particles_.size()) - 1);
  progress_.slow_likelihood = progress_.fast_likelihood = 0.0;
  progress_.likelihoods = 0;
  start_ancestry();
  if (first) {
    start_yaw_rate_bias();
    start_noise_factors();
    start_calibration();
  }
  // The robot is elsewhere than the path of all data has it.
  if (finds_beacons()) {
    start_memory(estimate());
  } else if (!first) {
    start_memory();
  }
}

void BeaconMcl::start_ancestry() {
  status_.particles = static_cast<int>(particles_.size());
  status_.distinct_ancestors_of_renewal = status_.particles;
  status_.distinct_ancestors_since_start = status_.particles;
  ancestry_.start(status_.particles);
}

void BeaconMcl::start_yaw_rate_bias() {
  const Eigen::Index count = particles_.size();
  particles_.yaw_rate_bias.setZero(count);
  const double sigma = options_.yaw_rate_bias.estimate ? options_.yaw_rate_bias.sigma : 0.0;
  particles_.yaw_rate_bias_variance.setConstant(count, sigma * sigma);
}

void BeaconMcl::start_noise_factors() {
  const Eigen::Index count = particles_.size();
  const double spread =
      options_.noise_estimation.odometry ? options_.noise_estimation.odometry_spread : 0.0;
  const RandomStream normals = stream(RandomPurpose::noise_factors);
  normals.fill_normal(0, count, particles_.translation_factor.data());
  normals.fill_normal(static_cast<std::uint64_t>(count), count, particles_.heading_factor.data());
  particles_.translation_factor = (spread * particles_.translation_factor).exp();
  particles_.heading_factor = (spread * particles_.heading_factor).exp();
}

void BeaconMcl::start_calibration() {
  const Eigen::Index count = particles_.size();
  const RangeCalibration first = nominal_.empty() ? RangeCalibration{} : nominal_.front();
  const double share = calibrates() ? 1.0 : 0.0;
  particles_.scale.setConstant(count, first.scale);
  particles_.bias.setConstant(count, first.bias);
  particles_.scale_variance.setConstant(count,
                                        share * std::pow(options_.calibration.scale_sigma, 2));
  particles_.scale_bias_covariance.setZero(count);
  particles_.bias_variance.setConstant(count, share * std::pow(options_.calibration.bias_sigma, 2));
  progress_.calibration_time = progress_.time;
}

// Poses that agree with the ranges of the last seconds: candidates on the ring of one of them, any
// heading, weighed by all others through the dead reckoning in between, then resampled. Importance
// sampling with the ranges themselves as the proposal (Probabilistic Robotics, section 8.3.7:
// "sensor resetting").
std::vector<Pose2> BeaconMcl::propose_from_ranges(int count) {
  const int candidates = count > kMostCandidates / kCandidatesPerParticle
                             ? kMostCandidates
                             : std::max(kFewestCandidates, kCandidatesPerParticle * count);
  const RandomStream draws = stream(RandomPurpose::injection);
  const RangeModelOptions& model = options_.ranges;

  struct Ring {
    Eigen::Vector3d beacon;
    double distance;  // of antenna and beacon, horizontal
    double sigma;     // of that distance, in which the calibration is uncertain
    Pose2 antenna;    // from the robot's present pose to the antenna's place back then
  };
  std::vector<Ring> rings;
  for (const RecentRange& recent : progress_.ranges) {
    const RangeObservation& observation = recent.observation;
    const std::size_t beacon = beacon_index(observation.beacon);
    const double distance = std::max(0.0, corrected_range(observation.beacon, observation.range));
    double variance = observation_variance(observation);
    if (calibrates()) {
      const CalibrationEstimate known = calibration_or_prior(beacon);
      variance += std::pow(known.scale_sigma * distance, 2) + std::pow(known.bias_sigma, 2);
    }
    const double height =
        beacons_[beacon].is_planar ? 0.0 : beacons_[beacon].position.z() - observation.antenna.z();
    const double horizontal = std::sqrt(std::max(0.0, distance * distance - height * height));
    const Pose2 back_then = relative(progress_.dead_reckoning, recent.pose);
    const Pose2 antenna =
        compose(back_then, {observation.antenna.x(), observation.antenna.y(), 0.0});
    rings.push_back({beacons_[beacon].position, horizontal, std::sqrt(variance), antenna});
  }

  std::vector<Pose2> poses(static_cast<std::size_t>(candidates));
  Eigen::ArrayXd log_weights(candidates);
  for (int i = 0; i < candidates; ++i) {
    const std::uint64_t index = 8 + 8 * static_cast<std::uint64_t>(i);
    // The anchors in turn, so that one outlier does not place all candidates.
    const Ring& anchor = rings[static_cast<std::size_t>(i) % rings.size()];
    const double radius = std::abs(anchor.distance + anchor.sigma * draws.normal(index));
    const double angle = 2.0 * kPi * draws.uniform(index + 2);
    const double heading = kPi * (2.0 * draws.uniform(index + 3) - 1.0);
    const Pose2 turned = compose({0.0, 0.0, heading}, {anchor.antenna.x, anchor.antenna.y, 0.0});
    const Pose2 pose{anchor.beacon.x() + radius * std::cos(angle) - turned.x,
                     anchor.beacon.y() + radius * std::sin(angle) - turned.y, heading};
    double log_weight = 0.0;
    for (const Ring& ring : rings) {
      if (&ring == &anchor) continue;
      const Pose2 antenna = compose(pose, ring.antenna);
      const double distance = std::hypot(ring.beacon.x() - antenna.x, ring.beacon.y() - antenna.y);
      const double deviation = (distance - ring.distance) / ring.sigma;
      const double gaussian = (1.0 - model.outlier_share) * std::exp(-0.5 * deviation * deviation) /
                              (std::sqrt(2.0 * kPi) * ring.sigma);
      log_weight += std::log(gaussian + model.outlier_share / model.maximum_range + 1e-300);
    }
    poses[static_cast<std::size_t>(i)] = pose;
    log_weights[i] = log_weight;
  }
  Eigen::ArrayXd weights(candidates);
  normalize(log_weights, weights);
  Resampler resampler;
  const ResamplingResult result =
      resampler.resample(weights, count, stream(RandomPurpose::selection));
  std::vector<Pose2> chosen(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    chosen[static_cast<std::size_t>(i)] = poses[static_cast<std::size_t>(result.ancestors[i])];
  }
  return chosen;
}

// What is known of a radio's calibration at present, or before there are particles.
CalibrationEstimate BeaconMcl::calibration_or_prior(std::size_t beacon) const {
  if (is_initialized()) {
    const std::vector<CalibrationEstimate> estimates = calibration();
    return estimates.size() == 1 ? estimates.front() : estimates[beacon];
  }
  return {beacons_[beacon].id, nominal_[beacon].scale, options_.calibration.scale_sigma,
          nominal_[beacon].bias, options_.calibration.bias_sigma};
}

}  // namespace pf_resampling
