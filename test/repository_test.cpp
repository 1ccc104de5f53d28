// The rules of the repository that no other tool knows.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

TEST(Repository, KeepsItsRules) {
  if (!std::filesystem::exists(PF_RESAMPLING_SOURCE "/.git")) {
    GTEST_SKIP() << "not a clone: git lists the files that the rules are about";
  }
  FILE* pipe = popen(PF_RESAMPLING_SOURCE "/scripts/check_repository 2>&1", "r");
  ASSERT_NE(pipe, nullptr);
  std::string findings;
  std::array<char, 4096> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) findings += line.data();
  EXPECT_EQ(pclose(pipe), 0) << findings;
}
