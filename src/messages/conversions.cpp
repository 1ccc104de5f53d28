#include "src/messages/conversions.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace pf_resampling {
namespace {

constexpr std::array<std::size_t, 3> kPlanarAxes = {
    0, 1, 5};  // x, y, yaw among x, y, z, roll, pitch, yaw

/// One point of the cloud; the layout of the fields below.
struct CloudPoint {
  float x, y, z, yaw, weight;
  std::uint32_t ancestor;
};
static_assert(sizeof(CloudPoint) == 24, "points of the cloud are packed");

/// A drive that was loaded may have begun before time did, where that is simulated.
ros::Time time_within_range(double seconds) {
  return seconds > 0.0 ? ros::Time(std::min(seconds, ros::TIME_MAX.toSec())) : ros::Time();
}

}  // namespace

geometry_msgs::Quaternion to_quaternion_message(double angle) {
  geometry_msgs::Quaternion rotation;
  rotation.z = std::sin(0.5 * angle);
  rotation.w = std::cos(0.5 * angle);
  return rotation;
}

geometry_msgs::Pose to_pose_message(const Pose2& pose) {
  geometry_msgs::Pose message;
  message.position.x = pose.x;
  message.position.y = pose.y;
  message.orientation = to_quaternion_message(pose.heading);
  return message;
}

double yaw_of(const geometry_msgs::Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z);
}

Pose2 to_pose2(const geometry_msgs::Pose& pose) {
  return {pose.position.x, pose.position.y, yaw_of(pose.orientation)};
}

bool is_unit(const geometry_msgs::Quaternion& q) {
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return std::abs(length - 1.0) <= 0.01;
}

nav_msgs::Odometry to_odometry_message(const geometry_msgs::TransformStamped& transform) {
  nav_msgs::Odometry odometry;
  odometry.header = transform.header;
  odometry.child_frame_id = transform.child_frame_id;
  odometry.pose.pose.position.x = transform.transform.translation.x;
  odometry.pose.pose.position.y = transform.transform.translation.y;
  odometry.pose.pose.position.z = transform.transform.translation.z;
  odometry.pose.pose.orientation = transform.transform.rotation;
  return odometry;
}

nav_msgs::Odometry to_odometry_message(const geometry_msgs::PoseWithCovarianceStamped& pose,
                                       const std::string& base) {
  nav_msgs::Odometry odometry;
  odometry.header = pose.header;
  odometry.child_frame_id = base;
  odometry.pose = pose.pose;
  return odometry;
}

boost::array<double, 36> to_covariance_message(const Eigen::Matrix3d& covariance) {
  boost::array<double, 36> message;
  message.assign(0.0);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      message[6 * kPlanarAxes[row] + kPlanarAxes[column]] =
          covariance(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    }
  }
  return message;
}

Eigen::Matrix3d to_covariance3(const boost::array<double, 36>& message) {
  Eigen::Matrix3d covariance;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      covariance(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
          message[6 * kPlanarAxes[row] + kPlanarAxes[column]];
    }
  }
  return covariance;
}

bool is_covariance(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return false;
  const double scale = covariance.cwiseAbs().maxCoeff();
  if (scale == 0.0) return true;
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > 1e-6 * scale) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= -1e-9 * scale;
}

bool is_finite(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) &&
         std::isfinite(q.y) && std::isfinite(q.z) && std::isfinite(q.w);
}

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
}

std::string without_slash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

geometry_msgs::PoseArray to_pose_array(const ParticleView& particles, const Pose2& motion) {
  geometry_msgs::PoseArray message;
  const Eigen::Index count = particles.x.size();
  message.poses.reserve(static_cast<std::size_t>(count));
  for (Eigen::Index i = 0; i < count; ++i) {
    message.poses.push_back(
        to_pose_message(compose({particles.x[i], particles.y[i], particles.heading[i]}, motion)));
  }
  return message;
}

sensor_msgs::PointCloud2 to_point_cloud(const ParticleView& particles, const Pose2& motion) {
  using sensor_msgs::PointField;
  sensor_msgs::PointCloud2 cloud;
  const Eigen::Index count = particles.x.size();
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier layout(cloud);
  layout.setPointCloud2Fields(6, "x", 1, PointField::FLOAT32, "y", 1, PointField::FLOAT32,  //
                              "z", 1, PointField::FLOAT32, "yaw", 1, PointField::FLOAT32,   //
                              "weight", 1, PointField::FLOAT32, "ancestor", 1, PointField::UINT32);
  layout.resize(static_cast<std::size_t>(count));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Pose2 pose = compose({particles.x[i], particles.y[i], particles.heading[i]}, motion);
    const CloudPoint point = {static_cast<float>(pose.x),
                              static_cast<float>(pose.y),
                              0.0F,
                              static_cast<float>(pose.heading),
                              static_cast<float>(particles.weights[i]),
                              static_cast<std::uint32_t>(particles.ancestors[i])};
    std::memcpy(&cloud.data[static_cast<std::size_t>(i) * sizeof(CloudPoint)], &point,
                sizeof(CloudPoint));
  }
  return cloud;
}

std::vector<FindingStatus> to_messages(const std::vector<Finding>& findings, double start) {
  std::vector<FindingStatus> messages;
  for (const Finding& finding : findings) {
    FindingStatus message;
    message.kind = to_string(finding.kind);
    message.id = static_cast<std::int32_t>(finding.id);
    message.begin = time_within_range(finding.begin);
    message.end = time_within_range(finding.end);
    message.place.x = finding.place.x();
    message.place.y = finding.place.y();
    message.size = finding.size;
    message.sigma = finding.sigma;
    message.probability = finding.probability;
    message.open = finding.is_open;
    message.text = sentence_of(finding, start);
    messages.push_back(message);
  }
  return messages;
}

SystematicError to_systematic_error(const std::string& name, double value, double sigma) {
  SystematicError error;
  error.name = name;
  error.value = value;
  error.sigma = sigma;
  return error;
}

std::vector<PoseHypothesis> to_hypotheses(const PoseClusters& clusters) {
  std::vector<PoseHypothesis> hypotheses;
  for (const PoseCluster& cluster : clusters.clusters) {
    PoseHypothesis hypothesis;
    hypothesis.weight = cluster.weight;
    hypothesis.pose.pose = to_pose_message(cluster.pose.mean);
    hypothesis.pose.covariance = to_covariance_message(cluster.pose.covariance);
    hypotheses.push_back(hypothesis);
  }
  return hypotheses;
}

}  // namespace pf_resampling
