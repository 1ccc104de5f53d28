#pragma once

#include <tuple>

namespace pf_resampling {

/// A message that a pipeline takes, and its topic.
template <typename MessageType>
struct Input {
  using Message = MessageType;
  const char* topic;
};

/// Calls `take` with every input of a pipeline.
template <typename Pipeline, typename Take>
void for_each_input(const Take& take) {
  std::apply([&](const auto&... input) { (take(input), ...); }, Pipeline::inputs());
}

}  // namespace pf_resampling
