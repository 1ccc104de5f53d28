#pragma once

#include <gtest/gtest.h>

#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

/// Whether a text contains these words; a failure shows it.
inline testing::AssertionResult says(const std::string& text, const std::string& words) {
  const bool is_said = text.find(words) != std::string::npos;
  return (is_said ? testing::AssertionSuccess() : testing::AssertionFailure())
         << "\"" << words << "\" in \"" << text << "\"";
}

/// What work is refused with; empty if it is done.
template <typename Work>
std::string refusal(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace pf_resampling
