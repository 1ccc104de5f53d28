#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/Range.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/run_program.hpp"
#include "tools/checks/bag_findings.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/files.hpp"
#include "tools/worlds/recording_to_bag.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// 10 s of odometry at 10 Hz and ranges at 3 × 1 Hz, with nothing wrong.
Recording good_recording() {
  Recording recording;
  for (int i = 0; i <= 100; ++i) {
    const double time = 10.0 + 0.1 * i;
    recording.odometry.push_back({time, {0.1 * i, 0.0, 0.0}});
    recording.truth.push_back({time, {0.1 * i, 0.0, 0.0}});
  }
  for (int i = 0; i < 30; ++i) {
    recording.ranges.push_back({10.05 + i / 3.0, "antenna", 1 + i % 3, 2.0 + i});
  }
  recording.beacons = {
      {1, {0.0, 5.0, 0.5}, true}, {2, {5.0, 5.0, 0.5}, true}, {3, {5.0, 0.0, 0.5}, true}};
  recording.frames["antenna"] = Eigen::Translation3d(0.25, 0.0, 0.5);
  return recording;
}

/// 10 s of odometry at 10 Hz and a scan per second, from 11.05 s on, of the landmarks 7 and 8.
Recording landmark_recording() {
  Recording recording = good_recording();
  recording.ranges.clear();
  recording.beacons.clear();
  for (int i = 0; i < 9; ++i) {
    recording.scans.push_back(
        {11.05 + i, "sensor", {{7, 2.0 + i, 0.5, 0.0, 0.0}, {8, 3.0, -0.25, 0.01, 0.0}}});
  }
  recording.frames.clear();
  recording.frames["sensor"] = Eigen::Translation3d(0.1, 0.0, 0.3);
  return recording;
}

template <typename Next>
void set_ids(StampedScan* scan, const Next& next) {
  for (SeenLandmark& seen : scan->landmarks) seen.id = next();
}

BagFindings check_of(const Recording& recording, const CheckedTopics& topics = {}) {
  const TemporaryDirectory directory;
  write_recording(recording, directory.file("a.bag"));
  return findings_of(open_bag(directory.file("a.bag")), topics);
}

/// What is found in a bag that `write` fills.
BagFindings check_of_written(const std::function<void(BagWriter*)>& write) {
  const TemporaryDirectory directory;
  BagWriter bag(directory.file("a.bag"));
  write(&bag);
  bag.finish();
  return findings_of(open_bag(directory.file("a.bag")), {});
}

bool has(const std::vector<std::string>& lines, const std::string& words) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return says(line, words); });
}

TEST(CheckBag, AGoodBagIsReadyAndHasNoRemarks) {
  const BagFindings found = check_of(good_recording());
  EXPECT_EQ(found.beacon_mcl.text(), "ready for beacon_mcl: yes");
  EXPECT_TRUE(found.remarks.empty()) << found.remarks.front();
}

TEST(CheckBag, ABagWithLandmarksIsReadyForFastSlam) {
  const BagFindings found = check_of(landmark_recording());
  EXPECT_EQ(found.fastslam.text(), "ready for fastslam: yes");
  EXPECT_FALSE(found.beacon_mcl.is_ready());
  EXPECT_TRUE(found.is_ready_for_any());
  EXPECT_TRUE(found.remarks.empty()) << found.remarks.front();
}

TEST(CheckBag, ABagCanBeReadyForBoth) {
  Recording recording = landmark_recording();
  recording.ranges = good_recording().ranges;
  recording.beacons = good_recording().beacons;
  recording.frames["antenna"] = Eigen::Translation3d(0.25, 0.0, 0.5);
  const BagFindings found = check_of(recording);
  EXPECT_TRUE(found.beacon_mcl.is_ready()) << found.beacon_mcl.text();
  EXPECT_TRUE(found.fastslam.is_ready()) << found.fastslam.text();
}

TEST(CheckBag, SaysWhetherLandmarksHaveIds) {
  Recording recording = landmark_recording();
  for (std::size_t i = 0; i < 2; ++i) set_ids(&recording.scans[i], [] { return -1; });
  BagFindings found = check_of(recording);
  EXPECT_TRUE(found.fastslam.is_ready());
  for (StampedScan& scan : recording.scans) set_ids(&scan, [] { return -1; });
  found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "/landmarks: without ids"));
  EXPECT_TRUE(found.fastslam.is_ready());
  std::int32_t id = 0;
  for (StampedScan& scan : recording.scans) set_ids(&scan, [&] { return id++; });
  EXPECT_TRUE(has(check_of(recording).remarks, "/landmarks: no id is seen twice"));
}

