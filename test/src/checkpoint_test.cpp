// Checkpoints of both pipelines, and what keeps them for the nodes.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <new>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/checkpoint/checkpoint_keeper.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

template <typename Checkpoint>
Checkpoint read_back(const Checkpoint& checkpoint) {
  const TemporaryDirectory directory;
  write_saved(kCheckpointFile, directory.file("a"), checkpoint);
  return read_saved<Checkpoint>(kCheckpointFile, directory.file("a"));
}

// The messages up to an odometry message and those after it: none waits in between.
template <typename Message>
std::size_t cut_after_odometry(const std::vector<Message>& messages, std::size_t place) {
  while (!std::holds_alternative<nav_msgs::Odometry::ConstPtr>(messages[place])) ++place;
  return place + 1;
}

// A run over all of a drive, beside one that ends somewhere and another that goes on from its
// checkpoint: the same particles at the end, to the bit. The pose between two observations, and
// what follows from it, is the same but for rounding.
template <typename AnyRig, typename Message, typename Options>
void expect_goes_on(const std::vector<Message>& messages, const Options& options) {
  AnyRig whole(options);
  whole.feed(messages);
  for (const unsigned share : {3u, 5u, 8u}) {
    const std::size_t cut = cut_after_odometry(messages, messages.size() * share / 10);
    const std::vector<Message> before(messages.begin(), messages.begin() + static_cast<long>(cut));
    const std::vector<Message> after(messages.begin() + static_cast<long>(cut), messages.end());
    AnyRig first(options);
    EXPECT_FALSE(first.pipeline.checkpoint());
    first.feed(before);
    const auto checkpoint = first.pipeline.checkpoint();
    ASSERT_TRUE(checkpoint);
    AnyRig second(options);
    second.pipeline.resume(read_back(*checkpoint));
    second.feed(after);
    EXPECT_TRUE(same_particles(second.particles(), whole.particles()));
    ASSERT_EQ(first.out.poses.size() + second.out.poses.size(), whole.out.poses.size());
    EXPECT_EQ(second.out.poses.back().pose.pose.position.x,
              whole.out.poses.back().pose.pose.position.x);
    EXPECT_NEAR(second.out.statuses.back().lost, whole.out.statuses.back().lost, 1e-12);
    EXPECT_EQ(second.out.statuses.back().normalized_innovation,
              whole.out.statuses.back().normalized_innovation);
    for (std::size_t i = 0; i < second.out.poses.size(); ++i) {
      const auto& a = second.out.poses[i];
      const auto& b = whole.out.poses[first.out.poses.size() + i];
      ASSERT_EQ(a.header.stamp, b.header.stamp);
      ASSERT_NEAR(a.pose.pose.position.x, b.pose.pose.position.x, 1e-9);
      ASSERT_NEAR(a.pose.covariance[35], b.pose.covariance[35], 1e-12);
    }
  }
}

TEST(Checkpoint, EitherFilterGoesOnAsIfNothingHadHappened) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.filter.yaw_rate_bias.estimate = true;
  expect_goes_on<Rig>(BeaconMclDrive::messages(40.0), options);
  expect_goes_on<Rig>(BeaconMclDrive::messages(40.0), options_of_redraw<BeaconMclDrive>());
  expect_goes_on<FastSlamRig>(FastSlamDrive::messages(40.0), FastSlamDrive::options());
  expect_goes_on<FastSlamRig>(FastSlamDrive::messages(40.0), options_of_redraw<FastSlamDrive>());
}

// With four landmarks in each place.
std::vector<FastSlamMessage> with_four_each(const std::vector<FastSlamMessage>& messages) {
  return changed<LandmarkObservationArray>(messages, [](LandmarkObservationArray* scan) {
    const auto as_seen = scan->observations;
    for (int copy = 1; copy < 4; ++copy) {
      for (LandmarkObservation seen : as_seen) {
        seen.id += copy * static_cast<int>(FastSlamDrive::landmarks().size());
        scan->observations.push_back(seen);
      }
    }
  });
}

// What is drawn from in a loaded map begins with what the map was made of.
TEST(Checkpoint, FastSlamInALoadedMapGoesOnAsIfNothingHadHappened) {
  const TemporaryDirectory directory;
  const std::vector<FastSlamMessage> messages = with_four_each(FastSlamDrive::messages(40.0));
  auto options = options_of_redraw<FastSlamDrive>();
  FastSlamRig mapped(options);
  mapped.feed(messages);
  options.map_file = directory.file("lab.map");
  mapped.pipeline.save_map(options.map_file);
  FastSlamRig located(options);
  located.feed(messages);
  const int updates_of_map = mapped.pipeline.checkpoint()->filter.memory.updates;
  const MemoryState memory = located.pipeline.checkpoint()->filter.memory;
  EXPECT_EQ(memory.landmarks.size(), 48u);
  EXPECT_GT(memory.updates, updates_of_map) << "it remembers the drive that made the map, too";
  expect_goes_on<FastSlamRig>(messages, options);
}

