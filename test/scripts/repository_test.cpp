// The rules of the repository that no other tool knows.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "test/places.hpp"

TEST(Repository, KeepsItsRules) {
  const std::string source = pf_resampling::kSourceFolder;
  if (!std::filesystem::exists(source + "/.git")) {
    GTEST_SKIP() << "not a clone: git lists the files that the rules are about";
  }
  FILE* pipe = popen((source + "/scripts/check_repository 2>&1").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string findings;
  std::array<char, 4096> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) findings += line.data();
  EXPECT_EQ(pclose(pipe), 0) << findings;
}
