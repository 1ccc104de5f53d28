#include "pf_resampling_core/filters/fastslam/kernels.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling::kernels {
namespace {

constexpr double kSmallestDistance = 1e-6;  // m: a landmark on top of the sensor has no bearing

// The observation as predicted from a pose and a landmark, and its derivatives.
struct Geometry {
  double range_error, bearing_error;  // observed minus predicted
  double rx, ry, rh, bx, by,
      bh;  // of range and bearing by the pose; by the landmark: minus rx, ry, bx, by
};

PF_RESAMPLING_INLINE Geometry geometry(const Observation& z, double x, double y, double heading,
                                       double landmark_x, double landmark_y) {
  double sine;
  double cosine;
  sincos_vector(heading, &sine, &cosine);
  const double lever_x = cosine * z.sensor_x - sine * z.sensor_y;
  const double lever_y = sine * z.sensor_x + cosine * z.sensor_y;
  const double dx = landmark_x - x - lever_x;
  const double dy = landmark_y - y - lever_y;
  const double square = dx * dx + dy * dy + kSmallestDistance * kSmallestDistance;
  const double range = std::sqrt(square);
  const double over_range = 1.0 / range;
  const double over_square = over_range * over_range;
  Geometry g;
  g.range_error = z.range - range;
  g.bearing_error = wrap_angle_vector(z.bearing + z.sensor_yaw + heading - atan2_vector(dy, dx));
  g.rx = -dx * over_range;
  g.ry = -dy * over_range;
  g.bx = dy * over_square;
  g.by = -dx * over_square;
  // The sensor swings about the robot: it moves by (-lever_y, lever_x) per radian.
  g.rh = g.ry * lever_x - g.rx * lever_y;
  g.bh = g.by * lever_x - g.bx * lever_y - 1.0;
  return g;
}

struct Symmetric2 {
  double a, b, c;  // [a b; b c]
};

// Covariance of the observation due to the landmark and the sensor.
PF_RESAMPLING_INLINE Symmetric2 landmark_part(const Observation& z, const Geometry& g, double xx,
                                              double xy, double yy) {
  const double r1 = g.rx * xx + g.ry * xy;
  const double r2 = g.rx * xy + g.ry * yy;
  const double b1 = g.bx * xx + g.by * xy;
  const double b2 = g.bx * xy + g.by * yy;
  return {r1 * g.rx + r2 * g.ry + z.range_variance, r1 * g.bx + r2 * g.by,
          b1 * g.bx + b2 * g.by + z.bearing_variance};
}

// Pose covariance times the derivative: three entries per component of the observation.
struct PoseGain {
  double rx, ry, rh, bx, by, bh;
};

PF_RESAMPLING_INLINE PoseGain pose_gain(const Geometry& g, double xx, double xy, double xh,
                                        double yy, double yh, double hh) {
  return {xx * g.rx + xy * g.ry + xh * g.rh, xy * g.rx + yy * g.ry + yh * g.rh,
          xh * g.rx + yh * g.ry + hh * g.rh, xx * g.bx + xy * g.by + xh * g.bh,
          xy * g.bx + yy * g.by + yh * g.bh, xh * g.bx + yh * g.by + hh * g.bh};
}

// S = L D Lᵀ of the innovation covariance, solved and measured. Neither pivot is less than what the
// sensor adds; a covariance far larger than that leaves rounding of either sign instead.
struct Innovation {
  double determinant;
  double ia, ib, ic;  // inverse
  double distance;    // squared Mahalanobis
};

PF_RESAMPLING_INLINE Innovation innovation(const Observation& z, const Geometry& g,
                                           const Symmetric2& s) {
  const double a = s.a > z.range_variance ? s.a : z.range_variance;
  const double l = s.b / a;
  const double rest = s.c - l * s.b;
  const double d = rest > z.bearing_variance ? rest : z.bearing_variance;
  Innovation i;
  i.determinant = a * d;
  i.ic = 1.0 / d;
  i.ib = -l * i.ic;
  i.ia = 1.0 / a - l * i.ib;
  const double second = g.bearing_error - l * g.range_error;
  i.distance = g.range_error * g.range_error / a + second * second * i.ic;
  return i;
}

PF_RESAMPLING_INLINE double log_likelihood_of(double distance, double determinant) {
  constexpr double kLogTwoPi = 1.8378770664093453;
  return -0.5 * distance - 0.5 * log_vector(determinant) - kLogTwoPi;
}

// Square root of a pivot and its inverse; both zero where rounding has left nothing or less.
PF_RESAMPLING_INLINE void pivot(double value, double* root, double* inverse) {
  constexpr double kNothing = 1e-18;
  const bool some = value > kNothing;
  const double r = std::sqrt(some ? value : 1.0);
  *root = some ? r : 0.0;
  *inverse = some ? 1.0 / r : 0.0;
}

}  // namespace

