#pragma once

#include <pf_resampling/FindingStatus.h>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"
#include "tools/common/bag_contents.hpp"

namespace pf_resampling {

/// The newest poses of least squares at every observation, each with the data until then, judged
/// like the poses that the filter gave out.
struct OnlineBound {
  PathErrors errors;
  AlignedPathErrors aligned;
  int solutions = 0;
  int refused = 0;  ///< of these: there was none, and the odometry went on
  /// The filter's mean Cartesian error over this one: as given, and both aligned.
  std::optional<double> ratio;
  std::optional<double> aligned_ratio;
};

/// What the solution found of radios and gyro where it was one of ranges.
struct RadioComparison {
  std::vector<RadioKnowledge> radios;  ///< that were heard
  RangeNoise noise;
  double yaw_rate_bias = 0.0;        ///< rad/s, measured less true
  std::vector<std::string> remarks;  ///< on those that are not as listed
};

/// The least-squares solution of the same data, judged in the same way, beside the filter.
struct BatchComparison {
  PathErrors errors;
  AlignedPathErrors aligned;
  /// At the stamps of the filter's path, and aligned there.
  std::optional<AlignedPathErrors> path_aligned;
  std::optional<MapErrors> map;
  /// The filter's error over the solution's, both aligned: mean Cartesian of the whole path as it
  /// was believed at the end, which like the solution knows all data; of the poses as they were
  /// given out, which knew the past only; RMS of the map.
  std::optional<double> path_ratio;
  std::optional<double> online_ratio;
  std::optional<OnlineBound> online;
  std::optional<double> map_ratio;
  double distance_scale = 1.0;  ///< of the odometry, measured over true
  double yaw_scale = 1.0;
  std::optional<RadioComparison> radios;
  int observations = 0;
  int outliers = 0;
  bool has_ids_of_filter = false;  ///< no observation had one of its own
};

/// What a filter said of its health, beside the truth: of the (unclipped) true poses that have an
/// estimate, each with what was said last before.
struct HealthShares {
  std::map<std::string, double> shares;  ///< of the poses, by the names of Health; they sum to 1
  /// Of the poses at which it said healthy: with the truth outside its 3-sigma ellipse of (x, y).
  /// Nothing if there are none, or the estimate states no covariance.
  std::optional<double> wrong_when_healthy;
  double several_places = 0.0;  ///< share of the poses at which it said that several places fit
};
/// Nothing if nothing was said.
std::optional<HealthShares> health_shares(const std::vector<StampedHealth>& said,
                                          const PathErrors& errors);

/// What evaluate_bag found.
struct Evaluation {
  double clip = 0.0;
  std::string frame = "given";  ///< how the estimate's was laid on the truth's: given, start, fit
  bool is_slam = false;         ///< there is an estimated map
  PathErrors estimate;
  AlignedPathErrors estimate_aligned;
  /// The whole path as it was believed at the end, if a mapper gave one: at its own stamps.
  std::optional<AlignedPathErrors> path_aligned;
  std::optional<PathErrors> dead_reckoning;
  std::optional<AlignedPathErrors> dead_reckoning_aligned;
  std::optional<MapErrors> map;
  std::optional<FilterSummary> filter;
  std::optional<HealthShares> health;
  std::optional<BatchComparison> batch;
};

/// As in FilterStatus; times in s.
nlohmann::json to_json(const std::vector<FindingStatus>& findings);

/// All figures; doc of the keys: the structs they come from.
nlohmann::json to_json(const Evaluation& evaluation);

/// The same as tables on stdout; `bag` names it.
void print(const std::string& bag, const Evaluation& evaluation);

}  // namespace pf_resampling
