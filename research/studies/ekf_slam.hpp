#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"

namespace pf_resampling {

/// EKF-SLAM with known ids (Smith, Self, Cheeseman 1990; Thrun, Burgard, Fox 2005, section 10.2):
/// one Gaussian over the pose and all landmarks. What the particle filters are held against in
/// studies; no filter to take on a robot: the cost of an update is quadratic in the landmarks.
class EkfSlam {
 public:
  explicit EkfSlam(const LandmarkSensorOptions& sensor) : sensor_(sensor) {}

  /// One step: moves by `odometry`, then takes up the observations one by one, each linearised
  /// where those before it have brought the state. The sensor sits in the middle of the robot.
  void update(const OdometryIncrement& odometry,
              const std::vector<RangeBearingObservation>& observations);

  /// Pose in the frame of the start, m and rad.
  PoseEstimate estimate() const;

  /// Rows of the state that hold a landmark's x; y follows. By id.
  const std::map<int, Eigen::Index>& rows() const { return rows_; }
  const Eigen::VectorXd& state() const { return state_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  void start(const RangeBearingObservation& observation, const Eigen::Matrix2d& noise);
  void correct(const RangeBearingObservation& observation, const Eigen::Matrix2d& noise,
               Eigen::Index row);

  LandmarkSensorOptions sensor_;
  Eigen::VectorXd state_ = Eigen::VectorXd::Zero(3);
  Eigen::MatrixXd covariance_ = Eigen::MatrixXd::Zero(3, 3);
  std::map<int, Eigen::Index> rows_;
};

}  // namespace pf_resampling
