#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/datasets/recording.hpp"

namespace pf_resampling {

/// A format that dataset_to_bag reads: `dataset_to_bag NAME INPUT out.bag [options]`.
struct DatasetFormat {
  std::string name;
  std::string line;                   ///< for the list of formats
  std::string help;                   ///< what a bag is made of
  std::string input;                  ///< "DIRECTORY" or "FILE.mat"
  std::vector<std::string> examples;  ///< command lines after `rosrun pf_resampling`
  std::function<void(CommandLine* line)> add_options;  ///< may be empty
  /// Reads the input with the options of the command line. Throws Error that names the file.
  std::function<Recording(const std::string& input, const CommandLine& line)> read;
};

/// The value of --range-unit. Throws UsageError unless it is "m" or "ft".
inline double metres_per(const std::string& unit) {
  if (unit == "m") return 1.0;
  if (unit == "ft") return kMetresPerFoot;
  throw UsageError("--range-unit " + unit + ": known are m and ft");
}

}  // namespace pf_resampling
