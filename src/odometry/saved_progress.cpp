#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

void describe(Archive& archive, ros::Time& stamp) {
  const auto most = static_cast<std::int64_t>(ros::TIME_MAX.toNSec());
  const auto nanoseconds = static_cast<std::int64_t>(stamp.toNSec());
  stamp.fromNSec(static_cast<std::uint64_t>(archive.integer(nanoseconds, 0, most)));
}

void describe(Archive& archive, OdometrySample& sample) {
  PF_RESAMPLING_FIELDS(archive, sample.stamp, sample.received, sample.pose, sample.covariance,
                       sample.step_covariance, sample.may_slip);
}

void describe(Archive& archive, SavedProgress& progress) {
  PF_RESAMPLING_FIELDS(archive, progress.first_odometry, progress.used, progress.last_observation,
                       progress.lost_probability, progress.normalized_innovation,
                       progress.odometry_offset, progress.speed.driven, progress.speed.slipping,
                       progress.speed.moving, progress.speed.moves, progress.odometry);
}

}  // namespace pf_resampling
