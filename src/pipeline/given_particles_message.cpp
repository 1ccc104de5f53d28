#include "src/pipeline/given_particles_message.hpp"

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

constexpr const char* kName = "set_particles: ";

}  // namespace

GivenParticles to_given_particles(const geometry_msgs::PoseArray& poses,
                                  const std::vector<double>& weights, const FrameNames& frames) {
  if (without_slash(poses.header.frame_id) != without_slash(frames.map)) {
    throw Error(kName + std::string("the frame is '") + poses.header.frame_id +
                "'; give the poses in '" + frames.map + "'");
  }
  GivenParticles particles;
  particles.weights = weights;
  particles.poses.reserve(poses.poses.size());
  for (const geometry_msgs::Pose& pose : poses.poses) {
    const auto& q = pose.orientation;
    if (is_finite(pose) && !is_unit(q)) {
      throw Error(kName + rejection(RejectReason::not_unit_quaternion, "the orientation (", q.x,
                                    ", ", q.y, ", ", q.z, ", ", q.w, ") of particle ",
                                    particles.poses.size(),
                                    " is not of length 1; give unit quaternions")
                              .detail);
    }
    particles.poses.push_back(to_pose2(pose));
  }
  try {
    check_given_particles(particles);
  } catch (const Error& error) {
    throw Error(std::string(kName) + error.what());
  }
  return particles;
}

ros::Time stamp_of_given(ros::Time stamp, const DeadReckoning& odometry) {
  if (odometry.empty()) return stamp;
  if (stamp.isZero()) return odometry.newest();
  if (odometry.covers(stamp)) return stamp;
  throw Error(kName + std::string("no odometry is kept for the stamp ") +
              std::to_string(stamp.toSec()) + "; give one up to " +
              std::to_string(odometry.newest().toSec()) + ", or 0 for the newest");
}

}  // namespace pf_resampling
