#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pf_resampling_core/models/point_alignment.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "tools/common/recording.hpp"

namespace pf_resampling {

/// With the truth, map frame.
struct KnownDrive : Recording {
  std::vector<StampedPose> truth;
  std::vector<PointLandmark> landmarks;
};

/// A drive through a world, which does not say how good its odometry is.
inline KnownDrive drive_through(const World& world, std::uint64_t seed) {
  const SimulatedDrive simulated = simulate(world, seed);
  KnownDrive drive;
  for (const SimulatedDrive::Odometry& each : simulated.odometry) {
    drive.odometry.push_back({each.time, each.pose});
    drive.truth.push_back({each.time, each.truth});
  }
  for (const SimulatedBeacon& each : world.beacons) drive.beacons.push_back(each.beacon);
  for (const SimulatedDrive::Range& each : simulated.ranges) {
    drive.ranges.push_back(
        {each.time, {{each.beacon, each.range, 0.0, world.ranges.antenna, true}}});
  }
  for (const Eigen::Vector2d& place : world.landmarks) {
    drive.landmarks.push_back({static_cast<std::int32_t>(drive.landmarks.size()), place});
  }
  const SimulatedLandmarkSensor& sensor = world.landmark_sensor;
  for (const SimulatedDrive::Scan& scan : simulated.scans) {
    drive.scans.push_back({scan.time, {}, {}});
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      drive.scans.back().landmarks.push_back({seen.id, seen.range, seen.bearing,
                                              sensor.range_sigma * sensor.range_sigma,
                                              sensor.bearing_sigma * sensor.bearing_sigma});
    }
  }
  return drive;
}

/// Leaves out what is later than `end` (s).
template <typename Entry>
void cut(double end, std::vector<Entry>* entries) {
  entries->erase(std::remove_if(entries->begin(), entries->end(),
                                [end](const Entry& entry) { return entry.time > end; }),
                 entries->end());
}

/// Sets the clock forward by so much (s) at `time`: what is later, is later by that.
template <typename Entry>
void set_clock(double time, double forward, std::vector<Entry>* entries) {
  for (Entry& entry : *entries) {
    if (entry.time > time) entry.time += forward;
  }
}

/// m: the mean distance of a path from the truth after a share of the time; `is_aligned`: after the
/// best rigid fit, which is returned, too.
struct PathError {
  double mean = 0.0;
  Pose2 alignment;
};
inline PathError path_error(const KnownDrive& drive, const std::vector<StampedPose>& path,
                            double clip, bool is_aligned = false) {
  const double first = drive.truth.front().time, last = drive.truth.back().time;
  std::vector<Eigen::Vector2d> from, to;
  for (const auto& [time, truth] : drive.truth) {
    if (time < first + clip * (last - first)) continue;
    const Pose2 there = pose_at(path, time);
    from.emplace_back(there.x, there.y);
    to.emplace_back(truth.x, truth.y);
  }
  PathError error;
  if (is_aligned) error.alignment = align_points(from, to);
  for (std::size_t i = 0; i < from.size(); ++i) {
    error.mean += (moved(from[i], error.alignment) - to[i]).norm();
  }
  error.mean /= static_cast<double>(from.size());
  return error;
}

/// m: the root mean square distance of landmarks from the true ones of their ids, likewise.
inline double map_error(const std::vector<PointLandmark>& map,
                        const std::vector<PointLandmark>& truth, bool is_aligned = false) {
  std::vector<Eigen::Vector2d> from, to;
  for (const PointLandmark& landmark : map) {
    for (const PointLandmark& other : truth) {
      if (other.id != landmark.id) continue;
      from.push_back(landmark.position);
      to.push_back(other.position);
    }
  }
  const Pose2 alignment = is_aligned ? align_points(from, to) : Pose2{};
  double squares = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    squares += (moved(from[i], alignment) - to[i]).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(from.size()));
}

/// m.
inline double distance(const StampedPose& a, const StampedPose& b) {
  return std::hypot(a.pose.x - b.pose.x, a.pose.y - b.pose.y);
}

}  // namespace pf_resampling
