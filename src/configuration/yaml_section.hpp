#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace pf_resampling {

/// What an error says of a text that may hold any letters: on one line.
std::string one_line(std::string text);

/// A map of a YAML file, read key by key; afterwards, keys that nobody asked for are an error, so
/// that a misspelt one never silently leaves a default in place. All members throw Error naming
/// source, line and key of what is unknown, missing or makes no sense.
class YamlSection {
 public:
  /// The whole of a text; `source` names it in errors.
  static YamlSection of_text(const std::string& text, const std::string& source);

  /// `path`: the keys that lead to the map, for errors; empty: the file itself.
  YamlSection(const YAML::Node& node, std::string source, std::string path);

  /// Each leaves the value as it is if there is no such key.
  void read(const std::string& key, double* value) { read_as(key, value, "a number"); }
  void read(const std::string& key, int* value) { read_as(key, value, "a whole number"); }
  void read(const std::string& key, bool* value) { read_as(key, value, "true or false"); }
  void read(const std::string& key, std::string* value) { read_as(key, value, "a word or a text"); }

  bool has(const std::string& key) const { return node_[key].IsDefined(); }
  void require(const std::string& key) const;

  /// Reads the map `key`, if there is one, by `reader`.
  template <typename Reader>
  void read_section(const std::string& key, Reader reader) {
    known_.insert(key);
    if (!has(key)) return;
    YamlSection section(at(key), source_, name(key));
    reader(section);
    section.finish();
  }

  /// Reads each map of the list `key` by `reader`.
  template <typename Reader>
  void read_sections(const std::string& key, Reader reader) {
    for (const YAML::Node& item : list(key)) {
      YamlSection section(item, source_, name(key));
      reader(section);
      section.finish();
    }
  }

  /// Pairs [x, y] of finite numbers.
  void read_points(const std::string& key, std::vector<Eigen::Vector2d>* points);

  /// Whole numbers of the list `key`.
  void read_list(const std::string& key, std::vector<int>* values);

  /// Whole numbers under keys with a prefix, by the rest of the key.
  void read_prefixed(const std::string& prefix, std::map<std::string, int>* values);

  /// Values as text, by their key, of the map `key`.
  void read_texts(const std::string& key, std::map<std::string, std::string>* values);

  void ignore(const std::string& key) { known_.insert(key); }

  /// To be called when all that is known has been read.
  void finish() const;

  /// Throws Error that names source, line and key.
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;

 private:
  // Const, because yaml-cpp's other operator[] adds what it does not find.
  YAML::Node at(const std::string& key) const { return node_[key]; }
  static std::string text(const YAML::Node& node);
  std::string name(const std::string& key) const { return path_.empty() ? key : path_ + "/" + key; }

  template <typename Value>
  void read_as(const std::string& key, Value* value, const std::string& kind) {
    known_.insert(key);
    if (!has(key)) return;
    const YAML::Node item = at(key);
    if (!item.IsScalar() || !YAML::convert<Value>::decode(item, *value)) {
      fail_at(item, name(key), "is \"" + text(item) + "\", needed: " + kind);
    }
  }

  YAML::Node list(const std::string& key);
  [[noreturn]] void fail_at(const YAML::Node& node, const std::string& what,
                            const std::string& problem) const;

  YAML::Node node_;
  std::string source_;
  std::string path_;
  std::set<std::string> known_;
};

}  // namespace pf_resampling
