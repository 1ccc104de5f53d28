// Scenes of an attack on a pipeline: nothing that arrives ends it, and once good input comes again,
// the pose is good again within 30 s.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <new>
#include <stdexcept>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

// s, after which the pose has to be good again.
constexpr double kRecovery = 30.0;

template <typename AnyRig>
class HostileInput : public testing::Test {};
using Rigs = testing::Types<Rig, FastSlamRig>;
TYPED_TEST_SUITE(HostileInput, Rigs);

// The drive goes on after `from`, s.
template <typename AnyRig>
void expect_good_again(AnyRig* run, double from) {
  using Drive = typename AnyRig::Drive;
  run->feed(Drive::messages(from + 0.1, from + kRecovery));
  ASSERT_FALSE(run->out.poses.empty());
  EXPECT_EQ(run->out.poses.back().header.stamp, Drive::at(from + kRecovery));
  EXPECT_LT(run->error(), kLost);
  EXPECT_TRUE(all_finite(run->out));
  // No message needed the guard.
  for (const RejectCounter::Count& count : run->pipeline.rejects().counts()) {
    const bool is_request = count.input == "a_request" || count.input == "load_map";
    EXPECT_TRUE(is_request || count.reason != RejectReason::exception) << count.latest;
  }
}

// A message with its stamp moved by `shift`.
template <typename Message>
Message later(const Message& message, ros::Duration shift) {
  return std::visit(
      [&](const auto& pointer) -> Message {
        using Value = std::decay_t<decltype(*pointer)>;
        if constexpr (std::is_same_v<Value, tf2_msgs::TFMessage>) {
          return pointer;
        } else {
          auto copy = boost::make_shared<Value>(*pointer);
          copy->header.stamp += shift;
          return copy;
        }
      },
      message);
}

// ---- exceptions -------------------------------------------------------------------------------

struct Throw {
  const char* name;
  std::function<void()> now;
};

std::vector<Throw> all_throws() {
  return {{"bad_alloc", [] { throw std::bad_alloc(); }},
          {"length_error", [] { throw std::length_error("too long"); }},
          {"Error", [] { throw Error("refused"); }},
          {"a number", [] { throw 7; }},
          {"a text", [] { throw "text"; }}};
}

// What fails while it gives out poses and status, as a message that finds no memory does.
TYPED_TEST(HostileInput, NoExceptionGetsOutWhateverItsType) {
  using Drive = typename TypeParam::Drive;
  for (const Throw& thrown : all_throws()) {
    SCOPED_TRACE(thrown.name);
    decltype(TypeParam::out) out;
    auto sinks = sinks_into(&out);
    bool fails = false;
    sinks.transform = [&](const auto&) {
      if (fails) thrown.now();
    };
    sinks.status = [&](const FilterStatus& status) {
      if (fails) thrown.now();
      out.statuses.push_back(status);
    };
    decltype(TypeParam::pipeline) pipeline(Drive::options(), sinks);
    const auto feed = [&](double from, double until) {
      for (const auto& message : Drive::messages(from, until)) handle(message, &pipeline);
    };
    feed(0.0, 20.0);
    fails = true;
    EXPECT_NO_THROW(feed(20.1, 25.0));
    fails = false;
    // Every odometry gave out a transform, or found a status to give out before.
    EXPECT_GE(pipeline.rejects().count("odom", RejectReason::exception), 49u);
    EXPECT_EQ(pipeline.rejects().total(),
              pipeline.rejects().count("odom", RejectReason::exception));
    const auto times_said = std::count_if(out.log.begin(), out.log.end(), [](const auto& line) {
      return line.find("odom: rejected, exception") != std::string::npos;
    });
    EXPECT_EQ(times_said, 1);
    feed(25.1, 25.0 + kRecovery);
    EXPECT_EQ(out.poses.back().header.stamp, Drive::at(25.0 + kRecovery));
    EXPECT_LT(distance(to_pose2(out.poses.back().pose.pose), Drive::truth(Drive::at(55.0))), kLost);
    EXPECT_EQ(out.statuses.back().rejects.back().reason, "exception");
    EXPECT_NE(value_of(out.diagnostics.back(), "rejected odom exception"), "");
  }
}

TYPED_TEST(HostileInput, ARequestIsAnsweredWithAnErrorWhateverIsThrown) {
  TypeParam run;
  run.feed(TypeParam::Drive::messages(0.0, 20.0));
  for (const Throw& thrown : all_throws()) {
    SCOPED_TRACE(thrown.name);
    const auto ask = [&] {
      run.pipeline.ask("a_request", [&]() -> std::string {
        thrown.now();
        return "done";
      });
    };
    EXPECT_THROW(ask(), Error);
  }
  // An Error is an answer, no fault.
  EXPECT_EQ(run.rejected("a_request", RejectReason::exception), all_throws().size() - 1);
  EXPECT_EQ(run.pipeline.ask("a_request", [] { return std::string("done"); }), "done");
  expect_good_again(&run, 20.0);
}

