#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "pf_resampling_core/filters/fastslam/relocalization.hpp"

namespace pf_resampling {

/// The landmarks with ids that were seen in the last seconds and are in the map, for relocalize().
/// Stamps are in nanoseconds.
class RecentSightings {
 public:
  void add(std::int64_t stamp, const LandmarkSighting& sighting);
  /// Forgets those that are too old at `stamp`, or too many.
  void forget_before(std::int64_t stamp);
  /// Where the belief that they were seen from has moved, by what moved it (map frame).
  void move(const Pose2& correction);
  void clear() { sightings_.clear(); }

  /// Whether they could tell where the robot is: several scans, of different landmarks.
  bool suffice() const;
  std::vector<LandmarkSighting> all() const;

 private:
  struct Stamped {
    std::int64_t stamp;
    LandmarkSighting sighting;
  };
  std::deque<Stamped> sightings_;  // in order of time
};

}  // namespace pf_resampling
