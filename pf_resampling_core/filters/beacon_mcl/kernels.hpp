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
void move(const Motion& motion, std::int64_t count, const float* z0, const float* z1,
          const float* z2, const float* z3, const MovingParticles& particles);

/// What is common to all particles in a range.
struct Range {
  double range;
  double beacon[3];   // m, map frame
  double antenna[3];  // m, on the robot
  double variance;    // m^2, of the noise
  double nominal;     // m^2, likewise, before anything was learnt of it
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

/// As many ranges are taken in at one go.
constexpr int kMostRanges = 8;

/// Sums over particles that were weighed by ranges of one moment.
struct RangeSums {
  // Of weights times likelihoods: of the first range, of the first two …
  double likelihood[kMostRanges];
  // The last range's innovation, and its square plus variance, by weights before that range.
  double innovation;
  double innovation_square;
  // By weights after all ranges: the expected square of a range's noise in units of its nominal
  // variance, and how far ranges are believed to be no outliers. Each range counts `keep` times as
  // much as the one after it.
  double noise_squares;
  double noise_count;
};
void add(const RangeSums& other, RangeSums* sums);

/// What is done with the ranges.
struct Weighing {
  double tempering;  // share of the log likelihood that the weights take up
  double keep;       // see RangeSums
  bool calibrates;   // otherwise the calibration's variances are all zero
  bool learns_noise;
};

/// log_weight += tempering · log likelihood of `ranges` ranges, at most kMostRanges; the particles'
/// calibration takes every range in as far as it is believed to be no outlier. `weight`:
/// normalised, before them. The sums are written.
void weigh(const Weighing& weighing, const Range* range, int ranges, std::int64_t count,
           const double* x, const double* y, const double* heading, const double* weight,
           const Calibration& calibration, double* log_weight, RangeSums* sums);

}  // namespace pf_resampling::kernels
