#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <pf_resampling/BeaconRange.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <limits>
#include <string>

#include "checks/bag_check.hpp"
#include "common/bag.hpp"
#include "common/files.hpp"
#include "datasets/recording_to_bag.hpp"
#include "run_program.hpp"
#include "temporary_directory.hpp"

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
  recording.truth_has_heading = true;
  for (int i = 0; i < 30; ++i) {
    recording.ranges.push_back({10.05 + i / 3.0, 1 + i % 3, 2.0 + i, 0.0, "antenna"});
  }
  recording.beacons = {
      {1, 0.0, 5.0, std::nullopt}, {2, 5.0, 5.0, std::nullopt}, {3, 5.0, 0.0, std::nullopt}};
  recording.frames = {{"antenna", 0.25, 0.0, 0.5, 0.0}};
  return recording;
}

BagCheck check_of(const Recording& recording, const BagCheckTopics& topics = {}) {
  const TemporaryDirectory directory;
  write_recording(recording, directory.file("a.bag"));
  return check_bag(open_bag(directory.file("a.bag")), topics);
}

/// What is found in a bag that `write` fills.
BagCheck check_of_written(const std::function<void(BagWriter*)>& write) {
  const TemporaryDirectory directory;
  BagWriter bag(directory.file("a.bag"));
  write(&bag);
  bag.finish();
  return check_bag(open_bag(directory.file("a.bag")), {});
}

bool has(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines) {
    if (line.find(words) != std::string::npos) return true;
  }
  return false;
}

TEST(CheckBag, AGoodBagIsReadyAndHasNoRemarks) {
  const BagCheck found = check_of(good_recording());
  EXPECT_EQ(found.verdict(), "ready for beacon_mcl: yes");
  EXPECT_TRUE(found.remarks.empty()) << found.remarks.front();
  // Of beacon 1: ranges 2, 5, ..., 29.
  EXPECT_NE(found.text.find("  1       0.000  5.000  0.500      10   2.00     17.00  29.00\n"),
            std::string::npos)
      << found.text;
  EXPECT_NE(found.text.find("/ranges: antenna on base_link  0.250  0.000  0.500      0.0\n"),
            std::string::npos)
      << found.text;
  EXPECT_NE(found.text.find("  ground truth: geometry_msgs/PoseStamped\n"), std::string::npos);
}

TEST(CheckBag, NamesWhatIsMissingAndWhatIsThere) {
  Recording recording = good_recording();
  recording.beacons.clear();
  recording.ranges.clear();
  const BagCheck found = check_of(recording);
  EXPECT_EQ(found.verdict(),
            "ready for beacon_mcl: no: no /ranges (needed: pf_resampling/BeaconRange); "
            "no /beacons (needed: pf_resampling/BeaconArray) (or give the beacons in the "
            "configuration); the bag has /ground_truth (geometry_msgs/PoseStamped), "
            "/odom (nav_msgs/Odometry), /tf (tf2_msgs/TFMessage), /tf_static (tf2_msgs/TFMessage)");
}

TEST(CheckBag, HintsAtTopicsOfTheRightType) {
  BagCheckTopics topics;
  topics.odom = "/robot/odom";
  topics.ranges = "/odom";
  const BagCheck found = check_of(good_recording(), topics);
  EXPECT_TRUE(has(found.problems,
                  "no /robot/odom (needed: nav_msgs/Odometry), /odom could be it (--odom /odom; "
                  "for the node odom:=/odom)"));
  EXPECT_TRUE(has(found.problems, "/odom is a nav_msgs/Odometry (needed: pf_resampling/"));
}

TEST(CheckBag, FindsGapsAndCoverage) {
  Recording recording = good_recording();
  recording.odometry.erase(recording.odometry.begin() + 41, recording.odometry.begin() + 56);
  const BagCheck gap = check_of(recording);
  // 1.6 s from 14 s on: one gap.
  EXPECT_NE(gap.text.find("1.600  14.000     1"), std::string::npos) << gap.text;

  recording = good_recording();
  recording.odometry.resize(50);
  EXPECT_TRUE(has(check_of(recording).remarks, "/odom does not cover all of /ranges"));
  for (auto& range : recording.ranges) range.time += 100.0;
  EXPECT_TRUE(has(check_of(recording).problems, "are of different times"));
}

TEST(CheckBag, FindsNumbersThatAreNone) {
  Recording recording = good_recording();
  recording.odometry[5].pose.x = kNan;
  recording.ranges[3].range = kNan;
  recording.ranges[4].range = -1.0;
  recording.ranges[6].variance = -1.0;
  recording.truth[2].pose.y = kNan;
  const BagCheck found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "/odom: 1 values are not finite"));
  EXPECT_TRUE(has(found.remarks, "/ranges: 1 values are not finite"));
  EXPECT_TRUE(has(found.remarks, "/ranges: 2 ranges are not positive or variances negative"));
  EXPECT_TRUE(has(found.remarks, "/ground_truth: 1 values are not finite"));
  EXPECT_TRUE(found.problems.empty());

  for (auto& range : recording.ranges) range.range = kNan;
  EXPECT_TRUE(has(check_of(recording).problems, "/ranges has no range that can be used"));
  recording = good_recording();
  for (auto& odometry : recording.odometry) odometry.pose.x = kNan;
  EXPECT_TRUE(has(check_of(recording).problems, "/odom has no pose that can be used"));
}

