#pragma once

#include <string>

#include "tools/datasets/recording.hpp"

namespace pf_resampling {

/// Reads a recording in the text format of TU Chemnitz (its readme; libRSF): a directory with one
/// file *Input.txt (lines range2 and odom2diff) and, if there is truth, one *GT.txt (lines point2,
/// without heading). Beacons stand in the lines of the ranges. Velocities hold from their time to
/// the next one's.
///
/// Two things differ from what the readme says, as the recorded truth shows and libRSF's own
/// factor (OdometryFactor2DDifferential) confirms: the first velocity is that of the left wheel,
/// the second of the right, and the "distance between wheels" is that from the middle to a wheel:
/// omega = (second - first) / (2 distance). The other readings leave the path of the recording
/// more than half a metre off, this one 6 cm.
///
/// Throws Error that names file, line and field.
Recording read_labyrinth(const std::string& directory);

}  // namespace pf_resampling
