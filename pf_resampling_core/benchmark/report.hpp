#pragma once

#include <functional>
#include <string>

namespace pf_resampling {

/// One measurement of a table: `row` done by `contender` for `particles`. `run` does it once.
/// Contender "ours" is what all others of the row are compared with. The processor's time is taken,
/// which other programs on the machine disturb least; `with_threads` takes the wall's, too.
/// `prepare` is called before each repetition and not measured.
void measure(const std::string& section, const std::string& row, const std::string& contender,
             int particles, const std::function<void()>& run, bool with_threads = false,
             const std::function<void()>& prepare = {});

/// What the numbers of a table are.
struct TableUnit {
  std::string text = "ns of processor time per particle";
  bool per_particle = true;  ///< times are divided by `particles` of measure()
  double nanoseconds = 1.0;  ///< of one unit
  /// Beside our times, in square brackets, how many times that of the first size they are.
  bool with_growth = false;
};

/// Runs all measurements and prints a table of times, with the ratio to ours, and where it ran.
/// Takes Google Benchmark's options. Returns the exit code for main.
int run_and_report(int argc, char** argv, const std::string& title, const TableUnit& unit = {});

}  // namespace pf_resampling
