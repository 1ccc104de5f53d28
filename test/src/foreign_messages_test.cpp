#include "src/messages/foreign_messages.hpp"

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Transform.h>
#include <gtest/gtest.h>
#include <ros/serialization.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "src/node/any_message.hpp"

// Messages whose packages are not installed are put together by hand, field by field, as ROS does.
namespace pf_resampling {
namespace {

class Bytes {
 public:
  template <typename Field>
  Bytes& add(const Field& field) {
    const std::uint32_t size = ros::serialization::serializationLength(field);
    const std::size_t before = bytes_.size();
    bytes_.resize(before + size);
    ros::serialization::OStream stream(bytes_.data() + before, size);
    ros::serialization::serialize(stream, field);
    return *this;
  }
  topic_tools::ShapeShifter as(const std::string& type, const std::string& definition) {
    topic_tools::ShapeShifter message;
    message.morph("*", type, definition, "");
    ros::serialization::IStream stream(bytes_.data(), static_cast<std::uint32_t>(bytes_.size()));
    message.read(stream);
    return message;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

template <typename Message>
std::string definition_of(const std::string& name) {
  return "\n================================================================================\nMSG:"
         " " +
         name + "\n" + ros::message_traits::Definition<Message>::value();
}

std_msgs::Header header(double time, const std::string& frame) {
  std_msgs::Header header;
  header.stamp = ros::Time(time);
  header.frame_id = frame;
  return header;
}

const std::uint32_t kOne = 1, kTwo = 2;

TEST(ForeignMessages, AprilTagsAreDetectionsOfTheCamera) {
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = header(10.0, "camera");
  pose.pose.pose.position.x = 0.5;
  pose.pose.pose.position.z = 3.0;
  Bytes bytes;
  bytes.add(header(10.0, "camera")).add(kTwo);
  bytes.add(kOne).add(std::int32_t{7}).add(kOne).add(0.16).add(pose);
  // A bundle: no tag, but to be told of.
  bytes.add(kTwo).add(std::int32_t{1}).add(std::int32_t{2}).add(kOne).add(0.16).add(pose);
  const auto message = bytes.as(
      "apriltag_ros/AprilTagDetectionArray",
      "std_msgs/Header header\nAprilTagDetection[] detections\n"
      "\n====\nMSG: apriltag_ros/AprilTagDetection\n# Tag ID(s).\nint32[] id\nfloat64[] size\n"
      "geometry_msgs/PoseWithCovarianceStamped pose\n" +
          definition_of<geometry_msgs::PoseWithCovarianceStamped>(
              "geometry_msgs/PoseWithCovarianceStamped"));
  const auto tags = std::get<tf2_msgs::TFMessage>(landmarks_in(message));
  ASSERT_EQ(tags.transforms.size(), 2u);
  EXPECT_TRUE(is_detected_tag(tags.transforms[1].child_frame_id));
  EXPECT_FALSE(id_of_detected_tag(tags.transforms[1].child_frame_id));
  EXPECT_EQ(id_of_detected_tag(tags.transforms[0].child_frame_id), 7);
  EXPECT_EQ(tags.transforms[0].header.frame_id, "camera");
  EXPECT_EQ(tags.transforms[0].header.stamp, ros::Time(10.0));
  EXPECT_EQ(tags.transforms[0].transform.translation.x, 0.5);
  EXPECT_EQ(tags.transforms[0].transform.translation.z, 3.0);
}

// A stamp that ROS itself cannot have is for the checks of all messages to reject.
TEST(ForeignMessages, MayHaveImpossibleStamps) {
  Bytes bytes;
  bytes.add(std::uint32_t{0}).add(std::uint32_t{0xffffffff}).add(std::uint32_t{0xffffffff});
  bytes.add(std::string("camera")).add(std::int32_t{0}).add(std::uint32_t{0});
  const auto message =
      bytes.as("fiducial_msgs/FiducialTransformArray",
               "Header header\nint32 image_seq\nFiducialTransform[] transforms\n"
               "\n====\nMSG: fiducial_msgs/FiducialTransform\nint32 fiducial_id\n" +
                   definition_of<std_msgs::Header>("std_msgs/Header"));
  EXPECT_TRUE(std::get<tf2_msgs::TFMessage>(landmarks_in(message)).transforms.empty());
}

// Each with one tag at (0, -1, 2) in the frame of the camera.
TEST(ForeignMessages, FiducialTransformsAndArucoMarkersLikewise) {
  geometry_msgs::Transform transform;
  transform.translation.y = -1.0;
  transform.translation.z = 2.0;
  geometry_msgs::PoseWithCovariance pose;
  pose.pose.position.y = -1.0;
  pose.pose.position.z = 2.0;
  Bytes fiducials, markers;
  fiducials.add(header(11.0, "camera")).add(std::int32_t{4}).add(kOne);
  fiducials.add(std::int32_t{12}).add(transform).add(0.1).add(0.2).add(30.0);
  markers.add(header(12.0, "camera")).add(kOne);
  markers.add(header(12.0, "camera")).add(std::uint32_t{12}).add(pose).add(0.9);
  for (const auto& message :
       {fiducials.as("fiducial_msgs/FiducialTransformArray",
                     "Header header\nint32 image_seq\nFiducialTransform[] transforms\n"
                     "\n====\nMSG: fiducial_msgs/FiducialTransform\nint32 fiducial_id\n"
                     "geometry_msgs/Transform transform\nfloat64 image_error\n"
                     "float64 object_error\nfloat64 fiducial_area\n" +
                         definition_of<geometry_msgs::Transform>("geometry_msgs/Transform") +
                         definition_of<std_msgs::Header>("std_msgs/Header")),
        markers.as("aruco_msgs/MarkerArray",
                   "Header header\naruco_msgs/Marker[] markers\n"
                   "\n====\nMSG: aruco_msgs/Marker\nHeader header\nuint32 id\n"
                   "geometry_msgs/PoseWithCovariance pose\nfloat64 confidence\n" +
                       definition_of<geometry_msgs::PoseWithCovariance>(
                           "geometry_msgs/PoseWithCovariance") +
                       definition_of<std_msgs::Header>("std_msgs/Header"))}) {
    SCOPED_TRACE(message.getDataType());
    const auto tags = std::get<tf2_msgs::TFMessage>(landmarks_in(message));
    ASSERT_EQ(tags.transforms.size(), 1u);
    EXPECT_EQ(id_of_detected_tag(tags.transforms[0].child_frame_id), 12);
    EXPECT_EQ(tags.transforms[0].transform.translation.y, -1.0);
    EXPECT_EQ(tags.transforms[0].transform.translation.z, 2.0);
  }
}

TEST(ForeignMessages, RangesAlongTheLineOfSightBecomeThoseInThePlane) {
  Bytes bytes;
  bytes.add(header(13.0, "sensor")).add(geometry_msgs::Pose());
  bytes.add(0.1).add(20.0).add(0.2).add(0.01).add(0.01).add(kOne);
  bytes.add(4.0).add(0.25).add(std::acos(0.5)).add(std::int32_t{-1});
  const auto message = bytes.as(
      "mrpt_msgs/ObservationRangeBearing",
      "Header header\ngeometry_msgs/Pose sensor_pose_on_robot\nfloat64 min_sensor_distance\n"
      "float64 max_sensor_distance\nfloat64 sensor_std_range\nfloat64 sensor_std_yaw\n"
      "float64 sensor_std_pitch\nSingleRangeBearingObservation[] sensed_data\n"
      "\n====\nMSG: mrpt_msgs/SingleRangeBearingObservation\nint32 INVALID_LANDMARK_ID = -1\n"
      "float64 range\nfloat64 yaw\nfloat64 pitch\nint32 id\n" +
          definition_of<geometry_msgs::Pose>("geometry_msgs/Pose") +
          definition_of<std_msgs::Header>("std_msgs/Header"));
  const auto scan = std::get<LandmarkObservationArray>(landmarks_in(message));
  EXPECT_EQ(scan.header.frame_id, "sensor");
  ASSERT_EQ(scan.observations.size(), 1u);
  EXPECT_EQ(scan.observations[0].id, -1);
  EXPECT_NEAR(scan.observations[0].range, 2.0, 1e-12);
  EXPECT_EQ(scan.observations[0].bearing, 0.25);
  EXPECT_NEAR(scan.observations[0].range_variance, 0.04, 1e-12);
}

TEST(ForeignMessages, GtecRangesAreInMillimetresAndHaveNoStamp) {
  Bytes bytes;
  bytes.add(std::int16_t{5}).add(std::int16_t{1}).add(std::int32_t{2500}).add(std::int32_t{9});
  bytes.add(0.0);
  const auto message = bytes.as("gtec_msgs/Ranging",
                                "int16 anchorId\nint16 tagId\nint32 range\nint32 seq\n"
                                "float64 errorEstimation\n");
  const BeaconRange range = range_in(message, "antenna", ros::Time(20.0));
  EXPECT_EQ(range.beacon, 5);
  EXPECT_NEAR(range.range, 2.5, 1e-12);
  EXPECT_EQ(range.header.frame_id, "antenna");
  EXPECT_EQ(range.header.stamp, ros::Time(20.0));
  EXPECT_THROW(landmarks_in(message), Error);
}

TEST(ForeignMessages, UwbDriverRangesAreOfTheResponder) {
  const char* const definition =
      "std_msgs/Header header\nuint8 requester_id\nuint8 responder_id\nfloat64 distance\n"
      "float64 distance_err\n";
  Bytes bytes;
  bytes.add(header(21.0, "world")).add(std::uint8_t{200}).add(std::uint8_t{101}).add(7.5).add(0.2);
  const auto message = bytes.as("uwb_driver/UwbRange",
                                definition + definition_of<std_msgs::Header>("std_msgs/Header"));
  const BeaconRange range = range_in(message, "antenna", ros::Time(99.0));
  EXPECT_EQ(range.beacon, 101);
  EXPECT_EQ(range.range, 7.5);
  EXPECT_NEAR(range.variance, 0.04, 1e-12);
  EXPECT_EQ(range.header.frame_id, "antenna");
  EXPECT_EQ(range.header.stamp, ros::Time(21.0));
}

TEST(ForeignMessages, RefusesOtherTypesAndOtherDefinitions) {
  Bytes bytes;
  bytes.add(std::int16_t{5});
  const auto said = [&](const std::string& type, const std::string& definition) -> std::string {
    return refusal([&] { range_in(bytes.as(type, definition), "", ros::Time(1.0)); });
  };
  EXPECT_NE(said("gtec_msgs/Ranging", "int16 anchorId\n"), "");
  EXPECT_EQ(said("gtec_msgs/Ranging", "int16 anchorId\nint16 tagId\n")
                .rfind("a gtec_msgs/Ranging cannot be read: ", 0),
            0u);
  EXPECT_EQ(said("std_msgs/Int16", "int16 data\n"),
            "ranges come as std_msgs/Int16, which is not known; see doc/other_drivers.md");
  EXPECT_FALSE(id_of_detected_tag("tag_7"));
  EXPECT_FALSE(id_of_detected_tag("detected tag x"));
}

struct ByTheMast {
  std::string antenna() const { return "mast"; }
};

template <typename Message>
topic_tools::ShapeShifter own(const Message& message, const std::string& checksum = "") {
  namespace traits = ros::message_traits;
  Bytes bytes;
  topic_tools::ShapeShifter any = bytes.add(message).as(traits::DataType<Message>::value(), "");
  any.morph(checksum.empty() ? traits::MD5Sum<Message>::value() : checksum, any.getDataType(), "",
            "");
  return any;
}

// What nodes hear: messages of their own by the code that is generated, others by definition.
TEST(AnyMessage, IsReadByItsType) {
  const auto odometry_in = [](const topic_tools::ShapeShifter& message) {
    return read_any(Input<nav_msgs::Odometry>{}, LiveMessage{message}, "base", ByTheMast());
  };
  const auto range_in = [](const topic_tools::ShapeShifter& message) {
    return read_any(Input<BeaconRange>{}, LiveMessage{message}, "base", ByTheMast());
  };
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = header(5.0, "odom");
  pose.pose.pose.position.x = 1.5;
  EXPECT_EQ(odometry_in(own(pose)).pose.pose.position.x, 1.5);
  EXPECT_EQ(odometry_in(own(pose)).child_frame_id, "base");
  BeaconRange range;
  range.beacon = 7;
  EXPECT_EQ(range_in(own(range)).beacon, 7);
  EXPECT_TRUE(says(refusal([&] { range_in(own(range, "0")); }), "of another version"));
  EXPECT_TRUE(says(refusal([&] { odometry_in(own(range)); }), "odometry comes as pf_resampling/"));
  ros::Time::init();
  Bytes heard;
  heard.add(std::int16_t{3}).add(std::int16_t{0}).add(std::int32_t{4250});
  const BeaconRange foreign =
      range_in(heard.as("gtec_msgs/Ranging", "int16 anchorId\nint16 tagId\nint32 range\n"));
  EXPECT_EQ(foreign.beacon, 3);
  EXPECT_EQ(foreign.range, 4.25);
  EXPECT_EQ(foreign.header.frame_id, "mast");
}

}  // namespace
}  // namespace pf_resampling
