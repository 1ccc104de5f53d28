#pragma once

#include <pf_resampling/ParticleErrors.h>
#include <rosbag/bag.h>

#include <optional>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"

namespace pf_resampling {

/// Judges particles and their maps by the truth in the bag while the filter runs (Kwak 2008,
/// eqs. 5 and 6): the maps of all particles are too much to keep for later.
class ParticleJudge {
 public:
  /// Takes /ground_truth and /ground_truth_landmarks. `frame_is_given`: the filter's frame is the
  /// truth's (it got an initial pose or a map); else it is where the robot was at the first
  /// odometry, on `odom`.
  ParticleJudge(const rosbag::Bag& bag, const std::string& odom, bool frame_is_given);

  /// Whether the bag carries what it takes.
  bool can_judge() const { return !truth_.empty() && to_filter_.has_value(); }

  /// Of the filter as it is now; nothing where the truth has a gap. Without true landmarks, or
  /// without a landmark that is one of them, eq. 5 is of nothing: 0.
  std::optional<ParticleErrors> judge(ros::Time stamp, FastSlam* filter) const;

 private:
  const PointLandmark* truth_of(FastSlam* filter, int row, const double* x, const double* y,
                                const std::uint8_t* held) const;

  std::vector<TruePose> truth_;
  double max_gap_ = 0.0;
  std::vector<PointLandmark> landmarks_;  // in the filter's frame
  double gate_ = 0.0;
  std::optional<Pose2> to_filter_;  // the truth's frame in the filter's
};

}  // namespace pf_resampling