TEST(CheckBag, FindsBeaconsThatAreNotKnown) {
  Recording recording = good_recording();
  recording.beacons[0].id = 9;
  const BagCheck found = check_of(recording);
  EXPECT_TRUE(has(found.remarks, "ranges to beacons that are not in /beacons: 1"));
  EXPECT_TRUE(has(found.remarks, "only 2 known beacons"));
  EXPECT_TRUE(found.problems.empty());

  for (auto& range : recording.ranges) range.beacon = 77;
  EXPECT_TRUE(has(check_of(recording).problems, "no range is to a beacon of /beacons"));

  recording = good_recording();
  recording.beacons[0].id = 2;
  EXPECT_TRUE(has(check_of(recording).problems, "beacon 2 is there twice"));
  recording.beacons[0] = {1, kNan, 0.0, std::nullopt};
  EXPECT_TRUE(has(check_of(recording).problems, "the position of beacon 1 is not finite"));
}

/// One odometry message and one range; both to be spoilt.
struct TwoMessages {
  nav_msgs::Odometry odometry;
  BeaconRange range;

  TwoMessages() {
    odometry.header.stamp = ros::Time(10.0);
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = "base_link";
    odometry.pose.pose.orientation.w = 1.0;
    range.header.stamp = ros::Time(10.0);
    range.header.frame_id = "antenna";
    range.beacon = 1;
    range.range = 3.0;
  }

  BagCheck check() const {
    return check_of_written([this](BagWriter* bag) {
      bag->write("/odom", ros::Time(10.0), odometry);
      bag->write("/ranges", ros::Time(10.0), range);
    });
  }
};

TEST(CheckBag, FindsStampsThatAreNone) {
  TwoMessages messages;
  messages.odometry.header.stamp = ros::Time();
  messages.range.header.stamp = ros::Time();
  const BagCheck found = messages.check();
  EXPECT_TRUE(has(found.remarks, "/odom: 1 messages without a stamp"));
  EXPECT_TRUE(has(found.problems, "/odom has no stamps"));
  EXPECT_TRUE(has(found.problems, "/ranges has no stamps"));
}

TEST(CheckBag, FindsStampsFarFromBagTime) {
  TwoMessages messages;
  messages.odometry.header.stamp = ros::Time(7.5);
  EXPECT_TRUE(has(messages.check().remarks, "/odom: stamps and bag times differ by up to 2.500 s"));
}

TEST(CheckBag, FindsFramesThatNothingPlaces) {
  TwoMessages messages;
  EXPECT_TRUE(has(messages.check().problems,
                  "/ranges: nothing in /tf_static places its frame 'antenna' on 'base_link'"));
  messages.range.header.frame_id = "base_link";
  EXPECT_FALSE(has(messages.check().problems, "places its frame"));
  messages.range.header.frame_id = "";
  EXPECT_TRUE(has(messages.check().problems, "places its frame ''"));
  messages.odometry.child_frame_id = "";
  messages.odometry.header.frame_id = "";
  EXPECT_TRUE(has(messages.check().problems, "/odom names no child_frame_id"));
  EXPECT_TRUE(has(messages.check().problems, "/odom names no frame_id"));
  messages.odometry.header.frame_id = "wheels";
  messages.odometry.child_frame_id = "footprint";
  EXPECT_TRUE(has(messages.check().remarks, "set the parameter odom_frame"));
  EXPECT_TRUE(has(messages.check().remarks, "set the parameter base_frame"));
}

TEST(CheckBag, FindsOrientationsThatAreNone) {
  TwoMessages messages;
  messages.odometry.pose.pose.orientation.w = 0.0;
  EXPECT_TRUE(has(messages.check().remarks, "/odom: 1 orientations are not unit quaternions"));
}

TEST(CheckBag, FindsAnotherLocalization) {
  const BagCheck found = check_of_written([](BagWriter* bag) {
    bag->write("/odom", ros::Time(10.0), TwoMessages().odometry);
    tf2_msgs::TFMessage transforms;
    transforms.transforms.resize(1);
    transforms.transforms[0].header.frame_id = "map";
    transforms.transforms[0].child_frame_id = "odom";
    bag->write("/tf", ros::Time(10.0), transforms);
  });
  EXPECT_TRUE(has(found.remarks, "/tf places 'odom' in 'map': another localization's"));
}

TEST(CheckBagProgram, ExitsWithZeroOnAGoodBagAndOneOnABadOne) {
  const TemporaryDirectory directory;
  write_recording(good_recording(), directory.file("good.bag"));
  const ProgramResult good = run_program("check_bag " + directory.file("good.bag"));
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(good.error, "") << "no progress bar in a log";
  EXPECT_NE(good.out.find("\nready for beacon_mcl: yes\n"), std::string::npos);

  const ProgramResult renamed =
      run_program("check_bag " + directory.file("good.bag") + " --odom wheels");
  EXPECT_EQ(renamed.exit_code, 1);
  EXPECT_NE(renamed.out.find("\nready for beacon_mcl: no: no /wheels (needed: nav_msgs/Odometry)"),
            std::string::npos);
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
    EXPECT_NE(result.error.find(directory.file(name)), std::string::npos) << result.error;
  }
  for (const char* arguments : {"", "a.bag b.bag", "a.bag --odm /odom"}) {
    const ProgramResult result = run_program(std::string("check_bag ") + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_TRUE(result.is_one_line_error("check_bag")) << result.error;
  }
  const ProgramResult help = run_program("check_bag --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Usage: rosrun pf_resampling check_bag in.bag"), std::string::npos);
}

}  // namespace
}  // namespace pf_resampling
