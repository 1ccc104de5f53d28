// The lists of what this package needs, and its version in all the places that name it.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

TEST(Packages, EveryPythonModuleIsInstalledAndTheVersionsAgree) {
  FILE* pipe = popen("/usr/bin/python3 " PF_RESAMPLING_SOURCE "/scripts/check_packages 2>&1", "r");
  ASSERT_NE(pipe, nullptr);
  std::string findings;
  std::array<char, 4096> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) findings += line.data();
  EXPECT_EQ(pclose(pipe), 0) << findings;
}