TEST(CheckBag, FindsWhatHindersFastSlam) {
  Recording recording = landmark_recording();
  recording.scans[0].landmarks[0].range = kNan;
  BagFindings found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "1 landmarks rejected, not_finite"));
  EXPECT_TRUE(found.fastslam.is_ready());
  for (StampedScan& scan : recording.scans) {
    for (SeenLandmark& seen : scan.landmarks) seen.bearing = kNan;
  }
  EXPECT_TRUE(has(check_of(recording).fastslam.problems, "landmarks rejected, not_finite"));
}

/// A robot that stands at the origin.
nav_msgs::Odometry standing(const ros::Time& stamp) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp = stamp;
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base_link";
  odometry.pose.pose.orientation.w = 1.0;
  return odometry;
}

/// A frame `above` (m) another one.
tf2_msgs::TFMessage placed(const ros::Time& stamp, const std::string& parent,
                           const std::string& child, double above = 0.0) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(1);
  geometry_msgs::TransformStamped& placed = message.transforms[0];
  placed.header.stamp = stamp;
  placed.header.frame_id = parent;
  placed.child_frame_id = child;
  placed.transform.translation.z = above;
  placed.transform.rotation.w = 1.0;
  return message;
}

/// A camera 0.3 m above the frame that it sits on, whose z axis points ahead (an optical frame).
tf2_msgs::TFMessage camera_on(const std::string& parent) {
  tf2_msgs::TFMessage message = placed(ros::Time(10.0), parent, "camera", 0.3);
  geometry_msgs::Quaternion& rotation = message.transforms[0].transform.rotation;
  rotation.w = rotation.y = 0.5;
  rotation.x = rotation.z = -0.5;
  return message;
}

/// A scan of a camera 0.3 m above the robot; `parent` is the frame that it sits on. Its z axis
/// points ahead if `is_optical`.
BagFindings check_of_camera(bool is_optical, const std::string& parent = "base_link") {
  return check_of_written([&](BagWriter* bag) {
    const ros::Time stamp(10.0);
    bag->write("/odom", stamp, standing(stamp));
    LandmarkObservationArray scan;
    scan.header.stamp = stamp;
    scan.header.frame_id = "camera";
    scan.observations.resize(1);
    scan.observations[0].range = 3.0;
    bag->write("/landmarks", stamp, scan);
    // Not latched: a driver that repeats where its camera is.
    bag->write(is_optical ? "/tf_static" : "/tf", stamp,
               is_optical ? camera_on(parent) : placed(stamp, parent, "camera", 0.3));
  });
}

TEST(CheckBag, SensorsLieFlatAndMayBePlacedByTf) {
  EXPECT_TRUE(
      has(check_of_camera(true).fastslam.problems, "the z axis of 'camera' does not point up"));
  EXPECT_FALSE(has(check_of_camera(false).fastslam.problems, "frame"));
  EXPECT_TRUE(has(check_of_camera(false, "mast").fastslam.problems,
                  "where 'camera' is on 'base_link' is not known: give it on /tf_static, or in the "
                  "list `sensors` of the configuration"));
}

TEST(CheckBag, GivesTheCommandWithTheOptionsThatTheBagNeeds) {
  const BagFindings found = check_of_written([](BagWriter* bag) {
    nav_msgs::Odometry odometry = standing(ros::Time(10.0));
    odometry.header.frame_id = "wheels";
    odometry.child_frame_id = "the robot";
    bag->write("/odom", ros::Time(10.0), odometry);
  });
  EXPECT_TRUE(says(found.fastslam.command, "rosrun pf_resampling run_bag fastslam /"));
  EXPECT_TRUE(says(found.fastslam.command,
                   "/a.bag out.bag --set frames/odom=wheels --set 'frames/base=the robot'"));
  CheckedTopics topics;
  topics.odom = "/robot/odom";
  topics.ranges = "/uwb";
  topics.landmarks = "/camera/landmarks";
  const BagFindings renamed = check_of(good_recording(), topics);
  EXPECT_TRUE(says(renamed.beacon_mcl.command, "out.bag --odom /robot/odom --ranges /uwb"));
  EXPECT_TRUE(
      says(renamed.fastslam.command, "out.bag --odom /robot/odom --landmarks /camera/landmarks"));
}

