#pragma once

#include <string>

#include "pf_resampling_core/simulation/world.hpp"

namespace pf_resampling {

/// A world from a map of the public FastSLAM simulator (T. Bailey, University of Sydney): landmarks
/// `lm` and way-points `wp`, m, 2 x N, in the text form of its C++ ports: a line "lm 2 N", then N
/// lines "x y", and the same for wp. Robot and sensor are those of the
/// world indoor_two_loops (Kwak 2008, section 4, the simulator's own: 3 m/s, 0.3 m/s and 3 deg/s,
/// 0.1 m and 1 deg, 25 ms and 200 ms), with the simulator's range of 30 m. The robot starts at the
/// first way-point and faces the second. Throws Error that names the file and the line.
World load_map(const std::string& path);

}  // namespace pf_resampling
