#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"

#include <gtest/gtest.h>

#include "test/beacon_mcl_rig.hpp"

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

constexpr double kStart = BeaconMclDrive::kStart;

// ---- time -------------------------------------------------------------------------------------

TEST(BeaconMclPipeline, RangesWaitForTheBeacons) {
  const auto drive = BeaconMclDrive::messages(10.0);
  Rig run;
  run.feed({drive.begin() + 1, drive.end()});
  EXPECT_EQ(run.pipeline.filter(), nullptr);
  EXPECT_TRUE(run.out.poses.empty());
  EXPECT_EQ(run.pipeline.queued(), 51);
  EXPECT_TRUE(says(run.out.diagnostics.back().status[0].message, "waiting for the beacons"));
  run.pipeline.handle(BeaconMclDrive::beacon_array());
  EXPECT_EQ(run.pipeline.queued(), 1);  // the last is newer than the odometry
  run.pipeline.handle(BeaconMclDrive::odometry(ros::Time(kStart + 10.1)));
  EXPECT_LT(run.error(), 0.5);
}

TEST(BeaconMclPipeline, RangesOfOneStampAreOneUpdate) {
  Rig run;
  run.pipeline.handle(BeaconMclDrive::beacon_array());
  for (int i = 0; i <= 50; ++i) {
    const ros::Time stamp(kStart + 0.1 * i);
    for (int beacon = 0; beacon < 4; ++beacon) {
      run.pipeline.handle(BeaconMclDrive::range(stamp - ros::Duration(0.05), beacon));
    }
    run.pipeline.handle(BeaconMclDrive::odometry(stamp));
  }
  // The first four come before all odometry.
  EXPECT_EQ(run.pipeline.rejects().count("ranges", RejectReason::before_odometry), 4u);
  EXPECT_EQ(run.out.statuses.size(), 50u);
  EXPECT_LT(run.error(), 0.5);
}

// Ranges say where a robot is that stands, and nothing of where it looks: until it drives, it is
// not to be believed.
TEST(BeaconMclPipeline, AHeadingThatIsNotKnownIsSaid) {
  Rig run;
  run.pipeline.handle(BeaconMclDrive::beacon_array());
  for (int step = 0; step <= 200; ++step) {
    const ros::Time stamp(kStart - 20.0 + 0.1 * step);
    nav_msgs::Odometry odometry = BeaconMclDrive::odometry(ros::Time(kStart));
    odometry.header.stamp = stamp;
    run.pipeline.handle(odometry);
    BeaconRange range = BeaconMclDrive::range(ros::Time(kStart), step % 4);
    range.header.stamp = stamp - ros::Duration(0.05);
    run.pipeline.handle(range);
  }
  const FilterStatus standing = run.out.statuses.back();
  EXPECT_LT(std::hypot(run.pipeline.estimate()->covariance(0, 0),
                       run.pipeline.estimate()->covariance(1, 1)),
            0.25);
  EXPECT_EQ(standing.health, "converging");
  EXPECT_TRUE(says(standing.health_text, "the heading is uncertain"));
  EXPECT_LT(standing.lost, 0.5);  // the position is known
  EXPECT_EQ(run.out.diagnostics.back().status[0].message,
            "the heading is uncertain by a large part of a turn");
  run.feed(BeaconMclDrive::messages(0.1, 40.0));
  EXPECT_EQ(run.out.statuses.back().health, "healthy");
  EXPECT_LT(run.out.statuses.back().lost, 0.1);
}

// ---- what comes out ---------------------------------------------------------------------------

TEST(BeaconMclPipeline, BeaconsAreShownOnceInAWhileAndTheRangesAlways) {
  Rig run;
  run.feed(BeaconMclDrive::messages(20.0));
  EXPECT_EQ(markers_called(run.out.markers.front(), "beacons").size(), 4u);
  EXPECT_EQ(markers_called(run.out.markers.back(), "ranges").size(), 4u);
}

