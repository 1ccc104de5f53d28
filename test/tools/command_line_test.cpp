#include "tools/common/command_line.hpp"
#include "pf_resampling_core/test/says.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pf_resampling {
namespace {

CommandLine example_line() {
  CommandLine line("tool", "Does a thing.");
  line.positional("in.bag", "what to read");
  line.positional("out.bag", "what to write", false);
  line.option<std::string>("antenna", "x,y,z", "where it sits");
  line.option<unsigned>("seed", "N", 1, "seed");
  line.repeatable_option("config", "FILE", "several are merged");
  line.example("tool in.bag --seed 3");
  return line;
}

std::string misuse_of(const std::vector<std::string>& arguments) {
  CommandLine line = example_line();
  try {
    line.parse(arguments);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(CommandLine, ReadsPositionalsAndOptions) {
  CommandLine line = example_line();
  ASSERT_TRUE(line.parse({"a.bag", "--seed", "7", "b.bag"}));
  EXPECT_EQ(line.get<std::string>("in.bag"), "a.bag");
  EXPECT_EQ(line.get<std::string>("out.bag"), "b.bag");
  EXPECT_EQ(line.get<unsigned>("seed"), 7U);
  EXPECT_FALSE(line.has("antenna"));
}

TEST(CommandLine, GathersRepeatedOptions) {
  CommandLine line = example_line();
  ASSERT_TRUE(line.parse({"a.bag", "--config", "a.yaml", "--config=b.yaml"}));
  EXPECT_EQ(line.get<std::vector<std::string>>("config"),
            (std::vector<std::string>{"a.yaml", "b.yaml"}));
  EXPECT_FALSE(line.has("out.bag"));
}

TEST(CommandLine, TakesNegativeNumbersAsValues) {
  CommandLine line = example_line();
  ASSERT_TRUE(line.parse({"a.bag", "--antenna", "-0.3,0,1e-1"}));
  EXPECT_EQ(line.text("antenna"), "-0.3,0,1e-1");
}

TEST(CommandLine, PassesOverArgumentsForRos) {
  CommandLine line = example_line();
  ASSERT_TRUE(line.parse({"a.bag", "__name:=tool_7"}));
  EXPECT_FALSE(line.has("out.bag"));
}

TEST(CommandLine, MisuseIsOneLineWithTheUsage) {
  const std::vector<std::vector<std::string>> misuses = {
      {},
      {"a.bag", "b.bag", "c.bag"},
      {"a.bag", "--sed", "3"},
      {"a.bag", "--seed"},
      {"a.bag", "--seed", "three"},
      {"a.bag", "-s", "3"},
  };
  for (const auto& arguments : misuses) {
    const std::string message = misuse_of(arguments);
    EXPECT_TRUE(says(message, "usage: tool in.bag [out.bag] [options]"));
    EXPECT_FALSE(says(message, "\n"));
  }
  EXPECT_EQ(misuse_of({}).find("missing in.bag"), 0U);
}

TEST(CommandLine, HelpShowsUsageOptionsAndExamples) {
  const std::string help = example_line().help();
  EXPECT_TRUE(says(help, "Usage: rosrun pf_resampling tool in.bag [out.bag] [options]"));
  EXPECT_TRUE(says(help, "--antenna x,y,z"));
  EXPECT_TRUE(says(help, "rosrun pf_resampling tool in.bag --seed 3"));
}

TEST(RunTool, TurnsErrorsIntoExitCodes) {
  std::string name = "tool";
  char* argv[] = {name.data()};
  EXPECT_EQ(run_tool("tool", 1, argv, [](const auto&) { return 5; }), 5);
  EXPECT_EQ(run_tool("tool", 1, argv, [](const auto&) -> int { throw UsageError("misuse"); }), 2);
  EXPECT_EQ(run_tool("tool", 1, argv, [](const auto&) -> int { throw Error("bad\ninput"); }), 1);
}

TEST(RunTool, AnErrorIsOneWholeLineWhateverIsInIt) {
  std::string name = "tool";
  char* argv[] = {name.data()};
  testing::internal::CaptureStderr();
  run_tool("tool", 1, argv,
           [](const auto&) -> int { throw Error("a\nb\rc\td\x1b[2J\x7f\x01 \xc3\xa9"); });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "tool: a b c d [2J   \xc3\xa9\n");
  EXPECT_FALSE(says(misuse_of({"a.bag", "--s\x1b" + std::string(1, '\0') + "d", "3"}), "\x1b"));
}

}  // namespace
}  // namespace pf_resampling
