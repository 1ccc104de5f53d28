#pragma once

#include <boost/program_options.hpp>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {

/// Misuse of a command line; the programs print it and exit with 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The command line of one program: positional arguments, options, and a help text with usage and
/// examples.
///
///     CommandLine line("run_bag", "Runs a filter over a bag.");
///     line.positional("in.bag", "a bag with odometry");
///     line.topic("odom", "/odom", "odometry");
///     line.example("run_bag slam.bag");
///     if (!line.parse(arguments)) return 0;  // help was asked for and has been printed
///     open_bag(line.text("in.bag"));
class CommandLine {
 public:
  /// `tool`: the name to be typed, for instance "dataset_to_bag plaza"; `summary`: what it does.
  CommandLine(std::string tool, std::string summary);

  /// Adds a positional argument; they are taken in the order of these calls, the `required` first.
  void positional(const std::string& name, const std::string& help, bool required = true);

  /// Adds an option --name VALUE, without a default.
  template <typename T>
  void option(const std::string& name, const std::string& value_name, const std::string& help) {
    add(name, boost::program_options::value<T>()->value_name(value_name), help);
  }

  /// Likewise, with one.
  template <typename T>
  void option(const std::string& name, const std::string& value_name, const T& default_value,
              const std::string& help) {
    std::ostringstream text;  // 0.4, not 0.40000000000000002
    text << default_value;
    add(name,
        boost::program_options::value<T>()
            ->default_value(default_value, text.str())
            ->value_name(value_name),
        help);
  }

  /// Adds an option --name FORMAT of text that may be given without its value, which is then
  /// `implicit`.
  void option_with_implicit(const std::string& name, const std::string& value_name,
                            const std::string& implicit, const std::string& help);

  /// Adds an option that names a topic.
  void topic(const std::string& name, const std::string& default_topic, const std::string& help);

  /// Adds an option without a value: get<bool>() says whether it was given.
  void flag(const std::string& name, const std::string& help);

  /// Adds an option that may be given several times; its value is a std::vector<std::string>.
  void repeatable_option(const std::string& name, const std::string& value_name,
                         const std::string& help);

  /// Says that the values of an option or positional argument name files that are read, or written:
  /// parse() throws Error when one that is written is also read, is written twice, or is no regular
  /// file (require_separate()).
  void reads(const std::string& name) { read_.push_back(name); }
  void writes(const std::string& name) { written_.push_back(name); }

  /// Adds a line to the examples of the help text.
  void example(const std::string& command);

  /// Reads the arguments (without the program's name). Returns false if --help was among them; the
  /// help text is then on stdout. Arguments for ROS ("__name:=...") are passed over.
  /// Throws UsageError with one line.
  bool parse(const std::vector<std::string>& arguments);

  /// Whether the option or positional argument was given or has a default.
  bool has(const std::string& name) const;

  /// The value of an option or positional argument; positional ones are std::string.
  template <typename T>
  T get(const std::string& name) const {
    const T* value = boost::any_cast<T>(&values_[name].value());
    if (value == nullptr) throw Error("--" + name + " was asked for as another type than it is");
    return *value;
  }

  /// get<std::string>(name).
  std::string text(const std::string& name) const { return get<std::string>(name); }

  /// The topic that an option names, absolute as names in bags are: "odom" is "/odom".
  std::string topic(const std::string& name) const;

  /// The files that are to be written.
  std::vector<FileOfRun> written() const { return files_of(written_); }

  /// The help text: usage, summary, arguments, options, examples.
  std::string help() const;

 private:
  struct Positional {
    std::string name;
    std::string help;
    bool required;
  };

  void add(const std::string& name, const boost::program_options::value_semantic* value,
           const std::string& help);
  std::string usage() const;
  std::vector<FileOfRun> files_of(const std::vector<std::string>& names) const;
  [[noreturn]] void misuse(const std::string& what) const;

  std::string tool_;
  std::string summary_;
  std::vector<Positional> positionals_;
  std::vector<std::string> examples_;
  std::vector<std::string> read_, written_;  // names of what names files
  boost::program_options::options_description options_;
  boost::program_options::variables_map values_;
};

/// The body of every main: runs `body` on the arguments (without the program's name) and returns
/// the exit code: what `body` returns, 2 for misuse of the command line, 1 for every other error,
/// also when standard output could not be written; the error is one line "<tool>: <message>" on
/// stderr.
int run_tool(const std::string& tool, int argc, char** argv,
             const std::function<int(const std::vector<std::string>&)>& body);

}  // namespace pf_resampling
