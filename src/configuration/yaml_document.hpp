#pragma once

#include <yaml-cpp/node/node.h>

#include <cstddef>
#include <string>

namespace pf_resampling {

/// The longest YAML text that is read, in bytes; ours have ten thousand. yaml-cpp takes seconds and
/// hundreds of megabytes for this much.
inline constexpr std::size_t kLongestYaml = 1000000;

/// Throws Error that begins with `name` if the text is longer; to be called before parse_yaml().
void require_short(const std::string& text, const std::string& name);

/// A YAML text as values that can be gone through without an end to fear: one document, every key
/// once in its map, no aliases (which may contain themselves), no deeper than anybody would write.
/// Throws YAML::Exception, with the place, for all else.
YAML::Node parse_yaml(const std::string& text);

/// What an error says of such a text, which may hold any letters: on one line.
std::string one_line(std::string text);

}  // namespace pf_resampling
