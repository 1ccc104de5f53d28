#include "pf_resampling_core/health/finding.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

TEST(Finding, IsASentence) {
  Finding finding;
  finding.begin = 1412.4;
  EXPECT_EQ(sentence_of(finding, 1000.0), "the wheels slipped at 412 s, or the robot was carried");
  finding.kind = FindingKind::odometry_turns_wrong;
  finding.size = -1.0;
  EXPECT_NE(sentence_of(finding, 1000.0).find("turns the wrong way, 1.00 times"),
            std::string::npos);
  finding.id = 60;
  finding.size = 2.04;
  finding.kind = FindingKind::landmark_moved;
  EXPECT_EQ(sentence_of(finding, 1000.0), "landmark 60 is 2.0 m from the map");
  finding.size = 0.42;
  finding.kind = FindingKind::landmark_twice;
  EXPECT_EQ(sentence_of(finding, 1000.0),
            "landmark 60 is at two places, 0.42 m apart: two of one id, or moved?");
  finding.kind = FindingKind::landmark_gone;
  EXPECT_EQ(sentence_of(finding, 1000.0), "landmark 60 is gone");
  finding.kind = FindingKind::beacon_moved;
  EXPECT_EQ(sentence_of(finding, 1000.0), "beacon 60 is 0.42 m from where the list has it");
  finding.words = "Better words";
  EXPECT_EQ(sentence_of(finding, 1000.0), "Better words");
}

}  // namespace
}  // namespace pf_resampling
