#include "pf_resampling_core/files/new_file.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

namespace fs = std::filesystem;

class NewFiles : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return directory_.file(name); }
  std::string with(const std::string& name, const std::string& content) const {
    return directory_.write(name, content);
  }
  std::string content(const std::string& name) const { return directory_.content(name); }
  mode_t mode(const std::string& name) const {
    struct stat there {};
    lstat(path(name).c_str(), &there);
    return there.st_mode;
  }

  TemporaryDirectory directory_;
};

void write_whole(const std::string& path) {
  NewFile file(path, "the file");
  file.write("new");
  file.finish();
}

TEST_F(NewFiles, AreThereWholeOrNotAtAll) {
  with("a", "old");
  {
    NewFile file(path("a"), "the file");
    file.write("new");
    EXPECT_EQ(content("a"), "old");
  }
  EXPECT_EQ(content("a"), "old");
  EXPECT_EQ(directory_.listing(), "a");
  write_whole(path("a"));
  write_whole(path("b"));
  EXPECT_EQ(content("a"), "new");
  EXPECT_EQ(content("b"), "new");
  EXPECT_EQ(directory_.listing(), "a b");
}

TEST_F(NewFiles, HaveTheModeOfTheOldOne) {
  for (const mode_t mode_before : {0600U, 0664U, 0755U}) {
    with("a", "old");
    chmod(path("a").c_str(), mode_before);
    write_whole(path("a"));
    EXPECT_EQ(mode("a"), S_IFREG | mode_before);
  }
  const mode_t mask = umask(027);
  write_whole(path("b"));
  umask(mask);
  EXPECT_EQ(mode("b"), S_IFREG | 0640U);
}

// What is there stays what it is: as root, too, for whom nothing is read-only.
TEST_F(NewFiles, ReplaceRegularFilesOnly) {
  with("target", "old");
  fs::create_symlink(path("target"), path("link"));
  fs::create_symlink(path("nowhere"), path("dangling"));
  ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
  fs::create_directory(path("folder"));
  with("read_only", "old");
  chmod(path("read_only").c_str(), 0444);
  const int socket_there = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path("socket").size(), sizeof address.sun_path);
  std::strcpy(address.sun_path, path("socket").c_str());
  ASSERT_EQ(bind(socket_there, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  // A device like /dev/null; only root can make one.
  const bool has_device = mknod(path("device").c_str(), S_IFCHR | 0666, makedev(1, 3)) == 0;

  const std::string before = directory_.listing();
  const struct {
    const char* name;
    const char* said;
  } cases[] = {{"link", "it is not a regular file"},    {"dangling", "it is not a regular file"},
               {"fifo", "it is not a regular file"},    {"socket", "it is not a regular file"},
               {"folder", "it is not a regular file"},  {"read_only", "it is read-only"},
               {"folder/", "it is not a regular file"}, {"none/a", "No such file or directory"},
               {"target/a", "Not a directory"},         {"", "it is not a regular file"},
               {"device", "it is not a regular file"}};
  for (const auto& test : cases) {
    if (std::string(test.name) == "device" && !has_device) continue;
    const mode_t mode_before = mode(test.name);
    const std::string said = refusal([&] { write_whole(path(test.name)); });
    EXPECT_EQ(said.rfind(std::string("the file cannot be written: ") + test.said, 0), 0u)
        << test.name << ": " << said;
    EXPECT_EQ(mode(test.name), mode_before) << test.name;
  }
  EXPECT_EQ(directory_.listing(), before);
  EXPECT_EQ(content("target"), "old");
  EXPECT_EQ(content("read_only"), "old");
  EXPECT_NE(refusal([] { write_whole(""); }), "");
  close(socket_there);
}

// What was a file when writing began may be none at its end.
TEST_F(NewFiles, LookAgainAtTheEnd) {
  NewFile file(path("a"), "the file");
  ASSERT_EQ(mkfifo(path("a").c_str(), 0600), 0);
  EXPECT_THROW(file.finish(), Error);
  EXPECT_EQ(mode("a"), S_IFIFO | 0600U);
}

// A process of this number has left something, or somebody has laid a link there.
TEST_F(NewFiles, ReplaceNamesThatAreTaken) {
  with("victim", "old");
  fs::create_symlink(path("victim"), path("a") + ".part-" + std::to_string(getpid()));
  write_whole(path("a"));
  EXPECT_EQ(content("a"), "new");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(path("a"))));
  EXPECT_EQ(content("victim"), "old");
  EXPECT_EQ(directory_.listing(), "a victim");
}

TEST_F(NewFiles, AreNeitherReadNorWrittenTwice) {
  const FileOfRun in{with("in", "x"), "in.bag"};
  fs::create_hard_link(in.path, path("other_name"));
  fs::create_symlink(in.path, path("link"));
  fs::create_directory_symlink(directory_.path(), path("way"));
  for (const char* name : {"in", "./in", "other_name", "way/in"}) {
    EXPECT_EQ(refusal([&] {
                require_separate({{path(name), "--out"}}, {in});
              }),
              "--out is the same file as in.bag, which is read; give another name")
        << name;
  }
  EXPECT_NE(refusal([&] { require_separate({in}, {{path("link"), "--config"}}); }), "");
  for (const char* name : {"new", "./new", "way/new"}) {
    EXPECT_EQ(refusal([&] {
                require_separate({{path("new"), "out.bag"}, {path(name), "--save-map"}}, {in});
              }),
              "--save-map is the same file as out.bag, which is written as well; give another name")
        << name;
  }
  EXPECT_EQ(refusal([&] {
              require_separate({{path("new"), "a"}, {path("old"), "b"}},
                               {in, {"", "nothing"}, {path("none"), "c"}});
            }),
            "");
  // The name of a world that is built in is that of no file.
  EXPECT_EQ(refusal([&] { require_separate({{path("new"), "a"}}, {{path("new"), "b"}}); }), "");
  EXPECT_NE(refusal([&] { require_separate({{path("link"), "a"}}, {}); }), "");
}

TEST_F(NewFiles, LeaveNothingBehindWhenAProcessIsKilled) {
  with("a", "old");
  for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
    const pid_t child = fork();
    if (child == 0) {
      NewFile file(path("a"), "the file");
      file.write("new");
      std::signal(SIGINT, SIG_DFL);  // under nohup it is ignored
      raise(signal);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << strsignal(signal);
    EXPECT_EQ(directory_.listing(), "a") << strsignal(signal);
    EXPECT_EQ(content("a"), "old");
  }
}

}  // namespace
}  // namespace pf_resampling