PF_RESAMPLING_VECTOR_CLONES
void predict(const Eigen::ArrayXXd& motion, const Eigen::Matrix3d& covariance, std::int64_t count,
             const PoseGaussians& pose) {
  const auto [x, y, heading, xx, xy, xh, yy, yh, hh] = pose;
  const double* const mean_x = motion.col(0).data();
  const double* const mean_y = motion.col(1).data();
  const double* const mean_heading = motion.col(2).data();
  const double qxx = covariance(0, 0), qxy = covariance(0, 1), qxh = covariance(0, 2);
  const double qyy = covariance(1, 1), qyh = covariance(1, 2), qhh = covariance(2, 2);
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    double s;
    double c;
    sincos_vector(heading[i], &s, &c);
    x[i] += c * mean_x[i] - s * mean_y[i];
    y[i] += s * mean_x[i] + c * mean_y[i];
    heading[i] = wrap_angle_vector(heading[i] + mean_heading[i]);
    xx[i] = c * c * qxx - 2.0 * c * s * qxy + s * s * qyy;
    xy[i] = c * s * (qxx - qyy) + (c * c - s * s) * qxy;
    yy[i] = s * s * qxx + 2.0 * c * s * qxy + c * c * qyy;
    xh[i] = c * qxh - s * qyh;
    yh[i] = s * qxh + c * qyh;
    hh[i] = qhh;
  }
}

PF_RESAMPLING_VECTOR_CLONES
void match(const Observation& observation, std::int64_t count, const PoseGaussians& pose,
           const LandmarkRow& landmark, double* distance, double* log_likelihood) {
  const auto [x, y, heading, pxx, pxy, pxh, pyy, pyh, phh] = pose;
  const auto [lx, ly, lxx, lxy, lyy, log_odds, held] = landmark;
  const Observation z = observation;
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    const Geometry g = geometry(z, x[i], y[i], heading[i], lx[i], ly[i]);
    const PoseGain p = pose_gain(g, pxx[i], pxy[i], pxh[i], pyy[i], pyh[i], phh[i]);
    Symmetric2 s = landmark_part(z, g, lxx[i], lxy[i], lyy[i]);
    s.a += g.rx * p.rx + g.ry * p.ry + g.rh * p.rh;
    s.b += g.rx * p.bx + g.ry * p.by + g.rh * p.bh;
    s.c += g.bx * p.bx + g.by * p.by + g.bh * p.bh;
    const Innovation v = innovation(z, g, s);
    distance[i] = v.distance;
    log_likelihood[i] = log_likelihood_of(v.distance, v.determinant);
  }
}

double squared_innovation(const Observation& observation, ConstArray weights,
                          const PoseGaussians& pose, const LandmarkRow& landmark) {
  double whole = 0.0;
  double range_error = 0.0;
  double bearing_error = 0.0;
  Symmetric2 within = {0.0, 0.0, 0.0};   // mean of the covariances
  Symmetric2 squares = {0.0, 0.0, 0.0};  // of the errors
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    if (landmark.held[i] == 0) continue;
    const Geometry g =
        geometry(observation, pose.x[i], pose.y[i], pose.heading[i], landmark.x[i], landmark.y[i]);
    const PoseGain p =
        pose_gain(g, pose.xx[i], pose.xy[i], pose.xh[i], pose.yy[i], pose.yh[i], pose.hh[i]);
    const Symmetric2 s =
        landmark_part(observation, g, landmark.xx[i], landmark.xy[i], landmark.yy[i]);
    const double w = weights[i];
    whole += w;
    within.a += w * (s.a + g.rx * p.rx + g.ry * p.ry + g.rh * p.rh);
    within.b += w * (s.b + g.rx * p.bx + g.ry * p.by + g.rh * p.bh);
    within.c += w * (s.c + g.bx * p.bx + g.by * p.by + g.bh * p.bh);
    range_error += w * g.range_error;
    bearing_error += w * g.bearing_error;
    squares.a += w * g.range_error * g.range_error;
    squares.b += w * g.range_error * g.bearing_error;
    squares.c += w * g.bearing_error * g.bearing_error;
  }
  Geometry mean{};
  mean.range_error = range_error / whole;
  mean.bearing_error = bearing_error / whole;
  const Symmetric2 covariance = {
      (within.a + squares.a) / whole - mean.range_error * mean.range_error,
      (within.b + squares.b) / whole - mean.range_error * mean.bearing_error,
      (within.c + squares.c) / whole - mean.bearing_error * mean.bearing_error};
  return innovation(observation, mean, covariance).distance;
}

