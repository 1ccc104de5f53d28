// Redraws in a thread beside the filter. The tests decide when the thread goes on, so that what
// they see does not depend on time.
#include "pf_resampling_core/filters/fastslam/background_redraw.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/filters/fastslam/circle_drive.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

using namespace circle_drive;

constexpr int kEvery = 10;

FastSlamOptions redraw_options(DataAssociation method) {
  FastSlamOptions options = some_options(method);
  options.strategy.renewal = Renewal::redraw;
  options.strategy.redraw.every_n = kEvery;
  options.strategy.redraw.closure_absence = 0;
  return options;
}

// A redraw asks for the time when it begins and when it ends: it waits there.
class Gate {
 public:
  std::function<double()> stopwatch() {
    return [this] {
      std::unique_lock<std::mutex> lock(mutex_);
      opened_.wait(lock, [this] { return is_open_; });
      return static_cast<double>(++calls_);
    };
  }
  void open() {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = true;
    opened_.notify_all();
  }
  void close() {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable opened_;
  bool is_open_ = false;
  int calls_ = 0;
};

// A filter that does not wait for its redraws.
struct Live {
  Live(const FastSlamOptions& options, std::uint64_t seed) : filter(options, seed) {
    filter.set_deferred_redraws(true);
  }
  ~Live() { gate.open(); }
  void update(const Step& step) { redraws.update(&filter, step.odometry, step.observations); }
  void run(const std::vector<Step>& steps, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) update(steps[t]);
  }

  FastSlam filter;
  Gate gate;
  TakeOvers take_overs;
  BackgroundRedraw redraws{gate.stopwatch(), &take_overs};
};

// All that a filter says, but for what it holds.
std::vector<double> all_of(FastSlam* filter) {
  const FastSlamStatus& status = filter->status();
  std::vector<double> all = {static_cast<double>(status.particles),
                             static_cast<double>(status.landmarks),
                             status.effective_sample_size,
                             status.entropy_sample_size,
                             static_cast<double>(status.distinct_ancestors_of_renewal),
                             static_cast<double>(status.distinct_ancestors_since_start),
                             static_cast<double>(status.renewed),
                             static_cast<double>(status.updates),
                             static_cast<double>(status.renewals),
                             static_cast<double>(status.redraws),
                             static_cast<double>(status.redraws_refused),
                             static_cast<double>(status.weight_resets),
                             static_cast<double>(status.injected),
                             static_cast<double>(status.gated),
                             status.log_likelihood};
  for (const ObservationOutcome& outcome : filter->outcomes()) {
    all.insert(all.end(), {static_cast<double>(outcome.landmark),
                           static_cast<double>(outcome.is_new), outcome.accepted});
  }
  for (const Pose2& pose : filter->path()) all.insert(all.end(), {pose.x, pose.y, pose.heading});
  return all;
}

// Whatever number of updates came while it drew, a filter is afterwards what it would be if it had
// waited: numbers, counts and path, to the bit. With resampling after most updates.
TEST(BackgroundRedraw, IsAfterwardsAsIfItHadWaited) {
  for (const bool with_ids : {true, false}) {
    for (const std::size_t meanwhile : {0u, 1u, 7u}) {
      FastSlamOptions options = redraw_options(DataAssociation::automatic);
      options.strategy.threshold = 0.95;
      const std::vector<Step> steps = drive(55, with_ids, 3);
      FastSlam waiting(options, 7);
      Live live(options, 7);
      const std::size_t taken = kEvery + meanwhile;
      live.run(steps, 0, taken);
      run(&waiting, steps, 0, taken);
      EXPECT_NE(numbers_of(&live.filter), numbers_of(&waiting));
      EXPECT_EQ(live.filter.status().redraws, 0);
      EXPECT_EQ(live.filter.status().updates, static_cast<std::int64_t>(taken));
      live.gate.open();
      live.redraws.wait();
      EXPECT_TRUE(live.redraws.take_over(&live.filter));
      EXPECT_EQ(live.redraws.status().last_replayed, static_cast<int>(meanwhile));
      EXPECT_EQ(live.redraws.status().last_duration, 1.0);  // the gate's clock
      EXPECT_EQ(numbers_of(&live.filter), numbers_of(&waiting));
      EXPECT_EQ(all_of(&live.filter), all_of(&waiting));
      for (std::size_t t = taken; t < steps.size(); ++t) {
        live.update(steps[t]);
        live.redraws.wait();
        waiting.update(steps[t].odometry, steps[t].observations);
      }
      live.redraws.take_over(&live.filter);
      EXPECT_EQ(waiting.status().redraws, 5);
      EXPECT_EQ(numbers_of(&live.filter), numbers_of(&waiting));
      EXPECT_EQ(all_of(&live.filter), all_of(&waiting));
      EXPECT_EQ(live.redraws.status().taken_over, 5);
      EXPECT_EQ(live.redraws.status().given_up, 0);
    }
  }
}

