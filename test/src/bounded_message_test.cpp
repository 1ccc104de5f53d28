#include "src/messages/bounded_message.hpp"
#include "pf_resampling_core/test/says.hpp"

#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <pf_resampling/SetParticles.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <topic_tools/shape_shifter.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstring>
#include <vector>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/node/any_message.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <typename Message>
Bytes bytes_of(const Message& message) {
  Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <typename Message>
Bounded<Message> read(Bytes bytes) {
  Bounded<Message> bounded;
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(stream, bounded);
  EXPECT_EQ(stream.getLength(), 0u);
  return bounded;
}

// The bytes, but that they say at `place` how long an array is.
Bytes with_length(Bytes bytes, std::size_t place, std::uint32_t length) {
  std::memcpy(&bytes.at(place), &length, sizeof length);
  return bytes;
}

visualization_msgs::MarkerArray array_of_arrays() {
  visualization_msgs::MarkerArray array;
  array.markers.resize(3);
  array.markers[1].ns = "a name";
  array.markers[1].points.resize(4);
  array.markers[1].points[3].y = 2.5;
  array.markers[2].colors.resize(2);
  array.markers[2].colors[1].a = 0.5F;
  return array;
}

TEST(BoundedMessage, HoldsWhatTheMessageDoes) {
  EXPECT_EQ(whole(read<visualization_msgs::MarkerArray>(bytes_of(array_of_arrays()))),
            array_of_arrays());

  dynamic_reconfigure::ReconfigureRequest request;
  request.config.strs.resize(2);
  request.config.strs[1].name = "population/renewal";
  request.config.bools.resize(1);
  const auto parameters = read<dynamic_reconfigure::ReconfigureRequest>(bytes_of(request));
  EXPECT_EQ(whole(parameters).config, request.config);
}

// Elements as short as they can be, up to the last byte: of fixed size, or with empty texts.
TEST(BoundedMessage, TakesAsManyElementsAsThereAre) {
  SetParticles::Request particles;
  particles.weights.assign(1000, 0.001);
  EXPECT_EQ(whole(read<SetParticles::Request>(bytes_of(particles))).weights, particles.weights);

  tf2_msgs::TFMessage transforms;
  transforms.transforms.resize(1000);
  EXPECT_EQ(whole(read<tf2_msgs::TFMessage>(bytes_of(transforms))), transforms);
}

TEST(BoundedMessage, WhatEndsBeforeItShouldIsNotWhole) {
  const Bytes bytes = bytes_of(array_of_arrays());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto part = read<visualization_msgs::MarkerArray>(Bytes(bytes.data(), &bytes[size]));
    EXPECT_FALSE(part.is_whole) << size;
    EXPECT_THROW(whole(part), Error) << size;
  }
}

// Beacons that are not there: no room is made for one of them.
TEST(BoundedMessage, MakesNoRoomForWhatIsNotThere) {
  const Bytes empty = bytes_of(BeaconArray());
  const std::size_t place = empty.size() - 4;
  for (const std::uint32_t length : {1u, 3000000u, 0x7fffffffu, 0xffffffffu}) {
    const auto beacons = read<BeaconArray>(with_length(empty, place, length));
    EXPECT_FALSE(beacons.is_whole) << length;
    EXPECT_EQ(beacons.message.beacons.capacity(), 0u) << length;
  }
}

// 2^29 + 1 numbers of 8 bytes take, in 32 bits, no more than one.
TEST(BoundedMessage, ALengthThatOverflowsIsFound) {
  SetParticles::Request one;
  one.weights = {1.0};
  const Bytes bytes = bytes_of(one);
  const auto request =
      read<SetParticles::Request>(with_length(bytes, bytes.size() - 12, 0x20000001u));
  EXPECT_FALSE(request.is_whole);
  EXPECT_EQ(request.message.weights.capacity(), 0u);
}

TEST(BoundedMessage, AnArrayInAnArrayIsBoundedToo) {
  const Bytes bytes = bytes_of(array_of_arrays());
  visualization_msgs::Marker named;
  named.ns = "a name";
  // Behind the points of a marker: the lengths of its colours and of two texts, and a flag.
  const std::size_t place =
      4 + bytes_of(visualization_msgs::Marker()).size() + bytes_of(named).size() - (3 * 4 + 1) - 4;
  std::uint32_t length = 0;
  std::memcpy(&length, &bytes.at(place), sizeof length);
  ASSERT_EQ(length, 4u);
  const auto array = read<visualization_msgs::MarkerArray>(with_length(bytes, place, 5000000));
  EXPECT_FALSE(array.is_whole);
  EXPECT_EQ(array.message.markers.at(1).points.capacity(), 0u);
}

// A message that says that it has three million elements, and ends there.
template <typename Message>
topic_tools::ShapeShifter without_its_elements() {
  const Message message;
  const Bytes whole = bytes_of(message);
  Bytes bytes = with_length(whole, whole.size() - 4, 3000000);
  topic_tools::ShapeShifter shifter;
  shifter.morph(ros::message_traits::md5sum(message), ros::message_traits::datatype(message),
                ros::message_traits::definition(message), "");
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  shifter.read(stream);
  return shifter;
}

TEST(BoundedMessage, IsWhatNodesRead) {
  const auto scan = without_its_elements<LandmarkObservationArray>();
  EXPECT_THROW(message_in<LandmarkObservationArray>(scan), Error);
}

TEST(BoundedMessage, IsWhatToolsRead) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.write("/beacons", ros::Time(1.0), without_its_elements<BeaconArray>());
    bag.close();
  }
  const rosbag::Bag bag = open_bag(path);
  for (const rosbag::MessageInstance& record : rosbag::View(bag)) {
    try {
      message_in<BeaconArray>(record);
      FAIL() << "it was taken";
    } catch (const rosbag::BagFormatException& error) {
      EXPECT_TRUE(says(error.what(), "/beacons is damaged"));
    }
  }
}

}  // namespace
}  // namespace pf_resampling
