#pragma once

namespace pf_resampling {

/// m. A robot is lost when it is further off than radio noise explains (0.2 m) plus 3 % of the
/// extent of its scene, the diagonal of the area (m): 3.1 m on Plaza 2 (96 m), 0.29 m in the
/// labyrinth (3 m). A wrong mode of a range-only belief is off by a good part of the area, so the
/// verdict hardly depends on the figure.
inline double lost_error(double extent) {
  constexpr double kRadioNoise = 0.2;  // m
  constexpr double kShareOfExtent = 0.03;
  return kRadioNoise + kShareOfExtent * extent;
}

}  // namespace pf_resampling
