#include "tools/common/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace pf_resampling {

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(std::max<std::uint64_t>(total, 1)),
      is_terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (drawn_percent_ >= 0) std::fprintf(stderr, "\r\033[K");
}

void ProgressBar::update(std::uint64_t done) {
  const double share = static_cast<double>(std::min(done, total_)) / static_cast<double>(total_);
  const int percent = static_cast<int>(100.0 * share);
  if (!is_terminal_ || percent == drawn_percent_) return;
  drawn_percent_ = percent;
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
  std::fprintf(stderr, "\r%s: %d %%", label_.c_str(), percent);
  // Before, it is not known how fast it goes.
  if (passed.count() > 1.0 && percent > 0) {
    std::fprintf(stderr, ", %.0f s left", passed.count() * (1.0 - share) / share);
  }
  std::fprintf(stderr, "\033[K");
}

}  // namespace pf_resampling