// ---- stamps at the edge of the odometry that is kept -------------------------------------------

// Stamped as the oldest odometry that is kept (30 s), which the next message makes forgotten. The
// motion since is not lost.
TYPED_TEST(HostileInput, APoseOfTheOldestOdometryIsBroughtForward) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 60.0));
  run.pipeline.handle(initial_pose(Drive::at(29.9), Drive::truth(Drive::at(29.9))));
  run.feed(Drive::messages(60.1, 60.1));
  EXPECT_LT(run.error(), 3.0 * kLost);  // 30 s of dead reckoning
  expect_good_again(&run, 60.1);
  EXPECT_EQ(run.pipeline.rejects().total(), 0u);
}

// While there is no odometry to compare them with, they may wait; then they must not keep the place
// of those that can be used.
TYPED_TEST(HostileInput, ObservationsFromFarAheadOfTheFirstOdometryKeepNoPlace) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  for (const double ahead : {1e8, 2e8, 3e8}) {
    for (const auto& message : Drive::messages(0.0, 20.0)) {
      if (!std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message)) {
        run.feed({later(message, ros::Duration(ahead))});
      }
    }
  }
  run.feed(Drive::messages(0.0, 20.0));
  std::uint64_t ahead = 0;
  for (const RejectCounter::Count& count : run.pipeline.rejects().counts()) {
    if (count.reason == RejectReason::ahead_of_odometry) ahead += count.count;
  }
  EXPECT_EQ(ahead, static_cast<std::uint64_t>(Drive::options().queue_length));
  expect_good_again(&run, 20.0);
}

TEST(HostileInputOfBeaconMcl, BeaconsMayComeLateAndChange) {
  using Drive = BeaconMclDrive;
  Rig run;
  for (const BeaconMclMessage& message : Drive::messages(0.0, 45.0)) {
    if (!std::holds_alternative<BeaconArray::ConstPtr>(message)) run.feed({message});
  }
  EXPECT_TRUE(run.out.poses.empty());
  run.pipeline.handle(Drive::beacon_array());
  expect_good_again(&run, 45.0);
  BeaconArray other = Drive::beacon_array();
  other.beacons[1].position.x += 500.0;
  run.pipeline.handle(other);
  run.feed(Drive::messages(75.1, 80.0));
  run.pipeline.handle(Drive::beacon_array());
  expect_good_again(&run, 80.0);
}

// ---- clocks ------------------------------------------------------------------------------------

// A computer without a clock of its own begins in 1970 and is told the time later; the robot drives
// on meanwhile.
TYPED_TEST(HostileInput, AClockThatIsSetFrom1970ToNowLosesNothing) {
  using Drive = typename TypeParam::Drive;
  for (const double forward : {1.7e9, 2e5, 3000.0}) {
    SCOPED_TRACE(forward);
    const ros::Duration shift(forward);
    TypeParam run;
    run.feed(Drive::messages(0.0, 20.0));
    ASSERT_LT(run.error(), kLost);
    for (const auto& message : Drive::messages(20.1, 20.0 + kRecovery)) {
      run.feed({later(message, shift)});
    }
    const ros::Time end = run.out.poses.back().header.stamp;
    EXPECT_EQ(end, Drive::at(20.0 + kRecovery) + shift);
    EXPECT_LT(distance(run.pose(), Drive::truth(end - shift)), kLost);
    EXPECT_TRUE(all_finite(run.out));
  }
}

TYPED_TEST(HostileInput, AClockFarAheadIsCountedAndNothingElse) {
  using Drive = typename TypeParam::Drive;
  TypeParam run;
  run.feed(Drive::messages(0.0, 20.0));
  for (const std::uint32_t second : {0x7fffffffu, 0x80000000u, 0x90000000u, 0xffffffffu}) {
    EXPECT_NO_THROW(run.pipeline.report_silence(ros::Time(second, 0)));
  }
  EXPECT_EQ(run.rejected("clock", RejectReason::impossible_stamp), 3u);
  expect_good_again(&run, 20.0);
}

// ---- the same again ---------------------------------------------------------------------------

