#pragma once

#include <map>
#include <optional>
#include <string>

#include "tools/datasets/recording.hpp"

namespace pf_resampling {

struct PlazaOptions {
  /// Metres per unit of the ranges; without a value it is found from the true distances, metres if
  /// there is no truth.
  std::optional<double> metres_per_unit;
  /// Where antennas sit on the robot, by their number in the file; -1: all that are not named.
  std::map<int, Recording::Frame> antennas;
};

/// Reads the MATLAB 5 files of the CMU range-only data sets (Djugash, Hamner, Roth, "Navigating
/// with ranging radios", FSR 2009; Kurth, CMU-RI-TR-04-29, has the same layout with ranges in
/// feet):
///   DR [t distance dheading]  steps of dead reckoning, each from the row before to t; without it
///   DRp [t x y heading]       dead reckoning as a path,
///   TD [t antenna beacon range], TL [beacon x y (z)], GT [t x y (heading)]; TL and GT may miss.
///
/// The steps are integrated with the mid-point rule, as DRp of the files is. (On Plaza 2 the truth
/// cannot tell it from the rule "heading before": 1.73 and 1.72 m mean error with the yaw-rate bias
/// taken out.) If the heading of GT is nearer the opposite of the direction of travel than to it,
/// as in Plaza 2, it is turned by pi. Distances of DR are without sign: driving in reverse does
/// not show in them.
/// Throws Error that names the file and the variable.
Recording read_plaza(const std::string& path, const PlazaOptions& options);

/// Circular mean (rad) of the direction of travel minus the heading, over the steps of the truth in
/// which the robot moves by more than 2 cm; nothing if it hardly moves.
std::optional<double> mean_travel_minus_heading(const std::vector<Recording::Truth>& truth);

}  // namespace pf_resampling
