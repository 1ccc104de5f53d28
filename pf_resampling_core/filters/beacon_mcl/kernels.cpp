#include "pf_resampling_core/filters/beacon_mcl/kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling::kernels {
namespace {

// Added to every likelihood; kSmallestLogLikelihood is its logarithm.
constexpr double kSmallestLikelihood = 1e-300;

template <int kBytes>
PF_RESAMPLING_INLINE void move_in(const Motion& motion, std::int64_t count, const float* z0,
                                  const float* z1, const float* z2, const float* z3, double* x,
                                  double* y, double* heading, double* yaw_rate_bias,
                                  double* bias_variance, const double* translation_factor,
                                  const double* heading_factor) {
  const Motion m = motion;
  for (std::int64_t i = 0; i < count; ++i) {
    // Dead reckoning turns by its bias too much: the drawn bias is taken out.
    const double bias = yaw_rate_bias[i] + std::sqrt(bias_variance[i]) * double{z3[i]};
    const double turn_noise = heading_factor[i] * double{z2[i]};
    const double along_noise = translation_factor[i] * double{z0[i]};
    const double across_noise = translation_factor[i] * double{z1[i]};
    const double turn = m.heading_noise * turn_noise - m.sensitivity[2] * bias;
    const double dx =
        m.mean[0] - m.sensitivity[0] * bias + m.x_of_heading * turn_noise + m.x_noise * along_noise;
    const double dy = m.mean[1] - m.sensitivity[1] * bias + m.y_of_heading * turn_noise +
                      m.y_of_x * along_noise + m.y_noise * across_noise;

    // Kalman filter of the bias: the turn that was drawn is its observation.
    const double noise = m.heading_noise * heading_factor[i];
    const double to_bias = bias_variance[i] * m.sensitivity[2];
    const double turn_variance = noise * noise + m.sensitivity[2] * to_bias;
    const double gain = turn_variance > 0.0 ? to_bias / turn_variance : 0.0;
    yaw_rate_bias[i] -= gain * (turn + m.sensitivity[2] * yaw_rate_bias[i]);
    bias_variance[i] += m.bias_walk - gain * to_bias;

    double sine;
    double cosine;
    sincos_vector(heading[i], &sine, &cosine);
    x[i] += cosine * dx - sine * dy;
    y[i] += sine * dx + cosine * dy;
    heading[i] = wrap_angle_vector(heading[i] + m.mean[2] + turn);
  }
}

// Particles that take in one range after the other while what is known of them is at hand.
constexpr int kBlock = 256;

struct Block {
  double sine[kBlock], cosine[kBlock];  // of the heading
  double square[kBlock];                // of the distance to the beacon, m^2
  double likelihood[kBlock];            // of all ranges so far
  double before[kBlock];                // and without the last one
  double innovation[kBlock];            // of the last one, m
  double innovation_square[kBlock];     // and its square plus variance
  double noise_squares[kBlock];         // as in RangeSums
  double noise_count[kBlock];
};

PF_RESAMPLING_INLINE void headings(int count, const double* heading, Block* block) {
  for (int i = 0; i < count; ++i) sincos_vector(heading[i], &block->sine[i], &block->cosine[i]);
}

PF_RESAMPLING_INLINE bool has_lever(const Range& range) {
  return range.antenna[0] != 0.0 || range.antenna[1] != 0.0;
}

// From the antenna, of a robot at these poses, to the beacon.
PF_RESAMPLING_INLINE void squares_of_distances(const Range& range, int count,
                                               const double* __restrict x,
                                               const double* __restrict y,
                                               Block* __restrict block) {
  const double dz = range.beacon[2] - range.antenna[2];
  if (!has_lever(range)) {
    for (int i = 0; i < count; ++i) {
      const double dx = range.beacon[0] - x[i];
      const double dy = range.beacon[1] - y[i];
      block->square[i] = dx * dx + dy * dy + dz * dz;
    }
    return;
  }
  for (int i = 0; i < count; ++i) {
    const double sine = block->sine[i];
    const double cosine = block->cosine[i];
    const double dx =
        range.beacon[0] - (x[i] + (cosine * range.antenna[0] - sine * range.antenna[1]));
    const double dy =
        range.beacon[1] - (y[i] + (sine * range.antenna[0] + cosine * range.antenna[1]));
    block->square[i] = dx * dx + dy * dy + dz * dz;
  }
}

PF_RESAMPLING_INLINE void take_in(const Range& range, double keep, bool calibrates, bool learns,
                                  int count, const Calibration& calibration,
                                  Block* __restrict block) {
  constexpr double kInverseSqrtTwoPi = 0.3989422804014327;
  double* __restrict scale = calibration.scale;
  double* __restrict bias = calibration.bias;
  double* __restrict scale_variance = calibration.scale_variance;
  double* __restrict covariance = calibration.scale_bias_covariance;
  double* __restrict bias_variance = calibration.bias_variance;
  const double peak = range.inlier_share * kInverseSqrtTwoPi;
  const double floor = range.floor_density + kSmallestLikelihood;
  const double factor = range.variance / range.nominal;
  for (int i = 0; i < count; ++i) {
    const double distance = std::sqrt(block->square[i]);
    const double ss = calibrates ? scale_variance[i] + range.scale_walk : 0.0;
    const double sb = calibrates ? covariance[i] : 0.0;
    const double bb = calibrates ? bias_variance[i] + range.bias_walk : 0.0;
    const double to_scale = distance * ss + sb;
    const double to_bias = distance * sb + bb;
    const double spread = calibrates ? distance * to_scale + to_bias : 0.0;
    const double variance = range.variance + spread;
    const double difference = range.range - (scale[i] * distance + bias[i]);
    const double square = difference * difference;
    const double root = inverse_sqrt_vector(variance);
    const double inverse = root * root;
    const double deviation = square * inverse;

    const double gaussian = peak * root * exp_likelihood_vector(-0.5 * deviation);
    const double likelihood = gaussian + floor;
    const double product = block->likelihood[i] * likelihood;
    block->likelihood[i] = product > kSmallestLikelihood ? product : kSmallestLikelihood;
    block->innovation[i] = difference;
    block->innovation_square[i] = square + variance;
    if (!learns && !calibrates) continue;

    // The noise given the innovation is normal: mean R/S times it, variance R (S - R) / S.
    const double inlier = gaussian / likelihood;
    const double taken_in = inlier * inverse;
    const double noise = taken_in * factor * (range.variance * deviation + spread);
    block->noise_squares[i] = keep * block->noise_squares[i] + noise;
    block->noise_count[i] = keep * block->noise_count[i] + inlier;
    if (!calibrates) continue;

    // Mean and covariance of the mixture of "taken in" and "was an outlier".
    const double gain = taken_in * difference;
    const double shrink = taken_in * (1.0 - (1.0 - inlier) * deviation);
    scale[i] += to_scale * gain;
    bias[i] += to_bias * gain;
    scale_variance[i] = ss - shrink * to_scale * to_scale;
    covariance[i] = sb - shrink * to_scale * to_bias;
    bias_variance[i] = bb - shrink * to_bias * to_bias;
  }
}

// Σ weight · likelihood · value, or without a value; in eight lanes, so in one order on every
// machine.
template <int kBytes>
PF_RESAMPLING_INLINE double weighted_sum(int count, const double* weight, const double* likelihood,
                                         const double* value) {
  using R = Registers<kBytes>;
  typename R::Doubles sums[R::kParts] = {};
  const int whole = count / kLanes * kLanes;
  for (int i = 0; i < whole; i += kLanes) {
#pragma GCC unroll 4
    for (int part = 0; part < R::kParts; ++part) {
      const int at = i + part * R::kWidth;
      typename R::Doubles w, l;
      std::memcpy(&w, weight + at, sizeof w);
      std::memcpy(&l, likelihood + at, sizeof l);
      typename R::Doubles product = w * l;
      if (value != nullptr) {
        typename R::Doubles v;
        std::memcpy(&v, value + at, sizeof v);
        product *= v;
      }
      sums[part] += product;
    }
  }
  double lanes[kLanes];
  std::memcpy(lanes, sums, sizeof lanes);
  for (int i = whole; i < count; ++i) {
    const double product = weight[i] * likelihood[i];
    lanes[i - whole] += value != nullptr ? product * value[i] : product;
  }
  return sum_of_lanes(lanes);
}

PF_RESAMPLING_INLINE void take_up(double tempering, int count, const double* __restrict likelihood,
                                  double* __restrict log_weight) {
  for (int i = 0; i < count; ++i) log_weight[i] += tempering * log_vector(likelihood[i]);
}

template <int kBytes>
PF_RESAMPLING_INLINE void weigh_in(const Weighing& weighing, const Range* range, int ranges,
                                   std::int64_t all, const double* x, const double* y,
                                   const double* heading, const double* weight,
                                   const Calibration& calibration, double* log_weight,
                                   RangeSums* sums) {
  const Weighing w = weighing;
  bool needs_headings = false;
  for (int k = 0; k < ranges; ++k) needs_headings |= has_lever(range[k]);
  *sums = RangeSums{};
  Block block;
  for (std::int64_t begin = 0; begin < all; begin += kBlock) {
    const int count = static_cast<int>(std::min<std::int64_t>(kBlock, all - begin));
    const double* prior = weight + begin;
    const Calibration c = {
        calibration.scale + begin, calibration.bias + begin, calibration.scale_variance + begin,
        calibration.scale_bias_covariance + begin, calibration.bias_variance + begin};
    if (needs_headings) headings(count, heading + begin, &block);
    for (int i = 0; i < count; ++i) {
      block.likelihood[i] = 1.0;
      block.noise_squares[i] = block.noise_count[i] = 0.0;
    }
    for (int k = 0; k < ranges; ++k) {
      const Range r = range[k];
      squares_of_distances(r, count, x + begin, y + begin, &block);
      if (k == ranges - 1) std::copy(block.likelihood, block.likelihood + count, block.before);
      if (w.calibrates) {
        take_in(r, w.keep, true, true, count, c, &block);
      } else if (w.learns_noise) {
        take_in(r, w.keep, false, true, count, c, &block);
      } else {
        take_in(r, w.keep, false, false, count, c, &block);
      }
      sums->likelihood[k] += weighted_sum<kBytes>(count, prior, block.likelihood, nullptr);
    }
    sums->innovation += weighted_sum<kBytes>(count, prior, block.before, block.innovation);
    sums->innovation_square +=
        weighted_sum<kBytes>(count, prior, block.before, block.innovation_square);
    if (w.learns_noise) {
      sums->noise_squares +=
          weighted_sum<kBytes>(count, prior, block.likelihood, block.noise_squares);
      sums->noise_count += weighted_sum<kBytes>(count, prior, block.likelihood, block.noise_count);
    }
    take_up(w.tempering, count, block.likelihood, log_weight + begin);
  }
}

}  // namespace