PF_RESAMPLING_VECTOR_CLONES
void propose(const Observation& observation, double gate, std::int64_t count,
             const PoseGaussians& pose, const LandmarkRow& landmark, const double* takes,
             double* log_weight, double* accepted) {
  const auto [x, y, heading, pxx, pxy, pxh, pyy, pyh, phh] = pose;
  const auto [lx, ly, lxx, lxy, lyy, log_odds, held] = landmark;
  const Observation z = observation;
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    const Geometry g = geometry(z, x[i], y[i], heading[i], lx[i], ly[i]);
    const PoseGain p = pose_gain(g, pxx[i], pxy[i], pxh[i], pyy[i], pyh[i], phh[i]);
    Symmetric2 s = landmark_part(z, g, lxx[i], lxy[i], lyy[i]);
    s.a += g.rx * p.rx + g.ry * p.ry + g.rh * p.rh;
    s.b += g.rx * p.bx + g.ry * p.by + g.rh * p.bh;
    s.c += g.bx * p.bx + g.by * p.by + g.bh * p.bh;
    const Innovation v = innovation(z, g, s);
    const double bounded = v.distance < gate ? v.distance : gate;
    const double applies = v.distance < gate ? takes[i] : 0.0;
    log_weight[i] += takes[i] * log_likelihood_of(bounded, v.determinant);
    accepted[i] = applies;

    // Gain K = P Hᵀ S⁻¹; the mean moves by K·innovation, the covariance loses K (P Hᵀ)ᵀ.
    const double krx = applies * (p.rx * v.ia + p.bx * v.ib),
                 kbx = applies * (p.rx * v.ib + p.bx * v.ic);
    const double kry = applies * (p.ry * v.ia + p.by * v.ib),
                 kby = applies * (p.ry * v.ib + p.by * v.ic);
    const double krh = applies * (p.rh * v.ia + p.bh * v.ib),
                 kbh = applies * (p.rh * v.ib + p.bh * v.ic);
    x[i] += krx * g.range_error + kbx * g.bearing_error;
    y[i] += kry * g.range_error + kby * g.bearing_error;
    heading[i] = wrap_angle_vector(heading[i] + krh * g.range_error + kbh * g.bearing_error);
    pxx[i] -= krx * p.rx + kbx * p.bx;
    pxy[i] -= krx * p.ry + kbx * p.by;
    pxh[i] -= krx * p.rh + kbx * p.bh;
    pyy[i] -= kry * p.ry + kby * p.by;
    pyh[i] -= kry * p.rh + kby * p.bh;
    phh[i] -= krh * p.rh + kbh * p.bh;
  }
}

PF_RESAMPLING_VECTOR_CLONES
void draw(std::int64_t count, const double* z0, const double* z1, const double* z2,
          const PoseGaussians& pose) {
  const auto [x, y, heading, xx, xy, xh, yy, yh, hh] = pose;
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    double lh;
    double inverse;
    pivot(hh[i], &lh, &inverse);
    const double lxh = xh[i] * inverse;
    const double lyh = yh[i] * inverse;
    double lx;
    pivot(xx[i] - lxh * lxh, &lx, &inverse);
    const double lyx = (xy[i] - lxh * lyh) * inverse;
    double ly;
    pivot(yy[i] - lyh * lyh - lyx * lyx, &ly, &inverse);
    heading[i] = wrap_angle_vector(heading[i] + lh * z0[i]);
    x[i] += lxh * z0[i] + lx * z1[i];
    y[i] += lyh * z0[i] + lyx * z1[i] + ly * z2[i];
  }
}

