#include "pf_resampling_core/health/finding.hpp"

#include <cmath>
#include <cstdio>

namespace pf_resampling {
namespace {

const EnumNames<FindingKind> kFindingNames{
    "finding",
    {{FindingKind::wheels_slipped, "wheels_slipped"},
     {FindingKind::odometry_counts_wrong, "odometry_counts_wrong"},
     {FindingKind::odometry_turns_wrong, "odometry_turns_wrong"},
     {FindingKind::landmark_moved, "landmark_moved"},
     {FindingKind::landmark_twice, "landmark_twice"},
     {FindingKind::landmark_gone, "landmark_gone"},
     {FindingKind::beacon_biased, "beacon_biased"},
     {FindingKind::beacon_moved, "beacon_moved"},
     {FindingKind::beacon_swapped, "beacon_swapped"},
     {FindingKind::beacon_repeats, "beacon_repeats"}}};

std::string metres(double length) {
  char text[40];
  std::snprintf(text, sizeof(text), length < 0.95 ? "%.2f m" : "%.1f m", length);
  return text;
}

std::string times(double factor) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.2f times", factor);
  return text;
}

}  // namespace

const EnumNames<FindingKind>& names_of(FindingKind) {
  return kFindingNames;
}

bool is_of_landmark(const Finding& finding) {
  return finding.kind == FindingKind::landmark_moved ||
         finding.kind == FindingKind::landmark_twice || finding.kind == FindingKind::landmark_gone;
}

std::string sentence_of(const Finding& finding, double start) {
  if (!finding.words.empty()) return finding.words;
  const std::string landmark = "landmark " + std::to_string(finding.id);
  const std::string beacon = "beacon " + std::to_string(finding.id);
  switch (finding.kind) {
    case FindingKind::wheels_slipped:
      return "the wheels slipped at " + std::to_string(std::lround(finding.begin - start)) +
             " s, or the robot was carried";
    case FindingKind::odometry_counts_wrong:
      return "the odometry counts " + times(finding.size) +
             " the distance that is driven: wheel radius, gear, unit?";
    case FindingKind::odometry_turns_wrong:
      return finding.size < 0.0
                 ? "the odometry turns the wrong way, " + times(-finding.size) +
                       " as far as the robot: sign of the gyro, left and right wheel swapped?"
                 : "the odometry turns " + times(finding.size) +
                       " as far as the robot: distance of the wheels, scale of the gyro?";
    case FindingKind::landmark_moved:
      return landmark + " is " + metres(finding.size) + " from the map";
    case FindingKind::landmark_twice:
      return landmark + " is at two places, " + metres(finding.size) +
             " apart: two of one id, or moved?";
    case FindingKind::landmark_gone:
      return landmark + " is gone";
    case FindingKind::beacon_biased:
      return beacon + " measures wrong by " + metres(finding.size);
    case FindingKind::beacon_moved:
    case FindingKind::beacon_swapped:
      return beacon + " is " + metres(finding.size) + " from where the list has it";
    case FindingKind::beacon_repeats:
      return beacon + " repeats the ranges of another";
  }
  return "";
}

}  // namespace pf_resampling
