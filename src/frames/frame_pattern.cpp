#include "src/frames/frame_pattern.hpp"

#include <algorithm>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// std::regex recurses as deep as the pattern is long, its repetitions written out.
constexpr std::size_t kLongestPattern = 200;
constexpr int kMostRepetitions = 50;

/// Where the character class ends that begins at `begin`: [a-z], [^\]], [[:digit:]_].
std::size_t end_of_class(const std::string& pattern, std::size_t begin) {
  std::size_t i = begin + 1;
  for (; i < pattern.size() && pattern[i] != ']'; ++i) {
    if (pattern[i] == '\\') {
      ++i;
    } else if (pattern[i] == '[' && i + 1 < pattern.size() &&
               std::string(":.=").find(pattern[i + 1]) != std::string::npos) {
      const std::size_t end = pattern.find({pattern[i + 1], ']'}, i + 2);
      if (end == std::string::npos) return pattern.size();
      i = end + 1;
    }
  }
  return i;
}

/// The largest of the numbers in {2,7}, which begins at `begin`.
int repetitions_at(const std::string& pattern, std::size_t begin) {
  int largest = 0;
  int number = 0;
  for (std::size_t i = begin + 1; i < pattern.size() && pattern[i] != '}'; ++i) {
    const bool is_digit = pattern[i] >= '0' && pattern[i] <= '9';
    number = is_digit ? std::min(10 * number + (pattern[i] - '0'), kMostRepetitions + 1) : 0;
    largest = std::max(largest, number);
  }
  return largest;
}

/// What of a pattern could take more time or memory than there is; nothing if it is harmless.
std::string danger_of(const std::string& pattern) {
  struct Group {
    bool has_ways = false;  // more than one way to match: a repetition or an alternative in it
    bool is_ahead = false;  // in a look-ahead
  };
  const auto at = [&](std::size_t i) { return i < pattern.size() ? pattern[i] : '\0'; };
  std::vector<Group> open(1);
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const char letter = pattern[i];
    if (letter == '\\') {
      ++i;
    } else if (letter == '[') {
      i = end_of_class(pattern, i);
    } else if (letter == '(') {
      const bool looks_ahead = at(i + 1) == '?' && (at(i + 2) == '=' || at(i + 2) == '!');
      if (looks_ahead && open.back().is_ahead) return "a look-ahead within a look-ahead";
      open.push_back({false, looks_ahead || open.back().is_ahead});
      if (at(i + 1) == '?') i += 2;
    } else if (letter == ')' && open.size() > 1) {
      const bool has_ways = open.back().has_ways;
      open.pop_back();
      open.back().has_ways = open.back().has_ways || has_ways;
      // With ? it is there once at most.
      const char next = at(i + 1);
      if (has_ways && (next == '*' || next == '+' || next == '{')) {
        return "a repetition of a group that has a repetition or an alternative in it";
      }
    } else if (letter == '*' || letter == '+' || letter == '?' || letter == '|') {
      open.back().has_ways = true;
    } else if (letter == '{') {
      open.back().has_ways = true;
      if (repetitions_at(pattern, i) > kMostRepetitions) {
        return "more than " + std::to_string(kMostRepetitions) + " repetitions";
      }
    }
  }
  return "";
}

}  // namespace

FramePattern::FramePattern(const std::string& pattern) {
  if (pattern.empty()) return;
  const std::string remedy =
      "; it has to be a regular expression for names of frames with one group, such as tag_(\\d+)";
  if (pattern.size() > kLongestPattern) {
    throw Error("a regular expression of " + std::to_string(pattern.size()) + " letters, where " +
                std::to_string(kLongestPattern) + " are allowed" + remedy);
  }
  const std::string danger = danger_of(pattern);
  if (!danger.empty()) {
    throw Error("'" + pattern + "' may take without end to match: it has " + danger +
                "; write it without" + remedy);
  }
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
  // The time that matching takes grows with the name.
  if (!expression_ || frame.size() > kLongestFrameName) return std::nullopt;
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
