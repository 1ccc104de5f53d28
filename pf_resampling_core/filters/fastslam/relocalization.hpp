#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"

namespace pf_resampling {

/// A landmark that was seen and is in the map: where a belief that may be wrong puts the
/// observation, and where the map has the landmark.
struct LandmarkSighting {
  std::int64_t id = 0;
  Eigen::Vector2d seen = Eigen::Vector2d::Zero();    ///< m, map frame, by the belief
  Eigen::Vector2d mapped = Eigen::Vector2d::Zero();  ///< m, map frame
  double sigma = 0.1;      ///< m, expected deviation of the difference, but for the belief's error
  std::int64_t stamp = 0;  ///< ns
};

/// Sightings of the last seconds, in order of time.
class RecentSightings {
 public:
  /// `window`: for so long, in ns, odometry alone may lie between them; no more than `most`.
  RecentSightings(std::int64_t window, std::size_t most) : window_(window), most_(most) {}

  void add(const LandmarkSighting& sighting) { sightings_.push_back(sighting); }
  /// Forgets those that are too old at `stamp`, or too many.
  void forget_before(std::int64_t stamp);
  /// Where the belief that they were seen from has moved, by what moved it (map frame).
  void move(const Pose2& correction);
  void clear() { sightings_.clear(); }

  /// Whether they are of several scans: one alone may be a mistake of the sensor.
  bool are_of_several_scans() const;
  const std::vector<LandmarkSighting>& all() const { return sightings_; }

 private:
  std::int64_t window_;
  std::size_t most_;
  std::vector<LandmarkSighting> sightings_;
};

/// Where a robot is that was carried away: the pose from which most of what it has seen since is
/// where the map has it. Two sightings of different landmarks, as far from each other as these are,
/// place the robot; all such pairs are tried, the one that most others agree with is refined by
/// least squares over the landmarks (random sample consensus, Fischler & Bolles 1981, without the
/// randomness). `belief`: the pose that the sightings are seen from, as believed; the sightings'
/// beliefs may be earlier ones if odometry alone lies between them. Nothing if fewer than 60 %
/// agree, or if they do not tell the heading.
std::optional<PoseEstimate> relocalize(const std::vector<LandmarkSighting>& sightings,
                                       const Pose2& belief);

}  // namespace pf_resampling
