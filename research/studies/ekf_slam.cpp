#include "research/studies/ekf_slam.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {

void EkfSlam::update(const OdometryIncrement& odometry,
                     const std::vector<RangeBearingObservation>& observations) {
  const double heading = state_[2];
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(heading).toRotationMatrix();
  const Eigen::Vector2d motion(odometry.mean.x, odometry.mean.y);
  const Eigen::Vector2d moved = turn * motion;
  state_.head<2>() += moved;
  state_[2] = wrap_angle(heading + odometry.mean.heading);
  Eigen::Matrix3d by_pose = Eigen::Matrix3d::Identity();
  by_pose(0, 2) = -moved.y();
  by_pose(1, 2) = moved.x();
  Eigen::Matrix3d by_motion = Eigen::Matrix3d::Identity();
  by_motion.topLeftCorner<2, 2>() = turn;
  covariance_.topRows<3>() = (by_pose * covariance_.topRows<3>()).eval();
  covariance_.leftCols<3>() = (covariance_.leftCols<3>() * by_pose.transpose()).eval();
  covariance_.topLeftCorner<3, 3>() += by_motion * odometry.covariance * by_motion.transpose();

  for (const RangeBearingObservation& observation : observations) {
    const Eigen::Matrix2d noise = Eigen::Vector2d(range_variance(sensor_, observation),
                                                  bearing_variance(sensor_, observation))
                                      .asDiagonal();
    const auto known = rows_.find(observation.id);
    if (known == rows_.end()) {
      start(observation, noise);
    } else {
      correct(observation, noise, known->second);
    }
  }
}

void EkfSlam::start(const RangeBearingObservation& z, const Eigen::Matrix2d& noise) {
  const double direction = state_[2] + z.bearing;
  const Eigen::Vector2d ahead(std::cos(direction), std::sin(direction));
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  const Eigen::Index row = state_.size();
  Eigen::Matrix<double, 2, 3> by_pose;
  by_pose << Eigen::Matrix2d::Identity(), z.range * left;
  Eigen::Matrix2d by_observation;
  by_observation << ahead, z.range * left;

  state_.conservativeResize(row + 2);
  state_.tail<2>() = state_.head<2>() + z.range * ahead;
  const Eigen::MatrixXd cross = by_pose * covariance_.topRows<3>();
  covariance_.conservativeResize(row + 2, row + 2);
  covariance_.bottomLeftCorner(2, row) = cross;
  covariance_.topRightCorner(row, 2) = cross.transpose();
  covariance_.bottomRightCorner<2, 2>() = cross.leftCols<3>() * by_pose.transpose() +
                                          by_observation * noise * by_observation.transpose();
  rows_[z.id] = row;
}

void EkfSlam::correct(const RangeBearingObservation& z, const Eigen::Matrix2d& noise,
                      Eigen::Index row) {
  const Eigen::Vector2d offset = state_.segment<2>(row) - state_.head<2>();
  const double squared = offset.squaredNorm();
  if (!(squared > 0.0)) return;  // no direction to a landmark under the sensor
  const double range = std::sqrt(squared);
  Eigen::Matrix2d by_landmark;
  by_landmark << offset.x() / range, offset.y() / range, -offset.y() / squared,
      offset.x() / squared;
  Eigen::Matrix<double, 2, 3> by_pose;
  by_pose << -by_landmark, Eigen::Vector2d(0.0, -1.0);

  // Covariance of the state with what is observed, and of that itself.
  const Eigen::MatrixXd cross = covariance_.leftCols<3>() * by_pose.transpose() +
                                covariance_.middleCols<2>(row) * by_landmark.transpose();
  const Eigen::Matrix2d innovation_covariance =
      by_pose * cross.topRows<3>() + by_landmark * cross.middleRows<2>(row) + noise;
  const Eigen::Vector2d innovation(
      z.range - range, wrap_angle(z.bearing - std::atan2(offset.y(), offset.x()) + state_[2]));
  const Eigen::LDLT<Eigen::Matrix2d> solver(innovation_covariance);
  const Eigen::MatrixXd gain = solver.solve(cross.transpose()).transpose();
  state_ += gain * innovation;
  state_[2] = wrap_angle(state_[2]);
  covariance_ -= gain * cross.transpose();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

PoseEstimate EkfSlam::estimate() const {
  PoseEstimate pose;
  pose.mean = {state_[0], state_[1], state_[2]};
  pose.covariance = covariance_.topLeftCorner<3, 3>();
  return pose;
}

}  // namespace pf_resampling