TEST(CheckBag, NamesWhatIsMissingAndWhatIsThere) {
  Recording recording = good_recording();
  recording.beacons.clear();
  recording.ranges.clear();
  const BagFindings found = check_of(recording);
  EXPECT_EQ(found.beacon_mcl.text(),
            "ready for beacon_mcl: no: no /ranges (needed: pf_resampling/BeaconRange); "
            "no /beacons (needed: pf_resampling/BeaconArray) (or give the beacons in the "
            "configuration: --config beacons.yaml)");
  EXPECT_EQ(found.fastslam.text(),
            "ready for fastslam: no: no /landmarks (needed: "
            "pf_resampling/LandmarkObservationArray)");
  EXPECT_FALSE(found.is_ready_for_any());
}

TEST(CheckBag, HintsAtTopicsOfTheRightType) {
  CheckedTopics topics;
  topics.odom = "/robot/odom";
  topics.ranges = "/odom";
  const BagFindings found = check_of(good_recording(), topics);
  EXPECT_TRUE(has(found.beacon_mcl.problems,
                  "no /robot/odom (needed: nav_msgs/Odometry), /odom could be it (--odom /odom; "
                  "for the node odom:=/odom)"));
  EXPECT_TRUE(
      has(found.beacon_mcl.problems, "/odom is a nav_msgs/Odometry (needed: pf_resampling/"));
}

TEST(CheckBag, FindsGapsAndCoverage) {
  Recording recording = good_recording();
  recording.odometry.erase(recording.odometry.begin() + 41, recording.odometry.begin() + 56);
  const BagFindings gap = check_of(recording);
  EXPECT_TRUE(has(gap.remarks, "/odom: nothing came for 1.600 s after 14.000 s"));

  recording = good_recording();
  for (auto& range : recording.ranges) range.time += 100.0;
  EXPECT_TRUE(has(check_of(recording).beacon_mcl.problems, "rejected, ahead_of_odometry"));
}

TEST(CheckBag, FindsNumbersThatAreNone) {
  Recording recording = good_recording();
  recording.odometry[5].pose.x = kNan;
  recording.ranges[4].range = -1.0;
  const BagFindings found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "1 odom rejected, not_finite"));
  EXPECT_TRUE(has(found.remarks, "1 ranges rejected, not_positive"));
  EXPECT_TRUE(found.beacon_mcl.problems.empty());
  for (auto& range : recording.ranges) range.range = kNan;
  EXPECT_TRUE(has(check_of(recording).beacon_mcl.problems, "30 ranges rejected, not_finite"));
}

TEST(CheckBag, FindsBeaconsThatAreNotKnown) {
  Recording recording = good_recording();
  recording.beacons[0].id = 9;
  const BagFindings found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "10 ranges rejected, unknown_beacon: beacon 1 is unknown"));
  EXPECT_TRUE(has(found.remarks, "only 2 known beacons"));
  EXPECT_TRUE(found.beacon_mcl.problems.empty());

  for (auto& range : recording.ranges) range.beacon = 77;
  EXPECT_TRUE(has(check_of(recording).beacon_mcl.problems, "beacon 77 is unknown"));

  recording = good_recording();
  recording.beacons[0].id = 2;
  EXPECT_TRUE(has(check_of(recording).beacon_mcl.problems, "beacon 2 is there twice"));
}

/// A robot that drives a circle of 4 m among four beacons at the corners of a square of 12 m.
Recording circle_among_beacons() {
  Recording recording;
  const double places[4][2] = {{-6.0, -6.0}, {6.0, -6.0}, {6.0, 6.0}, {-6.0, 6.0}};
  for (int i = 0; i < 4; ++i)
    recording.beacons.push_back({i + 1, {places[i][0], places[i][1], 0.0}, true});
  for (int i = 0; i <= 600; ++i) {
    const double time = 10.0 + 0.1 * i;
    const double angle = 0.0125 * i;
    const double x = 4.0 * std::cos(angle);
    const double y = 4.0 * std::sin(angle);
    recording.odometry.push_back({time, {x, y, angle + kPi / 2}});
    const auto* beacon = places[i % 4];
    recording.ranges.push_back(
        {time, "base_link", 1 + i % 4, std::hypot(beacon[0] - x, beacon[1] - y)});
  }
  return recording;
}

