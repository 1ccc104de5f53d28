#include "src/frames/frame_pattern.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"

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

std::string error_of_pattern(const std::string& text) {
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
  EXPECT_EQ(error_of_pattern("tag_(\\d+)"), "");
  EXPECT_EQ(error_of_pattern(""), "");
  for (const char* bad : {"tag_(", "tag_\\d+", "(tag)_(\\d+)", "["}) {
    const std::string said = error_of_pattern(bad);
    EXPECT_TRUE(says(said, "group/pattern"));
    EXPECT_TRUE(says(said, bad));
    EXPECT_TRUE(says(said, "tag_(\\d+)"));
    EXPECT_FALSE(says(said, "\n"));
  }
}

}  // namespace
}  // namespace pf_resampling
