#pragma once

#include <map>
#include <string>
#include <vector>

#include "pf_resampling_core/filters/fastslam/presets.hpp"

namespace pf_resampling {

/// A filter to be compared: the study's settings with some changed.
struct CompensationVariant {
  std::string name;   ///< unique; tables and --variants know it by this
  std::string group;  ///< the table it stands in
  std::map<std::string, std::string> settings;
};

/// All filters of the study, table by table: resampling schemes, compensations by pairing and
/// ratio, by covariance and weights, excitation, thresholds, particle counts, FastSLAM 1.0.
const std::vector<CompensationVariant>& all_compensation_variants();

/// Those with these names, in the order of the tables. Throws Error on a name there is not.
std::vector<CompensationVariant> compensation_variants(const std::vector<std::string>& names);

/// The study's settings with those of the variant. Throws Error.
FastSlamOptions options_of(const CompensationVariant& variant, const FastSlamOptions& base);

/// The preset of that name.
FastSlamOptions kwak2008_options();

}  // namespace pf_resampling