// A run that is replayed takes over when the live one did: neither earlier nor later.
TEST(BackgroundRedraw, IsTakenOverWhenItWasLive) {
  const FastSlamOptions options = redraw_options(DataAssociation::automatic);
  const std::vector<Step> steps = drive(2 * kEvery - 1, true, 3);
  FastSlam waiting(options, 7);
  run(&waiting, steps, 0, steps.size());
  for (const std::size_t taken : {kEvery + 0u, kEvery + 3u}) {
    Live replay(options, 7);
    replay.gate.open();
    replay.take_overs.wanted = 0;
    replay.run(steps, 0, taken);
    replay.redraws.wait();
    EXPECT_FALSE(replay.redraws.take_over(&replay.filter));
    replay.take_overs.wanted = 1;
    replay.run(steps, taken, steps.size());
    EXPECT_EQ(replay.redraws.status().last_replayed, static_cast<int>(taken) - kEvery);
    EXPECT_EQ(numbers_of(&replay.filter), numbers_of(&waiting));
  }
}

// What was seen meanwhile counts for finding a robot that was carried away, too.
TEST(BackgroundRedraw, RemembersWhatWasSeenMeanwhile) {
  const FastSlamOptions options = redraw_options(DataAssociation::known);
  const std::vector<Step> steps = drive(120, true, 3);
  constexpr std::size_t kCarried = 5 * kEvery + 2;  // a quarter of a round further on
  Live live(options, 7);
  live.gate.open();
  std::optional<PoseEstimate> found;
  for (std::size_t t = 0; t < kCarried + 6; ++t) {
    Step step = steps[t];
    if (t >= kCarried) step.observations = steps[t + 10].observations;
    if (t == 5 * kEvery - 1) live.gate.close();  // the fifth redraw is due now
    live.update(step);
    if (t < 5 * kEvery - 1) live.redraws.wait();
    const bool is_last = t + 1 == kCarried + 6;
    if (is_last) {
      live.gate.open();
      live.redraws.wait();
      ASSERT_TRUE(live.redraws.take_over(&live.filter));
    }
    const auto stamp = static_cast<std::int64_t>(t) * 500000000;
    found = live.redraws.recover(&live.filter, step.observations, {}, stamp, is_last ? 1.0 : 0.0);
  }
  EXPECT_EQ(live.redraws.status().last_replayed, 8);
  ASSERT_TRUE(found);
  EXPECT_LT(distance(found->mean, steps[kCarried + 15].truth), 0.6);
}

