#include "rviz_panel/filter_health.hpp"

#include <algorithm>
#include <cstdio>

#include "pf_resampling_core/health/health.hpp"

namespace pf_resampling {
namespace {

constexpr double kMinute = 60.0;          // s
constexpr std::size_t kMostFindings = 3;  // lines of them
constexpr double kRejectSpacing = 5.0;    // s between remembered counts of rejects

double share(double part, double whole) {
  return whole > 0.0 ? part / whole : 0.0;
}

std::string number(double value, int decimals) {
  char buffer[60];
  std::snprintf(buffer, sizeof(buffer), "%.*f", decimals, value);
  return buffer;
}

std::string key_of(const RejectCount& reject) {
  return reject.input + " " + reject.reason;
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds >= 9.95) return number(seconds, 0) + " s";
  if (seconds >= 0.9995) return number(seconds, 1) + " s";
  if (seconds >= 0.00995) return number(1e3 * seconds, 0) + " ms";
  return number(1e3 * seconds, seconds >= 0.000995 ? 1 : 2) + " ms";
}

std::string percent_text(double share) {
  return number(100.0 * share, share < 0.00995 ? 1 : 0) + " %";
}

std::string reject_text(const FilterHealth::Reject& reject) {
  std::string reason = reject.reason;
  std::replace(reason.begin(), reason.end(), '_', ' ');
  return reject.input + ": " + reason + " " + std::to_string(reject.count) +
         (reject.recent > 0 ? " (" + std::to_string(reject.recent) + ")" : "");
}

void FilterHealth::add(const FilterStatus& status) {
  const double now = status.header.stamp.toSec();
  if (latest_ && now < latest_->header.stamp.toSec() - 1.0) clear();
  timing_.add(status.update_time, status.header.stamp);
  latest_ = status;
  sample_sizes_.push_back(
      {now, share(status.effective_sample_size, status.particles), status.renewed != 0});
  while (sample_sizes_.front().time < now - kMinute) sample_sizes_.pop_front();

  while (rejects_before_.size() > 1 && rejects_before_[1].first < now - kMinute) {
    rejects_before_.erase(rejects_before_.begin());
  }
  if (rejects_before_.empty() || now - rejects_before_.back().first > kRejectSpacing) {
    std::map<std::string, std::uint64_t> counts;
    for (const RejectCount& reject : status.rejects) counts[key_of(reject)] = reject.count;
    rejects_before_.emplace_back(now, counts);
  }
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

std::vector<FilterHealth::Reject> FilterHealth::rejects() const {
  std::vector<Reject> rejects;
  if (!latest_) return rejects;
  for (const RejectCount& reject : latest_->rejects) {
    if (reject.count == 0) continue;
    const auto& before = rejects_before_.front().second;
    const auto known = before.find(key_of(reject));
    const std::uint64_t earlier = known == before.end() ? 0 : known->second;
    // Counts start again with the node.
    const std::uint64_t recent = reject.count >= earlier ? reject.count - earlier : reject.count;
    rejects.push_back({reject.input, reject.reason, reject.count, recent});
  }
  std::stable_sort(rejects.begin(), rejects.end(), [](const Reject& a, const Reject& b) {
    return a.recent != b.recent ? a.recent > b.recent : a.count > b.count;
  });
  return rejects;
}

}  // namespace pf_resampling