TEST(BeaconMclPipeline, InitialPoseAndServicesStartTheFilterAnew) {
  Rig run;
  run.feed(BeaconMclDrive::messages(5.0));
  run.pipeline.handle(initial_pose(ros::Time(kStart + 5.0), {3.0, 4.0, 0.5}));
  ASSERT_TRUE(run.pipeline.estimate().has_value());
  // 400 particles of sigma 0.1: the mean is off by 0.005 m, five sigma are 0.025.
  EXPECT_NEAR(run.pipeline.estimate()->mean.x, 3.0, 0.025);
  EXPECT_NEAR(run.pipeline.estimate()->mean.y, 4.0, 0.025);
  EXPECT_NEAR(run.pipeline.estimate()->mean.heading, 0.5, 0.025);

  run.pipeline.global_localization();
  if (const auto belief = run.pipeline.estimate()) {
    // From the latest ranges at once: back near the truth, (4.4, -4.0).
    EXPECT_GT(std::hypot(belief->mean.x - 3.0, belief->mean.y - 4.0), 4.0);
  }
  const auto drive = BeaconMclDrive::messages(20.0);
  run.feed({drive.begin() + 1 + 51 + 26, drive.end()});
  EXPECT_LT(run.error(), 0.5);

  run.pipeline.reset();
  EXPECT_EQ(run.pipeline.filter()->status().updates, 0);
  EXPECT_FALSE(run.pipeline.estimate().has_value());
  run.feed(drive);
  EXPECT_LT(run.error(), 0.5);
}

// Of one that sits 2 m ahead.
BeaconRange range_of_antenna(ros::Time stamp, int beacon) {
  BeaconRange range = BeaconMclDrive::range(stamp, beacon);
  const Pose2 antenna = compose(BeaconMclDrive::truth(stamp), {2.0, 0.0, 0.0});
  const Eigen::Vector3d place =
      BeaconMclDrive::beacons()[static_cast<std::size_t>(beacon)].position;
  range.header.frame_id = "antenna";
  range.range = std::hypot(place.x() - antenna.x, place.y() - antenna.y);
  return range;
}

TEST(BeaconMclPipeline, TheAntennaIsTakenFromTfOrTheConfiguration) {
  // The antenna sits 2 m ahead; taking it for the robot's centre is off by that.
  const auto run_with = [](bool tf, bool configured) {
    BeaconMclPipelineOptions options = BeaconMclDrive::options();
    if (configured) options.antennas["antenna"] = {2.0, 0.0, 0.0};
    Rig run(options);
    if (tf) {
      tf2_msgs::TFMessage message;
      message.transforms.resize(2);
      // By way of a mast that is turned by 90 degrees.
      message.transforms[0].header.frame_id = "base_link";
      message.transforms[0].child_frame_id = "mast";
      message.transforms[0].transform.translation.x = 1.0;
      message.transforms[0].transform.rotation = to_quaternion_message(kPi / 2);
      message.transforms[1].header.frame_id = "mast";
      message.transforms[1].child_frame_id = "antenna";
      message.transforms[1].transform.translation.y = -1.0;
      message.transforms[1].transform.rotation.w = 1.0;
      run.pipeline.handle(message);
    }
    run.pipeline.handle(BeaconMclDrive::beacon_array());
    for (int i = 0; i <= 300; ++i) {
      const ros::Time stamp(kStart + 0.1 * i);
      run.pipeline.handle(BeaconMclDrive::odometry(stamp));
      run.pipeline.handle(range_of_antenna(stamp, i % 4));
    }
    return run.out.poses.empty() ? 1e9 : run.error();
  };
  EXPECT_LT(run_with(true, false), 0.5);
  EXPECT_LT(run_with(false, true), 0.5);
  EXPECT_EQ(run_with(false, false), 1e9);  // every range is rejected
}

// Wheels that count 4 % too much; an antenna of which somebody told where it is.
TEST(BeaconMclPipeline, ErrorsOfOdometryAndAntennaAreToldWithTheirSigma) {
  auto options = options_of_redraw<BeaconMclDrive>();
  options.antennas["antenna"] = {2.0, 0.0, 0.0};
  Rig run(options);
  run.pipeline.handle(BeaconMclDrive::beacon_array());
  for (int i = 0; i <= 600; ++i) {
    const ros::Time stamp(kStart + 0.1 * i);
    nav_msgs::Odometry odometry = BeaconMclDrive::odometry(stamp);
    lengthen(&odometry);
    run.pipeline.handle(odometry);
    run.pipeline.handle(range_of_antenna(stamp, i % 4));
  }
  const auto& errors = run.out.statuses.back().systematic_errors;
  const double expected[] = {1.04, 1.0, 0.0, 0.0, 0.0};
  ASSERT_EQ(errors.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT(errors[i].sigma, 0.03) << errors[i].name;
    EXPECT_NEAR(errors[i].value, expected[i], 3.0 * errors[i].sigma) << errors[i].name;
  }
}

