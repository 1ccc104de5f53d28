// What FastSlamPipeline makes of scans: sensors anywhere on the robot, ids or none, what is not
// believed; and the map, markers, status and diagnostics that it gives out.
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

using Drive = FastSlamDrive;
using Scan = LandmarkObservationArray;
using visualization_msgs::Marker;

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child,
                                          const Pose2& place) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform.translation.x = place.x;
  transform.transform.translation.y = place.y;
  transform.transform.rotation = to_quaternion_message(place.heading);
  return transform;
}

/// A drive with a sensor at `sensor` on the robot whose scans are in `frame`.
std::vector<FastSlamMessage> drive_with(const Pose2& sensor, const std::string& frame,
                                        double seconds) {
  std::vector<FastSlamMessage> all;
  for (int step = 0; step <= 10 * seconds; ++step) {
    const ros::Time stamp = Drive::at(0.1 * step);
    all.emplace_back(boost::make_shared<nav_msgs::Odometry>(Drive::odometry(stamp)));
    LandmarkObservationArray scan = Drive::scan(stamp, sensor);
    scan.header.frame_id = frame;
    all.emplace_back(boost::make_shared<LandmarkObservationArray>(scan));
  }
  return all;
}

void forget_ids(Scan* scan) {
  for (LandmarkObservation& seen : scan->observations) seen.id = -1;
}

// ---- sensors ----------------------------------------------------------------------------------

TEST(FastSlamScans, TheSensorMaySitAnywhereAndBeTurned) {
  // Behind the robot, to the left, looking back: taken for the robot's centre, landmarks would be
  // off by more than a metre and on the wrong side.
  const Pose2 sensor{-0.8, 0.5, 2.6};
  const auto drive = drive_with(sensor, "camera", 30.0);
  FastSlamRig from_tf;
  tf2_msgs::TFMessage message;
  // By way of a mast, and with slashes as before tf2.
  const Pose2 mast{-1.0, 0.0, 1.2};
  message.transforms = {transform("/base_link", "/mast", mast),
                        transform("mast", "camera", relative(mast, sensor))};
  from_tf.pipeline.handle(message);
  from_tf.feed(drive);
  EXPECT_EQ(from_tf.pipeline.rejects().total(), 0u);
  EXPECT_LT(from_tf.error(), kLost);
  EXPECT_LT(from_tf.map_error(), kLost);

  FastSlamPipelineOptions options = Drive::options();
  options.sensors["camera"] = sensor;
  FastSlamRig configured(options);
  configured.feed(drive);
  EXPECT_LT(configured.error(), kLost);
  EXPECT_LT(configured.map_error(), kLost);

  // tf tells more than the configuration.
  options.sensors["camera"] = {3.0, 3.0, 0.0};
  FastSlamRig both(options);
  both.pipeline.handle(message);
  both.feed(drive);
  EXPECT_TRUE(same_bytes(both.out.poses, from_tf.out.poses));

  FastSlamRig none;
  none.feed(drive);
  EXPECT_EQ(none.rejected("landmarks", RejectReason::unknown_frame), 301u);
  EXPECT_TRUE(none.has_said("'camera' is on 'base_link' is not known"));
  EXPECT_TRUE(none.out.updates.empty());
  EXPECT_EQ(none.out.poses.size(), 301u);  // by odometry
}

TEST(FastSlamScans, ASensorThatIsNotUprightIsRejected) {
  FastSlamRig run;
  tf2_msgs::TFMessage message;
  message.transforms = {transform("base_link", "camera", {}), transform("base_link", "tilted", {})};
  message.transforms[0].transform.rotation = geometry_msgs::Quaternion();
  message.transforms[0].transform.rotation.x = 1.0;  // upside down
  message.transforms[1].transform.rotation.y = std::sin(0.1);
  message.transforms[1].transform.rotation.w = std::cos(0.1);  // 11 degrees: a slope
  run.pipeline.handle(message);
  run.feed(drive_with({}, "camera", 1.0));
  EXPECT_EQ(run.rejected("landmarks", RejectReason::wrong_frame), 11u);
  EXPECT_TRUE(run.has_said("the z axis of 'camera' does not point up"));
  EXPECT_TRUE(run.out.updates.empty());
  FastSlamRig tilted;
  tilted.pipeline.handle(message);
  tilted.feed(drive_with({}, "tilted", 1.0));
  EXPECT_EQ(tilted.pipeline.rejects().total(), 0u);
  EXPECT_EQ(tilted.out.updates.size(), 11u);
}

