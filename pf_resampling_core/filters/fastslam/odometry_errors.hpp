#pragma once

#include <Eigen/Core>
#include <vector>

#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"

namespace pf_resampling {

/// Errors of the dead reckoning that stay the same for long: standard deviations of their prior,
/// the size such errors have where nobody has calibrated anything (Borenstein, Feng 1996,
/// "Measurement and correction of systematic odometry errors in mobile robots"). Zero: free of it.
struct OdometryErrorOptions {
  bool estimate = true;
  double distance_scale = 0.05;  ///< relative error of distances (size of the wheels)
  double turn_scale = 0.1;       ///< of turns (distance of the wheels, scale of a gyro)
  double drift = 0.01;           ///< turn per distance, rad/m (unequal wheels, steering off centre)
  double yaw_rate = 0.001;       ///< turn per time, rad/s (bias of a gyro)
  double delay = 0.15;           ///< s, of the observations against the odometry
  double walk = 0.01;            ///< what is added in a second, as a share of these, 1/sqrt(s)
};

/// What OdometryErrorEstimator knows at a moment.
struct OdometryErrorState {
  Eigen::ArrayXXd means;  ///< a row per particle, a column per error
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of OdometryIncrement, at the end
};

/// The systematic errors of dead reckoning, a Kalman filter in each particle. Given a particle's
/// path, the odometry is linear in them:
///
///   motion = odometry + J·errors + noise,
///
/// so FastSLAM's factorisation (Montemerlo et al. 2002) extends to them: given the path, they are
/// independent of the landmarks. Their covariance does not depend on the path, to first order, so
/// all particles share one; the means are their own.
class OdometryErrorEstimator {
 public:
  static constexpr int kCount = 5;  ///< in the order of OdometryErrorOptions
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;

  void start(const OdometryErrorOptions& options, Eigen::Index particles);

  /// What the odometry implies once its errors are taken into account, in the body frame at its
  /// start: motion of each particle (a row; x, y, heading) and covariance, common to all.
  void predict(const OdometryIncrement& odometry);
  const Eigen::ArrayXXd& motion() const { return motion_; }
  const Eigen::Matrix3d& covariance() const { return covariance_; }
  /// J of that odometry, in metres and radians per unit of each error.
  const Eigen::Matrix<double, 3, kCount>& sensitivity() const { return sensitivity_; }

  /// Takes in what the particles did: the same as motion(), as drawn.
  void condition(const Eigen::ArrayXXd& motion);

  /// The motion since the last condition(), by the odometry's own clock, with the errors' weighted
  /// mean taken out and what is not known of them in its covariance. Changes nothing.
  OdometryIncrement corrected(const OdometryIncrement& since, ConstArray weights) const;

  /// See LandmarkStore.
  void select(ConstIndices ancestors);
  void blend(const std::vector<BlendPair>& pairs);

  /// Other beliefs about the errors: means, a row per particle, and the covariance that all share.
  void redraw(const Eigen::ArrayXXd& means, const Matrix& covariance);

  const OdometryErrorState& state() const { return state_; }
  /// Goes on from there, with so many rows of means as after start(). Nothing changes if there is
  /// nothing to be estimated, or was not where the state comes from (no covariance).
  void resume(const OdometryErrorState& state);

 private:
  bool estimate_ = false;
  Vector walk_ = Vector::Zero();  // variance per second
  OdometryErrorState state_;
  static Eigen::Matrix<double, 3, kCount> sensitivity_of(const OdometryIncrement& odometry,
                                                         const Eigen::Vector3d& velocity_before);

  Eigen::Matrix<double, 3, kCount> sensitivity_ = Eigen::Matrix<double, 3, kCount>::Zero();
  Eigen::ArrayXXd motion_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  Eigen::ArrayXXd work_;
};

}  // namespace pf_resampling
