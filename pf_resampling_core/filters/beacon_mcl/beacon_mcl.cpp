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

// Bounds of what is learnt about noise: beyond them the model is wrong in another way.
constexpr double kLargestFactor = 30.0;
constexpr double kLargestVarianceFactor = kLargestFactor * kLargestFactor;
// Of a likelihood: below it the squares of weights vanish.
constexpr double kSquareVanishes = 1e-150;

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
                     std::uint64_t seed, const RangeCalibrations& calibration)
    : options_(options), beacons_(std::move(beacons)), calibration_(calibration), seed_(seed) {
  validate(options_);
  checks::check_beacons(beacons_, finds_beacons() ? 0 : 1);
  checks::check_calibration(calibration);
  for (const Beacon& beacon : beacons_) {
    nominal_.push_back(calibration_of(beacon.id, calibration));
  }
  pool_ = std::make_unique<WorkerPool>(options_.threads);
  reset();
}

void BeaconMcl::reset() {
  progress_ = BeaconMclProgress{};
  particles_ = BeaconMclParticles{};
  strategy_ = Strategy(options_.strategy);
  status_ = BeaconMclStatus{};
  progress_.range_squares = progress_.range_count = options_.noise_estimation.prior_count;
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
  ++progress_.step;
  progress_.time += odometry.duration;
  progress_.dead_reckoning = compose(progress_.dead_reckoning, odometry.mean);
  if (memory_) memory_->add(odometry, ranges);
  if (solution_) solution_->since.emplace_back(odometry, ranges);
  for (const RangeObservation& range : ranges) remember(range);
  if (!is_initialized() && !finds_beacons()) {
    initialize_when_possible();
    return;
  }
  WorkerPool::Body move;
  if (is_initialized()) move = motion_of(without_known_errors(odometry));
  const bool weighs = !ranges.empty() && !finds_beacons() && !progress_.is_drawn_from_memory;
  if (move && !weighs) pool_->for_each_block(particles_.size(), move);
  if (ranges.empty()) return;
  status_.log_likelihood = 0.0;
  status_.innovation_sigma = 0.0;
  ++status_.updates;
  if (!weighs) {
    note_innovation_of_memory();
  } else {
    // Those of a moment together, as many as are taken in at one go.
    const RangeObservation* const end = ranges.data() + ranges.size();
    for (const RangeObservation* first = ranges.data(); first < end;
         first += kernels::kMostRanges) {
      weigh(first, static_cast<int>(std::min<std::ptrdiff_t>(end - first, kernels::kMostRanges)),
            move);
      move = nullptr;
    }
    renew();
  }
  if (memory_ && (solution_ || progress_.time >= progress_.next_solution)) solve_memory();
  status_.particles = static_cast<int>(particles_.size());
}

// What moves a block of particles; nothing, where the odometry is empty.
WorkerPool::Body BeaconMcl::motion_of(const OdometryIncrement& odometry) {
  if (odometry.is_empty()) return nullptr;
  const bool estimates_bias = options_.yaw_rate_bias.estimate;
  const kernels::Motion motion =
      kernels::make_motion(odometry, estimates_bias ? options_.yaw_rate_bias.walk : 0.0);
  return [this, motion, normals = stream(RandomPurpose::motion)](std::int64_t begin,
                                                                 std::int64_t end) {
    // Few enough at a time that their random numbers never leave the cache.
    constexpr std::int64_t kFew = 256;
    float z[4][kFew];
    BeaconMclParticles& p = particles_;
    for (std::int64_t i = begin; i < end; i += kFew) {
      const std::int64_t few = std::min(kFew, end - i);
      normals.fill_single_normal4(static_cast<std::uint64_t>(i), few, z[0], z[1], z[2], z[3]);
      kernels::move(motion, few, z[0], z[1], z[2], z[3],
                    {p.x.data() + i, p.y.data() + i, p.heading.data() + i,
                     p.yaw_rate_bias.data() + i, p.yaw_rate_bias_variance.data() + i,
                     p.translation_factor.data() + i, p.heading_factor.data() + i});
    }
  };
}

kernels::Range BeaconMcl::range_of(const RangeObservation& observation) {
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
  range.nominal = difference.scale * difference.scale * observation_variance(observation);
  range.variance = range_variance_factor() * range.nominal;
  range.inlier_share = 1.0 - model.outlier_share;
  range.floor_density = model.outlier_share / (difference.scale * model.maximum_range);
  if (calibrates()) {
    const double since = progress_.time - progress_.calibration_time;
    range.scale_walk = std::pow(options_.calibration.scale_walk, 2) * since;
    range.bias_walk = std::pow(options_.calibration.bias_walk, 2) * since;
    progress_.calibration_time = progress_.time;
  }
  return range;
}

