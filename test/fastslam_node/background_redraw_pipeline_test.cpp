// The pose does not wait for a redraw.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

using Drive = FastSlamDrive;

FastSlamPipelineOptions redraw_options() {
  auto options = options_of_redraw<Drive>();
  options.filter.strategy.redraw.every_n = 10;
  return options;
}

// A node's pipeline with redraws that take until they are let go: they ask for the time when they
// begin, and wait there.
struct LiveRig {
  explicit LiveRig(FastSlamPipelineOptions options = redraw_options())
      : pipeline(deferred(std::move(options)), sinks()) {}
  ~LiveRig() { let_go(); }

  static FastSlamPipelineOptions deferred(FastSlamPipelineOptions options) {
    options.deferred = true;
    return options;
  }
  FastSlamSinks sinks() {
    FastSlamSinks sinks = sinks_into(&out);
    sinks.stopwatch = [this, caller = std::this_thread::get_id()] {
      std::unique_lock<std::mutex> lock(mutex);
      if (std::this_thread::get_id() != caller) let.wait(lock, [this] { return is_let_go; });
      return seconds += 1.0;
    };
    return sinks;
  }
  void let_go() {
    const std::lock_guard<std::mutex> lock(mutex);
    is_let_go = true;
    let.notify_all();
  }
  // As a node does.
  void feed(const std::vector<FastSlamMessage>& messages) {
    for (const FastSlamMessage& message : messages) {
      handle(message, &pipeline);
      while (pipeline.process_next()) {
      }
    }
  }
  // Until a redraw has taken over; false if it never does.
  bool wait_for_redraw(std::int64_t redraws) {
    for (int tries = 0; tries < 60000; ++tries) {
      pipeline.process_next();
      if (pipeline.filter().status().redraws >= redraws) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  FastSlamOutputs out;
  std::mutex mutex;
  std::condition_variable let;
  bool is_let_go = false;
  double seconds = 0.0;
  FastSlamPipeline pipeline;
};

std::size_t odometry_in(const std::vector<FastSlamMessage>& messages) {
  return static_cast<std::size_t>(
      std::count_if(messages.begin(), messages.end(), FastSlamRig::is_odometry));
}

TEST(BackgroundRedrawPipeline, ThePoseComesWithAllOdometryWhileARedrawRuns) {
  LiveRig live;
  const auto drive = Drive::messages(60.0);
  live.feed(drive);
  EXPECT_EQ(live.out.poses.size(), odometry_in(drive));
  EXPECT_EQ(live.out.statuses.back().updates, 300u);
  EXPECT_EQ(live.out.statuses.back().redraws, 0u) << "the first still runs";
  EXPECT_EQ(live.out.statuses.back().redraw_time, 0.0);
  const Pose2 before = live.pipeline.estimate()->mean;
  live.let_go();
  ASSERT_TRUE(live.wait_for_redraw(1));
  // The pose that goes out from now on is the new population's, and it stays where the robot is.
  const Pose2 after = live.pipeline.estimate()->mean;
  EXPECT_GT(distance(before, after), 0.0);
  EXPECT_LT(distance(before, after), 0.2);
  EXPECT_LT(live.pipeline.lost_probability(), 0.5);

  live.feed(Drive::messages(60.1, 70.0));
  ASSERT_TRUE(live.wait_for_redraw(2));
  live.feed(Drive::messages(70.1, 71.0));
  EXPECT_EQ(live.out.poses.size(), 711u);
  for (std::size_t i = 1; i < live.out.poses.size(); ++i) {
    EXPECT_GT(live.out.poses[i].header.stamp, live.out.poses[i - 1].header.stamp);
  }
  const FilterStatus& status = live.out.statuses.back();
  EXPECT_EQ(status.updates, 355u);
  EXPECT_GE(status.redraws, 2u);
  EXPECT_GE(status.redraw_time, 1.0);
  EXPECT_LT(distance(live.pipeline.estimate()->mean, Drive::truth(Drive::at(71.0))), 0.2);
  EXPECT_EQ(live.pipeline.filter().path().size(), 355u);
  EXPECT_GE(std::stoi(value_of(live.out.diagnostics.back(), "redraws")), 1);
  EXPECT_EQ(value_of(live.out.diagnostics.back(), "redraws given up"), "0");
}

// Offline it waits, so that its bytes do not depend on time: those of two runs agree, also with a
// stopwatch, and redraws are of the update in which they are due.
TEST(BackgroundRedrawPipeline, OfflineARedrawIsPartOfItsUpdate) {
  FastSlamRig run(redraw_options());
  run.feed(Drive::messages(10.0));
  ASSERT_GE(run.out.statuses.size(), 50u);
  EXPECT_EQ(run.out.statuses[8].redraws, 0u);
  EXPECT_EQ(run.out.statuses[9].redraws, 1u);
  EXPECT_EQ(run.out.statuses.back().redraw_time, 0.0);
  EXPECT_EQ(run.out.statuses.back().redraw_replayed, 0u);
}

// What is saved while a redraw runs is the filter as the pose shows it; put elsewhere, it stays
// there.
TEST(BackgroundRedrawPipeline, AResetOrACheckpointDoesNotWait) {
  LiveRig live;
  live.feed(Drive::messages(20.0));
  const auto checkpoint = live.pipeline.checkpoint();
  ASSERT_TRUE(checkpoint);
  EXPECT_EQ(checkpoint->filter.memory.updates, 100);
  FastSlamRig resumed(redraw_options());
  resumed.pipeline.resume(*checkpoint);
  EXPECT_TRUE((resumed.particles().x == live.pipeline.filter().particles().x).all());
  live.pipeline.reset();
  live.feed(Drive::messages(0.0, 1.0));
  live.let_go();
  live.feed(Drive::messages(1.1, 1.5));
  EXPECT_EQ(live.out.statuses.back().updates, 8u);
  EXPECT_EQ(live.pipeline.filter().status().redraws, 0);
}

}  // namespace
}  // namespace pf_resampling
