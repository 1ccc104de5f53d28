#include "rviz_panel/filter_health.hpp"

#include <gtest/gtest.h>

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

TEST(FilterHealth, SaysWhatIsWrong) {
  FilterHealth health;
  EXPECT_EQ(health.verdict().level, Level::unknown);
  health.add(status_at(1.0));
  EXPECT_EQ(health.verdict().level, Level::good);
  EXPECT_EQ(health.sample_size_text(), "70 % of 1000");
  EXPECT_EQ(health.ancestors_text(), "480 of 1000, 12 since the start");

  FilterHealth degenerate;
  FilterStatus status = status_at(1.0);
  status.effective_sample_size = 4.0;
  degenerate.add(status);
  EXPECT_EQ(degenerate.verdict().level, Level::warning);
  EXPECT_EQ(degenerate.verdict().text, "Degenerate: 0.4 % carry the weight");

  FilterHealth depleted;
  status = status_at(1.0);
  status.distinct_ancestors_of_renewal = 30;
  depleted.add(status);
  EXPECT_EQ(depleted.verdict().text, "Depleted: 3 % have descendants");

  FilterHealth lost;
  status.lost = 0.97;  // is worse than that
  lost.add(status);
  EXPECT_EQ(lost.verdict().level, Level::bad);
  EXPECT_EQ(lost.verdict().text, "Lost: probability 0.97");
}

TEST(FilterHealth, OneBadUpdateIsNoDepletion) {
  FilterHealth health;
  for (int i = 0; i < 40; ++i) health.add(status_at(0.25 * i));
  FilterStatus bad = status_at(10.0);
  bad.distinct_ancestors_of_renewal = 1;
  bad.effective_sample_size = 1.0;
  health.add(bad);
  EXPECT_EQ(health.verdict().level, Level::good);
}

// Sooner or later few of them have descendants, in a filter that is well, too.
TEST(FilterHealth, FewParticlesOfTheStartAreNoDepletion) {
  FilterHealth health;
  FilterStatus status = status_at(1.0);
  status.distinct_ancestors_since_start = 2;
  health.add(status);
  EXPECT_EQ(health.verdict().level, Level::good);
  EXPECT_EQ(health.ancestors_text(), "480 of 1000, 2 since the start");
}

TEST(FilterHealth, UpdateTimeBesideTheTimeBetweenObservations) {
  FilterHealth health;
  for (int i = 0; i < 400; ++i) health.add(status_at(0.25 * i));
  EXPECT_EQ(health.load_text(), "2.0 ms of 250 ms");
  EXPECT_NEAR(*health.load().latest(), 0.008, 1e-6);
  EXPECT_EQ(health.verdict().level, Level::good);
  for (int i = 400; i < 800; ++i) {
    FilterStatus slow = status_at(0.25 * i);
    slow.update_time = 0.5;
    health.add(slow);
  }
  EXPECT_EQ(health.verdict().text,
            "Too slow: updates take longer than the time between observations");
}

TEST(FilterHealth, RejectsByReasonThoseOfTheLastMinuteFirst) {
  FilterHealth health;
  for (int second = 0; second <= 200; ++second) {
    FilterStatus status = status_at(second);
    status.rejects = {reject("ranges", "unknown_beacon", 40),  // all before
                      reject("odom", "not_finite", 0),
                      reject("ranges", "gated", static_cast<std::uint64_t>(second > 190 ? 7 : 0))};
    health.add(status);
  }
  const auto rejects = health.rejects();
  ASSERT_EQ(rejects.size(), 2u);
  EXPECT_EQ(reject_text(rejects[0]), "ranges: gated 7 (7)");
  EXPECT_EQ(reject_text(rejects[1]), "ranges: unknown beacon 40");
}

TEST(FilterHealth, ABagThatIsPlayedAgainStartsAnew) {
  FilterHealth health;
  FilterStatus status = status_at(100.0);
  status.effective_sample_size = 1.0;
  health.add(status);
  health.add(status_at(2.0));
  EXPECT_EQ(health.sample_size().columns().size(), 1u);
  EXPECT_EQ(health.verdict().level, Level::good);
}

TEST(FilterHealth, AFilterWithoutParticlesIsNotDividedBy) {
  FilterHealth health;
  FilterStatus nothing;
  nothing.header.stamp = ros::Time(1.0);
  health.add(nothing);
  EXPECT_EQ(*health.sample_size().latest(), 0.0);
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
