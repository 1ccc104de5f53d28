#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/checks.hpp"
#include "pf_resampling_core/filters/beacon_mcl/kernels.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr int kAllBeacons = -1;

// Bounds of what is learnt about noise: beyond them the model is wrong in another way.
constexpr double kLargestFactor = 30.0;
constexpr double kLargestVarianceFactor = kLargestFactor * kLargestFactor;

// Weighted mean and standard deviation over the population of what each particle holds as mean and
// variance.
ScalarEstimate pooled(ConstArray weights, ConstArray means, ConstArray variances) {
  ScalarEstimate estimate;
  estimate.mean = (weights * means).sum();
  estimate.sigma =
      std::sqrt(std::max(0.0, (weights * (variances + (means - estimate.mean).square())).sum()));
  return estimate;
}

}  // namespace

BeaconMcl::BeaconMcl(const BeaconMclOptions& options, std::vector<Beacon> beacons,
                     std::uint64_t seed,
                     const std::vector<std::pair<int, RangeCalibration>>& calibration)
    : options_(options), beacons_(std::move(beacons)), calibration_(calibration), seed_(seed) {
  validate(options_);
  checks::check_beacons(beacons_, finds_beacons() ? 0 : 1);
  checks::check_calibration(calibration);
  for (const Beacon& beacon : beacons_) {
    RangeCalibration nominal;
    for (const auto& [id, given] : calibration) {
      if (id == kAllBeacons) nominal = given;
    }
    for (const auto& [id, given] : calibration) {
      if (id == beacon.id) nominal = given;
    }
    nominal_.push_back(nominal);
  }
  pool_ = std::make_unique<WorkerPool>(options_.threads);
  reset();
}

void BeaconMcl::reset() {
  step_ = 0;
  particles_ = BeaconMclParticles{};
  strategy_ = Strategy(options_.strategy);
  status_ = BeaconMclStatus{};
  dead_reckoning_ = Pose2{};
  recent_.clear();
  first_range_time_.reset();
  slow_likelihood_ = fast_likelihood_ = 0.0;
  likelihoods_ = 0;
  time_ = 0.0;
  range_squares_ = range_count_ = options_.noise_estimation.prior_count;
  memory_.reset();
  start_memory();
  if (options_.initialization.method == Initialization::uniform && !finds_beacons()) {
    initialize_uniform();
  } else if (options_.initialization.method == Initialization::gaussian) {
    const InitializationOptions& start = options_.initialization;
    const Eigen::Array3d sigma(start.sigma_position, start.sigma_position, start.sigma_heading);
    initialize_gaussian({start.x, start.y, start.heading}, sigma.square().matrix().asDiagonal());
  }
}

void BeaconMcl::set_options(const BeaconMclOptions& options) {
  validate(options);
  if (options.beacon_positions != options_.beacon_positions) {
    throw Error("parameter beacon_positions cannot change while the filter runs; start it anew");
  }
  const bool other_calibration = options.calibration.estimation != options_.calibration.estimation;
  const bool other_threads = options.threads != options_.threads;
  const bool other_yaw_rate_bias =
      options.yaw_rate_bias.estimate != options_.yaw_rate_bias.estimate;
  const bool other_noise = options.noise_estimation.odometry != options_.noise_estimation.odometry;
  const bool other_memory = options.strategy.renewal != options_.strategy.renewal;
  // Threads may not be had: then all stays as it is.
  if (other_threads) pool_ = std::make_unique<WorkerPool>(options.threads);
  strategy_.set_options(options.strategy);
  options_ = options;
  if (other_memory) start_memory();
  if (!is_initialized()) return;
  if (other_calibration) start_calibration();
  if (other_yaw_rate_bias) start_yaw_rate_bias();
  if (other_noise) start_noise_factors();
}