// By two publishers, which number their messages on their own: it counts once.
TYPED_TEST(HostileInput, WhatComesTwiceCountsOnce) {
  using Drive = typename TypeParam::Drive;
  TypeParam once, twice;
  std::uint64_t observations = 0;
  for (const auto& message : Drive::messages(0.0, 20.0)) {
    once.feed({message});
    twice.feed({message});
    std::visit(
        [&](const auto& pointer) {
          using Value = std::decay_t<decltype(*pointer)>;
          if constexpr (std::is_same_v<Value, typename decltype(TypeParam::pipeline)::Message>) {
            auto again = boost::make_shared<Value>(*pointer);
            again->header.seq += 100;
            twice.feed({again});
            ++observations;
          }
        },
        message);
  }
  ASSERT_GT(observations, 10u);
  EXPECT_EQ(twice.pipeline.rejects().total(), observations);
  EXPECT_EQ(twice.pipeline.rejects().count(decltype(twice.pipeline)::kObservations,
                                           RejectReason::repeated),
            observations);
  ASSERT_EQ(once.out.poses.size(), twice.out.poses.size());
  EXPECT_EQ(once.out.poses.back().pose, twice.out.poses.back().pose);
  // A bag that is played again says what it said before.
  twice.pipeline.reset();
  twice.feed(Drive::messages(0.0, 20.0));
  EXPECT_EQ(twice.pipeline.rejects().total(), observations);
}

// All of one moment and all different: what is remembered of them is bounded, as the queue is.
TYPED_TEST(HostileInput, ManyObservationsOfOneMomentAreNotAllRemembered) {
  using Drive = typename TypeParam::Drive;
  auto options = Drive::options();
  options.queue_length = 5;
  TypeParam run(options);
  run.feed(Drive::messages(0.0, 20.0));
  const ros::Time stamp = Drive::at(20.0);
  const std::uint64_t before = run.pipeline.rejects().total();
  const auto send = [&](std::uint32_t number) {
    auto message = Drive::observation_at(stamp, 0);
    // By a difference that the filter does not mind.
    if constexpr (std::is_same_v<decltype(message), BeaconRange>) {
      message.range += 1e-6 * number;
    } else {
      message.observations.front().range += 1e-6 * number;
    }
    run.pipeline.handle(message);
  };
  for (std::uint32_t number = 1; number <= 20; ++number) send(number);
  EXPECT_EQ(run.pipeline.rejects().total(), before);
  const char* const topic = decltype(run.pipeline)::kObservations;
  send(20);
  EXPECT_EQ(run.rejected(topic, RejectReason::repeated), 1u);
  send(1);  // forgotten
  EXPECT_EQ(run.rejected(topic, RejectReason::repeated), 1u);
  expect_good_again(&run, 20.0);
}

// ---- too much ----------------------------------------------------------------------------------

TEST(HostileInputOfFastSlam, AMapThatIsFullTakesNoMoreLandmarksAndGoesOn) {
  using Drive = FastSlamDrive;
  for (const bool by_estimates : {false, true}) {
    FastSlamPipelineOptions options = Drive::options();
    (by_estimates ? options.filter.map.max_estimates : options.filter.map.max_landmarks) =
        by_estimates ? 8 * options.filter.particles + 1 : 8;
    FastSlamRig run(options);
    run.feed(Drive::messages(0.0, 60.0));
    EXPECT_EQ(run.pipeline.filter().status().landmarks, 8);
    EXPECT_GT(run.rejected("landmarks", RejectReason::too_many), 10u);
    EXPECT_EQ(run.pipeline.not_believed(), 0u);
    EXPECT_TRUE(run.has_said("a new landmark is not taken: there are 8 in 60 particles"));
    EXPECT_LT(run.out.statuses.back().lost, 0.05);
    EXPECT_LT(run.error(), kLost);
    if (!by_estimates) continue;
    const FastSlamParticles before = run.particles();
    const std::string said = refusal([&] { run.pipeline.set_parameters({{"particles", "61"}}); });
    EXPECT_TRUE(says(said, "estimates, more than the limit of "));
    EXPECT_TRUE(same_particles(run.particles(), before));
    expect_good_again(&run, 60.0);
  }
}

void forget_ids(LandmarkObservationArray* scan) {
  for (auto& seen : scan->observations) seen.id = -1;
}

