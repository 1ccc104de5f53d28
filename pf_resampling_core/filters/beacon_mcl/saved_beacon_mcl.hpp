#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

namespace pf_resampling {

/// What a BeaconMcl filter knows at a moment. Options, seed and the beacons' nominal calibration
/// are not part of it. With the same of these, a filter that loads it goes on to the bit as the one
/// that was saved would have.
struct SavedBeaconMcl {
  std::vector<Beacon> beacons;
  BeaconMclProgress progress;
  BeaconMclParticles particles;
  std::optional<RangeMemory> memory;   ///< under Renewal::redraw
  std::vector<Beacon> memory_beacons;  ///< those whose place it knew at its start
};

/// As it is saved.
void describe(Archive& archive, SavedBeaconMcl& saved);
void describe(Archive& archive, RecentRange& range);
void describe(Archive& archive, BeaconMclParticles& particles);
void describe(Archive& archive, Beacon& beacon);

}  // namespace pf_resampling
