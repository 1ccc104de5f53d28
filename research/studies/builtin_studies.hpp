#pragma once

#include <map>
#include <string>

namespace pf_resampling {

/// Name and text of the studies that come with the package (research/studies/*.yaml), compiled in
/// so that the program needs no path to them.
const std::map<std::string, std::string>& builtin_study_texts();

}  // namespace pf_resampling