// Moves the particles first, if there is a `move`: while a block of them is at hand.
void BeaconMcl::weigh(const RangeObservation* observations, int count,
                      const WorkerPool::Body& move) {
  kernels::Range ranges[kernels::kMostRanges];
  for (int k = 0; k < count; ++k) ranges[k] = range_of(observations[k]);
  const kernels::Weighing weighing = {options_.strategy.tempering,
                                      std::exp(-1.0 / options_.noise_estimation.memory),
                                      calibrates(), options_.noise_estimation.ranges};

  struct Sums {
    kernels::RangeSums ranges;
    WeightSums weights;
  };
  const Eigen::Index size = particles_.size();
  BeaconMclParticles& p = particles_;
  std::vector<Sums> blocks(
      static_cast<std::size_t>((size + WorkerPool::kBlockSize - 1) / WorkerPool::kBlockSize));
  pool_->for_each_block(size, [&](std::int64_t i, std::int64_t end) {
    if (move) move(i, end);
    Sums& sums = blocks[static_cast<std::size_t>(i / WorkerPool::kBlockSize)];
    kernels::weigh(weighing, ranges, count, end - i, p.x.data() + i, p.y.data() + i,
                   p.heading.data() + i, p.weight.data() + i,
                   {p.scale.data() + i, p.bias.data() + i, p.scale_variance.data() + i,
                    p.scale_bias_covariance.data() + i, p.bias_variance.data() + i},
                   p.log_weight.data() + i, &sums.ranges);
    exponentials(p.log_weight.data() + i, 0.0, end - i, p.weight.data() + i, &sums.weights);
  });
  Sums sums{};
  for (const Sums& block : blocks) {
    kernels::add(block.ranges, &sums.ranges);
    add(block.weights, &sums.weights);
  }

  const double* likelihoods = sums.ranges.likelihood;
  const double before_last = count > 1 ? likelihoods[count - 2] : 1.0;
  const double innovation = sums.ranges.innovation / before_last;
  status_.observation = observations[count - 1].beacon;
  status_.innovation = innovation;
  status_.innovation_sigma = std::sqrt(
      std::max(0.0, sums.ranges.innovation_square / before_last - innovation * innovation));
  normalize_weights(likelihoods, count, sums.weights);
  learn_range_noise(weighing, count, sums.ranges);
  double before = 1.0;
  for (int k = 0; k < count; before = likelihoods[k++]) {
    follow_likelihood(ranges[k].variance, likelihoods[k] / before);
  }
}

// The weights are normalised by the sums; where no particle can explain a range, they all become
// equal. All likelihoods are then the smallest there is.
void BeaconMcl::normalize_weights(const double* likelihoods, int count, const WeightSums& sums) {
  bool is_explained = true;
  for (int k = 0; k < count; ++k) {
    const double before = k > 0 ? std::max(1.0, likelihoods[k - 1]) : 1.0;
    is_explained &= std::log(likelihoods[k] / before) > kernels::kSmallestLogLikelihood + 1e-6;
  }
  if (!is_explained || !std::isfinite(likelihoods[count - 1])) {
    ++status_.weight_resets;
    reset_weights();
    return;
  }
  WeightSummary summary;
  if (likelihoods[count - 1] < kSquareVanishes) {
    summary = normalize(particles_.log_weight, particles_.weight);
  } else {
    double inverse_sum = 1.0;
    summary = summary_of(sums, 0.0, particles_.size(), &inverse_sum);
    const auto rescale_block = [&](std::int64_t begin, std::int64_t end) {
      rescale(inverse_sum, summary.log_sum, end - begin, particles_.weight.data() + begin,
              particles_.log_weight.data() + begin);
    };
    pool_->for_each_block(particles_.size(), rescale_block, WorkerPool::kManyCheapElements);
  }
  status_.log_likelihood += std::log(likelihoods[count - 1]);
  status_.effective_sample_size = summary.effective_sample_size;
  status_.entropy_sample_size = summary.entropy_sample_size;
}

// Likelihood in units of the Gaussian's peak, so that ranges of different noise compare.
void BeaconMcl::follow_likelihood(double variance, double likelihood) {
  const double relative = std::min(1.0, std::sqrt(2.0 * kPi * variance) * likelihood);
  ++progress_.likelihoods;
  const double slow =
      std::max(options_.recovery.slow_rate, 1.0 / static_cast<double>(progress_.likelihoods));
  const double fast =
      std::max(options_.recovery.fast_rate, 1.0 / static_cast<double>(progress_.likelihoods));
  progress_.slow_likelihood += slow * (relative - progress_.slow_likelihood);
  progress_.fast_likelihood += fast * (relative - progress_.fast_likelihood);
}

void BeaconMcl::reset_weights() {
  const double count = static_cast<double>(particles_.size());
  particles_.log_weight.setConstant(-std::log(count));
  particles_.weight.setConstant(1.0 / count);
  status_.effective_sample_size = count;
  status_.entropy_sample_size = count;
}

// Expectation-maximisation: the expected squares of the ranges' noise, given the population after
// them, averaged over the past with forgetting. A particle that takes a range for an outlier says
// nothing about the noise.
void BeaconMcl::learn_range_noise(const kernels::Weighing& weighing, int count,
                                  const kernels::RangeSums& sums) {
  const double all = sums.likelihood[count - 1];
  const double squares = sums.noise_squares / all;
  if (!weighing.learns_noise || !std::isfinite(squares)) return;
  const double keep = std::pow(weighing.keep, count);
  progress_.range_squares = keep * progress_.range_squares + squares;
  progress_.range_count = keep * progress_.range_count + sums.noise_count / all;
}

double BeaconMcl::range_variance_factor() const {
  if (!options_.noise_estimation.ranges) return 1.0;
  return std::min(
      kLargestVarianceFactor,
      std::max(1.0 / kLargestVarianceFactor, progress_.range_squares / progress_.range_count));
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
  return pose_statistics(particles_.weight, particles_.x, particles_.y, particles_.heading,
                         pool_.get());
}

std::vector<CalibrationEstimate> BeaconMcl::calibration() const {
  std::vector<CalibrationEstimate> estimates;
  if (finds_beacons() || progress_.is_drawn_from_memory) {
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
    estimates.push_back({all_alike ? kAllRadios : beacons_[i].id, scale.mean / difference.scale,
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
    if (estimate.beacon != beacon && estimate.beacon != kAllRadios) continue;
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
  return {seed_, purpose, progress_.step};
}

}  // namespace pf_resampling