// A filter that is changed by hand while a redraw runs, or after it has ended, is not given back
// what it was before.
TEST(BackgroundRedraw, DoesNotUndoWhatIsDoneMeanwhile) {
  const std::vector<Step> steps = drive(40, true, 3);
  const FastSlamOptions options = redraw_options(DataAssociation::known);
  FastSlam other(options, 9);
  run(&other, steps, 0, 5);
  const SavedMap map = saved_map(&other, 40);
  const PoseEstimate there = {steps[12].truth, 0.01 * Eigen::Matrix3d::Identity()};
  const std::vector<std::function<void(FastSlam*)>> changes = {
      [](FastSlam* filter) { filter->reset(); },
      [&](FastSlam* filter) { filter->load(map); },
      [&](FastSlam* filter) { filter->set_poses(there); },
      [&](FastSlam* filter) { filter->set_options(options); },
  };
  for (std::size_t change = 0; change < changes.size(); ++change) {
    for (const bool has_ended : {false, true}) {
      SCOPED_TRACE(std::to_string(change) + (has_ended ? ", ended" : ", running"));
      FastSlam without(options, 7);  // its redraws never come
      without.set_deferred_redraws(true);
      Live live(options, 7);
      run(&without, steps, 0, kEvery + 2);
      live.run(steps, 0, kEvery + 2);
      if (has_ended) {
        live.gate.open();
        live.redraws.wait();
        live.gate.close();
      }
      changes[change](&without);
      changes[change](&live.filter);
      run(&without, steps, kEvery + 2, kEvery + 5);
      live.update(steps[kEvery + 2]);
      if (!has_ended) {
        live.gate.open();
        live.redraws.wait();
        live.gate.close();
      }
      live.run(steps, kEvery + 3, kEvery + 5);
      EXPECT_EQ(live.redraws.status().given_up, 1);
      EXPECT_EQ(live.redraws.status().taken_over, 0);
      EXPECT_EQ(live.filter.status().redraws, 0);
      without.put_off_redraw();  // as the other's is
      EXPECT_EQ(numbers_of(&live.filter), numbers_of(&without));
      EXPECT_EQ(all_of(&live.filter), all_of(&without));
    }
  }
}

// Equal where there is no number, too.
std::vector<std::uint64_t> bits_of(const std::vector<double>& numbers) {
  std::vector<std::uint64_t> bits(numbers.size());
  std::memcpy(bits.data(), numbers.data(), numbers.size() * sizeof(double));
  return bits;
}

// An odometry so far out that no cost is finite.
TEST(BackgroundRedraw, OneWithoutASolutionIsCountedAndLeavesTheFilter) {
  const FastSlamOptions options = redraw_options(DataAssociation::known);
  std::vector<Step> steps = drive(kEvery, true, 3);
  steps[kEvery - 1].odometry.mean.x = 1e153;
  FastSlam waiting(options, 7);
  Live live(options, 7);
  run(&waiting, steps, 0, steps.size());
  live.run(steps, 0, steps.size());
  const auto before = bits_of(numbers_of(&live.filter));
  live.gate.open();
  live.redraws.wait();
  live.redraws.take_over(&live.filter);
  EXPECT_EQ(waiting.status().redraws_refused, 1);
  EXPECT_EQ(bits_of(numbers_of(&live.filter)), before);
  EXPECT_EQ(bits_of(numbers_of(&live.filter)), bits_of(numbers_of(&waiting)));
  EXPECT_EQ(bits_of(all_of(&live.filter)), bits_of(all_of(&waiting)));
}

