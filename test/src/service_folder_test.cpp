#include "src/node/service_folder.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

std::string refusal_in(const ServiceFolder& folder, const std::string& name) {
  return pf_resampling::refusal([&] { folder.path_of(name); });
}

TEST(ServiceFolder, IsMadeWhenAFileIsNamed) {
  const TemporaryDirectory directory;
  const ServiceFolder folder(directory.file("a/b"));
  EXPECT_EQ(directory.listing(), "");
  EXPECT_EQ(folder.path_of("my.map"), directory.file("a/b/my.map"));
  EXPECT_EQ(folder.path_of("site/my.map"), directory.file("a/b/site/my.map"));
  EXPECT_EQ(folder.path_of(directory.file("my.map")), directory.file("my.map"));
  EXPECT_EQ(refusal_in(folder, ""), "no file is given; give a name in " + directory.file("a/b"));
  EXPECT_TRUE(std::filesystem::is_directory(directory.file("a/b")));
}

TEST(ServiceFolder, BeginsAtTheHomeOfTheUser) {
  const std::string home = std::getenv("HOME");
  EXPECT_EQ(ServiceFolder("~/maps").path(), home + "/maps");
  EXPECT_EQ(ServiceFolder("~").path(), home);
  EXPECT_EQ(ServiceFolder("/a/~/b").path(), "/a/~/b");
}

TEST(ServiceFolder, FilesOfAnotherKindAreNotWritten) {
  const TemporaryDirectory directory;
  const ServiceFolder folder(directory.path());
  directory.write("thesis", "the thesis");
  directory.write("short", "pf_");
  directory.write("a.map", std::string(kMapFile.format) + "\n");
  directory.write("old.map", "pf_resampling map 1\n");
  directory.write("a.checkpoint", std::string(kCheckpointFile.format) + "\n");
  directory.write("empty", "");
  const auto said = [&](const std::string& name) {
    return pf_resampling::refusal(
        [&] { EXPECT_EQ(folder.path_to_write(name, kMapFile), directory.file(name)); });
  };
  for (const char* name : {"a.map", "old.map", "empty", "new"}) EXPECT_EQ(said(name), "");
  for (const char* name : {"thesis", "short", "a.checkpoint"}) {
    EXPECT_EQ(said(name), "file " + directory.file(name) +
                              " is there and is no map file: give another name, or remove it");
  }
  EXPECT_NO_THROW(folder.path_to_write("a.checkpoint", kCheckpointFile));
}

TEST(ServiceFolder, AFolderThatCannotBeMadeIsNamedWithTheParameter) {
  const TemporaryDirectory directory;
  directory.write("maps", "a file in the way");
  const std::string said = refusal_in(ServiceFolder(directory.file("maps/of/robot")), "my.map");
  EXPECT_EQ(said.rfind("the folder " + directory.file("maps/of/robot") + " cannot be made: ", 0),
            0u)
      << said;
  EXPECT_TRUE(says(said, "; set map_file/directory to one that can"));
}

}  // namespace
}  // namespace pf_resampling
