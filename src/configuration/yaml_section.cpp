#include "src/configuration/yaml_section.hpp"

#include <cctype>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (std::iscntrl(static_cast<unsigned char>(letter)) != 0) letter = ' ';
  }
  return text;
}

YamlSection YamlSection::of_text(const std::string& text, const std::string& source) {
  try {
    return YamlSection(YAML::Load(text), source, "");
  } catch (const YAML::Exception& error) {
    throw Error(source + ", line " + std::to_string(error.mark.line + 1) +
                ": not YAML: " + one_line(error.msg));
  }
}

YamlSection::YamlSection(const YAML::Node& node, std::string source, std::string path)
    : node_(node), source_(std::move(source)), path_(std::move(path)) {
  if (!node_.IsMap()) {
    fail_at(node_, path_.empty() ? "the file" : path_, "has to be a map of keys");
  }
  std::set<std::string> keys;
  for (const auto& item : node_) {
    const std::string key = text(item.first);
    if (!keys.insert(key).second) fail_at(item.first, name(key), "is there twice");
  }
}

void YamlSection::require(const std::string& key) const {
  if (!has(key)) fail_at(node_, name(key), "is missing");
}

void YamlSection::read_points(const std::string& key, std::vector<Eigen::Vector2d>* points) {
  for (const YAML::Node& item : list(key)) {
    if (!item.IsSequence() || item.size() != 2) fail_at(item, name(key), "has to be pairs [x, y]");
    Eigen::Vector2d point;
    for (std::size_t i = 0; i < 2; ++i) {
      if (!YAML::convert<double>::decode(item[i], point(static_cast<Eigen::Index>(i)))) {
        fail_at(item[i], name(key), "has \"" + text(item[i]) + "\" where a number is needed");
      }
    }
    if (!point.allFinite()) fail_at(item, name(key), "has a coordinate that is not finite");
    points->push_back(point);
  }
}

void YamlSection::read_list(const std::string& key, std::vector<int>* values) {
  for (const YAML::Node& item : list(key)) {
    int value = 0;
    if (!item.IsScalar() || !YAML::convert<int>::decode(item, value)) {
      fail_at(item, name(key), "has \"" + text(item) + "\" where a whole number is needed");
    }
    values->push_back(value);
  }
}

void YamlSection::read_prefixed(const std::string& prefix, std::map<std::string, int>* values) {
  for (const auto& item : node_) {
    const std::string key = text(item.first);
    if (key.compare(0, prefix.size(), prefix) != 0) continue;
    read(key, &(*values)[key.substr(prefix.size())]);
  }
}

void YamlSection::read_texts(const std::string& key, std::map<std::string, std::string>* values) {
  known_.insert(key);
  if (!has(key)) return;
  const YAML::Node items = at(key);
  if (!items.IsMap()) fail_at(items, name(key), "has to be a map of keys");
  for (const auto& item : items) {
    if (!item.second.IsScalar()) {
      fail_at(item.second, name(key) + "/" + text(item.first), "has to be a single value");
    }
    (*values)[text(item.first)] = item.second.Scalar();
  }
}

void YamlSection::finish() const {
  for (const auto& item : node_) {
    const std::string key = text(item.first);
    if (known_.count(key) != 0) continue;
    std::string known;
    for (const std::string& each : known_) known += (known.empty() ? "" : ", ") + each;
    fail_at(item.first, name(key), "is unknown; known here: " + known);
  }
}

void YamlSection::fail(const std::string& key, const std::string& problem) const {
  fail_at(has(key) ? at(key) : node_, name(key), problem);
}

std::string YamlSection::text(const YAML::Node& node) {
  return node.IsScalar() ? node.Scalar() : std::string("a list or map");
}

YAML::Node YamlSection::list(const std::string& key) {
  known_.insert(key);
  if (!has(key)) return YAML::Node(YAML::NodeType::Sequence);
  const YAML::Node items = at(key);
  if (!items.IsSequence()) fail_at(items, name(key), "has to be a list");
  return items;
}

void YamlSection::fail_at(const YAML::Node& node, const std::string& what,
                          const std::string& problem) const {
  throw Error(source_ + ", line " + std::to_string(node.Mark().line + 1) + ": " +
              one_line(what + " " + problem));
}

}  // namespace pf_resampling
