#include "tools/common/table.hpp"

#include <gtest/gtest.h>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

TEST(Table, AlignsTextToTheLeftAndNumbersToTheRight) {
  Table table({"what", "kind", "m"});
  table.add_row({"one", "a", "1.50"});
  table.add_row({"Größe", "long", "-12.25"});
  table.add_row({"x"});
  EXPECT_EQ(table.text(1),
            " what   kind       m\n"
            " one    a       1.50\n"
            " Größe  long  -12.25\n"
            " x\n");
}

TEST(Table, RefusesMoreCellsThanHeadings) {
  Table table({"a"});
  EXPECT_THROW(table.add_row({"1", "2"}), Error);
}

TEST(Fixed, RoundsToDecimals) {
  EXPECT_EQ(fixed(1.256, 2), "1.26");
  EXPECT_EQ(fixed(-3.0, 0), "-3");
  EXPECT_EQ(fixed(1e12, 1), "1000000000000.0");
}

}  // namespace
}  // namespace pf_resampling
