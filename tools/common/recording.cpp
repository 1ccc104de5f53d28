#include "tools/common/recording.hpp"

#include <cmath>

namespace pf_resampling {

Recording read_recording(const rosbag::Bag& bag, const std::string& odometry,
                         const std::string& ranges, const std::string& landmarks,
                         const FrameNames& frames) {
  Recording recording;
  recording.odometry = read_odometry(bag, odometry, frames).poses;
  recording.odometry_noise = read_odometry_noise(bag, odometry);
  recording.ranges = read_ranges(bag, ranges);
  recording.scans = read_landmark_scans(bag, landmarks);
  recording.frames = read_frames_on_robot(bag, frames.base);
  return recording;
}

Pose2 to_pose2(const Eigen::Isometry3d& frame) {
  const Eigen::Matrix3d turn = frame.linear();
  return {frame.translation().x(), frame.translation().y(), std::atan2(turn(1, 0), turn(0, 0))};
}

}  // namespace pf_resampling
