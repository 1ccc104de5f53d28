#include "src/pipeline/belief_publisher.hpp"

#include <algorithm>
#include <cmath>

#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// Poses of paths per second that are given out at most, 16 kB: all of the path each time, its
// volume would grow with the square of the time.
constexpr double kMostPathPoses = 200.0;

}  // namespace

void add_parameters(OutputOptions* output, ParameterList* list) {
  list->push_back(
      real_parameter("output/cloud_period", &output->cloud_period, 0.0, 1e6, "s",
                     "Period of the particle clouds; 0: one with every odometry message."));
}

bool is_due(double period, ros::Time stamp, ros::Time* last) {
  // A little early, so that rounded stamps do not skip a message.
  const auto multiple = [period](ros::Time time) {
    return std::floor((time.toSec() + 1e-4) / period);
  };
  if (!last->isZero() && stamp >= *last && period > 0.0 && multiple(stamp) == multiple(*last)) {
    return false;
  }
  *last = stamp;
  return true;
}

double position_sigma(const PoseEstimate& estimate) {
  return std::sqrt(std::max(0.0, estimate.covariance(0, 0) + estimate.covariance(1, 1)));
}

double heading_sigma(const PoseEstimate& estimate) {
  return std::sqrt(std::max(0.0, estimate.covariance(2, 2)));
}

void BeliefPublisher::publish_pose(ros::Time stamp, const PoseEstimate& belief, const Pose2& base) {
  if (!is_finite(belief.mean) || !belief.covariance.allFinite()) {
    ++held_back_;
    return;
  }
  if (sinks_->estimate) sinks_->estimate(stamp, belief);
  if (sinks_->pose) {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.stamp = stamp;
    message.header.frame_id = frames_.map;
    message.pose.pose = to_pose_message(belief.mean);
    message.pose.covariance = to_covariance_message(belief.covariance);
    sinks_->pose(message);
  }
  if (sinks_->transform && frames_.publish_tf) {
    // map -> odom such that the robot is where it is believed: map -> base = map -> odom -> base.
    const Pose2 odom = compose(belief.mean, relative(base, Pose2{}));
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = stamp + ros::Duration(frames_.transform_tolerance);
    transform.header.frame_id = frames_.map;
    transform.child_frame_id = frames_.odom;
    transform.transform.translation.x = odom.x;
    transform.transform.translation.y = odom.y;
    transform.transform.rotation = to_quaternion_message(odom.heading);
    sinks_->transform(transform);
  }
  if (sinks_->path && position_sigma(belief) <= options_.path_max_sigma) {
    path_.add(stamp, frames_.map, belief.mean);
  }
}

void BeliefPublisher::publish_clouds(ros::Time stamp, const ParticleView& particles,
                                     const Pose2& motion) {
  if (!wants_clouds() || !is_due(options_.cloud_period, stamp, &last_cloud_)) return;
  if (sinks_->particlecloud) {
    geometry_msgs::PoseArray cloud = to_pose_array(particles, motion);
    cloud.header.stamp = stamp;
    cloud.header.frame_id = frames_.map;
    sinks_->particlecloud(cloud);
  }
  if (sinks_->particles) {
    sensor_msgs::PointCloud2 cloud = to_point_cloud(particles, motion);
    cloud.header.stamp = stamp;
    cloud.header.frame_id = frames_.map;
    sinks_->particles(cloud);
  }
}

void BeliefPublisher::publish_path(ros::Time stamp) {
  if (!sinks_->path || path_.path().poses.empty()) return;
  if (is_path_due(stamp)) give_out(path_.path());
}

bool BeliefPublisher::is_path_due(ros::Time stamp) {
  const double passed = stamp.toSec() - last_path_.toSec();
  const bool is_early = passed >= 0.0 && passed * kMostPathPoses < static_cast<double>(path_size_);
  if (is_early && options_.path_period > 0.0 && !last_path_.isZero()) return false;
  return is_due(options_.path_period, stamp, &last_path_);
}

void BeliefPublisher::give_out(const nav_msgs::Path& path) {
  path_size_ = path.poses.size();
  sinks_->path(path);
}

void BeliefPublisher::publish_path(ros::Time stamp, const std::vector<ros::Time>& stamps,
                                   const std::function<std::vector<Pose2>()>& poses) {
  if (!sinks_->path || stamps.empty() || !is_path_due(stamp)) return;
  const std::vector<Pose2> all = poses();
  PathRecorder path(options_.path_spacing, options_.path_length);
  for (std::size_t i = 0; i < all.size(); ++i) path.add(stamps[i], frames_.map, all[i]);
  give_out(path.path());
}

}  // namespace pf_resampling