// In whatever unit: what is wrong is said, with its factor, and nothing where all is in metres.
TEST(CheckBag, FindsUnitsThatDoNotFit) {
  EXPECT_TRUE(check_of(circle_among_beacons()).beacon_mcl.is_ready());
  const std::vector<std::pair<double, std::string>> units = {
      {1000.0,
       "1000 times too long for the distances between the beacons, as if ranges were in "
       "millimetres"},
      {100.0, "as if ranges were in centimetres"},
      {1.0 / 0.3048, "as if ranges were in feet"},
      {0.001, "as if the beacons were in millimetres"},
      {0.3048, "as if the beacons were in feet"}};
  for (const auto& [factor, words] : units) {
    Recording recording = circle_among_beacons();
    for (auto& range : recording.ranges) range.range *= factor;
    EXPECT_TRUE(has(check_of(recording).beacon_mcl.problems, words)) << words;
  }
}

TEST(CheckBag, FindsAHeadingInDegrees) {
  EXPECT_FALSE(has(check_of(circle_among_beacons()).remarks, "degrees"));
  Recording recording = circle_among_beacons();
  for (auto& odometry : recording.odometry) odometry.pose.heading *= 180.0 / kPi;
  EXPECT_TRUE(has(check_of(recording).remarks, "/odom: it turns about 57 times as much"));
}

/// One odometry message and one range; both to be spoilt.
struct TwoMessages {
  nav_msgs::Odometry odometry = standing(ros::Time(10.0));
  BeaconRange range;

  TwoMessages() {
    range.header.stamp = ros::Time(10.0);
    range.header.frame_id = "antenna";
    range.beacon = 1;
    range.range = 3.0;
  }

  BagFindings check() const {
    return check_of_written([this](BagWriter* bag) {
      BeaconArray beacons;
      beacons.header.frame_id = "map";
      beacons.beacons.resize(1);
      beacons.beacons[0].id = 1;
      bag->write("/beacons", ros::Time(10.0), beacons);
      bag->write("/odom", ros::Time(10.0), odometry);
      bag->write("/ranges", ros::Time(10.0), range);
    });
  }
};

TEST(CheckBag, FindsStampsFarFromBagTime) {
  TwoMessages messages;
  messages.odometry.header.stamp = ros::Time(7.5);
  EXPECT_TRUE(has(messages.check().remarks, "/odom: stamps and bag times differ by up to 2.500 s"));
}

TEST(CheckBag, FindsFramesThatNothingPlaces) {
  TwoMessages messages;
  messages.odometry.child_frame_id = "";
  EXPECT_TRUE(has(messages.check().remarks,
                  "/odom names no child_frame_id: it is taken as that of 'base_link'"));
  messages.odometry.header.frame_id = "wheels";
  messages.odometry.child_frame_id = "footprint";
  EXPECT_TRUE(has(messages.check().remarks, "set the parameter frames/odom"));
  EXPECT_TRUE(has(messages.check().remarks, "set the parameter frames/base"));
}

TEST(CheckBag, FindsAnotherLocalization) {
  const BagFindings found = check_of_written([](BagWriter* bag) {
    const ros::Time stamp(10.0);
    bag->write("/odom", stamp, standing(stamp));
    bag->write("/tf", stamp, placed(stamp, "map", "odom"));
  });
  EXPECT_TRUE(has(found.remarks, "/tf places 'odom' in 'map': that is from another localization"));
}

TEST(CheckBagProgram, ExitsWithZeroOnAGoodBagAndOneOnABadOne) {
  const TemporaryDirectory directory;
  write_recording(good_recording(), directory.file("good.bag"));
  const ProgramResult good = run_program("check_bag " + directory.file("good.bag"));
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(good.error, "") << "no progress bar in a log";
  EXPECT_TRUE(
      says(good.out, "\nready for beacon_mcl: yes\n  rosrun pf_resampling run_bag beacon_mcl " +
                         directory.file("good.bag") + " out.bag\n"));
  EXPECT_TRUE(says(good.out, "\nready for fastslam: no: no /landmarks"));
  write_recording(landmark_recording(), directory.file("landmarks.bag"));
  const ProgramResult slam = run_program("check_bag " + directory.file("landmarks.bag"));
  EXPECT_EQ(slam.exit_code, 0);
  EXPECT_TRUE(says(slam.out, "\nready for fastslam: yes\n"));

  const ProgramResult renamed =
      run_program("check_bag " + directory.file("good.bag") + " --odom wheels");
  EXPECT_EQ(renamed.exit_code, 1);
  EXPECT_TRUE(
      says(renamed.out, "\nready for beacon_mcl: no: no /wheels (needed: nav_msgs/Odometry)"));
}

