#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/relocalization.hpp"

namespace pf_resampling {

/// Finds a robot anywhere in a map, by the landmarks that it has seen in the last seconds, while
/// odometry alone says how it moves. With ids, relocalize() does it. Without, all ways are tried in
/// which two places that it saw could be two landmarks; the one in which most of all sightings are
/// of landmarks is taken, if it explains nearly all and no other explains nearly as many (joint
/// compatibility: Neira & Tardos 2001).
class GlobalSearch {
 public:
  /// The robot has moved, in its own frame.
  void move(const Pose2& motion) { robot_ = compose(robot_, motion); }

  /// Adds what `sensor` (on the robot) saw at `stamp` (ns), and looks for the robot in `map`.
  /// `with_ids`: the observations' ids are those of the landmarks. Nothing until it is clear.
  std::optional<PoseEstimate> add(std::int64_t stamp,
                                  const std::vector<RangeBearingObservation>& observations,
                                  const Pose2& sensor, const LandmarkSensorOptions& noise,
                                  const std::vector<LandmarkEstimate>& map, bool with_ids);

  /// Whether what was seen fits the map well from several places.
  bool is_ambiguous() const { return is_ambiguous_; }

 private:
  Pose2 robot_;                                     // by odometry, since the search began
  RecentSightings sightings_{20'000'000'000, 200};  // ns
  bool is_ambiguous_ = false;
  std::size_t next_pair_ = 0;  // of places, with which the next search begins
};

/// A place where something was seen: the mean of sightings that lie together.
struct SeenPlace {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< m
  double sigma = 0.1;                               ///< m
  int sightings = 1;
};

struct PlaceMatch {
  std::vector<int> landmarks;  ///< of the map, of each place; -1: none; empty: that is not clear
  bool is_ambiguous = false;   ///< because several ways fit well
};

/// Which landmark of the map each place is. Nothing in a map of more than 5000 landmarks. Where
/// there are too many ways to try them all at once, it begins with the pair of places `next_pair`,
/// if that is given, and moves it past those that it tried. Throws nothing.
PlaceMatch match_places(const std::vector<SeenPlace>& places,
                        const std::vector<LandmarkEstimate>& map, std::size_t* next_pair = nullptr);

}  // namespace pf_resampling
