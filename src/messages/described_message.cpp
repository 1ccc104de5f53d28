#include "src/messages/described_message.hpp"

#include <ros/serialization.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr int kDeepestMessage = 20;  // types in types

using ros::serialization::IStream;

template <typename Value>
json read_value(IStream* stream) {
  Value value;
  stream->next(value);
  return value;
}

template <typename Number>
json read_time(IStream* stream) {
  const json seconds = read_value<Number>(stream);
  return {{"secs", seconds}, {"nsecs", read_value<Number>(stream)}};
}

const std::map<std::string, json (*)(IStream*)>& builtin_types() {
  static const std::map<std::string, json (*)(IStream*)> types = {
      {"bool", read_value<std::uint8_t>},    {"byte", read_value<std::int8_t>},
      {"char", read_value<std::uint8_t>},    {"int8", read_value<std::int8_t>},
      {"uint8", read_value<std::uint8_t>},   {"int16", read_value<std::int16_t>},
      {"uint16", read_value<std::uint16_t>}, {"int32", read_value<std::int32_t>},
      {"uint32", read_value<std::uint32_t>}, {"int64", read_value<std::int64_t>},
      {"uint64", read_value<std::uint64_t>}, {"float32", read_value<float>},
      {"float64", read_value<double>},       {"string", read_value<std::string>},
      {"time", read_time<std::uint32_t>},    {"duration", read_time<std::int32_t>}};
  return types;
}

struct MessageField {
  std::string type;  // without brackets
  std::string name;
  bool is_array = false;
  std::int64_t length = -1;  // of an array; -1: it is in the message
};
using Definitions = std::map<std::string, std::vector<MessageField>>;

// A type as it is named inside a message of `package`.
std::string full_name(const std::string& type, const std::string& package) {
  if (builtin_types().count(type) > 0 || type.find('/') != std::string::npos) return type;
  return type == "Header" ? "std_msgs/Header" : package + "/" + type;
}

// A line "type name"; constants, comments and empty lines are none.
bool read_field(const std::string& line, const std::string& package, MessageField* field) {
  const std::string code = line.substr(0, line.find('#'));
  std::istringstream words(code);
  std::string type;
  if (!(words >> type >> field->name) || code.find('=') != std::string::npos) return false;
  const std::size_t bracket = type.find('[');
  field->is_array = bracket != std::string::npos;
  field->length = -1;
  if (field->is_array && type[bracket + 1] != ']') {
    std::istringstream length(type.substr(bracket + 1));
    if (!(length >> field->length) || field->length < 0) {
      throw Error("the definition of the message has the line \"" + line + "\"");
    }
  }
  field->type = full_name(type.substr(0, bracket), package);
  return true;
}

Definitions definitions_in(const std::string& type, const std::string& text) {
  Definitions definitions;
  std::string current = type;
  definitions[current];
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("MSG: ", 0) == 0) {
      std::istringstream(line.substr(5)) >> current;
      definitions[current];
      continue;
    }
    MessageField field;
    const std::string package = current.substr(0, current.find('/'));
    if (read_field(line, package, &field)) definitions[current].push_back(field);
  }
  return definitions;
}

json read_message(const Definitions& definitions, const std::string& type, int depth,
                  IStream* stream) {
  if (depth > kDeepestMessage) throw Error("the message has types in types without end");
  const auto builtin = builtin_types().find(type);
  if (builtin != builtin_types().end()) return builtin->second(stream);
  const auto definition = definitions.find(type);
  if (definition == definitions.end()) {
    throw Error("the definition of the message does not define " + type);
  }
  json message = json::object();
  for (const MessageField& field : definition->second) {
    json& value = message[field.name];
    if (!field.is_array) {
      value = read_message(definitions, field.type, depth + 1, stream);
      continue;
    }
    value = json::array();
    const std::int64_t length =
        field.length >= 0 ? field.length : read_value<std::uint32_t>(stream).get<std::int64_t>();
    for (std::int64_t i = 0; i < length; ++i) {
      value.push_back(read_message(definitions, field.type, depth + 1, stream));
    }
  }
  return message;
}

}  // namespace

json read_described(const std::string& type, const std::string& definition,
                    const std::uint8_t* data, std::size_t size) {
  // Messages of one kind come one after the other, and a definition may be longer than they are.
  thread_local std::pair<std::string, std::string> known;
  thread_local Definitions definitions;
  if (known != std::make_pair(type, definition)) {
    definitions = definitions_in(type, definition);
    known = {type, definition};
  }
  IStream stream(const_cast<std::uint8_t*>(data), static_cast<std::uint32_t>(size));
  try {
    json message = read_message(definitions, type, 0, &stream);
    if (stream.getLength() > 0) throw Error("the message is longer than its definition says");
    return message;
  } catch (const ros::serialization::StreamOverrunException&) {
    throw Error("the message is shorter than its definition says");
  }
}

}  // namespace pf_resampling
