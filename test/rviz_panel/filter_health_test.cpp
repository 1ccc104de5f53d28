#include "rviz_panel/filter_health.hpp"

#include <gtest/gtest.h>

#include <map>

#include "pf_resampling_core/health/health.hpp"

namespace pf_resampling {
namespace {

FilterStatus status_at(double stamp) {
  FilterStatus status;
  status.header.stamp = ros::Time(stamp);
  status.particles = 1000;
  status.effective_sample_size = 700.0;
  status.distinct_ancestors_of_renewal = 480;
  status.distinct_ancestors_since_start = 12;
  status.update_time = 0.002;
  status.lost = 0.01;
  status.health = "healthy";
  status.health_text = "Healthy";
  return status;
}

RejectCount reject(const char* input, const char* reason, std::uint64_t count) {
  RejectCount reject;
  reject.input = input;
  reject.reason = reason;
  reject.count = count;
  return reject;
}

using Level = FilterHealth::Level;

TEST(FilterHealth, TheLatestFindingsComeFirst) {
  FilterHealth health;
  EXPECT_EQ(health.findings_text(), "");
  FilterStatus status = status_at(1.0);
  for (int i = 0; i < 5; ++i) {
    status.findings.emplace_back();
    status.findings.back().text = "landmark " + std::to_string(i) + " is gone";
  }
  health.add(status);
  EXPECT_EQ(health.findings_text(),
            "landmark 4 is gone\nlandmark 3 is gone\nlandmark 2 is gone\nand 2 more");
}

// The node judges, the panel shows it: whatever the other numbers are.
TEST(FilterHealth, SaysWhatTheNodeSays) {
  FilterHealth health;
  EXPECT_EQ(health.verdict().level, Level::unknown);
  FilterStatus status = status_at(1.0);
  health.add(status);
  EXPECT_EQ(health.verdict().level, Level::good);
  EXPECT_EQ(health.verdict().text, "Healthy");
  EXPECT_EQ(health.sample_size_text(), "70 % of 1000");
  EXPECT_EQ(
      health.counts_text(),
      "1000 particles, 0 updates, 0 renewals\nAncestors: 480 at the last renewal, 12 since the "
      "start; lost: 1 %; update: 0.20 ms");
  const std::map<Health, Level> levels = {
      {Health::starting, Level::unknown},   {Health::lost, Level::bad},
      {Health::converging, Level::warning}, {Health::doubtful, Level::warning},
      {Health::degenerate, Level::warning}, {Health::depleted, Level::warning},
      {Health::too_slow, Level::warning},   {Health::healthy, Level::good}};
  for (const Health said : all_values<Health>()) {
    status.health = to_string(said);
    status.health_text = "A sentence about " + to_string(said) + ".";
    health.add(status);
    EXPECT_EQ(health.verdict().level, levels.at(said)) << to_string(said);
    EXPECT_EQ(health.verdict().text, status.health_text);
  }
}

TEST(FilterHealth, UpdateTimeBesideTheTimeBetweenObservations) {
  FilterHealth health;
  for (int i = 0; i < 400; ++i) health.add(status_at(0.25 * i));
  const auto ends_with = [&](const std::string& words) {
    const std::string text = health.counts_text();
    return text.size() > words.size() && text.substr(text.size() - words.size()) == words;
  };
  EXPECT_TRUE(ends_with("update: 2.0 ms of 250 ms")) << health.counts_text();
  for (int i = 400; i < 800; ++i) {
    FilterStatus slow = status_at(0.25 * i);
    slow.update_time = 0.5;
    health.add(slow);
  }
  EXPECT_TRUE(ends_with("update: 500 ms of 250 ms")) << health.counts_text();
}

TEST(FilterHealth, TheMostFrequentRejectsComeFirst) {
  FilterHealth health;
  FilterStatus status = status_at(1.0);
  status.rejects = {reject("ranges", "empty", 7), reject("odom", "not_finite", 0),
                    reject("ranges", "unknown_beacon", 40)};
  health.add(status);
  EXPECT_EQ(health.rejects(),
            (std::vector<std::string>{"ranges: unknown beacon 40", "ranges: empty 7"}));
}

TEST(FilterHealth, ABagThatIsPlayedAgainStartsAnew) {
  FilterHealth health;
  FilterStatus status = status_at(100.0);
  status.effective_sample_size = 1.0;
  health.add(status);
  health.add(status_at(2.0));
  EXPECT_EQ(health.sample_sizes().size(), 1u);
}

TEST(FilterHealth, TheCurveIsThatOfTheLastMinute) {
  FilterHealth health;
  for (int second = 0; second < 200; ++second) health.add(status_at(second));
  EXPECT_EQ(health.sample_sizes().front().time, 139.0);
}

TEST(FilterHealth, AFilterWithoutParticlesIsNotDividedBy) {
  FilterHealth health;
  FilterStatus nothing;
  nothing.header.stamp = ros::Time(1.0);
  health.add(nothing);
  EXPECT_EQ(health.sample_sizes().back().share, 0.0);
}

TEST(FilterHealth, TextsAreShort) {
  EXPECT_EQ(duration_text(0.00025), "0.25 ms");
  EXPECT_EQ(duration_text(0.012), "12 ms");
  EXPECT_EQ(duration_text(1.5), "1.5 s");
  EXPECT_EQ(duration_text(12.0), "12 s");
  EXPECT_EQ(percent_text(0.62), "62 %");
  EXPECT_EQ(percent_text(0.004), "0.4 %");
}

}  // namespace
}  // namespace pf_resampling
