#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

void describe(Archive& archive, SavedOdometry& odometry) {
  archive("stamp", odometry.stamp);
  archive("received", odometry.received);
  archive("pose", odometry.pose);
  archive("covariance", odometry.covariance);
  archive("step_covariance", odometry.step_covariance);
  archive("may_slip", odometry.may_slip);
}

void describe(Archive& archive, SavedProgress& progress) {
  archive("first_odometry", progress.first_odometry);
  archive("used", progress.used);
  archive("last_observation", progress.last_observation);
  archive("lost_probability", progress.lost_probability);
  archive("normalized_innovation", progress.normalized_innovation);
  archive("odometry_offset", progress.odometry_offset);
  archive("driven", progress.driven);
  archive("slipping", progress.slipping);
  archive("moving", progress.moving);
  archive("moves", progress.moves);
  archive("odometry", progress.odometry);
}

}  // namespace pf_resampling