TEST(BeaconMclPipeline, ConfiguredBeaconsCountMoreThanTheMessage) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.beacons = BeaconMclDrive::beacons();
  Rig run(options);
  BeaconArray other = BeaconMclDrive::beacon_array();
  other.beacons[0].position.x += 5.0;
  run.pipeline.handle(other);
  EXPECT_EQ(run.pipeline.rejects().count("beacons", RejectReason::ignored), 1u);
  run.pipeline.handle(BeaconMclDrive::beacon_array());  // the same ones: nothing to ignore
  EXPECT_EQ(run.pipeline.rejects().total(), 1u);
}

// Through all strategies while the robot drives: a switch leaves particles and weights
// bit-identical, and the filter goes on.
TEST(BeaconMclPipeline, StrategiesSwitchWhileItRuns) {
  Rig run;
  run.feed(BeaconMclDrive::messages(0.0, 10.0));
  double time = 10.0;
  for (const auto& parameter :
       {"population/schedule", "population/renewal", "population/resampling/scheme",
        "population/compensation/pairing", "excitation/method"}) {
    for (const Parameter& known : run.pipeline.live_parameters()) {
      if (known.name != parameter) continue;
      for (const std::string& choice : known.choices) {
        const BeaconMclParticles before = run.pipeline.filter()->particles();
        run.pipeline.set_parameters({{parameter, choice}, {"population/threshold", "0.9"}});
        EXPECT_TRUE(same_particles(run.pipeline.filter()->particles(), before)) << choice;
        run.feed(BeaconMclDrive::messages(time, time + 1.0));
        time += 1.0;
      }
    }
  }
  EXPECT_LT(run.error(), 0.5);
  EXPECT_TRUE(all_finite(run.out));
}

TEST(BeaconMclPipeline, ABeaconThatIsNotAsListedIsAFinding) {
  const int third = BeaconMclDrive::beacons()[2].id;
  Rig run(options_of_redraw<BeaconMclDrive>());
  run.feed(changed<BeaconRange>(BeaconMclDrive::messages(60.0), [&](BeaconRange* range) {
    if (range->beacon == third) range->range += 3.0;
  }));
  const auto& findings = run.out.statuses.back().findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_TRUE(says(findings[0].text, "is used"));
  EXPECT_EQ(findings[0].kind, "beacon_biased");
  EXPECT_EQ(findings[0].id, third);
  EXPECT_NEAR(findings[0].size, 3.0, 0.3);
  EXPECT_LT(findings[0].begin, findings[0].end);
  EXPECT_LT(run.error(), 0.5);
  // Known for long, it leaves a filter healthy that goes on from a checkpoint.
  Rig second(options_of_redraw<BeaconMclDrive>());
  second.pipeline.resume(*run.pipeline.checkpoint());
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(60.0, 63.0)) {
    if (std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message)) {
      handle(message, &second.pipeline);
    }
  }
  ASSERT_FALSE(second.out.statuses.empty());
  ASSERT_EQ(second.out.statuses[0].findings.size(), 1u);
  EXPECT_EQ(second.out.statuses[0].findings[0].kind, "beacon_biased");
  second.feed(BeaconMclDrive::messages(63.0, 64.0));
  const FilterStatus& status = second.out.statuses.back();
  ASSERT_EQ(status.findings.size(), 1u);
  EXPECT_EQ(status.findings[0].begin, findings[0].begin);
  EXPECT_EQ(status.health, run.out.statuses.back().health);
}

TEST(BeaconMclPipeline, OdometryThatTurnsTheWrongWayIsAFinding) {
  Rig run(options_of_redraw<BeaconMclDrive>());
  run.feed(changed<nav_msgs::Odometry>(BeaconMclDrive::messages(60.0), mirror));
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.findings.size(), 1u);
  EXPECT_EQ(status.findings[0].kind, "odometry_turns_wrong");
  EXPECT_NEAR(status.findings[0].size, -1.0, 0.1);
  EXPECT_EQ(status.health, "doubtful");
  run.pipeline.reset();
  run.feed(BeaconMclDrive::messages(5.0));
  EXPECT_TRUE(run.out.statuses.back().findings.empty());
}