TEST(HostileInputOfFastSlam, AScanWithoutIdsThatNeedsTooMuchMemoryChangesNothing) {
  using Drive = FastSlamDrive;
  FastSlamPipelineOptions options = Drive::options();
  options.filter.association.max_pairs = 5000;
  for (const FastSlamVersion version : all_values<FastSlamVersion>()) {
    options.filter.version = version;
    const auto go_on = [](FastSlamRig* run, double from, double until) {
      run->feed(changed<LandmarkObservationArray>(Drive::messages(from, until), forget_ids));
    };
    FastSlamRig run(options);
    FastSlamRig good(options);
    for (FastSlamRig* each : {&run, &good}) go_on(each, 0.0, 20.0);
    ASSERT_EQ(run.pipeline.rejects().total(), 0u);
    LandmarkObservationArray scan = Drive::scan(Drive::at(19.99));
    forget_ids(&scan);
    while (scan.observations.size() < 200) {
      scan.observations.insert(scan.observations.end(), scan.observations.begin(),
                               scan.observations.end());
    }
    for (auto& seen : scan.observations) seen.range *= 0.99;
    const FastSlamParticles before = run.particles();
    run.pipeline.handle(scan);
    EXPECT_EQ(run.rejected("landmarks", RejectReason::filter_error), 1u);
    EXPECT_TRUE(run.has_said("pairs with the landmarks near them"));
    EXPECT_TRUE(same_particles(run.particles(), before));
    for (FastSlamRig* each : {&run, &good}) go_on(each, 20.1, 20.0 + kRecovery);
    EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
    EXPECT_LT(run.error(), kLost);
  }
}

// ---- files -------------------------------------------------------------------------------------

std::string map_of(int landmarks, const TemporaryDirectory& directory) {
  SavedMap map;
  map.frame = "map";
  map.association = DataAssociation::known;
  map.pose.covariance = 0.01 * Eigen::Matrix3d::Identity();
  map.next_id = landmarks;
  map.odometry_errors.means.resize(0, OdometryErrorEstimator::kCount);
  for (int id = 0; id < landmarks; ++id) {
    SavedLandmark landmark;
    landmark.estimate.id = id;
    landmark.estimate.mean = landmark.last_seen = {0.1 * id, 50.0};
    landmark.estimate.covariance = 0.01 * Eigen::Matrix2d::Identity();
    landmark.estimate.held = 1.0;
    map.landmarks.push_back(landmark);
  }
  const std::string path = directory.file("map_of_" + std::to_string(landmarks));
  write_map_file(path, map);
  return path;
}

TEST(HostileInputOfFastSlam, AMapThatIsTooLargeIsRefusedBeforeItIsMade) {
  const TemporaryDirectory directory;
  const std::string path = map_of(30000, directory);
  for (const bool by_estimates : {false, true}) {
    for (const bool frozen : {false, true}) {
      FastSlamPipelineOptions options = FastSlamDrive::options();
      if (by_estimates) {
        options.filter.map.max_landmarks = 1000000;
        options.filter.map.max_estimates = 60 * 30000 - 1;
      }
      FastSlamRig run(options);
      run.feed(FastSlamDrive::messages(0.0, 20.0));
      const int landmarks = run.pipeline.filter().status().landmarks;
      const std::string said = pf_resampling::refusal([&] { run.pipeline.load_map(path, frozen); });
      const std::string name =
          by_estimates ? "estimates, more than the limit" : "landmarks is larger";
      EXPECT_TRUE(says(said, name));
      EXPECT_EQ(run.pipeline.filter().status().landmarks, landmarks);
      expect_good_again(&run, 20.0);
    }
  }
}

// /proc/self/mem opens, and answers reading with EIO, for whoever runs this.
TEST(HostileInputOfFastSlam, ANodeWhoseMapCannotBeReadStartsWithoutAndSaysSo) {
  using Drive = FastSlamDrive;
  const TemporaryDirectory directory;
  for (const std::string& path : {std::string("/proc/self/mem"), directory.path(),
                                  directory.file("no.map"), map_of(30000, directory)}) {
    SCOPED_TRACE(path);
    FastSlamPipelineOptions options = Drive::options();
    options.map_file = path;
    EXPECT_THROW(FastSlamRig{options}, Error);
    options.starts_without_map = true;
    FastSlamRig run(options);
    ASSERT_EQ(run.out.log.size(), 1u);
    EXPECT_EQ(run.out.log[0].rfind("started without the map: ", 0), 0u) << run.out.log[0];
    expect_good_again(&run, -0.1);
    EXPECT_EQ(run.out.diagnostics.back().status[0].level, diagnostic_msgs::DiagnosticStatus::ERROR);
    EXPECT_TRUE(says(run.out.diagnostics.back().status[0].message, run.out.log[0]));
    run.pipeline.reset();
    run.pipeline.load_map(map_of(3, directory), false);
    run.feed(Drive::messages(40.0, 45.0));
    EXPECT_NE(run.out.diagnostics.back().status[0].level, diagnostic_msgs::DiagnosticStatus::ERROR);
  }
}

}  // namespace
}  // namespace pf_resampling
