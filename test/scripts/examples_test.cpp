#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "test/places.hpp"

namespace {

// Copied by users: each has to build, without a warning, from an installed package, and to run.
TEST(Examples, BuildAndRunFromAnInstalledPackage) {
  const std::string script = std::string(pf_resampling::kSourceFolder) + "/scripts/check_examples ";
  EXPECT_EQ(std::system((script + pf_resampling::kBuildFolder).c_str()), 0);
}

}  // namespace