TEST(FastSlamScans, WhereTheRobotIsIsNotLearntFromTf) {
  FastSlamRig run;
  tf2_msgs::TFMessage message;
  message.transforms = {transform("odom", "base_link", {5.0, 5.0, 1.0}),
                        transform("map", "odom", {5.0, 5.0, 1.0})};
  run.pipeline.handle(message);
  run.feed(Drive::messages(5.0));
  FastSlamRig without;
  without.feed(Drive::messages(5.0));
  EXPECT_TRUE(same_bytes(run.out.poses, without.out.poses));
}

// ---- ids --------------------------------------------------------------------------------------

TEST(FastSlamScans, WithIdsTheMapHasTheLandmarksOfTheWorld) {
  FastSlamRig run;
  run.feed(Drive::messages(40.0));
  EXPECT_EQ(run.pipeline.filter().association(), DataAssociation::known);
  const LandmarkMap& map = run.out.maps.back();
  EXPECT_EQ(map.header.frame_id, "map");
  ASSERT_EQ(map.landmarks.size(), 12u);
  for (std::size_t id = 0; id < 12; ++id) {
    const Landmark& landmark = map.landmarks[id];
    EXPECT_EQ(landmark.id, static_cast<int>(id));
    EXPECT_EQ(landmark.covariance[1], landmark.covariance[2]);
    EXPECT_GT(landmark.covariance[0], 0.0);
    // One look is good to 0.1 m and 0.02 * 7 m: the root of their squares, 0.17 m.
    EXPECT_LT(landmark.covariance[0] + landmark.covariance[3], 0.17 * 0.17);
  }
  EXPECT_LT(run.map_error(), kLost);
  EXPECT_EQ(run.out.statuses.back().landmarks, 12u);
}

TEST(FastSlamScans, WithoutIdsItFindsThemToo) {
  FastSlamRig run;
  run.feed(changed<Scan>(Drive::messages(80.0), forget_ids));
  EXPECT_EQ(run.pipeline.filter().association(), DataAssociation::mutual_exclusion);
  EXPECT_EQ(value_of(run.out.diagnostics.back(), "data association"), "mutual_exclusion");
  ASSERT_EQ(run.out.maps.back().landmarks.size(), 12u);
  for (const Eigen::Vector2d& truth : Drive::landmarks()) {
    double nearest = 1e9;
    for (const Landmark& landmark : run.out.maps.back().landmarks) {
      nearest = std::min(
          nearest, (Eigen::Vector2d(landmark.position.x, landmark.position.y) - truth).norm());
    }
    EXPECT_LT(nearest, kLost);
  }
  EXPECT_LT(run.error(), kLost);
}

TEST(FastSlamScans, WhereIdsAreKnownTheOthersAreRejectedOneByOne) {
  const auto drive = Drive::messages(20.0);
  FastSlamRig good;
  good.feed(drive);
  FastSlamRig run;
  int count = 0;
  run.feed(changed<Scan>(drive, [&](Scan* scan) {
    if (++count < 2) return;
    LandmarkObservation more = scan->observations.front();
    more.id = -1;
    scan->observations.insert(scan->observations.begin() + 1, more);
  }));
  EXPECT_EQ(run.rejected("landmarks", RejectReason::unknown_id), 99u);
  EXPECT_TRUE(run.has_said("association/method is known"));
  EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
}

TEST(FastSlamScans, IfTheFirstScanIsMixedIdsAreNotUsed) {
  FastSlamRig run;
  bool first = true;
  run.feed(changed<Scan>(Drive::messages(40.0), [&](Scan* scan) {
    if (first) scan->observations.front().id = -1;
    first = false;
  }));
  EXPECT_EQ(run.pipeline.filter().association(), DataAssociation::mutual_exclusion);
  EXPECT_EQ(run.pipeline.rejects().total(), 0u);
  EXPECT_LT(run.error(), kLost);
}

