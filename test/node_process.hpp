#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace pf_resampling {

/// A node of this package in a process of its own, which ends as hard as a robot that loses power.
class NodeProcess {
 public:
  /// `program`: its path; `arguments`: remappings and private parameters, as `_name:=value`.
  NodeProcess(const std::string& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(&argument[0]);
    words.push_back(nullptr);
    process_ = fork();
    if (process_ < 0) throw std::runtime_error("cannot start " + program);
    if (process_ == 0) {
      execv(program.c_str(), words.data());
      _exit(127);
    }
  }
  ~NodeProcess() { kill_it(); }
  NodeProcess(const NodeProcess&) = delete;
  NodeProcess& operator=(const NodeProcess&) = delete;

  pid_t pid() const { return process_; }
  bool is_running() const { return process_ > 0 && waitpid(process_, nullptr, WNOHANG) == 0; }

  void kill_it() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }

 private:
  pid_t process_ = -1;
};

/// Memory that a process has in use.
inline double resident_megabytes(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/statm");
  double pages = 0.0;
  double resident = 0.0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

}  // namespace pf_resampling
