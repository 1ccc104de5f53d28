#pragma once

#include <array>
#include <tuple>
#include <variant>

namespace pf_resampling {

/// A message that a pipeline takes, and its topics: one or two.
template <typename MessageType>
struct Input {
  using Message = MessageType;
  std::array<const char*, 2> topics;
};

/// Calls `take(input, topic)` with every input of a pipeline and each of its topics.
template <typename Pipeline, typename Take>
void for_each_input(const Take& take) {
  const auto each = [&](const auto& input) {
    for (const char* topic : input.topics) {
      if (topic != nullptr) take(input, topic);
    }
  };
  std::apply([&](const auto&... input) { (each(input), ...); }, Pipeline::inputs());
}

/// Any of the messages that a pipeline takes, in memory.
template <typename... Messages>
std::variant<typename Messages::ConstPtr...> variant_of(
    const std::tuple<Input<Messages>...>& inputs);
template <typename Pipeline>
using AnyMessage = decltype(variant_of(Pipeline::inputs()));

/// Hands one to the pipeline.
template <typename Pipeline, typename... Pointers>
void handle(const std::variant<Pointers...>& message, Pipeline* pipeline) {
  std::visit([pipeline](const auto& pointer) { pipeline->handle(*pointer); }, message);
}

}  // namespace pf_resampling
