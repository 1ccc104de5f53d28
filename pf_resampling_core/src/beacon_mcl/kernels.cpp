#include "kernels.hpp"

#include <cmath>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling::kernels {
namespace {

// Below this a likelihood is taken as this: far beyond any range that could be told from an
// outlier.
constexpr double kSmallestLikelihood = 1e-300;

PF_RESAMPLING_VECTOR_CLONES
void move_clones(const Motion& motion, std::int64_t count, const double* __restrict z0,
                 const double* __restrict z1, const double* __restrict z2,
                 const double* __restrict z3, double* __restrict x, double* __restrict y,
                 double* __restrict heading, double* __restrict yaw_rate_bias) {
  const Motion m = motion;
  for (std::int64_t i = 0; i < count; ++i) {
    // Dead reckoning turns by its bias too much: the drawn bias is taken out.
    const double bias = yaw_rate_bias[i] + m.bias_sigma * z3[i];
    const double dx = m.mean[0] - m.sensitivity[0] * bias + m.root[0] * z0[i];
    const double dy = m.mean[1] - m.sensitivity[1] * bias + m.root[1] * z0[i] + m.root[2] * z1[i];
    const double turn =
        -m.sensitivity[2] * bias + m.root[3] * z0[i] + m.root[4] * z1[i] + m.root[5] * z2[i];
    yaw_rate_bias[i] += m.bias_gain * (-turn - m.sensitivity[2] * yaw_rate_bias[i]);

    double sine;
    double cosine;
    sincos_vector(heading[i], &sine, &cosine);
    x[i] += cosine * dx - sine * dy;
    y[i] += sine * dx + cosine * dy;
    heading[i] = wrap_angle_vector(heading[i] + m.mean[2] + turn);
  }
}

struct Prediction {
  double distance;
  double expected;
  double variance;
};

struct Likelihood {
  double log;
  double inlier;  // share of the likelihood that is the Gaussian's
};

PF_RESAMPLING_INLINE Likelihood likelihood(const Range& range, double innovation, double variance) {
  constexpr double kInverseSqrtTwoPi = 0.3989422804014327;
  const double exponent = -0.5 * innovation * innovation / variance;
  const double gaussian =
      range.inlier_share * kInverseSqrtTwoPi / std::sqrt(variance) * exp_vector(exponent);
  const double excess = innovation > 0.0 ? innovation : 0.0;
  const double tail =
      innovation > 0.0 ? range.tail_density * exp_vector(-range.tail_rate * excess) : 0.0;
  const double total = gaussian + tail + range.floor_density;
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

PF_RESAMPLING_INLINE void weigh_nominal(const Range& range, bool has_lever, std::int64_t count,
                                        const double* x, const double* y, const double* heading,
                                        double* log_weight, double* innovation,
                                        double* innovation_variance) {
  for (std::int64_t i = 0; i < count; ++i) {
    const double distance = distance_to_beacon(range, x[i], y[i], heading[i], has_lever);
    const double difference = range.range - (range.nominal_scale * distance + range.nominal_bias);
    log_weight[i] += likelihood(range, difference, range.variance).log;
    innovation[i] = difference;
    innovation_variance[i] = range.variance;
  }
}

PF_RESAMPLING_INLINE void weigh_calibrating(const Range& range, bool has_lever, std::int64_t count,
                                            const double* x, const double* y, const double* heading,
                                            const Calibration& calibration, double* log_weight,
                                            double* innovation, double* innovation_variance) {
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
void weigh_nominal_clones(const Range& range, bool has_lever, std::int64_t count,
                          const double* __restrict x, const double* __restrict y,
                          const double* __restrict heading, double* __restrict log_weight,
                          double* __restrict innovation, double* __restrict innovation_variance) {
  const Range r = range;
  if (has_lever) {
    weigh_nominal(r, true, count, x, y, heading, log_weight, innovation, innovation_variance);
  } else {
    weigh_nominal(r, false, count, x, y, heading, log_weight, innovation, innovation_variance);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void weigh_calibrating_clones(const Range& range, bool has_lever, std::int64_t count,
                              const double* __restrict x, const double* __restrict y,
                              const double* __restrict heading, const Calibration& calibration,
                              double* __restrict log_weight, double* __restrict innovation,
                              double* __restrict innovation_variance) {
  const Range r = range;
  if (has_lever) {
    weigh_calibrating(r, true, count, x, y, heading, calibration, log_weight, innovation,
                      innovation_variance);
  } else {
    weigh_calibrating(r, false, count, x, y, heading, calibration, log_weight, innovation,
                      innovation_variance);
  }
}

}  // namespace

Motion make_motion(const OdometryIncrement& odometry, double yaw_rate_bias_variance) {
  const Eigen::Matrix3d root = lower_root(odometry.covariance);
  const Eigen::Vector3d& sensitivity = odometry.yaw_rate_sensitivity;
  const double heading_variance =
      odometry.covariance(2, 2) + sensitivity[2] * sensitivity[2] * yaw_rate_bias_variance;
  Motion motion{};
  motion.mean[0] = odometry.mean.x;
  motion.mean[1] = odometry.mean.y;
  motion.mean[2] = odometry.mean.heading;
  const double entries[6] = {root(0, 0), root(1, 0), root(1, 1),
                             root(2, 0), root(2, 1), root(2, 2)};
  for (int i = 0; i < 6; ++i) motion.root[i] = entries[i];
  for (int i = 0; i < 3; ++i) motion.sensitivity[i] = sensitivity[i];
  motion.bias_sigma = std::sqrt(yaw_rate_bias_variance);
  motion.bias_gain =
      heading_variance > 0.0 ? yaw_rate_bias_variance * sensitivity[2] / heading_variance : 0.0;
  return motion;
}

void move(const Motion& motion, std::int64_t count, const double* z0, const double* z1,
          const double* z2, const double* z3, double* x, double* y, double* heading,
          double* yaw_rate_bias) {
  move_clones(motion, count, z0, z1, z2, z3, x, y, heading, yaw_rate_bias);
}

void weigh(const Range& range, std::int64_t count, const double* x, const double* y,
           const double* heading, const Calibration& calibration, double* log_weight,
           double* innovation, double* innovation_variance) {
  const bool has_lever = range.antenna[0] != 0.0 || range.antenna[1] != 0.0;
  if (calibration.scale == nullptr) {
    weigh_nominal_clones(range, has_lever, count, x, y, heading, log_weight, innovation,
                         innovation_variance);
  } else {
    weigh_calibrating_clones(range, has_lever, count, x, y, heading, calibration, log_weight,
                             innovation, innovation_variance);
  }
}

}  // namespace pf_resampling::kernels
