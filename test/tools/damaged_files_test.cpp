// What scripts/damage_files does with thousands of files, with few of each kind.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/places.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

TEST(DamagedFiles, EndNoToolBadly) {
  const TemporaryDirectory directory;
  const std::string command = std::string(kSourceFolder) +
                              "/scripts/damage_files --files 33 --seed 11 --programs " +
                              kProgramsFolder + " > " + directory.file("said") + " 2>&1";
  const int status = std::system(command.c_str());
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << read_file(directory.file("said"));
}

}  // namespace
}  // namespace pf_resampling