TEST(CheckBagProgram, BadFilesAndMisuseAreOneLine) {
  const TemporaryDirectory directory;
  write_recording(good_recording(), directory.file("good.bag"));
  const std::string bytes = read_file(directory.file("good.bag"));
  directory.write("cut.bag", bytes.substr(0, bytes.size() / 2));
  directory.write("text.bag", "hello");

  for (const char* name : {"none.bag", "cut.bag", "text.bag"}) {
    const ProgramResult result = run_program("check_bag " + directory.file(name));
    EXPECT_EQ(result.exit_code, 1) << name;
    EXPECT_TRUE(result.is_one_line_error("check_bag")) << result.error << result.out;
    EXPECT_TRUE(says(result.error, directory.file(name)));
  }
  for (const char* arguments : {"", "a.bag b.bag", "a.bag --odm /odom"}) {
    const ProgramResult result = run_program(std::string("check_bag ") + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("check_bag")) << result.error;
  }
  const ProgramResult help = run_program("check_bag --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_TRUE(says(help.out, "Usage: rosrun pf_resampling check_bag in.bag"));
}

/// A bag whose ranges are sensor_msgs/Range on `topic`, of the beacons 1 to 3 and of a sonar.
void write_sensor_ranges(const std::string& topic, BagWriter* bag) {
  BeaconArray beacons;
  beacons.header.stamp = ros::Time(10.0);
  beacons.header.frame_id = "map";
  for (int id = 1; id <= 3; ++id) {
    beacons.beacons.emplace_back();
    beacons.beacons.back().id = id;
    beacons.beacons.back().position.x = 5.0 * id;
    beacons.beacons.back().position.y = id == 2 ? 5.0 : 0.0;
  }
  bag->write_latched("/beacons", beacons.header.stamp, beacons);
  for (int i = 0; i <= 100; ++i) {
    const ros::Time stamp(10.0 + 0.1 * i);
    bag->write("/odom", stamp, standing(stamp));
    sensor_msgs::Range range;
    range.header.stamp = stamp;
    range.header.frame_id = i % 4 == 3 ? "sonar" : "beacon_" + std::to_string(1 + i % 4);
    range.range = 4.0F;
    range.max_range = 10.0F;
    bag->write(topic, stamp, range);
  }
}

TEST(CheckBag, RangesMayBeOfSensorMsgs) {
  const BagFindings found =
      check_of_written([](BagWriter* bag) { write_sensor_ranges("/sensor_ranges", bag); });
  EXPECT_EQ(found.beacon_mcl.text(), "ready for beacon_mcl: yes");
  EXPECT_TRUE(has(found.remarks, "rejected, unknown_beacon: frame 'sonar' does not name a beacon"));

  const BagFindings elsewhere =
      check_of_written([](BagWriter* bag) { write_sensor_ranges("/radio", bag); });
  EXPECT_TRUE(has(elsewhere.beacon_mcl.problems, "/radio could be it (--sensor-ranges /radio"));
}

TEST(CheckBag, TagsOnTfAreSuggestedAsLandmarks) {
  const auto write = [](const std::string& parent, BagWriter* bag) {
    bag->write("/tf", ros::Time(10.0), placed(ros::Time(10.0), parent, "ar_marker_12"));
  };
  const BagFindings seen = check_of_written([&](BagWriter* bag) { write("camera", bag); });
  EXPECT_TRUE(has(seen.fastslam.problems, "--set 'landmark_input/tag_pattern=ar_marker_(\\d+)'"));
  const BagFindings placed = check_of_written([&](BagWriter* bag) { write("map", bag); });
  EXPECT_FALSE(has(placed.fastslam.problems, "tag_pattern"));
}

/// A robot that stands, with a camera (optical frame) 0.3 m above its middle that looks ahead; it
/// sees the tag_7 3 m ahead, ten times.
void write_tags(BagWriter* bag) {
  bag->write("/tf_static", ros::Time(10.0), camera_on("base_link"));
  for (int i = 0; i <= 10; ++i) {
    const ros::Time time(10.0 + 0.1 * i);
    bag->write("/odom", time, standing(time));
    if (i == 10) continue;  // an image is complete when odometry has gone on
    bag->write("/tf", time + ros::Duration(0.01), placed(time, "camera", "tag_7", 3.0));
  }
}

/// What the program says, typed with what it advises after a first look.
TEST(CheckBagProgram, ConfirmsItsOwnAdvice) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("tags.bag");
  {
    BagWriter bag(path);
    write_tags(&bag);
    bag.finish();
  }
  const ProgramResult first = run_program("check_bag " + path);
  EXPECT_EQ(first.exit_code, 1);
  const std::string advice = " --set 'landmark_input/tag_pattern=tag_(\\d+)'";
  EXPECT_TRUE(says(first.out, "\n  try: rosrun pf_resampling check_bag " + path + advice + "\n"));
  const ProgramResult second = run_program("check_bag " + path + advice);
  EXPECT_EQ(second.exit_code, 0) << second.out << second.error;
  EXPECT_TRUE(says(second.out, "ready for fastslam: yes\n  rosrun pf_resampling run_bag fastslam " +
                                   path + " out.bag" + advice + "\n"));
  EXPECT_TRUE(says(second.out, "is unknown"));  // to beacon_mcl
  EXPECT_EQ(run_program("check_bag " + path + " --set no_such=1").exit_code, 1);
  EXPECT_TRUE(
      says(run_program("check_bag " + path + " --set landmark_input/tag_pattern='mark_(.)'").out,
           "no frame in /tf has a name that fits landmark_input/tag_pattern mark_(.)"));
}

