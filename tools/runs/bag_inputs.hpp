#pragma once

#include <rosbag/message_instance.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "src/node/any_message.hpp"
#include "src/pipeline/inputs.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// A message of a bag, of any type; see LiveMessage.
struct BagMessage {
  const rosbag::MessageInstance& message;

  const std::string& type() const { return message.getDataType(); }
  template <typename Message>
  typename Message::ConstPtr as() const {
    return message_in<Message>(message);
  }
  topic_tools::ShapeShifter described() const {
    return *message.instantiate<topic_tools::ShapeShifter>();
  }
  const ros::Time& arrival() const { return message.getTime(); }
};

/// The topic of a bag that an input of a pipeline is on: the option of its name tells, if there is
/// one.
inline std::string topic_of(std::string input, const CommandLine& line) {
  std::string option = input;
  std::replace(option.begin(), option.end(), '_', '-');
  if (line.has(option)) return line.topic(option);
  return input.front() == '/' ? input : "/" + input;
}

/// A message of a pipeline in memory; of a variant, what it holds.
template <typename Pipeline, typename Message>
AnyMessage<Pipeline> in_memory(const Message& message) {
  return typename Message::ConstPtr(boost::make_shared<Message>(message));
}
template <typename Pipeline, typename... Messages>
AnyMessage<Pipeline> in_memory(const std::variant<Messages...>& any) {
  return std::visit([](const auto& message) { return in_memory<Pipeline>(message); }, any);
}

/// A message on the topic of an input; nothing if it cannot be read, which the pipeline counts as
/// its node does. `base`: frame of the robot.
template <typename Pipeline, typename Message>
std::optional<AnyMessage<Pipeline>> read_input(const Input<Message>& input, const char* topic,
                                               const rosbag::MessageInstance& message,
                                               const std::string& base, Pipeline* pipeline) {
  if constexpr (kTakesOtherTypes<Message>) {
    try {
      return in_memory<Pipeline>(read_any(input, BagMessage{message}, base, *pipeline));
    } catch (const Error& error) {
      pipeline->note_unreadable(name_of_topic(topic), error.what());
      return std::nullopt;
    }
  } else {
    const typename Message::ConstPtr taken = message_in<Message>(message);
    if (!taken) return std::nullopt;
    return AnyMessage<Pipeline>(taken);
  }
}

/// A topic that a pipeline takes from a bag, and how its messages are read.
template <typename Pipeline>
struct BagInput {
  std::string topic;
  std::function<std::optional<AnyMessage<Pipeline>>(const rosbag::MessageInstance&)> read;
};

/// What a pipeline takes, in the order in which it takes messages of the same time.
template <typename Pipeline>
std::vector<BagInput<Pipeline>> bag_inputs(const CommandLine& line, const std::string& base,
                                           Pipeline* pipeline) {
  std::vector<BagInput<Pipeline>> inputs;
  for_each_input<Pipeline>([&](const auto& input, const char* topic) {
    inputs.push_back({topic_of(topic, line), [=](const rosbag::MessageInstance& message) {
                        return read_input(input, topic, message, base, pipeline);
                      }});
  });
  return inputs;
}

template <typename Pipeline>
std::vector<std::string> names_of(const std::vector<BagInput<Pipeline>>& inputs) {
  std::vector<std::string> names;
  for (const BagInput<Pipeline>& input : inputs) names.push_back(input.topic);
  return names;
}

/// Hands a message to the pipeline, if it takes one of its topic and type.
template <typename Pipeline>
void hand_over(const rosbag::MessageInstance& message,
               const std::vector<BagInput<Pipeline>>& inputs, Pipeline* pipeline) {
  for (const BagInput<Pipeline>& input : inputs) {
    if (input.topic != message.getTopic()) continue;
    if (const auto taken = input.read(message)) handle(*taken, pipeline);
    return;
  }
}

/// Throws Error that says why, if a pipeline has used no observation of a bag.
template <typename Pipeline>
void require_used(const rosbag::Bag& bag, const Pipeline& pipeline) {
  if (pipeline.used() > 0) return;
  throw Error(bag.getFileName() + ": none of its " + Pipeline::kObservations +
              " were used: " + pipeline.why_none_used() + "; it has " + topics_in_words(bag) +
              "; check_bag says what is missing");
}

}  // namespace pf_resampling
