#pragma once

#include <string>

#include "tools/datasets/recording.hpp"

namespace pf_resampling {

/// Reads the Victoria Park data set (Guivant, Nebot, "Optimization of the simultaneous localization
/// and map-building algorithm for real-time implementation", 2001), with the trees already found in
/// the laser scans: a directory with time.txt (ms), speed.txt (m/s), steering.txt (rad), or all
/// three in aa3_dr.mat; lasersampling.txt (ms), ObservationDistance.txt (m) and
/// ObservationAngle.txt (rad, from the right, ahead is pi/2), a row per scan, zeros at its end;
/// and, if there is truth, aa3_gpsx.mat with timeGps (ms), Lo_m and La_m (m).
///
/// The vehicle steers by its front wheels (info.txt: L = 2.83, a = 0.95, b = 0.5, H = 0.76 m).
/// base_link is the middle of its rear axle. The encoder sits at the left rear wheel, H from there,
/// so the middle moves at v / (1 - tan(steering) H / L) and turns at that times tan(steering) / L;
/// both hold until the next row. The laser sits a before the front axle and b left of the middle:
/// frame "sensor" at (L + a, b), the point whose path the GPS gives: frame "ground_truth".
/// Observations have no ids. The GPS gives no heading, has gaps, and its x axis is not the
/// direction in which the vehicle starts.
/// Throws Error that names file and line.
Recording read_victoria_park(const std::string& directory);

}  // namespace pf_resampling