TEST(FastSlamScans, MisreadIdsAreNotBelievedAndCountedButNotRejected) {
  FastSlamRig run;
  run.feed(Drive::messages(20.0));
  ASSERT_EQ(run.pipeline.rejects().total(), 0u);
  // From now on another landmark's id stands on one observation of each scan; both landmarks are
  // in the map, at least 2 m apart: 20 sigma.
  std::uint64_t misread = 0;
  run.feed(changed<Scan>(Drive::messages(20.1, 40.0), [&](Scan* scan) {
    scan->observations.front().id = (scan->observations.front().id + 6) % 12;
    ++misread;
  }));
  const std::uint64_t counted = run.pipeline.not_believed();
  // The last scan is still waiting.
  EXPECT_GE(counted, misread - 1);
  EXPECT_LE(counted, misread);
  const FilterStatus& status = run.out.statuses.back();
  EXPECT_EQ(status.not_believed, counted);
  EXPECT_TRUE(status.rejects.empty());
  EXPECT_EQ(run.out.diagnostics.back().status[1].message, "fine");
  EXPECT_LT(run.error(), kLost);
  EXPECT_LT(run.map_error(), kLost);
  // Resampling has left one history of the map's past by now; nothing else is wrong.
  EXPECT_EQ(status.health, "depleted");
  EXPECT_FALSE(says(run.out.diagnostics.back().status[0].message, "lost"));
}

TEST(FastSlamScans, AnEmptyMapReplacesNoFile) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("good.map");
  FastSlamRig run;
  EXPECT_THROW(run.pipeline.save_map(path), Error);
  EXPECT_FALSE(std::ifstream(path).good());
  run.feed(Drive::messages(60.0));
  EXPECT_TRUE(says(run.pipeline.save_map(path), "12 landmarks"));
  EXPECT_EQ(run.pipeline.landmarks(), 12u);
  run.pipeline.reset();
  EXPECT_THROW(run.pipeline.save_map(path), Error);
  EXPECT_EQ(read_map_file(path).landmarks.size(), 12u);
}

// A list of all landmarks of the drive.
std::string write_survey(const TemporaryDirectory& directory) {
  std::ofstream list(directory.file("survey.csv"));
  list << "id,x,y\n";
  const auto places = Drive::landmarks();
  for (std::size_t i = 0; i < places.size(); ++i) {
    list << i << "," << places[i].x() << "," << places[i].y() << "\n";
  }
  return directory.file("survey.csv");
}

TEST(FastSlamScans, LoadsASurveyedMapAndSaysSo) {
  const TemporaryDirectory directory;
  const std::string path = write_survey(directory);
  FastSlamRig run;
  EXPECT_EQ(run.pipeline.load_map(path, true), "12 landmarks loaded from " + path + ", frozen");
  run.feed(Drive::messages(20.0));
  EXPECT_EQ(run.out.statuses.back().map_file, path);
  EXPECT_LT(run.map_error(), 1e-4);  // six digits in the list
  EXPECT_LT(run.error(), kLost);
  run.pipeline.reset();
  run.feed(Drive::messages(20.0));
  EXPECT_EQ(run.out.statuses.back().map_file, "");
}

// What a camera sees that sees what is most ahead alone.
std::vector<FastSlamMessage> most_ahead(const std::vector<FastSlamMessage>& messages) {
  return changed<Scan>(messages, [](Scan* scan) {
    const auto ahead =
        std::min_element(scan->observations.begin(), scan->observations.end(),
                         [](const LandmarkObservation& a, const LandmarkObservation& b) {
                           return std::abs(a.bearing) < std::abs(b.bearing);
                         });
    scan->observations = {LandmarkObservation(*ahead)};
  });
}

