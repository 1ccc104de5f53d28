#pragma once

#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/statistics.hpp"

namespace pf_resampling {

/// "mean ± standard error"; a dash without values, no error of a single one.
std::string with_error(const MeanEstimate& estimate, int decimals);

/// A row of a Markdown table.
std::string markdown_row(const std::vector<std::string>& cells);

/// Its headings, with the rule below: the first column to the left, numbers to the right.
std::string markdown_heading(const std::vector<std::string>& cells);

}  // namespace pf_resampling
