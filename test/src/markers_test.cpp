#include "src/pictures/markers.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(Markers, FindingsAreInShortLinesWhereTheyAre) {
  FindingStatus finding;
  finding.place = make_point(3.0, 4.0, 0.0);
  finding.text = "the wheels slipped at 120 s, or the robot was carried";
  const auto array = finding_markers({"map", ros::Time(7.0)}, {finding}, 0.5, 1.0);
  ASSERT_EQ(array.markers.size(), 1u);
  EXPECT_EQ(array.markers[0].pose.position.y, 4.0);
  EXPECT_EQ(array.markers[0].text, "the wheels slipped\nat 120 s, or the\nrobot was carried");
}

}  // namespace
}  // namespace pf_resampling