// Three laps in a surveyed map with such a camera, changed by `change` where that is landmark 4.
// The only finding.
FindingStatus only_finding_of(const std::function<void(LandmarkObservationArray*)>& change,
                              FastSlamRig* run) {
  const TemporaryDirectory directory;
  run->pipeline.load_map(write_survey(directory), true);
  run->feed(changed<Scan>(most_ahead(Drive::messages(115.0)), [&](Scan* scan) {
    if (scan->observations.front().id == 4) change(scan);
  }));
  EXPECT_LT(run->error(), kLost);
  const std::vector<FindingStatus> findings = run->out.statuses.back().findings;
  EXPECT_EQ(findings.size(), 1u);
  return findings.empty() ? FindingStatus() : findings.front();
}

// Where it is not where the map begins, what it sees at first says nothing of the landmarks.
TEST(FastSlamScans, AWrongStartInAKnownMapIsNoFinding) {
  const TemporaryDirectory directory;
  FastSlamRig run;
  run.pipeline.load_map(write_survey(directory), true);
  run.feed(most_ahead(Drive::messages(12.0, 40.0)));
  EXPECT_TRUE(run.has_said("lost: the latest landmarks fit the map"));
  EXPECT_LT(run.error(), kLost);
  EXPECT_TRUE(run.out.statuses.back().findings.empty());
}

// What it shows contradicts the map for as long as nothing else is in view.
TEST(FastSlamScans, ALandmarkThatWasMovedDrawsNobodyAlong) {
  FastSlamRig run;
  const auto moved =
      only_finding_of([](auto* scan) { scan->observations.front().range += 3.0; }, &run);
  EXPECT_EQ(moved.kind, "landmark_moved");
  EXPECT_EQ(moved.id, 4);
  EXPECT_NEAR(moved.size, 3.0, 0.2);
  std::set<std::string> health;
  for (const FilterStatus& status : run.out.statuses) health.insert(status.health);
  EXPECT_EQ(health.count("lost"), 0u);
  EXPECT_EQ(health.count("doubtful"), 1u);
}

// A robot that was carried off sees new landmarks where it saw them first, wherever it is.
TEST(FastSlamScans, NewLandmarksDoNotSettleAContradiction) {
  FastSlamRig run;
  run.feed(Drive::messages(45.0));
  const auto see = [&](double time, int id, const Eigen::Vector2d& place) {
    const ros::Time stamp = Drive::at(time);
    run.pipeline.handle(Drive::odometry(stamp));
    LandmarkObservationArray scan = Drive::scan(stamp);
    scan.observations.resize(1);
    const Eigen::Vector2d from = seen_from(Drive::truth(stamp), place);
    scan.observations[0].id = id;
    scan.observations[0].range = from.norm();
    scan.observations[0].bearing = std::atan2(from.y(), from.x());
    run.pipeline.handle(scan);
  };
  const auto is_doubted = [&] {
    return says(run.out.statuses.back().health_text, "contradict the others");
  };
  const Eigen::Vector2d ahead = moved(Eigen::Vector2d(4.0, 0.0), Drive::truth(Drive::at(46.0)));
  const auto behind = Drive::scan(Drive::at(25.0)).observations.front().id;
  for (const double time : {45.1, 45.2, 45.3}) see(time, behind, ahead);
  EXPECT_TRUE(is_doubted());
  for (const double time : {45.4, 45.5, 45.6}) see(time, 77, ahead);
  EXPECT_TRUE(is_doubted());
  run.feed(Drive::messages(45.7, 47.0));
  EXPECT_FALSE(is_doubted());
  for (const double time : {47.1, 47.2, 47.3}) see(time, behind, ahead);
  EXPECT_TRUE(is_doubted());
  run.pipeline.reset();
  see(47.4, behind, ahead);
  EXPECT_FALSE(is_doubted());
}

TEST(FastSlamScans, ScansThatSeeNothingSayWhatIsGone) {
  FastSlamRig run;
  const auto gone = only_finding_of([](auto* scan) { scan->observations.clear(); }, &run);
  EXPECT_EQ(gone.kind, "landmark_gone");
  EXPECT_EQ(gone.id, 4);
}

