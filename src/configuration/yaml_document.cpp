#include "src/configuration/yaml_document.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <cctype>
#include <set>
#include <sstream>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr std::size_t kDeepestYaml = 50;

// Goes through a text as it is parsed, before anything is made of it.
class Inspection : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "a second document begins here; give one");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override { take_item(); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    refuse(mark, "an alias (*name) is not read; write out what it stands for");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& value) override {
    if (is_key() && !open_.back().keys.insert(value).second) {
      refuse(mark, "the key '" + value.substr(0, 40) + "' is there twice; give it once");
    }
    take_item();
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/,
                       YAML::anchor_t /*anchor*/, YAML::EmitterStyle::value /*style*/) override {
    open(mark, false);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {
    open(mark, true);
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  struct Collection {
    bool is_map = false;
    bool at_key = true;  // of a map: whether a key is next
    std::set<std::string> keys;
  };

  [[noreturn]] static void refuse(const YAML::Mark& mark, const std::string& what) {
    throw YAML::ParserException(mark, what);
  }
  bool is_key() const { return !open_.empty() && open_.back().is_map && open_.back().at_key; }
  void take_item() {
    if (!open_.empty()) open_.back().at_key = !open_.back().at_key;
  }
  void open(const YAML::Mark& mark, bool is_map) {
    take_item();
    if (open_.size() == kDeepestYaml) {
      refuse(mark, "it is nested deeper than " + std::to_string(kDeepestYaml) + " levels");
    }
    Collection collection;
    collection.is_map = is_map;
    open_.push_back(collection);
  }

  int documents_ = 0;
  std::vector<Collection> open_;
};

}  // namespace

void require_short(const std::string& text, const std::string& name) {
  if (text.size() <= kLongestYaml) return;
  throw Error(name + ": has more than " + std::to_string(kLongestYaml) +
              " bytes; is it a configuration, a world or a study?");
}

YAML::Node parse_yaml(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Inspection inspection;
  while (parser.HandleNextDocument(inspection)) {
  }
  return YAML::Load(text);
}

std::string one_line(std::string text) {
  for (char& letter : text) {
    if (std::iscntrl(static_cast<unsigned char>(letter)) != 0) letter = ' ';
  }
  return text;
}

}  // namespace pf_resampling
