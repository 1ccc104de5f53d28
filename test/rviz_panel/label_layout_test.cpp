#include "rviz_panel/label_layout.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

using Readable = std::vector<bool>;

TEST(LabelLayout, WhatWouldCoverAnEarlierLabelIsLeftOut) {
  // The second covers the first, the third is beside it, the fourth above it.
  EXPECT_EQ(readable_labels({{0, 0, 30, 12}, {29, 11, 30, 12}, {30, 0, 30, 12}, {0, 12, 30, 12}}),
            (Readable{true, false, true, true}));
}

TEST(LabelLayout, WhatIsLeftOutIsInNobodysWay) {
  EXPECT_EQ(readable_labels({{0, 0, 30, 12}, {20, 0, 30, 12}, {40, 0, 30, 12}}),
            (Readable{true, false, true}));
  EXPECT_TRUE(readable_labels({}).empty());
}

TEST(LabelLayout, OneInsideAnotherOverlapsIt) {
  EXPECT_EQ(readable_labels({{0, 0, 30, 30}, {10, 10, 5, 5}}), (Readable{true, false}));
  EXPECT_EQ(readable_labels({{10, 10, 5, 5}, {0, 0, 30, 30}}), (Readable{true, false}));
}

}  // namespace
}  // namespace pf_resampling