TEST(CheckBagProgram, TakesBeaconsFromAConfiguration) {
  const TemporaryDirectory directory;
  Recording recording = good_recording();
  recording.beacons.clear();
  const std::string path = directory.file("a.bag");
  write_recording(recording, path);
  EXPECT_EQ(run_program("check_bag " + path).exit_code, 1);
  const std::string yaml = directory.file("beacons.yaml");
  write_file(
      yaml,
      "beacons:\n  - {id: 1, x: 0, y: 5}\n  - {id: 2, x: 5, y: 5}\n  - {id: 3, x: 5, y: 0}\n");
  const ProgramResult found = run_program("check_bag " + path + " --config " + yaml);
  EXPECT_EQ(found.exit_code, 0) << found.out << found.error;
  EXPECT_TRUE(
      says(found.out, "ready for beacon_mcl: yes\n  rosrun pf_resampling run_bag beacon_mcl " +
                          path + " out.bag --config " + yaml + "\n"));
}

TEST(CheckBag, SeesOdometryOnTfAsAPoseAndTheImu) {
  const auto write = [](bool with_tf, bool with_pose, BagWriter* bag) {
    for (int i = 0; i < 10; ++i) {
      const ros::Time time(10.0 + 0.1 * i);
      if (with_tf) bag->write("/tf", time, placed(time, "odom", "base_footprint"));
      geometry_msgs::PoseWithCovarianceStamped pose;
      pose.header.stamp = time;
      pose.header.frame_id = "odom_combined";
      pose.pose.pose.orientation.w = 1.0;
      if (with_pose) bag->write("/odom_combined", time, pose);
      sensor_msgs::Imu imu;
      imu.header.stamp = time;
      bag->write("/imu/data", time, imu);
    }
  };
  const BagFindings on_tf = check_of_written([&](BagWriter* bag) { write(true, false, bag); });
  EXPECT_TRUE(has(on_tf.fastslam.problems,
                  "'odom' -> 'base_footprint' on /tf could be it (--set odometry_input/source=tf "
                  "--set frames/base=base_footprint)"));
  EXPECT_TRUE(has(on_tf.remarks, "/imu/data is an IMU: --imu /imu/data --set"));
  const BagFindings as_pose = check_of_written([&](BagWriter* bag) { write(false, true, bag); });
  EXPECT_TRUE(has(as_pose.fastslam.problems, "/odom_combined could be it (--odom /odom_combined"));

  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  {
    BagWriter bag(path);
    write(true, true, &bag);
    bag.finish();
  }
  const std::string by_tf = run_program("check_bag " + path +
                                        " --set odometry_input/source=tf"
                                        " --set frames/base=base_footprint")
                                .out;
  EXPECT_FALSE(says(by_tf, "no /odom"));
  EXPECT_FALSE(says(by_tf, "nothing on /tf"));
  const std::string by_pose = run_program("check_bag " + path + " --odom /odom_combined").out;
  EXPECT_TRUE(says(by_pose, "frame 'odom_combined' instead of 'odom'"));
  EXPECT_FALSE(says(by_pose, "needed: nav_msgs"));
  // What is asked for has to be there.
  const std::string no_imu =
      run_program("check_bag " + path + " --set odometry_input/imu_heading=yaw_rate").out;
  EXPECT_TRUE(
      says(no_imu, "no /imu (needed: sensor_msgs/Imu), /imu/data could be it (--imu /imu/data"));
}

}  // namespace
}  // namespace pf_resampling
