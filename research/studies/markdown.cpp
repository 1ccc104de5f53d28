#include "research/studies/markdown.hpp"

#include "tools/common/table.hpp"

namespace pf_resampling {

std::string with_error(const MeanEstimate& estimate, int decimals) {
  if (estimate.count == 0) return "–";
  if (estimate.count == 1) return fixed(estimate.mean, decimals);
  return fixed(estimate.mean, decimals) + " ± " + fixed(estimate.standard_error, decimals);
}

std::string markdown_row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line + "\n";
}

std::string markdown_heading(const std::vector<std::string>& cells) {
  std::string rule = "|---|";
  for (std::size_t i = 1; i < cells.size(); ++i) rule += "---:|";
  return markdown_row(cells) + rule + "\n";
}

}  // namespace pf_resampling
