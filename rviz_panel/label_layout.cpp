#include "rviz_panel/label_layout.hpp"

#include <algorithm>

namespace pf_resampling {
namespace {

bool overlap(const LabelPlace& a, const LabelPlace& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

}  // namespace

std::vector<bool> readable_labels(const std::vector<LabelPlace>& places) {
  std::vector<bool> readable;
  std::vector<LabelPlace> shown;
  for (const LabelPlace& place : places) {
    const bool is_free = std::none_of(
        shown.begin(), shown.end(), [&](const LabelPlace& other) { return overlap(place, other); });
    if (is_free) shown.push_back(place);
    readable.push_back(is_free);
  }
  return readable;
}

}  // namespace pf_resampling
