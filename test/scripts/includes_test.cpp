// What includes what: scripts/check_includes on the repository, and on a small one with each fault.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/places.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

struct Findings {
  int exit_code = 0;
  std::string text;
};

Findings check_includes(const std::string& root) {
  const TemporaryDirectory directory;
  const std::string file = directory.file("findings");
  const std::string command = "/usr/bin/python3 " + std::string(kSourceFolder) +
                              "/scripts/check_includes " + root + " > " + file;
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(file)};
}

TEST(Includes, NoneGoesUpwardsOrToASibling) {
  const Findings found = check_includes(kSourceFolder);
  EXPECT_EQ(found.text, "");
  EXPECT_EQ(found.exit_code, 0);
}

/// A repository with one source, whose second line includes something that may exist.
Findings check_planted(const std::string& source, const std::string& included, bool exists = true) {
  const TemporaryDirectory root;
  for (const std::string& path : {source, included}) {
    std::filesystem::create_directories(std::filesystem::path(root.file(path)).parent_path());
  }
  if (exists) root.write(included, "#pragma once\n");
  root.write(source, "#include <vector>\n#include \"" + included + "\"\n");
  return check_includes(root.path());
}

TEST(Includes, FaultsAreFound) {
  const std::string mcl = "pf_resampling_core/filters/beacon_mcl/";
  const std::string slam = "pf_resampling_core/filters/fastslam/";
  const struct {
    std::string source, included, fault;
  } plants[] = {
      {slam + "options.hpp", mcl + "options.hpp", "is beside"},
      {mcl + "renewal.cpp", slam + "fastslam.hpp", "is beside"},
      {"fastslam_node/main.cpp", "beacon_mcl_node/range_sensor.hpp", "is beside"},
      {"rviz_panel/panel.cpp", "fastslam_node/tag_scans.hpp", "is beside"},
      {"pf_resampling_core/strategy/renew.cpp", mcl + "options.hpp", "is above"},
      {"pf_resampling_core/population/weights.cpp", "pf_resampling_core/strategy/names.hpp",
       "is above"},
      {slam + "fastslam.cpp", "src/messages/conversions.hpp", "is above"},
      {"src/node/filter_node.cpp", "fastslam_node/pipeline.hpp", "is above"},
      {"src/messages/rejects.cpp", "src/odometry/dead_reckoning.hpp", "is above"},
      {"src/frames/static_frames.cpp", "src/pictures/markers.hpp", "is beside"},
      {slam + "memory/segment.cpp", slam + "fastslam.hpp", "is above"},
      {"fastslam_node/main.cpp", "tools/common/files.hpp", "is above"},
      {"tools/run_bag.cpp", "research/studies/table.hpp", "is above"},
      {"pf_resampling_core/test/weights_test.cpp", "src/messages/conversions.hpp", "is above"},
      {"tools/run_bag.cpp", "attic/table.hpp", "is in no room"},
      {"tools/run_bag.cpp", "table.hpp", "is in no room"},
      {"pf_resampling_core/attic/weights.cpp", "pf_resampling_core/error.hpp", "is in no room"},
  };
  for (const auto& plant : plants) {
    const Findings found = check_planted(plant.source, plant.included);
    EXPECT_EQ(found.exit_code, 1) << plant.source << " includes " << plant.included;
    EXPECT_EQ(found.text.rfind(plant.source + ":", 0), 0U) << found.text;
    EXPECT_TRUE(says(found.text, plant.fault));
  }
  EXPECT_TRUE(says(check_planted("tools/run_bag.cpp", "common/files.hpp", false).text,
                   "run_bag.cpp:2: \"common/files.hpp\" is not a path from the top"));
}

TEST(Includes, DownwardsIsNoFault) {
  EXPECT_EQ(check_planted("tools/run_bag.cpp", "fastslam_node/pipeline.hpp").exit_code, 0);
  EXPECT_EQ(check_planted("src/node/filter_node.cpp", "pf_resampling_core/strategy/renew.hpp").text,
            "");
}

}  // namespace
}  // namespace pf_resampling
