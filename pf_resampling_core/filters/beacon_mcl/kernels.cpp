#include "pf_resampling_core/filters/beacon_mcl/kernels.hpp"

#include <cmath>

#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling::kernels {
namespace {

// Below this a likelihood is taken as this; kSmallestLogLikelihood is its logarithm.
constexpr double kSmallestLikelihood = 1e-300;

PF_RESAMPLING_VECTOR_CLONES
void move_clones(const Motion& motion, std::int64_t count, const double* __restrict z0,
                 const double* __restrict z1, const double* __restrict z2,
                 const double* __restrict z3, double* __restrict x, double* __restrict y,
                 double* __restrict heading, double* __restrict yaw_rate_bias,
                 double* __restrict bias_variance, const double* __restrict translation_factor,
                 const double* __restrict heading_factor) {
  const Motion m = motion;
  for (std::int64_t i = 0; i < count; ++i) {
    // Dead reckoning turns by its bias too much: the drawn bias is taken out.
    const double bias = yaw_rate_bias[i] + std::sqrt(bias_variance[i]) * z3[i];
    const double turn_noise = heading_factor[i] * z2[i];
    const double along_noise = translation_factor[i] * z0[i];
    const double across_noise = translation_factor[i] * z1[i];
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

struct Likelihood {
  double log;
  double inlier;  // share of the likelihood that is the Gaussian's
};

PF_RESAMPLING_INLINE Likelihood likelihood(const Range& range, double innovation, double variance) {
  constexpr double kInverseSqrtTwoPi = 0.3989422804014327;
  const double exponent = -0.5 * innovation * innovation / variance;
  const double gaussian =
      range.inlier_share * kInverseSqrtTwoPi / std::sqrt(variance) * exp_vector(exponent);
  const double total = gaussian + range.floor_density;
  const double bounded = total > kSmallestLikelihood ? total : kSmallestLikelihood;
  return {log_vector(bounded), gaussian / bounded};
}

// Distance from the antenna, of a robot at this pose, to the beacon.
PF_RESAMPLING_INLINE double distance_to_beacon(const Range& range, double x, double y,
                                               double heading, bool has_lever) {
  double antenna_x = x;
  double antenna_y = y;
  if (has_lever) {
    double sine;
    double cosine;
    sincos_vector(heading, &sine, &cosine);
    antenna_x += cosine * range.antenna[0] - sine * range.antenna[1];
    antenna_y += sine * range.antenna[0] + cosine * range.antenna[1];
  }
  const double dx = range.beacon[0] - antenna_x;
  const double dy = range.beacon[1] - antenna_y;
  const double dz = range.beacon[2] - range.antenna[2];
  return std::sqrt(dx * dx + dy * dy + dz * dz);
}

PF_RESAMPLING_INLINE void weigh_all(const Range& range, bool has_lever, std::int64_t count,
                                    const double* x, const double* y, const double* heading,
                                    const Calibration& calibration, double* log_weight,
                                    double* innovation, double* innovation_variance,
                                    double* inlier) {
  double* __restrict scale = calibration.scale;
  double* __restrict bias = calibration.bias;
  double* __restrict scale_variance = calibration.scale_variance;
  double* __restrict covariance = calibration.scale_bias_covariance;
  double* __restrict bias_variance = calibration.bias_variance;
  for (std::int64_t i = 0; i < count; ++i) {
    const double distance = distance_to_beacon(range, x[i], y[i], heading[i], has_lever);
    const double ss = scale_variance[i] + range.scale_walk;
    const double sb = covariance[i];
    const double bb = bias_variance[i] + range.bias_walk;
    const double to_scale = distance * ss + sb;
    const double to_bias = distance * sb + bb;
    const double variance = range.variance + distance * to_scale + to_bias;
    const double difference = range.range - (scale[i] * distance + bias[i]);
    const Likelihood l = likelihood(range, difference, variance);
    log_weight[i] += l.log;
    innovation[i] = difference;
    innovation_variance[i] = variance;
    inlier[i] = l.inlier;

    // Mean and covariance of the mixture of "taken in" and "was an outlier".
    const double inverse = 1.0 / variance;
    const double gain = l.inlier * inverse * difference;
    const double shrink =
        l.inlier * inverse * (1.0 - (1.0 - l.inlier) * inverse * difference * difference);
    scale[i] += to_scale * gain;
    bias[i] += to_bias * gain;
    scale_variance[i] = ss - shrink * to_scale * to_scale;
    covariance[i] = sb - shrink * to_scale * to_bias;
    bias_variance[i] = bb - shrink * to_bias * to_bias;
  }
}

PF_RESAMPLING_VECTOR_CLONES
void weigh_clones(const Range& range, bool has_lever, std::int64_t count,
                  const double* __restrict x, const double* __restrict y,
                  const double* __restrict heading, const Calibration& calibration,
                  double* __restrict log_weight, double* __restrict innovation,
                  double* __restrict innovation_variance, double* __restrict inlier) {
  const Range r = range;
  if (has_lever) {
    weigh_all(r, true, count, x, y, heading, calibration, log_weight, innovation,
              innovation_variance, inlier);
  } else {
    weigh_all(r, false, count, x, y, heading, calibration, log_weight, innovation,
              innovation_variance, inlier);
  }
}

PF_RESAMPLING_INLINE void add_noise(double variance, double weight, double innovation,
                                    double innovation_variance, double inlier, double* squares,
                                    double* count) {
  const double share = variance / innovation_variance;
  const double residual = share * innovation;
  const double believed = weight * inlier;
  *squares += believed * (residual * residual + share * (innovation_variance - variance));
  *count += believed;
}

PF_RESAMPLING_VECTOR_CLONES
void noise_sums_clones(double variance, std::int64_t count, const double* weight,
                       const double* innovation, const double* innovation_variance,
                       const double* inlier, double* squares, double* counts) {
  std::int64_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      add_noise(variance, weight[i + lane], innovation[i + lane], innovation_variance[i + lane],
                inlier[i + lane], squares + lane, counts + lane);
    }
  }
  for (; i < count; ++i) {
    add_noise(variance, weight[i], innovation[i], innovation_variance[i], inlier[i], squares,
              counts);
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

void move(const Motion& motion, std::int64_t count, const double* z0, const double* z1,
          const double* z2, const double* z3, const MovingParticles& particles) {
  move_clones(motion, count, z0, z1, z2, z3, particles.x, particles.y, particles.heading,
              particles.yaw_rate_bias, particles.yaw_rate_bias_variance,
              particles.translation_factor, particles.heading_factor);
}

void weigh(const Range& range, std::int64_t count, const double* x, const double* y,
           const double* heading, const Calibration& calibration, double* log_weight,
           double* innovation, double* innovation_variance, double* inlier) {
  const bool has_lever = range.antenna[0] != 0.0 || range.antenna[1] != 0.0;
  weigh_clones(range, has_lever, count, x, y, heading, calibration, log_weight, innovation,
               innovation_variance, inlier);
}

NoiseSums noise_sums(double variance, std::int64_t count, const double* weight,
                     const double* innovation, const double* innovation_variance,
                     const double* inlier) {
  double squares[kLanes] = {};
  double counts[kLanes] = {};
  noise_sums_clones(variance, count, weight, innovation, innovation_variance, inlier, squares,
                    counts);
  NoiseSums sums;
  for (int lane = 0; lane < kLanes; ++lane) {
    sums.squares += squares[lane];
    sums.count += counts[lane];
  }
  return sums;
}

}  // namespace pf_resampling::kernels