TEST(BeaconMclPipeline, ABeaconThatRepeatsAnotherIsAFinding) {
  Rig run(options_of_redraw<BeaconMclDrive>());
  const int first = BeaconMclDrive::beacons()[0].id, third = BeaconMclDrive::beacons()[2].id;
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(30.0)) {
    const auto* range = std::get_if<BeaconRange::ConstPtr>(&message);
    if (range == nullptr || (*range)->beacon != third) handle(message, &run.pipeline);
    if (range == nullptr || (*range)->beacon != first) continue;
    BeaconRange repeated = **range;
    repeated.beacon = third;
    run.pipeline.handle(repeated);
  }
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.findings.size(), 1u);
  EXPECT_EQ(status.findings[0].kind, "beacon_repeats");
  EXPECT_EQ(status.findings[0].id, third);
}

// While it cannot tell yet, a filter with a wrong list is sure of a place that is metres away.
TEST(BeaconMclPipeline, IsNotHealthyBeforeTheListWasJudged) {
  Rig run(options_of_redraw<BeaconMclDrive>());
  int healthy = 0;
  double error_before = 0.0;
  const auto swap = [](BeaconArray* array) {
    std::swap(array->beacons[0].position, array->beacons[1].position);
  };
  for (const auto& message : changed<BeaconArray>(BeaconMclDrive::messages(40.0), swap)) {
    handle(message, &run.pipeline);
    if (run.out.statuses.empty() || run.out.poses.empty()) continue;
    if (run.out.statuses.back().health != "healthy") {
      error_before = std::max(error_before, run.error());
      continue;
    }
    ++healthy;
    ASSERT_LT(run.error(), 1.0) << run.out.statuses.back().health_text;
  }
  EXPECT_GT(error_before, 3.0);
  EXPECT_GT(healthy, 200);
}

TEST(BeaconMclPipeline, ABeaconThatLiesOrIsSilentIsNamed) {
  const int third = BeaconMclDrive::beacons()[2].id;
  const std::string name = "beacon " + std::to_string(third);
  // Redraw names the one that lies as biased, and does without it: see above.
  BeaconMclPipelineOptions resamples = BeaconMclDrive::options();
  resamples.filter.strategy.renewal = Renewal::resampling;
  Rig lying(resamples);
  const auto drive = BeaconMclDrive::messages(60.0);
  const auto is_of_it = [&](const BeaconRange& range) {
    return range.beacon == third && range.header.stamp.toSec() > kStart + 20.0;
  };
  lying.feed(changed<BeaconRange>(drive, [&](BeaconRange* range) {
    if (is_of_it(*range)) range->range += 5.0;
  }));
  Rig silent;
  for (const BeaconMclMessage& message : drive) {
    const auto* range = std::get_if<BeaconRange::ConstPtr>(&message);
    if (range == nullptr || !is_of_it(**range)) handle(message, &silent.pipeline);
  }
  Rig wild;
  int ranges = 0;
  wild.feed(changed<BeaconRange>(drive, [&](BeaconRange* range) {
    if (is_of_it(*range) && ++ranges % 5 == 0) range->range += 5.0;
  }));
  EXPECT_TRUE(says(said(lying.out, "beacon_mcl: beacons"), name + " do not fit"));
  EXPECT_TRUE(says(said(silent.out, "beacon_mcl: beacons"), name + " has not been heard"));
  Rig good;
  good.feed(BeaconMclDrive::messages(60.0));
  EXPECT_EQ(said(good.out, "beacon_mcl: beacons"), "fine");
  EXPECT_EQ(lying.out.statuses.back().health, "doubtful") << lying.out.statuses.back().health_text;
  EXPECT_EQ(silent.out.statuses.back().health, "healthy");
  const auto is_doubtful = [](const FilterStatus& status) { return status.health == "doubtful"; };
  const auto& statuses = wild.out.statuses;
  EXPECT_TRUE(std::none_of(statuses.begin(), statuses.end(), is_doubtful));
  // Neither is lost for it: the others hold the belief.
  EXPECT_LT(lying.error(), 1.0);
  EXPECT_LT(silent.error(), 0.5);
  EXPECT_LT(lying.out.statuses.back().lost, 0.5);
}

