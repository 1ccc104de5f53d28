#pragma once

#include <cstdint>

#include "pf_resampling_core/models/odometry_motion.hpp"

/// The loops over particles of beacon_mcl.cpp: plain pointers in, so that the compiler makes vector
/// instructions of them.
namespace pf_resampling::kernels {

/// No log likelihood is below this, that of 1e-300: far beyond any range that could be told from an
/// outlier.
constexpr double kSmallestLogLikelihood = -690.77552789821371;

/// What is common to all particles in a motion.
struct Motion {
  double mean[3];         // x, y, heading in the body frame, without the yaw-rate bias
  double sensitivity[3];  // by the yaw-rate bias
  // Root of the covariance with the heading first, so that what a turn does to the place goes with
  // the turn.
  double heading_noise;
  double x_of_heading;
  double y_of_heading;
  double x_noise;
  double y_of_x;
  double y_noise;
  double bias_walk;  // variance added to the yaw-rate bias's
};

Motion make_motion(const OdometryIncrement& odometry, double yaw_rate_bias_walk);

/// The part of a population that moves.
struct MovingParticles {
  double* x;
  double* y;
  double* heading;
  double* yaw_rate_bias;
  double* yaw_rate_bias_variance;
  const double* translation_factor;
  const double* heading_factor;
};

/// Draws every particle's motion, with normals z0 … z3, and lets its yaw-rate bias learn from what
/// was drawn.
void move(const Motion& motion, std::int64_t count, const double* z0, const double* z1,
          const double* z2, const double* z3, const MovingParticles& particles);

/// What is common to all particles in a range.
struct Range {
  double range;
  double beacon[3];   // m, map frame
  double antenna[3];  // m, on the robot
  double variance;    // m^2, of the noise
  double scale_walk;  // variance added to the calibration's since the radio's last range
  double bias_walk;
  double inlier_share;
  double floor_density;  // 1/m, of an outlier times its share
};

/// Columns of the calibration.
struct Calibration {
  double* scale;
  double* bias;
  double* scale_variance;
  double* scale_bias_covariance;
  double* bias_variance;
};

/// log_weight += log likelihood of the range; the particle's calibration takes the range in as far
/// as it is believed to be no outlier. innovation and innovation_variance: of each particle.
void weigh(const Range& range, std::int64_t count, const double* x, const double* y,
           const double* heading, const Calibration& calibration, double* log_weight,
           double* innovation, double* innovation_variance, double* inlier);

/// Expected square of a range's noise, and how far the range is believed to be no outlier, summed
/// over the population with its weights.
struct NoiseSums {
  double squares = 0.0;  // m^2
  double count = 0.0;
};

/// `variance`: of the noise as assumed; innovations and their variances as from weigh().
NoiseSums noise_sums(double variance, std::int64_t count, const double* weight,
                     const double* innovation, const double* innovation_variance,
                     const double* inlier);

}  // namespace pf_resampling::kernels