// As a node that was killed, and is there again seconds later: the robot went on meanwhile.
template <typename AnyRig, typename Message>
double error_after_silence(const std::vector<Message>& before, const std::vector<Message>& after) {
  AnyRig first;
  first.feed(before);
  AnyRig second;
  second.pipeline.resume(read_back(*first.pipeline.checkpoint()));
  double worst = 0.0;
  std::size_t given = 0;
  for (const Message& message : after) {
    second.feed({message});
    if (second.out.poses.size() == given) continue;
    given = second.out.poses.size();
    worst = std::max(worst, second.error());
  }
  EXPECT_GT(given, 0.8 * static_cast<double>(after.size()) / 1.5);
  return worst;
}

TEST(Checkpoint, ANodeThatWasAwayForSecondsIsRightAtOnce) {
  // On the circle a straight line for 3 s is at most 0.2 m off it.
  EXPECT_LT(error_after_silence<Rig>(BeaconMclDrive::messages(20.0),
                                     BeaconMclDrive::messages(23.0, 40.0)),
            0.6);
  EXPECT_LT(error_after_silence<FastSlamRig>(FastSlamDrive::messages(20.0),
                                             FastSlamDrive::messages(23.0, 40.0)),
            0.6);
}

TEST(Checkpoint, BeaconMclRefusesOneWithOtherBeaconsAndStaysAsItIs) {
  Rig first;
  first.feed(BeaconMclDrive::messages(20.0));
  const BeaconMclCheckpoint checkpoint = *first.pipeline.checkpoint();
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.beacons = BeaconMclDrive::beacons();
  Rig fitting(options);
  fitting.pipeline.resume(checkpoint);
  EXPECT_TRUE(fitting.pipeline.estimate());
  options.beacons[1].position.x() += 1.0;
  Rig other(options);
  EXPECT_THROW(other.pipeline.resume(checkpoint), Error);
  EXPECT_FALSE(other.pipeline.estimate());
  // The beacons come after all: the same, so nothing starts anew.
  first.feed(BeaconMclDrive::messages(20.0, 21.0));
  Rig resumed;
  resumed.pipeline.resume(*first.pipeline.checkpoint());
  const BeaconMclParticles before = resumed.particles();
  resumed.pipeline.handle(BeaconMclDrive::beacon_array());
  EXPECT_TRUE(same_particles(before, resumed.particles()));
}

// A bag that is played again from its start has nothing to do with the end of it.
TEST(Checkpoint, OneFromTheFutureIsGivenUpWhenTimeJumpsBack) {
  Rig first;
  first.feed(BeaconMclDrive::messages(30.0));
  Rig second;
  second.pipeline.resume(*first.pipeline.checkpoint());
  second.feed(BeaconMclDrive::messages(20.0));
  EXPECT_LT(second.error(), 0.5);
  EXPECT_EQ(value_of(second.out.diagnostics.back(), "jumps back in time"), "1");
}

// ---- the keeper ---------------------------------------------------------------------------------

struct Kept {
  explicit Kept(const CheckpointOptions& options)
      : keeper(options, [this](LogLevel, const std::string& text) { log.push_back(text); }) {}

  diagnostic_msgs::DiagnosticStatus status() { return keeper.diagnostic("checkpoint"); }
  std::string value(const std::string& key) {
    diagnostic_msgs::DiagnosticArray array;
    array.status.push_back(status());
    return value_of(array, key);
  }
  /// Until what is being written is done.
  void wait() {
    while (value("written") == "0" && value("failed") == "0") ros::WallDuration(0.005).sleep();
  }

  std::vector<std::string> log;
  CheckpointKeeper keeper;
};

void write_text(const std::string& path) {
  std::ofstream(path) << "all well";
}

TEST(CheckpointKeeper, IsOffWithoutAFile) {
  Kept kept{CheckpointOptions()};
  bool called = false;
  kept.keeper.start([&](const std::string&) { called = true; });
  EXPECT_FALSE(called);
  EXPECT_FALSE(kept.keeper.is_due());
  EXPECT_FALSE(kept.keeper.is_used());
  EXPECT_THROW(kept.keeper.write_now("", write_text), Error);
}

TEST(CheckpointKeeper, WritesInAThreadOfItsOwnAndStartsFromTheFile) {
  const TemporaryDirectory directory;
  CheckpointOptions options;
  options.file = directory.file("a");
  options.period = 0.05;
  Kept kept(options);
  EXPECT_FALSE(kept.keeper.is_due());
  ros::WallDuration(0.06).sleep();
  ASSERT_TRUE(kept.keeper.is_due());
  const ros::WallTime before = ros::WallTime::now();
  kept.keeper.write([](const std::string& path) {
    ros::WallDuration(0.3).sleep();
    write_text(path);
  });
  EXPECT_LT((ros::WallTime::now() - before).toSec(), 0.1);
  ros::WallDuration(0.1).sleep();
  EXPECT_FALSE(kept.keeper.is_due()) << "it is still being written";
  kept.wait();
  EXPECT_EQ(kept.value("written"), "1");
  EXPECT_EQ(kept.status().message, "fine");

  std::string from;
  Kept next(options);
  next.keeper.start([&](const std::string& path) { from = path; });
  EXPECT_EQ(from, options.file);
  EXPECT_EQ(next.value("started"), "from " + options.file);
}

