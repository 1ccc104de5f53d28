#pragma once

#include <geometry_msgs/PoseArray.h>

#include <vector>

#include "pf_resampling_core/population/given_particles.hpp"
#include "src/frames/frame_names.hpp"
#include "src/odometry/dead_reckoning.hpp"

namespace pf_resampling {

/// Particles as the service set_particles gets them. Throws Error, in one line that names thing,
/// value and remedy, for another frame, an impossible stamp, quaternions that are no rotation, and
/// what check_given_particles() refuses.
GivenParticles to_given_particles(const geometry_msgs::PoseArray& poses,
                                  const std::vector<double>& weights, const FrameNames& frames);

/// When they hold, given their stamp: zero is the newest odometry. Throws Error for a time that
/// the odometry does not cover.
ros::Time stamp_of_given(ros::Time stamp, const DeadReckoning& odometry);

}  // namespace pf_resampling
