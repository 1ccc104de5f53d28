#include "rviz_panel/filter_health.hpp"

#include <algorithm>

#include "pf_resampling_core/health/health.hpp"

namespace pf_resampling {
namespace {

constexpr double kMinute = 60.0;          // s
constexpr std::size_t kMostFindings = 3;  // lines of them

double share(double part, double whole) {
  return whole > 0.0 ? part / whole : 0.0;
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds >= 9.95) return number_text(seconds, 0) + " s";
  if (seconds >= 0.9995) return number_text(seconds, 1) + " s";
  if (seconds >= 0.00995) return number_text(1e3 * seconds, 0) + " ms";
  return number_text(1e3 * seconds, seconds >= 0.000995 ? 1 : 2) + " ms";
}

std::string percent_text(double share) {
  return number_text(100.0 * share, share < 0.00995 ? 1 : 0) + " %";
}

void FilterHealth::add(const FilterStatus& status) {
  const double now = status.header.stamp.toSec();
  if (latest_ && now < latest_->header.stamp.toSec() - 1.0) clear();
  timing_.add(status.update_time, status.header.stamp);
  latest_ = status;
  sample_sizes_.push_back(
      {now, share(status.effective_sample_size, status.particles), status.renewed != 0});
  while (sample_sizes_.front().time < now - kMinute) sample_sizes_.pop_front();
}

void FilterHealth::clear() {
  *this = FilterHealth();
}

FilterHealth::Verdict FilterHealth::verdict() const {
  if (!latest_) return {Level::unknown, "No status yet"};
  const std::string& text = latest_->health_text;
  if (latest_->health == to_string(Health::healthy)) return {Level::good, text};
  if (latest_->health == to_string(Health::lost)) return {Level::bad, text};
  if (latest_->health == to_string(Health::starting)) return {Level::unknown, text};
  return {Level::warning, text};
}

std::string FilterHealth::findings_text() const {
  if (!latest_) return "";
  std::string text;
  const auto& findings = latest_->findings;
  const std::size_t shown = std::min(kMostFindings, findings.size());
  for (std::size_t i = 0; i < shown; ++i) {
    text += (i > 0 ? "\n" : "") + findings[findings.size() - 1 - i].text;
  }
  const std::size_t more = findings.size() - shown;
  return text + (more > 0 ? "\nand " + std::to_string(more) + " more" : "");
}

std::string FilterHealth::sample_size_text() const {
  if (!latest_) return "";
  return percent_text(share(latest_->effective_sample_size, latest_->particles)) + " of " +
         std::to_string(latest_->particles);
}

std::string FilterHealth::counts_text() const {
  if (!latest_) return "";
  std::string counts = std::to_string(latest_->particles) + " particles";
  if (latest_->landmarks > 0) counts += ", " + std::to_string(latest_->landmarks) + " landmarks";
  counts += ", " + std::to_string(latest_->updates) + " updates, " +
            std::to_string(latest_->renewals) + " renewals";
  if (latest_->not_believed > 0) {
    counts += ", " + std::to_string(latest_->not_believed) + " observations not believed";
  }
  if (latest_->queued > 0) counts += ", " + std::to_string(latest_->queued) + " waiting";
  counts += "\nAncestors: " + std::to_string(latest_->distinct_ancestors_of_renewal) +
            " at the last renewal, " + std::to_string(latest_->distinct_ancestors_since_start) +
            " since the start; lost: " + percent_text(latest_->lost) +
            "; update: " + duration_text(timing_.update_time());
  if (timing_.observation_period() > 0.0) {
    counts += " of " + duration_text(timing_.observation_period());
  }
  return counts;
}

std::vector<std::string> FilterHealth::rejects() const {
  std::vector<std::string> lines;
  if (!latest_) return lines;
  auto rejects = latest_->rejects;
  std::stable_sort(rejects.begin(), rejects.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
  for (const RejectCount& reject : rejects) {
    if (reject.count == 0) break;
    std::string reason = reject.reason;
    std::replace(reason.begin(), reason.end(), '_', ' ');
    lines.push_back(reject.input + ": " + reason + " " + std::to_string(reject.count));
  }
  return lines;
}

}  // namespace pf_resampling