TEST(FastSlamScans, OdometryThatTurnsTheWrongWayIsNamedAndCorrected) {
  FastSlamRig run(options_of_redraw<Drive>());
  run.feed(changed<nav_msgs::Odometry>(Drive::messages(60.0), mirror));
  EXPECT_LT(run.error(), kLost);
  const FilterStatus& status = run.out.statuses.back();
  ASSERT_EQ(status.findings.size(), 1u);
  EXPECT_EQ(status.findings[0].kind, "odometry_turns_wrong");
  EXPECT_NEAR(status.findings[0].size, -1.0, 0.05);
  EXPECT_EQ(status.health, "doubtful");
  EXPECT_TRUE(says(status.health_text, "odometry")) << status.health_text;
}

TEST(FastSlamScans, WhenNothingFitsTheMapDiagnosticsAskWhetherItIsLost) {
  FastSlamRig run;
  run.feed(Drive::messages(20.0));
  EXPECT_EQ(run.out.diagnostics.back().status[0].message, "fine");
  run.feed(changed<Scan>(Drive::messages(20.1, 60.0), [](Scan* scan) {
    // No turn or shift of the map makes these ids right.
    for (auto& seen : scan->observations) seen.id = (seen.id * 5) % 12;
  }));
  EXPECT_TRUE(says(run.out.diagnostics.back().status[0].message, "lost?"));
  EXPECT_EQ(run.out.diagnostics.back().status[0].level, diagnostic_msgs::DiagnosticStatus::WARN);
}

TEST(FastSlamScans, AnIdTwiceInAScanIsOneLandmark) {
  FastSlamRig run;
  run.feed(changed<Scan>(Drive::messages(20.0), [](Scan* scan) {
    scan->observations.push_back(scan->observations.front());
  }));
  run.pipeline.publish_results();
  std::set<int> ids;
  for (const Landmark& landmark : run.out.maps.back().landmarks) ids.insert(landmark.id);
  EXPECT_EQ(ids.size(), run.out.maps.back().landmarks.size());
  EXPECT_LT(run.error(), kLost);
  EXPECT_EQ(run.rejected("landmarks", RejectReason::repeated), 100u);
}

// Two tags with one id in one image: what fits the map is believed, and it is said.
TEST(FastSlamScans, AnIdAtTwoPlacesInAScanIsSaid) {
  FastSlamRig run;
  run.feed(changed<Scan>(Drive::messages(20.0), [](Scan* scan) {
    scan->observations.push_back(scan->observations.front());
    scan->observations.back().range += 2.0;
  }));
  EXPECT_TRUE(run.has_said("appears twice in a scan, 2.000 m apart"));
  EXPECT_EQ(value_of(run.out.diagnostics.back(), "scans with an id in two positions").substr(0, 2),
            "10");
  EXPECT_LT(run.error(), kLost);
}

// ---- what comes out ---------------------------------------------------------------------------

TEST(FastSlamScans, PathAndMapComeAtTheirPeriods) {
  FastSlamPipelineOptions options = Drive::options();
  options.output.path_period = 4.0;
  options.map_period = 5.0;
  FastSlamRig run(options);
  run.feed(Drive::messages(20.0));
  EXPECT_EQ(run.out.paths.size(), 6u);  // with the first scan, then at 4, 8, ... 20 s
  EXPECT_EQ(run.out.maps.size(), 5u);
}

TEST(FastSlamScans, TheMapWaitsUntilEnoughParticlesHoldALandmark) {
  FastSlamPipelineOptions options = Drive::options();
  options.map_min_held = 1.0;
  FastSlamRig run(options);
  run.feed(Drive::messages(20.0));
  EXPECT_FALSE(run.out.maps.back().landmarks.empty());  // with ids all hold what is there
}

