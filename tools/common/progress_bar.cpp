#include "tools/common/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace pf_resampling {

namespace {

constexpr int kWidth = 40;
constexpr double kUntilItIsKnown = 1.0;  // s, how fast it goes

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)), total_(std::max<std::uint64_t>(total, 1)) {
  active_ = isatty(STDERR_FILENO) != 0;
}

ProgressBar::~ProgressBar() {
  finish();
}

void ProgressBar::update(std::uint64_t done) {
  if (!active_) return;
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
  const int filled = static_cast<int>(kWidth * share);
  std::fprintf(stderr, "\r%s [%s%s] %3d %% %s\033[K", label_.c_str(),
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(kWidth - filled), ' ').c_str(), percent,
               left.c_str());
  std::fflush(stderr);
}

void ProgressBar::finish() {
  if (active_ && drawn_percent_ >= 0) std::fprintf(stderr, "\r\033[K");
  active_ = false;
}

}  // namespace pf_resampling