TEST(CheckpointKeeper, ADamagedFileIsToldOfUntilTheNextIsWritten) {
  const TemporaryDirectory directory;
  CheckpointOptions options;
  options.file = directory.file("a");
  write_text(options.file);
  Kept kept(options);
  kept.keeper.start(
      [](const std::string& path) { read_saved<BeaconMclCheckpoint>(kCheckpointFile, path); });
  EXPECT_EQ(kept.status().level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(kept.status().message.rfind(
                "started from nothing: checkpoint " + options.file + " is not how", 0),
            0u)
      << kept.status().message;
  ASSERT_EQ(kept.log.size(), 1u);
  EXPECT_EQ(kept.log[0], kept.status().message);
  kept.keeper.write(write_text);
  kept.wait();
  EXPECT_EQ(kept.status().message, "fine");
  EXPECT_EQ(kept.value("started"), "from nothing");
}

// /proc/self/mem opens, and answers reading with EIO, for whoever runs this.
TEST(CheckpointKeeper, AFileThatCannotBeReadIsToldOfAndTheNodeStarts) {
  const TemporaryDirectory directory;
  const std::string circle = directory.file("circle");
  ASSERT_EQ(symlink(circle.c_str(), circle.c_str()), 0);
  CheckpointOptions options;
  for (const std::string& path : {std::string("/proc/self/mem"), directory.path(), circle}) {
    SCOPED_TRACE(path);
    options.file = path;
    Kept kept(options);
    EXPECT_NO_THROW(kept.keeper.start(
        [](const std::string& file) { read_saved<FastSlamCheckpoint>(kCheckpointFile, file); }));
    EXPECT_EQ(kept.status().message.rfind("started from nothing: checkpoint " + path, 0), 0u)
        << kept.status().message;
    EXPECT_EQ(kept.log, std::vector<std::string>{kept.status().message});
  }
  options.file = directory.file("a");
  write_text(options.file);
  Kept kept(options);
  EXPECT_NO_THROW(kept.keeper.start([](const std::string&) { throw std::bad_alloc(); }));
  EXPECT_EQ(kept.status().message, "started from nothing: std::bad_alloc");
  kept.keeper.write([](const std::string&) { throw std::bad_alloc(); });
  kept.wait();
  EXPECT_EQ(kept.value("failed"), "1");
}

// As a node does it, with either filter.
template <typename AnyRig>
void expect_kept() {
  const TemporaryDirectory directory;
  CheckpointOptions options;
  options.file = directory.file("robot.checkpoint");
  options.period = 0.0;
  Kept kept(options);
  AnyRig run;
  const std::string asked = directory.file("asked.checkpoint");
  kept.keeper.write_when_due(&run.pipeline);
  EXPECT_EQ(refusal([&] { kept.keeper.save(asked, &run.pipeline); }),
            "checkpoint: there is nothing to save yet; wait for the first pose");
  EXPECT_EQ(directory.listing(), "");

  run.feed(AnyRig::Drive::messages(10.0));
  EXPECT_TRUE(says(kept.keeper.save(asked, &run.pipeline), asked));
  kept.keeper.write_when_due(&run.pipeline);
  kept.wait();
  EXPECT_EQ(directory.listing(), "asked.checkpoint robot.checkpoint");
  diagnostic_msgs::DiagnosticArray array;
  kept.keeper.report("robot1/filter: checkpoint", &array);
  ASSERT_EQ(array.status.size(), 1u);
  EXPECT_EQ(array.status[0].name, "robot1/filter: checkpoint");
  EXPECT_EQ(value_of(array, "file"), options.file);
  for (const std::string& file : {asked, options.file}) {
    AnyRig next;
    next.pipeline.resume(file);
    ASSERT_TRUE(next.pipeline.estimate()) << file;
    EXPECT_EQ(distance(next.pipeline.estimate()->mean, run.pipeline.estimate()->mean), 0.0) << file;
  }
}

TEST(CheckpointKeeper, KeepsWhatEitherPipelineKnows) {
  expect_kept<Rig>();
  expect_kept<FastSlamRig>();
  diagnostic_msgs::DiagnosticArray nothing;
  Kept(CheckpointOptions()).keeper.report("checkpoint", &nothing);
  EXPECT_TRUE(nothing.status.empty());
}

TEST(CheckpointKeeper, WhatCannotBeWrittenIsToldOf) {
  CheckpointOptions options;
  options.file = "/nowhere/at/all";
  Kept kept(options);
  kept.keeper.write([](const std::string& path) { throw Error(path + " cannot be written"); });
  kept.wait();
  EXPECT_EQ(kept.value("failed"), "1");
  EXPECT_EQ(kept.status().level, diagnostic_msgs::DiagnosticStatus::WARN);
  EXPECT_EQ(kept.status().message, "/nowhere/at/all cannot be written");
  const TemporaryDirectory directory;
  EXPECT_EQ(kept.keeper.write_now(directory.file("b"), write_text),
            "checkpoint written to " + directory.file("b"));
}

}  // namespace
}  // namespace pf_resampling
