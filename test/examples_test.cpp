#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace {

// Copied by users: each has to build, without a warning, from an installed package, and to run.
TEST(Examples, BuildAndRunFromAnInstalledPackage) {
  const std::string script = std::string(PF_RESAMPLING_SOURCE) + "/scripts/check_examples ";
  EXPECT_EQ(std::system((script + PF_RESAMPLING_BUILD).c_str()), 0);
}

}  // namespace