PF_RESAMPLING_VECTOR_CLONES
void motion_since(std::int64_t count, const PoseGaussians& pose, double* motion_x, double* motion_y,
                  double* motion_heading) {
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    double sine;
    double cosine;
    sincos_vector(motion_heading[i], &sine, &cosine);
    const double dx = pose.x[i] - motion_x[i];
    const double dy = pose.y[i] - motion_y[i];
    motion_x[i] = cosine * dx + sine * dy;
    motion_y[i] = cosine * dy - sine * dx;
    motion_heading[i] = wrap_angle_vector(pose.heading[i] - motion_heading[i]);
  }
}

PF_RESAMPLING_VECTOR_CLONES
void update(const Observation& observation, std::int64_t count, const PoseGaussians& pose,
            const double* accepted, const LandmarkRow& landmark) {
  const auto [lx, ly, lxx, lxy, lyy, log_odds, held] = landmark;
  const Observation z = observation;
  PF_RESAMPLING_INDEPENDENT
  for (std::int64_t i = 0; i < count; ++i) {
    const Geometry g = geometry(z, pose.x[i], pose.y[i], pose.heading[i], lx[i], ly[i]);
    const Symmetric2 s = landmark_part(z, g, lxx[i], lxy[i], lyy[i]);
    const Innovation v = innovation(z, g, s);
    // Derivatives by the landmark are minus those by the place.
    const double r1 = -(lxx[i] * g.rx + lxy[i] * g.ry), r2 = -(lxy[i] * g.rx + lyy[i] * g.ry);
    const double b1 = -(lxx[i] * g.bx + lxy[i] * g.by), b2 = -(lxy[i] * g.bx + lyy[i] * g.by);
    const double kr1 = accepted[i] * (r1 * v.ia + b1 * v.ib),
                 kb1 = accepted[i] * (r1 * v.ib + b1 * v.ic);
    const double kr2 = accepted[i] * (r2 * v.ia + b2 * v.ib),
                 kb2 = accepted[i] * (r2 * v.ib + b2 * v.ic);
    lx[i] += kr1 * g.range_error + kb1 * g.bearing_error;
    ly[i] += kr2 * g.range_error + kb2 * g.bearing_error;
    // Joseph form: (I - K H) Σ (I - K H)ᵀ + K R Kᵀ.
    const double m11 = 1.0 + kr1 * g.rx + kb1 * g.bx, m12 = kr1 * g.ry + kb1 * g.by;
    const double m21 = kr2 * g.rx + kb2 * g.bx, m22 = 1.0 + kr2 * g.ry + kb2 * g.by;
    const double a11 = m11 * lxx[i] + m12 * lxy[i], a12 = m11 * lxy[i] + m12 * lyy[i];
    const double a21 = m21 * lxx[i] + m22 * lxy[i], a22 = m21 * lxy[i] + m22 * lyy[i];
    lxx[i] = a11 * m11 + a12 * m12 + z.range_variance * kr1 * kr1 + z.bearing_variance * kb1 * kb1;
    lxy[i] = a11 * m21 + a12 * m22 + z.range_variance * kr1 * kr2 + z.bearing_variance * kb1 * kb2;
    lyy[i] = a21 * m21 + a22 * m22 + z.range_variance * kr2 * kr2 + z.bearing_variance * kb2 * kb2;
  }
}

void start(const Observation& z, std::int64_t count, const PoseGaussians& pose,
           const double* starts, double log_odds, const LandmarkRow& landmark) {
  for (std::int64_t i = 0; i < count; ++i) {
    if (starts[i] == 0.0) continue;
    const Pose2 sensor =
        compose({pose.x[i], pose.y[i], pose.heading[i]}, {z.sensor_x, z.sensor_y, z.sensor_yaw});
    const double cosine = std::cos(sensor.heading + z.bearing);
    const double sine = std::sin(sensor.heading + z.bearing);
    // Close to the sensor the direction hardly matters; a covariance has to be one all the same.
    const double across = std::max(kSmallestVariance, z.bearing_variance * z.range * z.range);
    landmark.x[i] = sensor.x + z.range * cosine;
    landmark.y[i] = sensor.y + z.range * sine;
    landmark.xx[i] = z.range_variance * cosine * cosine + across * sine * sine;
    landmark.xy[i] = (z.range_variance - across) * cosine * sine;
    landmark.yy[i] = z.range_variance * sine * sine + across * cosine * cosine;
    landmark.log_odds[i] = log_odds;
    landmark.held[i] = 1;
  }
}

}  // namespace pf_resampling::kernels