// The filter's steps, Mahmoud section III: move, weigh, renew, excite.
void BeaconMcl::update(const OdometryIncrement& odometry,
                       const std::vector<RangeObservation>& ranges) {
  checks::check_odometry(odometry);
  for (const RangeObservation& range : ranges) {
    checks::check_range(range);
    if (!finds_beacons()) beacon_index(range.beacon);
  }
  ++step_;
  time_ += odometry.duration;
  dead_reckoning_ = compose(dead_reckoning_, odometry.mean);
  if (memory_) memory_->add(odometry, ranges);
  if (solution_) solution_->since.emplace_back(odometry, ranges);
  for (const RangeObservation& range : ranges) remember(range);
  if (!is_initialized() && !finds_beacons()) {
    initialize_when_possible();
    return;
  }
  if (is_initialized()) move(without_known_errors(odometry));
  if (ranges.empty()) return;
  status_.log_likelihood = 0.0;
  status_.innovation_sigma = 0.0;
  ++status_.updates;
  if (finds_beacons() || is_drawn_from_memory_) {
    note_innovation_of_memory();
  } else {
    for (const RangeObservation& range : ranges) weigh(range);
    renew();
  }
  if (memory_ && (solution_ || time_ >= next_solution_)) solve_memory();
  status_.particles = static_cast<int>(particles_.size());
}

void BeaconMcl::move(const OdometryIncrement& odometry) {
  if (odometry.is_empty()) return;
  const bool estimates_bias = options_.yaw_rate_bias.estimate;
  const kernels::Motion motion =
      kernels::make_motion(odometry, estimates_bias ? options_.yaw_rate_bias.walk : 0.0);
  const RandomStream normals = stream(RandomPurpose::motion);
  const Eigen::Index count = particles_.size();
  work_.resize(std::max<Eigen::Index>(work_.size(), 4 * count));
  double* z = work_.data();
  pool_->for_each_block(count, [&](std::int64_t begin, std::int64_t end) {
    double* z0 = z + begin;
    double* z1 = z0 + count;
    double* z2 = z1 + count;
    double* z3 = z2 + count;
    normals.fill_normal4(static_cast<std::uint64_t>(begin), end - begin, z0, z1, z2, z3);
    kernels::move(
        motion, end - begin, z0, z1, z2, z3,
        {particles_.x.data() + begin, particles_.y.data() + begin,
         particles_.heading.data() + begin, particles_.yaw_rate_bias.data() + begin,
         particles_.yaw_rate_bias_variance.data() + begin,
         particles_.translation_factor.data() + begin, particles_.heading_factor.data() + begin});
  });
}

void BeaconMcl::weigh(const RangeObservation& observation) {
  const std::size_t beacon = beacon_index(observation.beacon);
  const RangeModelOptions& model = options_.ranges;

  kernels::Range range{};
  const RadioDifference difference = difference_of(beacon);
  range.range = difference.scale * observation.range + difference.offset;
  for (int axis = 0; axis < 3; ++axis) {
    range.beacon[axis] = beacons_[beacon].position[axis];
    range.antenna[axis] = observation.antenna[axis];
  }
  if (beacons_[beacon].is_planar) range.beacon[2] = range.antenna[2];
  const double base_variance =
      difference.scale * difference.scale * observation_variance(observation);
  range.variance = range_variance_factor() * base_variance;
  range.inlier_share = 1.0 - model.outlier_share;
  range.floor_density = model.outlier_share / (difference.scale * model.maximum_range);

  if (calibrates()) {
    const double since = time_ - calibration_time_;
    range.scale_walk = std::pow(options_.calibration.scale_walk, 2) * since;
    range.bias_walk = std::pow(options_.calibration.bias_walk, 2) * since;
    calibration_time_ = time_;
  }

  const Eigen::Index count = particles_.size();
  const double share = options_.strategy.tempering;
  Eigen::ArrayXd log_weights_before;
  if (share < 1.0) log_weights_before = particles_.log_weight;
  work_.resize(std::max<Eigen::Index>(work_.size(), 3 * count));
  double* innovations = work_.data();
  double* variances = innovations + count;
  pool_->for_each_block(count, [&](std::int64_t begin, std::int64_t end) {
    const kernels::Calibration calibration = {
        particles_.scale.data() + begin, particles_.bias.data() + begin,
        particles_.scale_variance.data() + begin, particles_.scale_bias_covariance.data() + begin,
        particles_.bias_variance.data() + begin};
    kernels::weigh(range, end - begin, particles_.x.data() + begin, particles_.y.data() + begin,
                   particles_.heading.data() + begin, calibration,
                   particles_.log_weight.data() + begin, innovations + begin, variances + begin,
                   variances + count + begin);
  });

  // Innovation of the population, against its belief before the range.
  const Eigen::Map<const Eigen::ArrayXd> innovation(innovations, count);
  const Eigen::Map<const Eigen::ArrayXd> variance(variances, count);
  const ScalarEstimate pooled_innovation = pooled(particles_.weight, innovation, variance);
  status_.observation = observation.beacon;
  status_.innovation = pooled_innovation.mean;
  status_.innovation_sigma = pooled_innovation.sigma;

  normalize_weights(share < 1.0 ? temper(share, log_weights_before, particles_.log_weight) : 0.0);

  if (options_.noise_estimation.ranges) {
    learn_range_noise(base_variance, range.variance, innovation, variance,
                      Eigen::Map<const Eigen::ArrayXd>(variances + count, count));
  }

  // Likelihood in units of the Gaussian's peak, so that ranges of different noise compare.
  const double peak = std::sqrt(2.0 * kPi * range.variance);
  const double relative = std::min(1.0, peak * std::exp(last_log_sum_));
  ++likelihoods_;
  const double slow =
      std::max(options_.recovery.slow_rate, 1.0 / static_cast<double>(likelihoods_));
  const double fast =
      std::max(options_.recovery.fast_rate, 1.0 / static_cast<double>(likelihoods_));
  slow_likelihood_ += slow * (relative - slow_likelihood_);
  fast_likelihood_ += fast * (relative - fast_likelihood_);
}

