#pragma once

#include <vector>

namespace pf_resampling {

/// Where a label would be on the screen: its lower left corner and its size, in pixels.
struct LabelPlace {
  double x = 0.0, y = 0.0;
  double width = 0.0, height = 0.0;
};

/// Which of the labels can be read: from the first to the last, those that overlap none that is
/// shown before them.
std::vector<bool> readable_labels(const std::vector<LabelPlace>& places);

}  // namespace pf_resampling
