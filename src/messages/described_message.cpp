#include "src/messages/described_message.hpp"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <type_traits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr int kDeepestMessage = 20;  // types in types

struct Field {
  std::string type;  // without brackets
  std::string name;
  bool is_array = false;
  std::int64_t length = -1;  // of an array; -1: it is in the message
};
using Definitions = std::map<std::string, std::vector<Field>>;

bool is_builtin(const std::string& type) {
  static const char* const kBuiltin[] = {
      "bool",   "byte",  "char",   "int8",    "uint8",   "int16",  "uint16", "int32",
      "uint32", "int64", "uint64", "float32", "float64", "string", "time",   "duration"};
  for (const char* name : kBuiltin) {
    if (type == name) return true;
  }
  return false;
}

// A type as it is named inside a message of `package`.
std::string full_name(const std::string& type, const std::string& package) {
  if (is_builtin(type) || type.find('/') != std::string::npos) return type;
  return type == "Header" ? "std_msgs/Header" : package + "/" + type;
}

// A line "type name"; constants, comments and empty lines are none.
bool read_field(const std::string& line, const std::string& package, Field* field) {
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
    Field field;
    const std::string package = current.substr(0, current.find('/'));
    if (read_field(line, package, &field)) definitions[current].push_back(field);
  }
  return definitions;
}

}  // namespace

class DescribedMessageReader {
 public:
  DescribedMessageReader(const Definitions& definitions, const std::uint8_t* data, std::size_t size)
      : definitions_(definitions), data_(data), left_(size) {}

  DescribedMessage read_all(const std::string& type) {
    DescribedMessage message = read(type, 0);
    if (left_ > 0) throw Error("the message is longer than its definition says");
    return message;
  }

 private:
  const std::uint8_t* take(std::size_t size) {
    if (size > left_) throw Error("the message is shorter than its definition says");
    const std::uint8_t* const taken = data_;
    data_ += size;
    left_ -= size;
    return taken;
  }

  template <typename Number>
  Number take_number() {
    Number number;
    std::memcpy(&number, take(sizeof(Number)), sizeof(Number));
    return number;
  }

  template <typename Number>
  void take_into(DescribedMessage* message) {
    message->is_number_ = true;
    message->number_ = static_cast<double>(take_number<Number>());
  }

  template <typename Number>
  void take_time(DescribedMessage* message) {
    const auto seconds = take_number<Number>();
    const auto nanoseconds = take_number<Number>();
    message->is_number_ = true;
    message->number_ = static_cast<double>(seconds) + 1e-9 * static_cast<double>(nanoseconds);
    message->seconds_ = static_cast<std::uint32_t>(seconds);
    message->nanoseconds_ = static_cast<std::uint32_t>(nanoseconds);
  }

  DescribedMessage read(const std::string& type, int depth) {
    if (depth > kDeepestMessage) throw Error("the message has types in types without end");
    DescribedMessage message;
    if (type == "bool" || type == "uint8" || type == "char") {
      take_into<std::uint8_t>(&message);
    } else if (type == "int8" || type == "byte") {
      take_into<std::int8_t>(&message);
    } else if (type == "int16") {
      take_into<std::int16_t>(&message);
    } else if (type == "uint16") {
      take_into<std::uint16_t>(&message);
    } else if (type == "int32") {
      take_into<std::int32_t>(&message);
    } else if (type == "uint32") {
      take_into<std::uint32_t>(&message);
    } else if (type == "int64") {
      take_into<std::int64_t>(&message);
    } else if (type == "uint64") {
      take_into<std::uint64_t>(&message);
    } else if (type == "float32") {
      take_into<float>(&message);
    } else if (type == "float64") {
      take_into<double>(&message);
    } else if (type == "time") {
      take_time<std::uint32_t>(&message);
    } else if (type == "duration") {
      take_time<std::int32_t>(&message);
    } else if (type == "string") {
      const auto size = take_number<std::uint32_t>();
      const std::uint8_t* const letters = take(size);
      message.text_.assign(letters, letters + size);
    } else {
      read_fields(type, depth, &message);
    }
    return message;
  }

  void read_fields(const std::string& type, int depth, DescribedMessage* message) {
    const auto definition = definitions_.find(type);
    if (definition == definitions_.end()) {
      throw Error("the definition of the message does not define " + type);
    }
    for (const Field& field : definition->second) {
      DescribedMessage& value = message->fields_[field.name];
      if (!field.is_array) {
        value = read(field.type, depth + 1);
        continue;
      }
      const std::uint64_t length = field.length >= 0 ? static_cast<std::uint64_t>(field.length)
                                                     : take_number<std::uint32_t>();
      for (std::uint64_t i = 0; i < length; ++i) {
        value.elements_.push_back(read(field.type, depth + 1));
      }
    }
  }

  const Definitions& definitions_;
  const std::uint8_t* data_;
  std::size_t left_;
};

DescribedMessage DescribedMessage::read(const std::string& type, const std::string& definition,
                                        const std::uint8_t* data, std::size_t size) {
  // Messages of one kind come one after the other, and a definition may be longer than they are.
  thread_local std::string known_type;
  thread_local std::string known_text;
  thread_local Definitions definitions;
  if (type != known_type || definition != known_text) {
    definitions = definitions_in(type, definition);
    known_type = type;
    known_text = definition;
  }
  return DescribedMessageReader(definitions, data, size).read_all(type);
}

const DescribedMessage& DescribedMessage::operator[](const std::string& name) const {
  const std::size_t dot = name.find('.');
  const auto field = fields_.find(name.substr(0, dot));
  if (field == fields_.end()) throw Error("the message has no field '" + name + "'");
  return dot == std::string::npos ? field->second : field->second[name.substr(dot + 1)];
}

double DescribedMessage::number() const {
  if (!is_number_) throw Error("a field of the message is no number");
  return number_;
}

}  // namespace pf_resampling