// Where a quarter of all ranges are wild, that is how this radio is: nobody is to blame, and the
// filter is not lost.
TEST(BeaconMclPipeline, WildRangesOfAllBeaconsBlameNobody) {
  Rig rig;
  int ranges = 0;
  rig.feed(changed<BeaconRange>(BeaconMclDrive::messages(120.0), [&](BeaconRange* range) {
    const RandomStream random(1, RandomPurpose::test, static_cast<std::uint32_t>(ranges++));
    if (random.uniform(0) < 0.25) range->range = 20.0 * random.uniform(1);
  }));
  EXPECT_EQ(said(rig.out, "beacon_mcl: beacons"), "fine");
  EXPECT_LT(rig.error(), 0.5);
  const auto is_wrong = [](const FilterStatus& status) {
    return status.health == "doubtful" || status.health == "lost";
  };
  const auto& statuses = rig.out.statuses;
  const auto wrong = std::count_if(statuses.begin(), statuses.end(), is_wrong);
  EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(statuses.size()));
}

// ---- beacons that nobody listed ---------------------------------------------------------------

BeaconMclPipelineOptions that_finds_beacons() {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.filter.beacon_positions = BeaconPositions::estimated;
  return options;
}

/// A drive without what says where the beacons are.
std::vector<BeaconMclMessage> without_list(std::vector<BeaconMclMessage> messages) {
  messages.erase(messages.begin());
  return messages;
}

// The frame is that of the first pose.
TEST(BeaconMclPipeline, FindsBeaconsAndPublishesThem) {
  Rig run(that_finds_beacons());
  run.feed(without_list(BeaconMclDrive::messages(60.0)));
  EXPECT_EQ(run.out.statuses.back().health, "healthy") << run.out.statuses.back().health_text;
  const Pose2 start = BeaconMclDrive::truth(ros::Time(kStart));
  const Pose2 there = compose(start, run.pose());
  EXPECT_LT(distance(there, BeaconMclDrive::truth(run.out.poses.back().header.stamp)), 0.2);
  const BeaconMap& map = run.out.maps.back();
  EXPECT_EQ(map.header.frame_id, "map");
  ASSERT_EQ(map.places.size(), 4U);
  for (std::size_t b = 0; b < 4; ++b) {
    const Beacon beacon = BeaconMclDrive::beacons()[b];
    const BeaconPlace& place = map.places[b];
    EXPECT_EQ(place.id, beacon.id);
    EXPECT_EQ(place.probability, 1.0);
    EXPECT_GT(place.covariance[0], 0.0);
    const Pose2 found = compose(start, {place.position.x, place.position.y, 0.0});
    EXPECT_LT(distance(found, {beacon.position.x(), beacon.position.y(), 0.0}), 0.3);
  }
  EXPECT_TRUE(all_finite(run.out));
  EXPECT_EQ(run.rejected("ranges", RejectReason::unknown_beacon), 0U);
}

/// Straight on, past four beacons, at 1 m/s from the origin.
void drive_straight(double seconds, Rig* run) {
  const auto beacons = BeaconMclDrive::beacons();
  for (int step = 0; step <= static_cast<int>(10.0 * seconds); ++step) {
    const ros::Time stamp = BeaconMclDrive::at(0.1 * step);
    nav_msgs::Odometry odometry = BeaconMclDrive::odometry(BeaconMclDrive::at(0.0));
    odometry.header.stamp = stamp;
    odometry.pose.pose.position.x = 0.1 * step;
    run->pipeline.handle(odometry);
    BeaconRange range = BeaconMclDrive::range(stamp, step % 4);
    const Beacon& beacon = beacons[static_cast<std::size_t>(step % 4)];
    range.range = std::hypot(beacon.position.x() - (0.1 * step - 15.0), beacon.position.y()) +
                  0.1 * std::sin(2.0 * step);
    run->pipeline.handle(range);
  }
}

