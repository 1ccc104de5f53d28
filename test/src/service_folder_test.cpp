#include "src/node/service_folder.hpp"

#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

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

// A variable of the environment, as long as this lives.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    value != nullptr ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Variable() { before_.empty() ? unsetenv(name_) : setenv(name_, before_.c_str(), 1); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::string before_;
};

TEST(ServiceFolder, IsMadeWhenAFileIsNamed) {
  const TemporaryDirectory directory;
  const ServiceFolder folder(directory.file("a/b"));
  EXPECT_EQ(directory.listing(), "");
  EXPECT_EQ(folder.path_of("my.map"), directory.file("a/b/my.map"));
  EXPECT_EQ(folder.path_of("site/my.map"), directory.file("a/b/site/my.map"));
  EXPECT_EQ(folder.path_of(directory.file("a/b/my.map")), directory.file("a/b/my.map"));
  EXPECT_TRUE(std::filesystem::is_directory(directory.file("a/b")));
}

TEST(ServiceFolder, BeginsAtTheHomeOfTheUser) {
  const TemporaryDirectory directory;
  {
    const Variable home("HOME", directory.path().c_str());
    EXPECT_EQ(ServiceFolder("~/maps").path(), directory.file("maps"));
    EXPECT_EQ(ServiceFolder("~").path(), directory.path());
    EXPECT_EQ(ServiceFolder("/a/~/b").path(), "/a/~/b");
  }
  // A service of the system may have no such variable.
  const passwd* const user = getpwuid(geteuid());
  ASSERT_NE(user, nullptr);
  for (const char* const none : {static_cast<const char*>(nullptr), ""}) {
    const Variable home("HOME", none);
    EXPECT_EQ(ServiceFolder("~/maps").path(), std::string(user->pw_dir) + "/maps");
  }
}

TEST(ServiceFolder, NothingOutsideOfItIsNamed) {
  const TemporaryDirectory directory;
  const ServiceFolder folder(directory.file("maps"));
  for (const std::string& name :
       {std::string("../secret"), std::string("a/../../secret"), directory.file("secret"),
        std::string("/dev/null"), std::string("."), directory.file("maps_too/x")}) {
    EXPECT_TRUE(says(refusal_in(folder, name), " is not in " + directory.file("maps")));
  }
  EXPECT_EQ(refusal_in(folder, ""), "no file is given; give a name in " + directory.file("maps"));
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