// What is thrown in the thread is a redraw refused, with its reason; the filter goes on.
TEST(BackgroundRedraw, OneThatThrowsIsCountedAndLeavesTheFilter) {
  FastSlamOptions options = redraw_options(DataAssociation::known);
  options.strategy.schedule = Schedule::always;
  FastSlamOptions failing = options;
  const auto caller = std::this_thread::get_id();
  failing.strategy.resampling.own_scheme = [caller](ConstArray, int size, const RandomStream&,
                                                    MutableIndices counts) {
    if (std::this_thread::get_id() != caller) throw std::runtime_error("not in this thread");
    counts.setZero();
    counts[0] = size;
  };
  const std::vector<Step> steps = drive(kEvery + 6, true, 3);
  Live live(failing, 7);
  live.run(steps, 0, kEvery + 3);
  live.gate.open();
  live.redraws.wait();
  const std::vector<double> before = numbers_of(&live.filter);
  EXPECT_FALSE(live.redraws.take_over(&live.filter));
  EXPECT_EQ(numbers_of(&live.filter), before);
  live.update(steps[kEvery + 3]);
  EXPECT_EQ(live.filter.status().redraws_refused, 1);
  EXPECT_EQ(live.filter.status().redraws, 0);
  EXPECT_EQ(live.filter.status().updates, kEvery + 4);
  EXPECT_EQ(live.redraws.status().last_fault, "not in this thread");
  EXPECT_EQ(live.redraws.status().given_up, 1);
  EXPECT_FALSE(live.redraws.is_running()) << "not tried again at once";
  live.run(steps, kEvery + 4, steps.size());
  EXPECT_EQ(live.filter.status().redraws_refused, 1);
}

TEST(BackgroundRedraw, OneThatFallsBehindIsGivenUp) {
  FastSlamOptions options = redraw_options(DataAssociation::known);
  options.particles = 2;
  const std::vector<Step> steps = drive(400, true, 3);
  Live live(options, 7);
  live.run(steps, 0, kEvery);
  for (int t = 0; t < BackgroundRedraw::kMostReplayed; ++t) {
    live.update(steps[static_cast<std::size_t>(t) % 400]);
  }
  EXPECT_TRUE(live.redraws.is_running());
  EXPECT_EQ(live.filter.status().redraws_refused, 0);
  live.update(steps[0]);
  EXPECT_FALSE(live.redraws.is_running());
  EXPECT_EQ(live.filter.status().redraws_refused, 1);
  EXPECT_EQ(live.redraws.status().given_up, 1);
  EXPECT_NE(live.redraws.status().last_fault.find("2000 updates"), std::string::npos);
  live.gate.open();
  live.redraws.wait();
  EXPECT_FALSE(live.redraws.take_over(&live.filter));
}

// Both at once, as time has it (also for a thread sanitizer): whatever it was, all adds up.
TEST(BackgroundRedraw, CountsAddUpWhateverTheTiming) {
  FastSlamOptions options = redraw_options(DataAssociation::known);
  options.strategy.redraw.every_n = 1;
  const std::vector<Step> steps = drive(400, true, 3);
  Live live(options, 7);
  live.gate.open();
  for (std::size_t t = 0; t < steps.size(); ++t) {
    live.update(steps[t]);
    live.redraws.recover(&live.filter, steps[t].observations, {},
                         static_cast<std::int64_t>(t) * 500000000, 0.0);
    EXPECT_EQ(live.filter.status().updates, static_cast<std::int64_t>(t) + 1);
    EXPECT_EQ(live.filter.path().size(), t + 1);
  }
  live.redraws.wait();
  live.redraws.take_over(&live.filter);
  EXPECT_GE(live.filter.status().redraws, 1);
  EXPECT_EQ(live.filter.status().redraws, live.redraws.status().taken_over);
  EXPECT_EQ(live.redraws.status().given_up, 0);
  EXPECT_LT(distance(live.filter.estimate().mean, steps.back().truth), 0.5);
}

// Updates that it was not told of are not lost, either.
TEST(BackgroundRedraw, IsNotTakenWithoutAllUpdates) {
  const std::vector<Step> steps = drive(40, true, 3);
  Live live(redraw_options(DataAssociation::known), 7);
  live.run(steps, 0, kEvery + 2);
  run(&live.filter, steps, kEvery + 2, kEvery + 3);
  const std::vector<double> before = numbers_of(&live.filter);
  live.gate.open();
  live.redraws.wait();
  EXPECT_FALSE(live.redraws.take_over(&live.filter));
  EXPECT_EQ(numbers_of(&live.filter), before);
  EXPECT_EQ(live.redraws.status().given_up, 1);
}

}  // namespace
}  // namespace pf_resampling
