#include "pf_resampling_core/files/archive.hpp"

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"
#include "pf_resampling_core/files/text_file.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "format";
constexpr const char* kChecksum = "checksum";

std::string words_of(const FileKind& kind) {
  const std::string format = kind.format;
  return format.substr(0, format.rfind(' ') + 1);
}

// Of the file of a kind that is not text.
std::string first_line(const FileKind& kind, const std::string& content) {
  return std::string(kind.format) + ' ' + checksum_of(content) + '\n';
}

std::string content_of(const FileKind& kind, const std::string& path) {
  std::ifstream stream;
  text_file::open(kind.name, path, &stream);
  std::ostringstream bytes;
  try {  // what the disk does not give, the standard library answers with an exception of its own
    if (stream.peek() != std::char_traits<char>::eof()) bytes << stream.rdbuf();
  } catch (const std::ios_base::failure&) {
    stream.setstate(std::ios::badbit);
  }
  if (stream.bad() || bytes.bad()) {
    throw Error(std::string(kind.name) + " " + path +
                " cannot be read to its end; give one that can be read");
  }
  return bytes.str();
}

json parsed_text(const std::string& text, std::string* fault) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    // Where it is, but not what: a service answers with this, and it may be anybody's file.
    const std::string what = error.what();
    const std::size_t line = what.find("line ");
    *fault = what.substr(line, what.find(':', line) - line) + ": this is not JSON";
  } catch (const json::exception&) {
    *fault = "it has a number that is too large";
  }
  return {};
}

json parsed_binary(const FileKind& kind, const std::string& bytes, std::string* fault) {
  const std::string content = bytes.substr(std::min(bytes.find('\n') + 1, bytes.size()));
  if (bytes.compare(0, bytes.size() - content.size(), first_line(kind, content)) != 0) {
    *fault = "its checksum does not fit";
    return {};
  }
  try {
    return json::from_cbor(content);
  } catch (const json::exception&) {
    *fault = "this is not CBOR";
  }
  return {};
}

std::size_t leaves_of(const json& tree) {
  if (!tree.is_structured()) return 1;
  std::size_t leaves = 0;
  for (const json& branch : tree) leaves += leaves_of(branch);
  return leaves;
}

// A line for what is short or a list of single values, else one for each element.
void print(const json& tree, const std::string& indent, std::string* text) {
  constexpr std::size_t kShort = 20;
  const bool is_flat = tree.is_array() && std::none_of(tree.begin(), tree.end(), [](const json& j) {
                         return j.is_structured();
                       });
  if (is_flat || leaves_of(tree) <= kShort) {
    *text += tree.dump();
    return;
  }
  *text += tree.is_array() ? "[" : "{";
  const char* separator = "\n";
  const std::string deeper = indent + ' ';
  for (auto branch = tree.begin(); branch != tree.end(); ++branch) {
    *text += separator + deeper;
    if (tree.is_object()) *text += json(branch.key()).dump() + ": ";
    print(*branch, deeper, text);
    separator = ",\n";
  }
  *text += '\n' + indent + (tree.is_array() ? "]" : "}");
}

}  // namespace

bool FileKind::may_begin_with(const std::string& bytes) const {
  return bytes.substr(0, 100).find(words_of(*this)) != std::string::npos;
}

struct Archive::Tree {
  json root;
  json* here = &root;
};

struct Archive::Step {
  const char* name;  // null: an element
  std::size_t element;
  json* above;
};

Archive::Archive(const FileKind& kind)
    : kind_(kind), is_reading_(false), tree_(std::make_unique<Tree>()) {}

Archive::Archive(const FileKind& kind, const std::string& path)
    : kind_(kind), path_(path), is_reading_(true), tree_(std::make_unique<Tree>()) {
  const std::string bytes = content_of(kind, path);
  const std::string what = std::string(kind.name) + " " + path;
  std::string format = bytes.substr(0, std::min(bytes.find('\n'), std::strlen(kind.format)));
  std::string fault;
  const auto begin = std::find_if_not(bytes.begin(), bytes.end(), [](char letter) {
    return std::isspace(static_cast<unsigned char>(letter));
  });
  if (kind.is_text && begin != bytes.end() && *begin == '{') {
    tree_->root = parsed_text(bytes, &fault);
    if (!fault.empty()) refuse(fault);
    const json none;
    const json& found = tree_->root.value(kFormat, none);
    format = found.is_string() ? found.get<std::string>() : "";
  }
  if (format.rfind(words_of(kind), 0) != 0) {
    // What is in it is nobody's business.
    throw Error(what + " is not how a " + kind.content + " begins; " + kind.if_other);
  }
  if (format != kind.format) {
    throw Error(what + " is of the format " + text_file::printable(format) +
                "; this program reads \"" + kind.format + "\": " + kind.if_other);
  }
  if (!kind.is_text) tree_->root = parsed_binary(kind, bytes, &fault);
  if (!fault.empty()) refuse(fault);
}

Archive::~Archive() = default;

void Archive::refuse(const std::string& fault) const {
  std::string place;
  for (const Step& step : steps_) {
    if (step.name == nullptr) {
      place += '[' + std::to_string(step.element) + ']';
    } else {
      place += (place.empty() ? "" : ".") + std::string(step.name);
    }
  }
  const std::string where = place.empty() ? fault : place + ": " + fault;
  if (is_reading_) {
    throw Error(std::string(kind_.name) + " " + path_ + ": " + where + "; " + kind_.if_damaged);
  }
  throw Error(std::string(kind_.content) + " to write: " + where + "; reset the filter");
}

