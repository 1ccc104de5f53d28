#include "pf_resampling_core/health/finding.hpp"

#include <cmath>
#include <cstdio>

namespace pf_resampling {
namespace {

const EnumNames<FindingKind> kFindingNames{"finding",
                                           {{FindingKind::wheels_slipped, "wheels_slipped"},
                                            {FindingKind::landmark_moved, "landmark_moved"},
                                            {FindingKind::landmark_twice, "landmark_twice"},
                                            {FindingKind::landmark_gone, "landmark_gone"},
                                            {FindingKind::beacon_biased, "beacon_biased"},
                                            {FindingKind::beacon_moved, "beacon_moved"},
                                            {FindingKind::beacon_swapped, "beacon_swapped"}}};

std::string metres(double length) {
  char text[40];
  std::snprintf(text, sizeof(text), length < 0.95 ? "%.2f m" : "%.1f m", length);
  return text;
}

}  // namespace

const EnumNames<FindingKind>& names_of(FindingKind) {
  return kFindingNames;
}

std::string sentence_of(const Finding& finding, double start) {
  if (!finding.words.empty()) return finding.words;
  const std::string landmark = "landmark " + std::to_string(finding.id);
  const std::string beacon = "beacon " + std::to_string(finding.id);
  switch (finding.kind) {
    case FindingKind::wheels_slipped:
      return "the wheels slipped at " + std::to_string(std::lround(finding.begin - start)) +
             " s, or the robot was carried";
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
  }
  return "";
}

}  // namespace pf_resampling
