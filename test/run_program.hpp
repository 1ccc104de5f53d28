#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/places.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {

/// What a program did: its exit code (-1 if it was killed) and all it wrote.
struct ProgramResult {
  int exit_code = 0;
  std::string out;
  std::string error;

  /// Whether it said one line on stderr that begins with the program's name, and nothing on stdout.
  bool is_one_line_error(const std::string& program) const {
    return out.empty() && error.rfind(program + ": ", 0) == 0 && error.back() == '\n' &&
           std::count(error.begin(), error.end(), '\n') == 1;
  }
};

/// Runs a program of this package: "evaluate_bag out.bag --clip 0.2", as a user would type it after
/// `rosrun pf_resampling`; arguments as for a shell.
inline ProgramResult run_program(const std::string& command) {
  const TemporaryDirectory directory;
  const std::string error_file = directory.file("error");
  const std::string line = std::string(kProgramsFolder) + "/" + command + " 2>" + error_file;
  FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + line);
  ProgramResult result;
  char buffer[4096];
  for (std::size_t size; (size = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
    result.out.append(buffer, size);
  }
  const int status = pclose(pipe);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.error = read_file(error_file);
  return result;
}

/// Runs it in vain: it says so in one line, with these words.
inline void expect_failure(const std::string& command, int exit_code,
                           const std::vector<std::string>& words) {
  const ProgramResult result = run_program(command);
  EXPECT_EQ(result.exit_code, exit_code) << command;
  EXPECT_TRUE(result.is_one_line_error(command.substr(0, command.find(' '))))
      << command << ": " << result.out << result.error;
  for (const std::string& word : words) EXPECT_TRUE(says(result.error, word));
}

}  // namespace pf_resampling