std::string Archive::next_name(const char** written) {
  const char* const end = *written + std::strcspn(*written, ",");
  std::string name(*written, end);
  name.erase(0, name.find_last_of(".> ") + 1);
  if (name.back() == '_') name.pop_back();
  *written = end + (*end == ',' ? 1 : 0);
  return name;
}

void Archive::enter(const char* name, std::size_t element) {
  json& above = *tree_->here;
  if (name == nullptr) {
    tree_->here = &above[element];
  } else if (is_reading_) {
    if (!above.is_object()) refuse("named values expected");
    const auto found = above.find(name);
    if (found == above.end()) refuse("\"" + std::string(name) + "\" is missing");
    tree_->here = &*found;
  } else {
    tree_->here = &above[name];
  }
  steps_.push_back({name, element, &above});
}

bool Archive::has(const char* name) const {
  return tree_->here->is_object() && tree_->here->contains(name);
}

void Archive::leave() {
  tree_->here = steps_.back().above;
  steps_.pop_back();
}

// Of text alone: what is binary has a checksum of all.
void Archive::seal(const char* name) {
  json& above = *tree_->here;
  if (kind_.is_text && !above[name].is_null()) above[kChecksum] = checksum_of(above[name].dump());
}

void Archive::check_seal(const char* name) {
  const json& above = *tree_->here;
  if (!kind_.is_text || !above.is_object() || !above.contains(name) || above[name].is_null())
    return;
  if (above.value(kChecksum, json()) == json(checksum_of(above[name].dump()))) return;
  enter(name, 0);
  refuse("its checksum does not fit: it was damaged or edited; null in its place leaves the rest");
}

void Archive::constant(const char* name, const std::string& value) {
  std::string found = value;
  enter(name, 0);
  text(&found);
  if (found != value) {
    refuse('"' + value + "\" expected, " + text_file::printable(found) + " found");
  }
  leave();
}

std::size_t Archive::list(std::size_t size) {
  json& here = *tree_->here;
  if (!is_reading_) here = json::array_t(size);
  if (!here.is_array()) refuse("a list expected");
  return here.size();
}

void Archive::list_of(std::size_t size) {
  const std::size_t found = list(size);
  if (found != size) {
    refuse(std::to_string(size) + " values expected, " + std::to_string(found) + " found");
  }
}

std::size_t Archive::size_of_first() const {
  const json& here = *tree_->here;
  return here.empty() || !here[0].is_array() ? 0 : here[0].size();
}

void Archive::number(double* value) {
  json& here = *tree_->here;
  if (is_reading_) {
    if (!here.is_number()) refuse("a number expected");
    *value = here.get<double>();
  } else {
    here = *value;
  }
  if (!std::isfinite(*value)) refuse("it is not finite");
}

std::int64_t Archive::integer(std::int64_t value, std::int64_t least, std::int64_t most) {
  json& here = *tree_->here;
  if (!is_reading_) here = value;
  const bool is_too_large = here.is_number_unsigned() && here.get<std::uint64_t>() >> 63 != 0;
  const bool is_whole = here.is_number_integer() && !is_too_large;
  value = is_whole ? here.get<std::int64_t>() : 0;
  if (!is_whole || value < least || value > most) {
    refuse("a whole number from " + std::to_string(least) + " to " + std::to_string(most) +
           " expected");
  }
  return value;
}

void Archive::flag(bool* value) {
  json& here = *tree_->here;
  if (!is_reading_) here = *value;
  if (!here.is_boolean()) refuse("true or false expected");
  *value = here.get<bool>();
}

void Archive::text(std::string* value) {
  json& here = *tree_->here;
  if (!is_reading_) here = *value;
  if (!here.is_string()) refuse("a text expected");
  *value = here.get<std::string>();
}

bool Archive::something(bool is_there) {
  return is_reading_ ? !tree_->here->is_null() : is_there;
}

std::string Archive::bytes() const {
  if (kind_.is_text) {
    std::string text;
    print(tree_->root, "", &text);
    const json format = kind_.format;
    return "{\n \"" + std::string(kFormat) + "\": " + format.dump() + ',' + text.substr(1) + '\n';
  }
  std::string content;
  json::to_cbor(tree_->root, content);
  return first_line(kind_, content) + content;
}

void describe(Archive& archive, Pose2& pose) {
  archive.list_of(3);
  archive(std::size_t{0}, pose.x);
  archive(std::size_t{1}, pose.y);
  archive(std::size_t{2}, pose.heading);
}

std::string checksum_of(const std::string& bytes) {
  // Each byte takes the state through a bijection, so no change of a single byte goes unnoticed.
  std::uint64_t state = 0xcbf29ce484222325u;
  for (const char byte : bytes) {
    state = (state ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  }
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(state));
  return digits.data();
}

void write_bytes(const FileKind& kind, const std::string& path, const std::string& bytes) {
  NewFile file(path, std::string(kind.name) + " " + path);
  file.write(bytes);
  file.finish();
}

}  // namespace pf_resampling
