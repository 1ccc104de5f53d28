#include "src/frames/frame_pattern.hpp"

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
FramePattern::FramePattern(const std::string& pattern) {
  if (pattern.empty()) return;
  const std::string remedy =
      "; it has to be a regular expression for names of frames with one group, such as tag_(\\d+)";
  try {
    // Without going back: the time is bounded whatever the pattern.
    expression_.emplace(pattern, std::regex::ECMAScript | std::regex_constants::__polynomial);
  } catch (const std::regex_error& error) {
    throw Error("'" + pattern + "' is not a regular expression (" + error.what() + ")" + remedy);
  }
  if (expression_->mark_count() != 1) {
    throw Error("'" + pattern + "' is a regular expression with " +
                std::to_string(expression_->mark_count()) + " groups" + remedy);
  }
}

std::optional<int> FramePattern::id_of(const std::string& frame) const {
  if (!expression_) return std::nullopt;
  const std::string name = without_slash(frame);
  std::smatch match;
  if (!std::regex_match(name, match, *expression_)) return std::nullopt;
  const std::string digits = match[1].str();
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  try {
    return std::stoi(digits);
  } catch (const std::out_of_range&) {
    return std::nullopt;
  }
}

Parameter pattern_parameter(const std::string& name, std::string* field, const std::string& help) {
  Parameter parameter = text_parameter(name, field, help);
  parameter.set_checked = [name, field](const std::string& text) {
    try {
      FramePattern{text};
    } catch (const Error& error) {
      throw Error("parameter " + name + ": " + error.what());
    }
    *field = text;
  };
  return parameter;
}

}  // namespace pf_resampling