void BeaconMcl::normalize_weights(double left_out) {
  const bool is_usable = is_normalizable(particles_.log_weight);
  WeightSummary summary;
  if (is_usable) summary = normalize(particles_.log_weight, particles_.weight);
  summary.log_sum += left_out;
  // Where no particle can explain the range all likelihoods are the smallest there is.
  if (!is_usable || summary.log_sum < kernels::kSmallestLogLikelihood + 1e-6) {
    ++status_.weight_resets;
    reset_weights();
    last_log_sum_ = -std::numeric_limits<double>::infinity();
    return;
  }
  last_log_sum_ = summary.log_sum;
  status_.log_likelihood += summary.log_sum;
  status_.effective_sample_size = summary.effective_sample_size;
  status_.entropy_sample_size = summary.entropy_sample_size;
}

void BeaconMcl::reset_weights() {
  const double count = static_cast<double>(particles_.size());
  particles_.log_weight.setConstant(-std::log(count));
  particles_.weight.setConstant(1.0 / count);
  status_.effective_sample_size = count;
  status_.entropy_sample_size = count;
}

// Expectation-maximisation: the expected square of the range's noise, given the population after
// the range, averaged over the past with forgetting. A particle that takes the range for an outlier
// says nothing about the noise.
void BeaconMcl::learn_range_noise(double nominal_variance, double variance, ConstArray innovation,
                                  ConstArray innovation_variance, ConstArray inlier) {
  const double keep = std::exp(-1.0 / options_.noise_estimation.memory);
  const kernels::NoiseSums sums =
      kernels::noise_sums(variance, innovation.size(), particles_.weight.data(), innovation.data(),
                          innovation_variance.data(), inlier.data());
  const double squares = sums.squares / nominal_variance;
  if (!std::isfinite(squares)) return;
  range_squares_ = keep * range_squares_ + squares;
  range_count_ = keep * range_count_ + sums.count;
}

double BeaconMcl::range_variance_factor() const {
  if (!options_.noise_estimation.ranges) return 1.0;
  return std::min(kLargestVarianceFactor,
                  std::max(1.0 / kLargestVarianceFactor, range_squares_ / range_count_));
}

void BeaconMcl::vary_noise_factors() {
  const NoiseEstimationOptions& noise = options_.noise_estimation;
  if (!noise.odometry) return;
  const RandomStream normals = stream(RandomPurpose::noise_factors);
  const Eigen::Index count = particles_.size();
  work_.resize(std::max<Eigen::Index>(work_.size(), 2 * count));
  normals.fill_normal(0, 2 * count, work_.data());
  const auto vary = [&](Eigen::ArrayXd& factors, const double* z) {
    for (Eigen::Index i = 0; i < count; ++i) {
      const double varied = factors[i] * exp_vector(noise.odometry_walk * z[i]);
      factors[i] = std::min(kLargestFactor, std::max(1.0 / kLargestFactor, varied));
    }
  };
  vary(particles_.translation_factor, work_.data());
  vary(particles_.heading_factor, work_.data() + count);
}