TEST(FastSlamScans, MarkersShowTheLastScanFromWhereItWasTaken) {
  FastSlamPipelineOptions options = Drive::options();
  options.output.marker_period = 0.0;
  options.map_period = 0.0;
  FastSlamRig run(options);
  run.feed(Drive::messages(20.0));
  // The last was shown at 20.0 s, of the scan of 19.84 s.
  ASSERT_EQ(run.out.updates.back(), Drive::at(19.84));
  const auto lines = markers_called(run.out.markers.back(), "seen_again");
  ASSERT_EQ(lines.size(), 1u);
  const auto found = markers_called(run.out.markers.back(), "seen_first");
  ASSERT_EQ(found.size(), 1u);
  const std::size_t seen = Drive::scan(Drive::at(19.84)).observations.size();
  ASSERT_EQ(lines[0].points.size() + found[0].points.size(), 2 * seen);
  ASSERT_GT(lines[0].points.size(), 2u);
  const Pose2 there = Drive::truth(Drive::at(19.84));
  EXPECT_LT(std::hypot(lines[0].points[0].x - there.x, lines[0].points[0].y - there.y), 0.3);

  // The robot drives on without scans: the lines do not go with it, and then they go.
  for (int i = 1; i <= 300; ++i) run.pipeline.handle(Drive::odometry(Drive::at(20.0 + 0.1 * i)));
  EXPECT_EQ(markers_called(run.out.markers.back(), "seen_again").at(0).action, Marker::DELETE);
  for (const auto& array : run.out.markers) {
    if (array.markers.front().header.stamp < Drive::at(19.95)) continue;
    for (const Marker& marker : markers_called(array, "seen_again")) {
      if (marker.points.empty()) continue;
      EXPECT_LT(std::hypot(marker.points[0].x - there.x, marker.points[0].y - there.y), 0.3);
    }
  }
}

TEST(FastSlamScans, StatusAndDiagnosticsSayHowTheFilterIs) {
  FastSlamRig silent;
  silent.pipeline.report_silence(ros::Time(kPi));
  ASSERT_EQ(silent.out.diagnostics.size(), 1u);
  EXPECT_EQ(silent.out.diagnostics[0].status[0].message,
            "waiting for odometry; no landmark has been seen yet");
  EXPECT_EQ(silent.out.diagnostics[0].status[1].message,
            "no odometry yet; no usable landmarks yet");
  FastSlamRig run;
  run.feed(Drive::messages(20.0));
  ASSERT_EQ(run.out.statuses.size(), 100u);
  for (std::size_t i = 0; i < run.out.statuses.size(); ++i) {
    const FilterStatus& status = run.out.statuses[i];
    EXPECT_EQ(status.header.stamp, run.out.updates[i]);
    EXPECT_EQ(status.header.frame_id, "map");
    EXPECT_EQ(status.particles, 60u);
    EXPECT_EQ(status.updates, i + 1);
    EXPECT_GE(status.effective_sample_size, 1.0);
    EXPECT_LE(status.effective_sample_size, 60.0 + 1e-9);
    EXPECT_GE(status.entropy_sample_size, status.effective_sample_size - 1e-9);  // Jensen
    EXPECT_GE(status.distinct_ancestors_since_start, 1u);
    EXPECT_LE(status.distinct_ancestors_since_start, 60u);
    EXPECT_EQ(status.update_time, 0.0);  // reproducible
    EXPECT_EQ(status.observation, -1);
    // Of the first scan all is new.
    EXPECT_EQ(status.log_likelihood == 0.0, i == 0);
  }
  EXPECT_EQ(run.out.statuses.back().strategy,
            "effective_sample_size < 0.75, resampling "
            "systematic, none");
  const auto& diagnostics = run.out.diagnostics.back();
  EXPECT_EQ(diagnostics.status[0].name, "fastslam: mapping");
  EXPECT_EQ(diagnostics.status[0].message, "fine");
  EXPECT_EQ(diagnostics.status[1].message, "fine");
  EXPECT_EQ(value_of(diagnostics, "landmarks"), std::to_string(run.out.statuses.back().landmarks));
  EXPECT_EQ(value_of(diagnostics, "updates"), "100");
  EXPECT_EQ(value_of(diagnostics, "poses not published"), "0");
  run.pipeline.report_silence(Drive::at(40.0));
  EXPECT_TRUE(says(run.out.diagnostics.back().status[1].message, "no odometry for 20.000 s"));
}

}  // namespace
}  // namespace pf_resampling