Motion make_motion(const OdometryIncrement& odometry, double yaw_rate_bias_walk) {
  Eigen::Matrix3d heading_first;
  const int order[3] = {2, 0, 1};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      heading_first(row, column) = odometry.covariance(order[row], order[column]);
    }
  }
  const Eigen::Matrix3d root = lower_root(heading_first);
  Motion motion{};
  motion.mean[0] = odometry.mean.x;
  motion.mean[1] = odometry.mean.y;
  motion.mean[2] = odometry.mean.heading;
  for (int i = 0; i < 3; ++i) motion.sensitivity[i] = odometry.yaw_rate_sensitivity[i];
  motion.heading_noise = root(0, 0);
  motion.x_of_heading = root(1, 0);
  motion.y_of_heading = root(2, 0);
  motion.x_noise = root(1, 1);
  motion.y_of_x = root(2, 1);
  motion.y_noise = root(2, 2);
  motion.bias_walk = yaw_rate_bias_walk * yaw_rate_bias_walk * odometry.duration;
  return motion;
}

PF_RESAMPLING_BY_WIDTH(move_columns, move_in,
                       (const Motion& motion, std::int64_t count, const float* __restrict z0,
                        const float* __restrict z1, const float* __restrict z2,
                        const float* __restrict z3, double* __restrict x, double* __restrict y,
                        double* __restrict heading, double* __restrict yaw_rate_bias,
                        double* __restrict bias_variance,
                        const double* __restrict translation_factor,
                        const double* __restrict heading_factor),
                       (motion, count, z0, z1, z2, z3, x, y, heading, yaw_rate_bias, bias_variance,
                        translation_factor, heading_factor))

void move(const Motion& motion, std::int64_t count, const float* z0, const float* z1,
          const float* z2, const float* z3, const MovingParticles& p) {
  move_columns(motion, count, z0, z1, z2, z3, p.x, p.y, p.heading, p.yaw_rate_bias,
               p.yaw_rate_bias_variance, p.translation_factor, p.heading_factor);
}

PF_RESAMPLING_BY_WIDTH(weigh, weigh_in,
                       (const Weighing& weighing, const Range* range, int ranges,
                        std::int64_t count, const double* x, const double* y, const double* heading,
                        const double* weight, const Calibration& calibration, double* log_weight,
                        RangeSums* sums),
                       (weighing, range, ranges, count, x, y, heading, weight, calibration,
                        log_weight, sums))

void add(const RangeSums& other, RangeSums* sums) {
  for (int k = 0; k < kMostRanges; ++k) sums->likelihood[k] += other.likelihood[k];
  sums->innovation += other.innovation;
  sums->innovation_square += other.innovation_square;
  sums->noise_squares += other.noise_squares;
  sums->noise_count += other.noise_count;
}

}  // namespace pf_resampling::kernels
