#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/FindingStatus.h>
#include <pf_resampling/PoseHypothesis.h>
#include <pf_resampling/SystematicError.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Core>
#include <boost/array.hpp>
#include <string>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/health/finding.hpp"
#include "pf_resampling_core/population/pose_clusters.hpp"

namespace pf_resampling {

/// Planar pose as a message: z = 0, rotation about z.
geometry_msgs::Pose to_pose_message(const Pose2& pose);

/// Rotation about z by `angle` (rad).
geometry_msgs::Quaternion to_quaternion_message(double angle);

/// Position and yaw of a pose; roll, pitch and z are dropped. The quaternion has to be of unit
/// length (see is_unit).
Pose2 to_pose2(const geometry_msgs::Pose& pose);

/// Angle about z of a rotation.
double yaw_of(const geometry_msgs::Quaternion& rotation);

/// Whether a quaternion is a rotation: length 1 within 1 %, which single precision and text files
/// keep.
bool is_unit(const geometry_msgs::Quaternion& rotation);

/// Odometry without a covariance, from the transform odom -> base; and from a pose in the odometry
/// frame, of `base`.
nav_msgs::Odometry to_odometry_message(const geometry_msgs::TransformStamped& transform);
nav_msgs::Odometry to_odometry_message(const geometry_msgs::PoseWithCovarianceStamped& pose,
                                       const std::string& base);

/// Covariance of (x, y, heading) as the 6 x 6 of ROS: row-major, order x, y, z, roll, pitch, yaw.
boost::array<double, 36> to_covariance_message(const Eigen::Matrix3d& covariance);

/// The rows and columns x, y and yaw of such a 6 x 6.
Eigen::Matrix3d to_covariance3(const boost::array<double, 36>& covariance);

/// Whether a matrix is one that a covariance can be: finite, symmetric, nowhere negative. Zero is.
bool is_covariance(const Eigen::Matrix3d& covariance);

bool is_finite(const geometry_msgs::Pose& pose);
bool is_finite(const Pose2& pose);

/// "/map" -> "map": tf names have no slash in front since tf2.
std::string without_slash(const std::string& frame);

/// Particles of a planar filter, structure of arrays of equal size.
struct ParticleView {
  Eigen::Ref<const Eigen::ArrayXd> x;        ///< m
  Eigen::Ref<const Eigen::ArrayXd> y;        ///< m
  Eigen::Ref<const Eigen::ArrayXd> heading;  ///< rad
  Eigen::Ref<const Eigen::ArrayXd> weights;  ///< linear, sum 1
  Eigen::Ref<const Eigen::ArrayXi> ancestors;
};

/// Poses of all particles, each moved by `motion` (given in its own body frame). Header to be set
/// by the caller.
geometry_msgs::PoseArray to_pose_array(const ParticleView& particles, const Pose2& motion);

/// All particles, moved likewise, with the fields x, y, z, yaw, weight (float32) and ancestor
/// (uint32). Header to be set by the caller.
sensor_msgs::PointCloud2 to_point_cloud(const ParticleView& particles, const Pose2& motion);

/// As in FilterStatus; times of `findings` are stamps, those of texts count from `start`, s.
std::vector<FindingStatus> to_messages(const std::vector<Finding>& findings, double start);

/// As in FilterStatus.
SystematicError to_systematic_error(const std::string& name, double value, double sigma);

/// As in FilterStatus.
std::vector<PoseHypothesis> to_hypotheses(const PoseClusters& clusters);

}  // namespace pf_resampling