// Nothing else says how long it is.
TEST(BeaconMclPipeline, IsAsUnsureOfAMetreAsItsOdometryWhereNobodyListsBeacons) {
  Rig run(that_finds_beacons());
  run.feed(changed<nav_msgs::Odometry>(without_list(BeaconMclDrive::messages(60.0)), lengthen));
  EXPECT_EQ(run.out.statuses.back().health, "healthy") << run.out.statuses.back().health_text;
  const Pose2 truth = relative(BeaconMclDrive::truth(BeaconMclDrive::at(0.0)),
                               BeaconMclDrive::truth(BeaconMclDrive::at(30.0)));
  const auto is_there = [](const auto& pose) {
    return pose.header.stamp >= BeaconMclDrive::at(30.0);
  };
  const auto there = std::find_if(run.out.poses.begin(), run.out.poses.end(), is_there);
  ASSERT_NE(there, run.out.poses.end());
  const Eigen::Vector2d off(there->pose.pose.position.x - truth.x,
                            there->pose.pose.position.y - truth.y);
  Eigen::Matrix2d covariance;
  covariance << there->pose.covariance[0], there->pose.covariance[1], there->pose.covariance[6],
      there->pose.covariance[7];
  EXPECT_GT(off.norm(), 0.2);
  EXPECT_LT(off.dot(covariance.inverse() * off), 9.0);
}

TEST(BeaconMclPipeline, ShowsBothSidesAndIsNotHealthyBeforeATurn) {
  Rig run(that_finds_beacons());
  drive_straight(30.0, &run);
  EXPECT_EQ(run.out.maps.back().places.size(), 8U);
  std::map<int, double> sums;
  for (const BeaconPlace& place : run.out.maps.back().places) {
    EXPECT_LT(place.probability, 0.95);
    sums[place.id] += place.probability;
  }
  for (const auto& [id, sum] : sums) EXPECT_NEAR(sum, 1.0, 1e-9) << id;
  EXPECT_EQ(run.out.statuses.back().health, "converging");
  EXPECT_TRUE(says(run.out.statuses.back().health_text, "drive a turn near it"));
  int posts = 0;
  for (const auto& marker : run.out.markers.back().markers) {
    posts += marker.ns == "beacons" || marker.ns == "beacon_2_sigma" ? 1 : 0;
    // As large as the scene asks for, though no place is sure.
    if (marker.ns == "beacons") {
      EXPECT_GT(marker.scale.z, 0.4);
    }
  }
  EXPECT_EQ(posts, 16);
}

// A file that the list of another run can be.
TEST(BeaconMclPipeline, GoesOnFromBeaconsThatWereSaved) {
  const TemporaryDirectory directory;
  Rig first(that_finds_beacons());
  first.feed(without_list(BeaconMclDrive::messages(60.0)));
  const std::string said = first.pipeline.save_beacons(directory.file("beacons.yaml"));
  EXPECT_TRUE(says(said, "4 beacons written to "));
  BeaconMclPipelineOptions options = that_finds_beacons();
  apply(read_configuration(directory.file("beacons.yaml")), &options);
  ASSERT_EQ(options.beacons.size(), 4U);
  EXPECT_GT(options.beacons[0].sigma, 0.0);
  EXPECT_EQ(options.calibration.size(), 4U);
  Rig second(options);
  second.feed(without_list(BeaconMclDrive::messages(20.0)));
  const Pose2 there = compose(BeaconMclDrive::truth(ros::Time(kStart)), second.pose());
  EXPECT_LT(distance(there, BeaconMclDrive::truth(second.out.poses.back().header.stamp)), 0.2);
  EXPECT_THROW(Rig().pipeline.save_beacons(directory.file("none.yaml")), Error);
}

TEST(BeaconMclPipeline, ACheckpointKeepsWhatWasFound) {
  Rig whole(that_finds_beacons());
  whole.feed(without_list(BeaconMclDrive::messages(30.1)));  // none waits for odometry
  Rig second(that_finds_beacons());
  second.pipeline.resume(*whole.pipeline.checkpoint());
  for (Rig* run : {&whole, &second}) run->feed(BeaconMclDrive::messages(30.1, 40.0));
  EXPECT_TRUE(same_particles(whole.particles(), second.particles()));
  EXPECT_EQ(whole.pipeline.filter()->found_beacons().size(), 4U);
}

}  // namespace
}  // namespace pf_resampling