PoseEstimate BeaconMcl::estimate() const {
  if (!is_initialized())
    throw Error("there is no estimate yet: particles start with the first ranges");
  const PoseStatistics statistics =
      pose_statistics(particles_.weight, particles_.x, particles_.y, particles_.heading);
  return {statistics.mean, statistics.covariance};
}

std::vector<CalibrationEstimate> BeaconMcl::calibration() const {
  std::vector<CalibrationEstimate> estimates;
  if (finds_beacons() || is_drawn_from_memory_) {
    for (const RadioKnowledge& radio : memory_->radios()) {
      estimates.push_back({radio.id, radio.calibration.scale, radio.scale_sigma,
                           radio.calibration.bias, radio.bias_sigma});
    }
    return estimates;
  }
  if (!calibrates() || !is_initialized()) {
    for (std::size_t i = 0; i < beacons_.size(); ++i) {
      estimates.push_back({beacons_[i].id, nominal_[i].scale, 0.0, nominal_[i].bias, 0.0});
    }
    return estimates;
  }
  const bool all_alike = std::all_of(nominal_.begin(), nominal_.end(), [&](const auto& nominal) {
    return nominal.scale == nominal_[0].scale && nominal.bias == nominal_[0].bias;
  });
  const ScalarEstimate scale =
      pooled(particles_.weight, particles_.scale, particles_.scale_variance);
  const ScalarEstimate bias = pooled(particles_.weight, particles_.bias, particles_.bias_variance);
  for (std::size_t i = 0; i < (all_alike ? 1 : beacons_.size()); ++i) {
    const RadioDifference difference = difference_of(i);
    estimates.push_back({all_alike ? kAllBeacons : beacons_[i].id, scale.mean / difference.scale,
                         scale.sigma / difference.scale,
                         (bias.mean - difference.offset) / difference.scale,
                         bias.sigma / difference.scale});
  }
  return estimates;
}

ScalarEstimate BeaconMcl::yaw_rate_bias() const {
  const double prior = options_.yaw_rate_bias.estimate ? options_.yaw_rate_bias.sigma : 0.0;
  if (!is_initialized()) return {0.0, prior};
  return pooled(particles_.weight, particles_.yaw_rate_bias, particles_.yaw_rate_bias_variance);
}

double BeaconMcl::corrected_range(int beacon, double range) const {
  if (!finds_beacons()) beacon_index(beacon);  // which throws for those that are not known
  for (const CalibrationEstimate& estimate : calibration()) {
    if (estimate.beacon != beacon && estimate.beacon != kAllBeacons) continue;
    return (range - estimate.bias) / estimate.scale;
  }
  return range;
}

std::size_t BeaconMcl::beacon_index(int id) const {
  for (std::size_t i = 0; i < beacons_.size(); ++i) {
    if (beacons_[i].id == id) return i;
  }
  std::string known;
  for (const Beacon& beacon : beacons_)
    known += (known.empty() ? "" : ", ") + std::to_string(beacon.id);
  throw Error("beacon " + std::to_string(id) + " is not known; known are " + known);
}

// Errors of all radios are estimated as those of the first; what is known of how another
// differs from it is taken out of that one's ranges.
BeaconMcl::RadioDifference BeaconMcl::difference_of(std::size_t beacon) const {
  RadioDifference difference;
  difference.scale = nominal_[0].scale / nominal_[beacon].scale;
  difference.offset = nominal_[0].bias - difference.scale * nominal_[beacon].bias;
  return difference;
}

double BeaconMcl::observation_variance(const RangeObservation& range) const {
  const double sigma = nominal_[beacon_index(range.beacon)].sigma;
  if (sigma > 0.0) return sigma * sigma;
  return range.variance > 0.0 ? range.variance : options_.ranges.sigma * options_.ranges.sigma;
}

RandomStream BeaconMcl::stream(RandomPurpose purpose) const {
  return {seed_, purpose, step_};
}

}  // namespace pf_resampling
