#include "src/frames/frame_pattern.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

TEST(FramePattern, FindsTheIdInTheWholeName) {
  const FramePattern tags("tag_(\\d+)");
  EXPECT_EQ(tags.id_of("tag_7"), 7);
  EXPECT_EQ(tags.id_of("/tag_7"), 7);
  EXPECT_EQ(tags.id_of("tag_0042"), 42);
  EXPECT_EQ(tags.id_of("tag_2147483647"), 2147483647);
  for (const char* other : {"", "tag_", "tag_x", "tag_7b", "my_tag_7", "tag_-7", "camera"}) {
    EXPECT_EQ(tags.id_of(other), std::nullopt) << other;
  }
  EXPECT_EQ(tags.id_of("tag_2147483648"), std::nullopt) << "more than an id can be";
  EXPECT_EQ(tags.id_of("tag_99999999999999999999"), std::nullopt);
  EXPECT_EQ(tags.id_of("tag_" + std::string(251, '0')), 0);
  EXPECT_EQ(tags.id_of("tag_" + std::string(252, '0')), std::nullopt) << "longer than a name";
  EXPECT_EQ(tags.id_of("tag_" + std::string(1000000, '0')), std::nullopt);
}

TEST(FramePattern, TheGroupMayStandAnywhere) {
  EXPECT_EQ(FramePattern("(?:.*/)?ar_marker_([0-9]+)_front").id_of("robot1/ar_marker_12_front"),
            12);
  EXPECT_EQ(FramePattern("(.*)").id_of("31"), 31);
  EXPECT_EQ(FramePattern("(.*)").id_of("thirty one"), std::nullopt);
}

TEST(FramePattern, EmptyMatchesNothing) {
  EXPECT_TRUE(FramePattern("").is_empty());
  EXPECT_TRUE(FramePattern().is_empty());
  EXPECT_EQ(FramePattern("").id_of(""), std::nullopt);
  EXPECT_EQ(FramePattern("").id_of("tag_7"), std::nullopt);
}

std::string error_of(const std::string& text) {
  std::string field = "before";
  const Parameter parameter = pattern_parameter("group/pattern", &field, "Help.");
  try {
    set_parameter({parameter}, "group/pattern", text);
  } catch (const Error& error) {
    EXPECT_EQ(field, "before");
    return error.what();
  }
  EXPECT_EQ(field, text);
  return "";
}

TEST(FramePattern, AParameterThatIsNoneIsRefusedByNameAndValue) {
  EXPECT_EQ(error_of("tag_(\\d+)"), "");
  EXPECT_EQ(error_of(""), "");
  for (const char* bad : {"tag_(", "tag_\\d+", "(tag)_(\\d+)", "["}) {
    const std::string said = error_of(bad);
    EXPECT_NE(said.find("group/pattern"), std::string::npos) << said;
    EXPECT_NE(said.find(bad), std::string::npos) << said;
    EXPECT_NE(said.find("tag_(\\d+)"), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
}

TEST(FramePattern, WhatMayTakeWithoutEndIsRefused) {
  for (const char* bad : {"(?:a*)*(b)", "(a|a)*b", "(?:a|a)*(b)", "(a+)+", "(?:a?){2,}(b)",
                          "((?:a*))*", "(?:(?:a*)b)+(c)", "(a{2})*", "(?:[)]a*)*(b)",
                          "(?:[[:alpha:])]*)*(b)", "(?:\\)a*)*(b)", "(?:a|b)+?(c)"}) {
    const std::string said = error_of(bad);
    EXPECT_NE(said.find("may take without end"), std::string::npos) << bad << ": " << said;
    EXPECT_NE(said.find("a repetition of a group"), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
  EXPECT_NE(error_of("a{0,51}(b)").find("more than 50 repetitions"), std::string::npos);
  EXPECT_NE(error_of("a{99999999999}(b)").find("more than 50 repetitions"), std::string::npos);
  EXPECT_NE(error_of("(?=.*(?!.*c))(b)").find("a look-ahead within"), std::string::npos);
  EXPECT_NE(error_of("(a)\\1"), "") << "a back-reference";
  for (const char* good : {"(?:.*/)?tag_(\\d+)", "(?:tag|marker)_(\\d+)", "(?:left_)*(\\d+)",
                           "(\\d{1,3})", "\\(*(\\d+)", "[(*|]*(\\d+)", "[[:alpha:]*]+(\\d+)",
                           "(?!old).*_(\\d+)", "(?:[*|])+([0-9])"}) {
    EXPECT_EQ(error_of(good), "") << good;
  }
}

TEST(FramePattern, ALongOneIsRefusedBeforeItIsRead) {
  const std::string said = error_of(std::string(20000, '('));
  EXPECT_NE(said.find("of 20000 letters, where 200 are allowed"), std::string::npos) << said;
  EXPECT_LT(said.size(), 400u);
  EXPECT_EQ(error_of(std::string(196, 'a') + "(.)"), "");
  EXPECT_NE(error_of(std::string(198, 'a') + "(.)"), "");
}

// Going back, each of these would take longer than the world has been there.
TEST(FramePattern, TheTimeIsBounded) {
  const auto repeated = [](int count, const std::string& part) {
    std::string all;
    for (int i = 0; i < count; ++i) all += part;
    return all + "(b)";
  };
  const std::string name(250, 'a');
  EXPECT_EQ(FramePattern(repeated(98, ".*")).id_of(name), std::nullopt);
  EXPECT_EQ(FramePattern(repeated(98, "a?")).id_of(name), std::nullopt);
  EXPECT_EQ(FramePattern(repeated(26, "a{0,50}")).id_of(name), std::nullopt);
  EXPECT_EQ(FramePattern(repeated(28, "(?:a|a)")).id_of(name), std::nullopt);
  EXPECT_EQ(FramePattern("(?:" + std::string(180, '^') + "){50}(b)").id_of(name), std::nullopt);
}

}  // namespace
}  // namespace pf_resampling
