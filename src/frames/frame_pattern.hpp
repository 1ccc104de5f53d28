#pragma once

#include <optional>
#include <regex>
#include <string>

#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// Ids from names of frames, by a regular expression (ECMAScript) for the whole name whose one
/// group is the id: "tag_(\d+)" makes 7 of "tag_7".
class FramePattern {
 public:
  /// Matches nothing.
  FramePattern() = default;

  /// Empty: matches nothing. Throws Error if it is no regular expression with one group, or has a
  /// back-reference.
  explicit FramePattern(const std::string& pattern);

  /// The id in the name of a frame, with or without a slash in front; nothing if the name does not
  /// match, or what the group caught is no integer of 0 to 2147483647.
  std::optional<int> id_of(const std::string& frame) const;

  bool is_empty() const { return !expression_; }

 private:
  std::optional<std::regex> expression_;
};

/// A parameter that is such a pattern; any other text is refused.
Parameter pattern_parameter(const std::string& name, std::string* field, const std::string& help);

}  // namespace pf_resampling
