// sensor_msgs/Range as input of range-beacon localization: the beacon is named by frame_id.
#include "beacon_mcl_node/range_sensor.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "pf_resampling_core/error.hpp"
#include "test/beacon_mcl_rig.hpp"

namespace pf_resampling {
namespace {

constexpr float kNanFloat = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfiniteFloat = std::numeric_limits<float>::infinity();

sensor_msgs::Range message_of(const std::string& frame, float range, float least = 0.2F,
                              float most = 40.0F) {
  sensor_msgs::Range message;
  message.header.stamp = ros::Time(100.0);
  message.header.frame_id = frame;
  message.range = range;
  message.min_range = least;
  message.max_range = most;
  return message;
}

BeaconNames names() {
  return {{{"door", 3}, {"beacon_9", 4}}, FramePattern("beacon_(\\d+)"), "antenna"};
}

TEST(RangeSensor, TheFrameNamesTheBeacon) {
  const auto beacon_of = [](const std::string& frame) {
    const RangeReading reading = read_range(message_of(frame, 5.5F), names());
    EXPECT_TRUE(reading.range && !reading.rejection) << frame;
    return reading.range ? reading.range->beacon : -1;
  };
  EXPECT_EQ(beacon_of("beacon_12"), 12);
  EXPECT_EQ(beacon_of("/beacon_12"), 12);
  EXPECT_EQ(beacon_of("door"), 3);
  EXPECT_EQ(beacon_of("/door"), 3);
  EXPECT_EQ(beacon_of("beacon_9"), 4) << "a name that was given goes first";
  const BeaconRange range = *read_range(message_of("beacon_12", 5.5F), names()).range;
  EXPECT_EQ(range.range, 5.5);
  EXPECT_EQ(range.variance, 0.0);
  EXPECT_EQ(range.header.stamp, ros::Time(100.0));
  EXPECT_EQ(range.header.frame_id, "antenna");
}

TEST(RangeSensor, WithoutAnEchoThereIsNeitherARangeNorARejection) {
  const auto is_silent = [](float range, float least, float most) {
    const RangeReading reading = read_range(message_of("beacon_1", range, least, most), names());
    return !reading.range && !reading.rejection;
  };
  EXPECT_TRUE(is_silent(kInfiniteFloat, 0.2F, 40.0F));
  EXPECT_TRUE(is_silent(-kInfiniteFloat, 0.2F, 40.0F));
  EXPECT_TRUE(is_silent(40.5F, 0.2F, 40.0F));
  EXPECT_TRUE(is_silent(0.1F, 0.2F, 40.0F));
  EXPECT_TRUE(is_silent(kInfiniteFloat, 0.0F, 0.0F));
  EXPECT_TRUE(is_silent(kInfiniteFloat, 0.2F, kInfiniteFloat));
  EXPECT_FALSE(is_silent(40.0F, 0.2F, 40.0F));
  EXPECT_FALSE(is_silent(0.2F, 0.2F, 40.0F));
  EXPECT_FALSE(is_silent(300.0F, 0.0F, 0.0F)) << "a driver that fills in no limits has none";
}

TEST(RangeSensor, WhatMakesNoSenseIsRejectedWithTheReason) {
  const auto reason = [](const sensor_msgs::Range& message) {
    const RangeReading reading = read_range(message, names());
    EXPECT_FALSE(reading.range);
    return reading.rejection ? to_string(reading.rejection->reason) : "none";
  };
  EXPECT_EQ(reason(message_of("beacon_1", kNanFloat)), "not_finite");
  EXPECT_EQ(reason(message_of("beacon_1", 5.0F, kNanFloat)), "not_finite");
  EXPECT_EQ(reason(message_of("beacon_1", 5.0F, 0.2F, kNanFloat)), "not_finite");
  EXPECT_EQ(reason(message_of("beacon_1", 5.0F, 6.0F, 4.0F)), "impossible_range");
  EXPECT_EQ(reason(message_of("sonar_front", 5.0F)), "unknown_beacon");
  EXPECT_EQ(reason(message_of("", 5.0F)), "unknown_beacon");
  const std::string said = read_range(message_of("sonar_front", 5.0F), names()).rejection->detail;
  EXPECT_NE(said.find("sonar_front"), std::string::npos) << said;
  EXPECT_NE(said.find("range_input/frame_pattern"), std::string::npos) << said;
}

/// The drive with its ranges as sensor_msgs/Range, and as BeaconRange of the same numbers.
struct BothDrives {
  std::vector<BeaconMclMessage> sensor, own;
};

BothDrives both_drives(double seconds) {
  BothDrives drives;
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(seconds)) {
    const auto* range = std::get_if<BeaconRange::ConstPtr>(&message);
    if (range == nullptr) {
      drives.sensor.push_back(message);
      drives.own.push_back(message);
      continue;
    }
    sensor_msgs::Range sensed = message_of("beacon_" + std::to_string((*range)->beacon),
                                           static_cast<float>((*range)->range));
    sensed.header.stamp = (*range)->header.stamp;
    drives.sensor.emplace_back(boost::make_shared<sensor_msgs::Range>(sensed));
    BeaconRange same = **range;
    same.range = sensed.range;
    same.variance = 0.0;
    drives.own.emplace_back(boost::make_shared<BeaconRange>(same));
  }
  return drives;
}

TEST(RangeSensor, ThePipelineDoesWithThemWhatItDoesWithItsOwn) {
  const BothDrives drives = both_drives(20.0);
  Rig sensor;
  Rig own;
  sensor.feed(drives.sensor);
  own.feed(drives.own);
  ASSERT_GT(own.out.poses.size(), 100u);
  EXPECT_LT(own.error(), 0.5);
  EXPECT_EQ(sensor.pipeline.rejects().total(), 0u);
  EXPECT_TRUE(same_bytes(sensor.out.poses, own.out.poses));
}

TEST(RangeSensor, AnUnknownFrameIsCountedAndShownInTheDiagnostics) {
  Rig rig;
  rig.feed(both_drives(10.0).sensor);
  sensor_msgs::Range sonar = message_of("sonar_front", 1.0F);
  sonar.header.stamp = rig.out.poses.back().header.stamp;
  for (int i = 0; i < 3; ++i) rig.pipeline.handle(sonar);
  sensor_msgs::Range silent = sonar;
  silent.header.frame_id = "beacon_10";
  silent.range = kInfiniteFloat;
  rig.pipeline.handle(silent);
  EXPECT_EQ(rig.pipeline.rejects().count("sensor_ranges", RejectReason::unknown_beacon), 3u);
  EXPECT_EQ(rig.pipeline.rejects().total(), 3u);
  rig.pipeline.report_silence(sonar.header.stamp + ros::Duration(2.0));
  const std::string shown =
      value_of(rig.out.diagnostics.back(), "rejected sensor_ranges unknown_beacon");
  EXPECT_EQ(shown.rfind("3, ", 0), 0u) << shown;
  EXPECT_NE(shown.find("sonar_front"), std::string::npos) << shown;

  // An id that the pattern finds and no beacon has goes the way of the pipeline's own.
  sonar.header.frame_id = "beacon_99";
  rig.pipeline.handle(sonar);
  EXPECT_EQ(rig.pipeline.rejects().count("ranges", RejectReason::unknown_beacon), 1u);
}

TEST(RangeSensor, TheAntennaMayHaveAPlaceOfItsOwn) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.antenna = "mast";
  Rig nowhere(options);
  nowhere.feed(both_drives(2.0).sensor);
  EXPECT_GT(nowhere.pipeline.rejects().count("ranges", RejectReason::unknown_frame), 3u);
  options.antennas["mast"] = Eigen::Vector3d::Zero();
  Rig placed(options);
  placed.feed(both_drives(2.0).sensor);
  EXPECT_EQ(placed.pipeline.rejects().total(), 0u);
}

TEST(RangeSensor, BeaconsMayBeNamedInTheConfiguration) {
  BeaconMclPipelineOptions options;
  apply(parse_configuration("beacons:\n"
                            "  - {id: 1, x: 0.0, y: 0.0, frame: /door}\n"
                            "  - {id: 2, x: 5.0, y: 0.0}\n"
                            "range_input: {frame_pattern: 'uwb(\\d+)'}\n",
                            "file"),
        &options);
  EXPECT_EQ(options.beacon_frames, (std::map<std::string, int>{{"door", 1}}));
  EXPECT_EQ(options.frame_pattern, "uwb(\\d+)");
  EXPECT_THROW(parse_configuration("beacons: [{id: 1, x: 0.0, y: 0.0, frame: door},"
                                   " {id: 2, x: 5.0, y: 0.0, frame: /door}]",
                                   "file"),
               Error);
}

}  // namespace
}  // namespace pf_resampling
