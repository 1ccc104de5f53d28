// What BeaconMclPipeline does with messages that it cannot use.
#include <gtest/gtest.h>

#include "test/bad_inputs.hpp"
#include "test/beacon_mcl_rig.hpp"

namespace pf_resampling {
namespace {

using bad_inputs::kInfinity;
using bad_inputs::kNan;
constexpr double kBegin = BeaconMclDrive::kStart;

using BadMessage = bad_inputs::BadMessage<BeaconMclMessage>;

ros::Time now() {
  return ros::Time(kBegin + 12.0);
}

template <typename Change>
BadMessage bad_range(const std::string& name, RejectReason reason, Change change) {
  // Fresher than the filter's last range (11.84 s), covered by odometry.
  BeaconRange range = BeaconMclDrive::range(now() - ros::Duration(0.01), 1);
  change(&range);
  return {name, boost::make_shared<BeaconRange>(range), "ranges", reason};
}

template <typename Change>
BadMessage bad_beacons(const std::string& name, RejectReason reason, Change change) {
  BeaconArray beacons = BeaconMclDrive::beacon_array();
  beacons.beacons[0].position.x += 1.0;
  change(&beacons);
  return {name, boost::make_shared<BeaconArray>(beacons), "beacons", reason};
}

std::vector<BadMessage> bad_messages() {
  using R = RejectReason;
  std::vector<BadMessage> bad;
  const auto add_range = [&](const char* name, R reason, auto change) {
    bad.push_back(bad_range(name, reason, change));
  };
  const auto add_beacons = [&](const char* name, R reason, auto change) {
    bad.push_back(bad_beacons(name, reason, change));
  };
  add_range("NaN", R::not_finite, [](auto* m) { m->range = kNan; });
  add_range("infinite", R::not_finite, [](auto* m) { m->range = kInfinity; });
  add_range("zero", R::not_positive, [](auto* m) { m->range = 0.0; });
  add_range("negative", R::not_positive, [](auto* m) { m->range = -3.0; });
  add_range("NaN variance", R::not_finite, [](auto* m) { m->variance = kNan; });
  add_range("infinite variance", R::not_finite, [](auto* m) { m->variance = kInfinity; });
  add_range("negative variance", R::impossible_variance, [](auto* m) { m->variance = -0.01; });
  add_range("unknown id", R::unknown_beacon, [](auto* m) { m->beacon = 99; });
  bad_inputs::add_bad_headers(add_range);

  add_beacons("none", R::empty, [](auto* m) { m->beacons.clear(); });
  add_beacons("NaN", R::not_finite, [](auto* m) { m->beacons[1].position.x = kNan; });
  add_beacons("infinite height", R::not_finite,
              [](auto* m) { m->beacons[1].position.z = kInfinity; });
  add_beacons("twice", R::duplicate_beacon, [](auto* m) { m->beacons[1].id = m->beacons[0].id; });
  add_beacons("too many", R::too_many,
              [](auto* m) { m->beacons.resize(1001, m->beacons.front()); });
  add_beacons("wrong frame", R::wrong_frame, [](auto* m) { m->header.frame_id = "odom"; });

  bad_inputs::add_all(now(), BeaconMclDrive::odometry(now() + ros::Duration(0.05)), &bad);
  return bad;
}

TEST(BeaconMclPipeline, ABadMessageIsCountedReportedAndChangesNothing) {
  bad_inputs::expect_to_change_nothing<Rig>(bad_messages());
}

TEST(BeaconMclPipeline, NothingThatIsNotFiniteIsPublishedWhateverComes) {
  // Absurd but finite numbers pass the checks of messages: what comes out has to be finite.
  for (const double absurd : {1e-300, 1e-9, 1e9, 1e30, 1e160, 1.7e308}) {
    SCOPED_TRACE(absurd);
    Rig run;
    const auto drive = BeaconMclDrive::messages(6.0);
    int count = 0;
    for (const BeaconMclMessage& message : drive) {
      handle(message, &run.pipeline);
      if (++count % 7 == 0) {
        BeaconRange range = BeaconMclDrive::range(
            run.out.poses.empty() ? ros::Time(kBegin) : run.out.poses.back().header.stamp, 2);
        range.range = absurd;
        run.pipeline.handle(range);
        range.range = 5.0;
        range.variance = absurd;
        run.pipeline.handle(range);
      }
    }
    EXPECT_TRUE(all_finite(run.out));

    run.pipeline.handle(initial_pose({}, {absurd, 0.0, 0.0}, absurd));
    for (int i = 1; i < 40; ++i) {
      const ros::Time stamp(kBegin + 6.0 + 0.1 * i);
      run.pipeline.handle(BeaconMclDrive::odometry(stamp));
      run.pipeline.handle(BeaconMclDrive::range(stamp, i % 4));
    }
    EXPECT_TRUE(all_finite(run.out));
  }
}

TEST(BeaconMclPipeline, WhatTheFilterRefusesIsRejectedAndTheOldBeaconsStay) {
  Rig run;
  run.feed(BeaconMclDrive::messages(6.0));
  const auto beacons = run.pipeline.filter()->beacons();
  const BeaconMclParticles particles = run.pipeline.filter()->particles();
  BeaconArray absurd = BeaconMclDrive::beacon_array();
  absurd.beacons.front().position.x = 1e200;
  run.pipeline.handle(absurd);
  EXPECT_EQ(run.pipeline.filter()->beacons().front().position, beacons.front().position);
  run.pipeline.handle(initial_pose({}, {1e200, 0.0, 0.0}));
  EXPECT_TRUE((run.pipeline.filter()->particles().x == particles.x).all());
  EXPECT_EQ(run.pipeline.rejects().count("beacons", RejectReason::filter_error), 1u);
  EXPECT_EQ(run.pipeline.rejects().count("initialpose", RejectReason::impossible_position), 1u);
}

}  // namespace
}  // namespace pf_resampling
