#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {

/// What can have changed, or be wrong.
enum class FindingKind {
  wheels_slipped,
  odometry_counts_wrong,  ///< distances; its size is measured over true
  odometry_turns_wrong,   ///< likewise turns; less than 0 the other way round
  landmark_moved,
  landmark_twice,  ///< two landmarks have one id
  landmark_gone,
  beacon_biased,   ///< its ranges are too long or too short
  beacon_moved,    ///< it is not where the list has it
  beacon_swapped,  ///< it is at the place of another
  beacon_repeats,  ///< its ranges are those of another
};
const EnumNames<FindingKind>& names_of(FindingKind);

/// Something that has changed, or is wrong, and that the data of a drive show.
struct Finding {
  FindingKind kind = FindingKind::wheels_slipped;
  std::int64_t id = -1;           ///< of the landmark or beacon; -1: none
  double begin = 0.0, end = 0.0;  ///< s: when the data showed it first and last
  /// m, map frame: where the landmark or beacon was found, or where the one that is gone was; where
  /// the wheels slipped.
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double size = 0.0;   ///< m: from the map, between the two places, of the odometry's error, bias
  double sigma = 0.0;  ///< m, of the size; 0: there is no size
  double probability = 0.0;  ///< that it is so
  bool is_open = false;      ///< whether the pose suffers from it now
  std::string words;         ///< for people, if there are better ones than sentence_of() knows
};

/// Whether `id` is a landmark's.
bool is_of_landmark(const Finding& finding);

/// "landmark 60 is 2.0 m from the map". `start`: s, from which times are counted.
std::string sentence_of(const Finding& finding, double start);

}  // namespace pf_resampling
