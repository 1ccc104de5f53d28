#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

void describe(Archive& archive, SavedOdometry& odometry) {
  PF_RESAMPLING_FIELDS(archive, odometry.stamp, odometry.received, odometry.pose,
                       odometry.covariance, odometry.step_covariance, odometry.may_slip);
}

void describe(Archive& archive, SavedProgress& progress) {
  PF_RESAMPLING_FIELDS(archive, progress.first_odometry, progress.used, progress.last_observation,
                       progress.lost_probability, progress.normalized_innovation,
                       progress.odometry_offset, progress.driven, progress.slipping,
                       progress.moving, progress.moves, progress.odometry);
}

}  // namespace pf_resampling
