#include "tools/common/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace pf_resampling {

namespace {

constexpr int kWidth = 40;
constexpr double kUntilItIsKnown = 1.0;  // s, how fast it goes
// s, from one line of a log to the next.
constexpr double kBetweenLines = 30.0;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)), total_(std::max<std::uint64_t>(total, 1)) {
  is_terminal_ = isatty(STDERR_FILENO) != 0;
}

ProgressBar::~ProgressBar() {
  finish();
}

void ProgressBar::update(std::uint64_t done) {
  const double share = static_cast<double>(std::min(done, total_)) / static_cast<double>(total_);
  const int percent = static_cast<int>(100.0 * share);
  if (percent == drawn_percent_) return;
  drawn_percent_ = percent;
  const double passed = seconds_since(start_);
  const std::string left =
      passed > kUntilItIsKnown && share > 0.0
          ? std::to_string(static_cast<int>(std::lround(passed * (1.0 - share) / share))) +
                " s left"
          : "";
  if (!is_terminal_) {
    if (passed < next_line_) return;
    next_line_ = passed + kBetweenLines;
    std::fprintf(stderr, "%s: %d %% done, %s\n", label_.c_str(), percent, left.c_str());
    return;
  }
  const int filled = static_cast<int>(kWidth * share);
  std::fprintf(stderr, "\r%s [%s%s] %3d %% %s\033[K", label_.c_str(),
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(kWidth - filled), ' ').c_str(), percent,
               left.c_str());
  std::fflush(stderr);
}

void ProgressBar::finish() {
  if (is_terminal_ && drawn_percent_ >= 0) std::fprintf(stderr, "\r\033[K");
  is_terminal_ = false;
  next_line_ = std::numeric_limits<double>::infinity();
}

}  // namespace pf_resampling
