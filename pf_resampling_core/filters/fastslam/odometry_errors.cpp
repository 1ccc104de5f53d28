#include "pf_resampling_core/filters/fastslam/odometry_errors.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

void OdometryErrorEstimator::start(const OdometryErrorOptions& options, Eigen::Index particles) {
  estimate_ = options.estimate;
  Vector sigma;
  sigma << options.distance_scale, options.turn_scale, options.drift, options.yaw_rate,
      options.delay;
  if (!estimate_) sigma.setZero();
  state_.covariance = sigma.array().square().matrix().asDiagonal();
  walk_ = (options.walk * sigma).array().square();
  state_.means.setZero(particles, kCount);
  state_.velocity.setZero();
}

// With a delay of the observations they are of poses before the end and the start: the motion
// between them gains what was driven before the start, ...
Eigen::Matrix<double, 3, OdometryErrorEstimator::kCount> OdometryErrorEstimator::sensitivity_of(
    const OdometryIncrement& odometry, const Eigen::Vector3d& velocity_before) {
  const Pose2& mean = odometry.mean;
  const Eigen::Vector3d& velocity = velocity_before;
  Eigen::Matrix<double, 3, kCount> sensitivity;
  sensitivity.col(0) = odometry.distance_scale_sensitivity;
  sensitivity.col(1) = odometry.turn_scale_sensitivity;
  sensitivity.col(2) = odometry.drift_sensitivity;
  sensitivity.col(3) = odometry.yaw_rate_sensitivity;
  sensitivity.col(4) << velocity.x() - velocity.z() * mean.y, velocity.y() + velocity.z() * mean.x,
      velocity.z();
  return sensitivity;
}

OdometryIncrement OdometryErrorEstimator::corrected(const OdometryIncrement& since,
                                                    ConstArray weights) const {
  if (!estimate_) return since;
  const Eigen::Matrix<double, 3, kCount> sensitivity = sensitivity_of(since, state_.velocity);
  Vector errors;
  for (int error = 0; error < kCount; ++error) {
    errors[error] = (weights * state_.means.col(error)).sum();
  }
  OdometryIncrement corrected = since;
  const Eigen::Vector3d change = sensitivity * errors;
  corrected.mean = {since.mean.x + change.x(), since.mean.y + change.y(),
                    wrap_angle(since.mean.heading + change.z())};
  corrected.covariance += sensitivity * state_.covariance * sensitivity.transpose();
  return corrected;
}

void OdometryErrorEstimator::predict(const OdometryIncrement& odometry) {
  state_.covariance.diagonal() += odometry.duration * walk_;
  const Eigen::Vector3d velocity = odometry.velocity_left * state_.velocity + odometry.velocity;
  const Pose2& mean = odometry.mean;
  const double cosine = std::cos(mean.heading);
  const double sine = std::sin(mean.heading);
  sensitivity_ = sensitivity_of(odometry, state_.velocity);
  // It loses what was driven before the end.
  sensitivity_.col(4) -= Eigen::Vector3d(cosine * velocity.x() - sine * velocity.y(),
                                         sine * velocity.x() + cosine * velocity.y(), velocity.z());
  state_.velocity = velocity;

  covariance_ = odometry.covariance;
  motion_.resize(state_.means.rows(), 3);
  motion_.col(0).setConstant(mean.x);
  motion_.col(1).setConstant(mean.y);
  motion_.col(2).setConstant(mean.heading);
  if (!estimate_) return;
  covariance_ += sensitivity_ * state_.covariance * sensitivity_.transpose();
  for (int component = 0; component < 3; ++component) {
    for (int error = 0; error < kCount; ++error) {
      motion_.col(component) += sensitivity_(component, error) * state_.means.col(error);
    }
  }
}

void OdometryErrorEstimator::condition(const Eigen::ArrayXXd& motion) {
  if (!estimate_) return;
  // Odometry without noise would leave nothing to divide by: a micrometre and a microradian.
  constexpr double kSmallest = 1e-12;
  const Eigen::Matrix<double, kCount, 3> covariance = state_.covariance * sensitivity_.transpose();
  const Eigen::LDLT<Eigen::Matrix3d> motion_covariance(covariance_ +
                                                       kSmallest * Eigen::Matrix3d::Identity());
  const Eigen::Matrix<double, kCount, 3> gain =
      motion_covariance.solve(covariance.transpose()).transpose();
  for (Eigen::Index i = 0; i < state_.means.rows(); ++i) {
    motion_(i, 0) = motion(i, 0) - motion_(i, 0);
    motion_(i, 1) = motion(i, 1) - motion_(i, 1);
    motion_(i, 2) = wrap_angle(motion(i, 2) - motion_(i, 2));
  }
  for (int error = 0; error < kCount; ++error) {
    for (int component = 0; component < 3; ++component) {
      state_.means.col(error) += gain(error, component) * motion_.col(component);
    }
  }
  state_.covariance -= gain * covariance.transpose();
  state_.covariance = (0.5 * (state_.covariance + state_.covariance.transpose())).eval();
}

void OdometryErrorEstimator::resume(const OdometryErrorState& state) {
  if (!estimate_ || !(state.covariance.diagonal().maxCoeff() > 0.0)) return;
  state_ = state;
}

void OdometryErrorEstimator::redraw(const Eigen::ArrayXXd& means, const Matrix& covariance) {
  state_.means.setZero(means.rows(), kCount);
  if (!estimate_) return;
  state_.means = means;
  state_.covariance = covariance;
}

void OdometryErrorEstimator::select(ConstIndices ancestors) {
  if (!estimate_) {
    state_.means.setZero(ancestors.size(), kCount);
    return;
  }
  work_.resize(ancestors.size(), kCount);
  for (int error = 0; error < kCount; ++error) {
    for (Eigen::Index i = 0; i < ancestors.size(); ++i) {
      work_(i, error) = state_.means(ancestors[i], error);
    }
  }
  state_.means.swap(work_);
}

void OdometryErrorEstimator::blend(const std::vector<BlendPair>& pairs) {
  for (Eigen::Index k = 0; k < state_.means.cols(); ++k) blend_means(pairs, state_.means.col(k));
}

}  // namespace pf_resampling
