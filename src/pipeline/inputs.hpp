#pragma once

#include <array>
#include <tuple>
#include <type_traits>
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

/// What a live run did between its messages, of FlightRecorder: it used an observation
/// (std_msgs/Empty); before the next message it has taken over so many (std_msgs/UInt64).
inline constexpr const char* kStepTopic = "/flight/step";
inline constexpr const char* kTakeOverTopic = "/flight/take_overs";

/// Any of the messages that a pipeline takes, in memory.
template <typename... Messages>
std::variant<typename Messages::ConstPtr...> variant_of(
    const std::tuple<Input<Messages>...>& inputs);
template <typename Pipeline>
using AnyMessage = decltype(variant_of(Pipeline::inputs()));

/// As it is counted: "/tf" as "tf".
inline const char* name_of_topic(const char* topic) {
  return topic + (*topic == '/' ? 1 : 0);
}

/// The first topic that a message comes on, without its slash.
template <typename Message, typename Pipeline>
const char* name_of_input() {
  const char* name = "";
  for_each_input<Pipeline>([&](const auto& input, const char* topic) {
    using Taken = typename std::decay_t<decltype(input)>::Message;
    if (std::is_same_v<Taken, Message> && *name == '\0') name = name_of_topic(topic);
  });
  return name;
}

/// Hands a message to the pipeline. No exception gets out; see FilterPipeline::guard().
template <typename Message, typename Pipeline>
void dispatch(const Message& message, Pipeline* pipeline) {
  static const char* const input = name_of_input<Message, Pipeline>();
  pipeline->guard(input, [&] { pipeline->handle(message); });
}

/// Likewise one in memory.
template <typename Pipeline, typename... Pointers>
void handle(const std::variant<Pointers...>& message, Pipeline* pipeline) {
  std::visit([pipeline](const auto& pointer) { dispatch(*pointer, pipeline); }, message);
}

}  // namespace pf_resampling
