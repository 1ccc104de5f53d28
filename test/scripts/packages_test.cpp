// The lists of what this package needs, and its version in all the places that name it.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

#include "test/places.hpp"

TEST(Packages, EveryPythonModuleIsInstalledAndTheVersionsAgree) {
  const std::string source = pf_resampling::kSourceFolder;
  FILE* pipe = popen(("/usr/bin/python3 " + source + "/scripts/check_packages 2>&1").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string findings;
  std::array<char, 4096> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) findings += line.data();
  EXPECT_EQ(pclose(pipe), 0) << findings;
}
