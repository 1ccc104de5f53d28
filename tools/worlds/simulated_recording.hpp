#pragma once

#include <cstdint>

#include "pf_resampling_core/simulation/world.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// Drives through a world and returns what a robot would have recorded there, with the truth. The
/// same world and seed give the same recording. Ranges carry no variance, as from a radio that does
/// not know it; landmark observations carry those of the sensor. Throws Error (check_world).
Recording simulated_recording(const World& world, std::uint64_t seed);

}  // namespace pf_resampling
