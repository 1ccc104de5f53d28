#pragma once

#include <string>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"
#include "research/studies/recorded_drive.hpp"

namespace pf_resampling {

/// Something that goes wrong on a drive, from `begin` to `end` (s, stamps).
struct Fault {
  std::string name;  ///< what happens, in words
  double begin = 0.0;
  double end = 0.0;
  RecordedDrive drive;  ///< with the fault in it
  /// s by which the stamp of every message is wrong; empty: none is.
  std::vector<double> clock_errors = {};
};

/// What robots do, put into a drive at `share` of its duration: kidnapping, radios or landmarks
/// that fail, lie or move, odometry that slips or stops, gaps, every kind of bad message, time that
/// jumps. Of ranges and landmarks the drives have what its filter reads: ranges if there are
/// beacons. Throws Error if there are none of them. The random numbers, of which messages it
/// befalls, are those of `random`. Drives that begin in the first hour begin an hour later, so that
/// no clock is set back below zero.
std::vector<Fault> all_faults(const RecordedDrive& drive, double share, const RandomStream& random);

/// The drive cut and joined so that the robot is at least `distance` (m) elsewhere from one message
/// to the next, while odometry and time go on as if nothing had happened; not before `begin` (s).
/// Throws Error where the drive never is so far from anywhere.
Fault kidnapped(const RecordedDrive& drive, double begin, double distance);

}  // namespace pf_resampling
