#pragma once

#include <string>

#include "tools/datasets/recording.hpp"

namespace pf_resampling {

struct MrclamOptions {
  int robot = 1;                ///< whose recording: Robot<robot>_*.dat
  double odometry_delay = 0.0;  ///< s, added to the times of the odometry
};

/// Reads the recording of one robot of a UTIAS multi-robot data set (Leung, Halpern, Barfoot, Liu,
/// "The UTIAS multi-robot cooperative localization and mapping dataset", IJRR 2011): a directory
/// with Barcodes.dat [subject barcode], Robot<n>_Odometry.dat [t v omega], Robot<n>_Measurement.dat
/// [t barcode range bearing] and, if there is truth, Robot<n>_Groundtruth.dat [t x y heading] and
/// Landmark_Groundtruth.dat [subject x y sigma_x sigma_y].
///
/// Subjects 1 to 5 are robots: observations of them are left out, as are those of barcodes that no
/// subject carries (misread, counted in a note). Landmark ids are subject numbers, from 6. A
/// barcode misread as that of another landmark cannot be told here; the filter's gate has to.
///
/// Velocities hold until the next row: on data set 6 this fits the true turns of half a second to
/// 0.015 to 0.017 rad rms, the rule "since the row before" to 0.016 to 0.020. There a row's motion
/// shows in the truth 0.2 s after its time (robots 1 to 3, best fit); odometry_delay of 0.2 takes
/// that out.
/// Throws Error that names file and line.
Recording read_mrclam(const std::string& directory, const MrclamOptions& options);

}  // namespace pf_resampling
