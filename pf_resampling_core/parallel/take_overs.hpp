#pragma once

#include <cstdint>
#include <optional>

namespace pf_resampling {

/// When a filter takes over what a thread beside it has computed: as soon as it is there. When a
/// live run is replayed, `wanted` says how many were taken over by now: then it waits.
struct TakeOvers {
  std::int64_t done = 0;
  std::optional<std::int64_t> wanted;

  /// Whether to take over now; `is_there()`: whether that needs no waiting.
  template <typename IsThere>
  bool is_due(const IsThere& is_there) {
    if (wanted ? done >= *wanted : !is_there()) return false;
    ++done;
    return true;
  }
};

}  // namespace pf_resampling
