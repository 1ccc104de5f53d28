#include "src/node/rebinding.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace pf_resampling {
namespace {

using std::chrono::seconds;

const Rebinding::Clock::time_point kStart{seconds(1000)};

TEST(Rebinding, IsNotDueWhileAllIsWell) {
  Rebinding rebinding;
  for (int second = 0; second < 1000; ++second) {
    const auto now = kStart + seconds(second);
    rebinding.note_message(true, now);
    EXPECT_FALSE(rebinding.is_due(1, now)) << second;
  }
}

TEST(Rebinding, IsNotDueWhileThereIsNobody) {
  Rebinding rebinding;
  for (int second = 0; second < 1000; ++second) {
    EXPECT_FALSE(rebinding.is_due(0, kStart + seconds(second))) << second;
  }
}

TEST(Rebinding, IsDueOnceAfterAMessageOfAnotherType) {
  Rebinding rebinding;
  rebinding.note_message(false, kStart);
  EXPECT_TRUE(rebinding.is_due(0, kStart + seconds(1))) << "its publisher is gone already";
  EXPECT_FALSE(rebinding.is_due(0, kStart + seconds(2)));
  EXPECT_FALSE(rebinding.is_due(1, kStart + seconds(3)));
}

// One that says nothing, or whose driver was changed: after 10 s, 20 s more, 40 s more, ...
TEST(Rebinding, IsDueWhenNothingComesThoughEverMoreRarely) {
  Rebinding rebinding;
  std::vector<int> due;
  for (int second = 0; second < 1000; ++second) {
    const unsigned publishers = second < 5 ? 0 : 1;
    if (rebinding.is_due(publishers, kStart + seconds(second))) due.push_back(second);
  }
  EXPECT_EQ(due, (std::vector<int>{15, 36, 77, 158, 319, 480, 641, 802, 963}));
  rebinding.note_message(true, kStart + seconds(1000));
  EXPECT_FALSE(rebinding.is_due(1, kStart + seconds(1009)));
  EXPECT_TRUE(rebinding.is_due(0, kStart + seconds(1010))) << "it was bound, and may be wrongly";
  EXPECT_FALSE(rebinding.is_due(0, kStart + seconds(2000))) << "whoever comes is taken";
}

}  // namespace
}  // namespace pf_resampling
