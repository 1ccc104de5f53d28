#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/range_memory/saved_range_memory.hpp"

namespace pf_resampling {

/// What a BeaconMcl filter knows at a moment. Options, seed and the beacons' nominal calibration
/// are not part of it. With the same of these, a filter that loads it goes on to the bit as the one
/// that was saved would have.
struct SavedBeaconMcl {
  std::vector<Beacon> beacons;
  std::uint32_t step = 0;  ///< of the random streams
  double time = 0.0;       ///< s, since the start
  std::int64_t updates_since_renewal = 0;
  Pose2 dead_reckoning;  ///< since the start
  double first_range_time = 0.0;
  double range_squares = 0.0;  ///< of the ranges' noise, in units of the nominal variance
  double range_count = 0.0;    ///< and of how many
  double slow_likelihood = 0.0;
  double fast_likelihood = 0.0;
  std::int64_t likelihoods = 0;
  double calibration_time = 0.0;    ///< s, when its variances are of
  std::vector<RecentRange> ranges;  ///< the oldest first
  BeaconMclParticles particles;
  std::optional<RangeMemory> memory;   ///< under Renewal::redraw
  std::vector<Beacon> memory_beacons;  ///< those whose place it knew at its start
  bool is_drawn_from_memory = false;   ///< the population
  double next_solution = 0.0;          ///< s
};

/// As it is saved.
void describe(Archive& archive, SavedBeaconMcl& saved);
void describe(Archive& archive, RecentRange& range);
void describe(Archive& archive, BeaconMclParticles& particles);
void describe(Archive& archive, Beacon& beacon);

}  // namespace pf_resampling
