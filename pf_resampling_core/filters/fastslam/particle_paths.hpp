#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// The paths of all particles: what FastSLAM estimates is the robot's whole path (Montemerlo et al.
/// 2002), and the past of a particle that survived is known better than it was at the time.
///
/// A tree: particles share the past of their common ancestors. Where all have come down to one
/// ancestor, which resampling sees to, a single pose is kept; so memory grows by one pose a step,
/// and a bounded part for the steps in which particles still differ.
class ParticlePaths {
 public:
  /// `largest`: poses kept of the steps in which particles differ. When there are more, as without
  /// any resampling, the oldest steps are reduced to their means.
  explicit ParticlePaths(std::size_t largest = 1000000) : largest_(largest) {}

  void clear();

  /// A step: where every particle is now; as many as in the last step, or as were selected since.
  void append(ConstArray x, ConstArray y, ConstArray heading);

  /// Particle i goes on from former particle ancestors[i].
  void select(ConstIndices ancestors);

  /// All of so many particles go on from these poses: one for each of the newest steps, the oldest
  /// first; those of steps that are not there are left out. Of earlier steps the means by `weights`
  /// stay.
  void replace_newest(const std::vector<Pose2>& poses, ConstArray weights, int particles);

  /// Weighted mean of the paths of the present particles, a pose per step, the oldest first.
  std::vector<Pose2> mean(ConstArray weights) const;

  std::size_t steps() const { return common_.size() + recent_.size(); }
  /// Poses kept.
  std::size_t size() const;

 private:
  // Poses of a step that have descendants, and of each the index of its parent in the step before.
  struct Step {
    std::vector<Pose2> poses;
    std::vector<int> parents;
  };

  void compact();

  std::size_t largest_;
  std::vector<Pose2> common_;  // of all particles
  std::deque<Step> recent_;
  std::vector<int> parents_;  // of the present particles, in the last step
  int since_compaction_ = 0;
};

}  // namespace pf_resampling
