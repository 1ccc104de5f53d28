// Boost's own code for options with several values makes GCC 12 believe in a null pointer.
#pragma GCC diagnostic ignored "-Wnull-dereference"

#include "tools/common/command_line.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <sstream>
#include <utility>

#include "src/configuration/configuration.hpp"

namespace pf_resampling {

namespace {

namespace po = boost::program_options;

/// Only long options, never abbreviated: so that "-0.3,0,0" can be a value.
constexpr int kStyle = po::command_line_style::allow_long |
                       po::command_line_style::long_allow_adjacent |
                       po::command_line_style::long_allow_next;

bool is_for_ros(const std::string& argument) {
  return argument.compare(0, 2, "__") == 0 && argument.find(":=") != std::string::npos;
}

bool looks_like_short_option(const std::string& argument) {
  return argument.size() > 1 && argument[0] == '-' &&
         std::isalpha(static_cast<unsigned char>(argument[1])) != 0;
}

/// If the caller has closed a standard stream, its number must not become that of a file that is
/// opened later, in which everything printed would land. Writing there remains an error.
void reserve_standard_streams() {
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDONLY);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) close(descriptor);
}

/// No more than there is: a damaged length must end in an error, not in the kernel ending programs
/// to find memory. Sanitizers reserve far more than they use.
void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  std::ifstream stream("/proc/meminfo");
  for (std::string line; std::getline(stream, line);) {
    unsigned long long available = 0;  // KiB
    if (std::sscanf(line.c_str(), "MemAvailable: %llu", &available) != 1) continue;
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, 1024 * available);
    setrlimit(RLIMIT_DATA, &limit);
    return;
  }
#endif
}

void flush_standard_output() {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return;
  throw Error("standard output cannot be written; is the disk full?");
}

}  // namespace

CommandLine::CommandLine(std::string tool, std::string summary)
    : tool_(std::move(tool)), summary_(std::move(summary)), options_("Options", 100) {
  options_.add_options()("help", "print this text");
}

void CommandLine::positional(const std::string& name, const std::string& help, bool required) {
  positionals_.push_back({name, help, required});
}

void CommandLine::add(const std::string& name, const po::value_semantic* value,
                      const std::string& help) {
  options_.add_options()(name.c_str(), value, help.c_str());
}

void CommandLine::option_with_implicit(const std::string& name, const std::string& value_name,
                                       const std::string& implicit, const std::string& help) {
  add(name, po::value<std::string>()->implicit_value(implicit)->value_name(value_name), help);
}

void CommandLine::topic(const std::string& name, const std::string& default_topic,
                        const std::string& help) {
  option<std::string>(name, "TOPIC", default_topic, help);
}

void CommandLine::flag(const std::string& name, const std::string& help) {
  add(name, po::bool_switch(), help);
}

void CommandLine::repeatable_option(const std::string& name, const std::string& value_name,
                                    const std::string& help) {
  add(name, po::value<std::vector<std::string>>()->composing()->value_name(value_name), help);
}

void CommandLine::example(const std::string& command) {
  examples_.push_back(command);
}

bool CommandLine::parse(const std::vector<std::string>& arguments) {
  std::vector<std::string> own;
  for (const std::string& argument : arguments) {
    if (is_for_ros(argument)) continue;
    if (argument == "--help" || argument == "-h") {
      std::cout << help();
      return false;
    }
    if (looks_like_short_option(argument)) misuse("unknown option " + argument);
    own.push_back(argument);
  }

  po::options_description all;
  all.add(options_);
  po::positional_options_description order;
  for (const Positional& positional : positionals_) {
    all.add_options()(positional.name.c_str(), po::value<std::string>());
    order.add(positional.name.c_str(), 1);
  }
  try {
    po::store(po::command_line_parser(own).options(all).positional(order).style(kStyle).run(),
              values_);
    po::notify(values_);
  } catch (const po::too_many_positional_options_error&) {
    misuse("too many arguments");
  } catch (const po::error& error) {
    misuse(error.what());
  }
  for (const Positional& positional : positionals_) {
    if (positional.required && !has(positional.name)) misuse("missing " + positional.name);
  }
  require_separate(files_of(written_), files_of(read_));
  return true;
}

/// The files that the options and positional arguments of these names stand for.
std::vector<FileOfRun> CommandLine::files_of(const std::vector<std::string>& names) const {
  std::vector<FileOfRun> files;
  for (const std::string& name : names) {
    if (!has(name)) continue;
    const bool is_positional =
        std::any_of(positionals_.begin(), positionals_.end(),
                    [&](const Positional& positional) { return positional.name == name; });
    const auto* several = boost::any_cast<std::vector<std::string>>(&values_[name].value());
    for (const std::string& path : several != nullptr ? *several : std::vector{text(name)}) {
      files.push_back({path, (is_positional ? "" : "--") + name + " " + path});
    }
  }
  return files;
}

bool CommandLine::has(const std::string& name) const {
  return values_.count(name) > 0;
}

std::string CommandLine::topic(const std::string& name) const {
  const std::string topic = text(name);
  return topic.empty() || topic.front() == '/' ? topic : "/" + topic;
}

std::string CommandLine::usage() const {
  std::string text = tool_;
  for (const Positional& positional : positionals_) {
    text += positional.required ? " " + positional.name : " [" + positional.name + "]";
  }
  return text + " [options]";
}

std::string CommandLine::help() const {
  std::ostringstream text;
  text << "Usage: rosrun pf_resampling " << usage() << "\n\n" << summary_ << "\n";
  if (!positionals_.empty()) {
    std::size_t width = 0;
    for (const Positional& positional : positionals_) {
      width = std::max(width, positional.name.size());
    }
    text << "\nArguments:\n";
    for (const Positional& positional : positionals_) {
      text << "  " << positional.name << std::string(width - positional.name.size() + 2, ' ')
           << positional.help << "\n";
    }
  }
  text << "\n" << options_;
  if (!examples_.empty()) {
    text << "\nExamples:\n";
    for (const std::string& example : examples_) {
      text << "  rosrun pf_resampling " << example << "\n";
    }
  }
  return text.str();
}

void CommandLine::misuse(const std::string& what) const {
  throw UsageError(one_line(what) + "; usage: " + usage() + " (--help says more)");
}

int run_tool(const std::string& tool, int argc, char** argv,
             const std::function<int(const std::vector<std::string>&)>& body) {
  reserve_standard_streams();
  limit_memory();
  try {
    const int code = body(std::vector<std::string>(argv + 1, argv + argc));
    flush_standard_output();
    return code;
  } catch (const UsageError& error) {
    std::fprintf(stderr, "%s: %s\n", tool.c_str(), one_line(error.what()).c_str());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", tool.c_str(), one_line(error.what()).c_str());
    return 1;
  }
}

}  // namespace pf_resampling
