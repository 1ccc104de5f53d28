#include "src/messages/described_message.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <pf_resampling/FilterStatus.h>
#include <ros/serialization.h>
#include <sensor_msgs/Imu.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

template <typename Message>
std::vector<std::uint8_t> bytes_of(const Message& message) {
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <typename Message>
DescribedMessage described(const std::vector<std::uint8_t>& bytes) {
  return DescribedMessage::read(ros::message_traits::DataType<Message>::value(),
                                ros::message_traits::Definition<Message>::value(), bytes.data(),
                                bytes.size());
}

// The same bytes as the generated code reads, of types with arrays of both kinds, texts, times.
TEST(DescribedMessage, ReadsWhatTheGeneratedCodeWrites) {
  sensor_msgs::Imu imu;
  imu.header.stamp = ros::Time(1600000000, 250000000);
  imu.header.frame_id = "imu";
  imu.angular_velocity.z = -0.125;
  imu.angular_velocity_covariance[8] = 0.5;
  const DescribedMessage read = described<sensor_msgs::Imu>(bytes_of(imu));
  EXPECT_EQ(read["header.frame_id"].text(), "imu");
  EXPECT_EQ(read["header.stamp"].seconds(), 1600000000u);
  EXPECT_EQ(read["header"]["stamp"].nanoseconds(), 250000000u);
  EXPECT_EQ(read["angular_velocity.z"].number(), -0.125);
  ASSERT_EQ(read["angular_velocity_covariance"].elements().size(), 9u);
  EXPECT_EQ(read["angular_velocity_covariance"].elements()[8].number(), 0.5);

  diagnostic_msgs::DiagnosticArray array;
  array.status.resize(2);
  array.status[1].name = "two";
  array.status[1].level = -1;
  array.status[1].values.resize(1);
  array.status[1].values[0].key = "a key";
  const DescribedMessage list = described<diagnostic_msgs::DiagnosticArray>(bytes_of(array));
  ASSERT_EQ(list["status"].elements().size(), 2u);
  const DescribedMessage& second = list["status"].elements()[1];
  EXPECT_EQ(second["name"].text(), "two");
  EXPECT_EQ(second["level"].number(), -1.0);
  EXPECT_EQ(second["values"].elements()[0]["key"].text(), "a key");

  FilterStatus status;
  status.renewed = 1;
  status.updates = 1ULL << 40;
  status.observation = -1;
  const DescribedMessage of_filter = described<FilterStatus>(bytes_of(status));
  EXPECT_EQ(of_filter["renewed"].number(), 1.0);
  EXPECT_EQ(of_filter["updates"].number(), std::ldexp(1.0, 40));
  EXPECT_EQ(of_filter["observation"].number(), -1.0);
}

TEST(DescribedMessage, ReadsEveryTypeOfNumber) {
  std::vector<std::uint8_t> bytes;
  const auto add = [&](const auto& number) {
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(&number);
    bytes.insert(bytes.end(), begin, begin + sizeof number);
  };
  std::string definition;
  const auto field = [&](const std::string& type, const auto& number) {
    definition += type + " of_" + type + "\n";
    add(number);
  };
  field("bool", std::uint8_t{1});
  field("char", std::uint8_t{200});
  field("byte", std::int8_t{-100});
  field("int8", std::int8_t{-128});
  field("uint8", std::uint8_t{255});
  field("int16", std::int16_t{-32768});
  field("uint16", std::uint16_t{65535});
  field("int32", std::int32_t{-2147483647});
  field("uint32", std::uint32_t{4294967295u});
  field("int64", std::int64_t{-(1LL << 50)});
  field("uint64", std::uint64_t{1ULL << 63});
  field("float32", -0.25f);
  field("float64", 1e-300);
  definition += "duration of_duration\n";
  add(std::int32_t{-2});
  add(std::int32_t{500000000});
  const DescribedMessage read =
      DescribedMessage::read("a/B", definition, bytes.data(), bytes.size());
  EXPECT_EQ(read["of_bool"].number(), 1.0);
  EXPECT_EQ(read["of_char"].number(), 200.0);
  EXPECT_EQ(read["of_byte"].number(), -100.0);
  EXPECT_EQ(read["of_int8"].number(), -128.0);
  EXPECT_EQ(read["of_uint8"].number(), 255.0);
  EXPECT_EQ(read["of_int16"].number(), -32768.0);
  EXPECT_EQ(read["of_uint16"].number(), 65535.0);
  EXPECT_EQ(read["of_int32"].number(), -2147483647.0);
  EXPECT_EQ(read["of_uint32"].number(), 4294967295.0);
  EXPECT_EQ(read["of_int64"].number(), -std::ldexp(1.0, 50));
  EXPECT_EQ(read["of_uint64"].number(), std::ldexp(1.0, 63));
  EXPECT_EQ(read["of_float32"].number(), -0.25);
  EXPECT_EQ(read["of_float64"].number(), 1e-300);
  EXPECT_EQ(read["of_duration"].number(), -1.5);
}

TEST(DescribedMessage, RefusesWhatTheDefinitionDoesNotDescribe) {
  std::vector<std::uint8_t> bytes = bytes_of(sensor_msgs::Imu());
  const DescribedMessage read = described<sensor_msgs::Imu>(bytes);
  EXPECT_THROW(read["no_such_field"], Error);
  EXPECT_THROW(read["header"].number(), Error);
  bytes.pop_back();
  EXPECT_THROW(described<sensor_msgs::Imu>(bytes), Error);
  bytes.resize(bytes.size() + 2);
  EXPECT_THROW(described<sensor_msgs::Imu>(bytes), Error);
  const std::uint8_t none[4] = {0xff, 0xff, 0xff, 0xff};
  const auto read_as = [&](const std::string& definition) {
    return DescribedMessage::read("a/B", definition, none, sizeof(none));
  };
  EXPECT_THROW(read_as("Unknown x\n"), Error);
  EXPECT_THROW(read_as("string x\n"), Error);  // 4 GB of letters
  EXPECT_THROW(read_as("Empty[] x\n================\nMSG: a/Empty\n"), Error);
  EXPECT_THROW(read_as("B x\n"), Error);  // in itself, without end
  EXPECT_THROW(read_as("int32[-1] x\n"), Error);
  EXPECT_EQ(read_as("int32 kConstant=5\n# a comment\nint32 x # another\n")["x"].number(), -1.0);
}

// Types without fields take no bytes: a message of none could have any number of them, in arrays of
// arrays, or in types whose fields double twenty times.
TEST(DescribedMessage, RefusesValuesWithoutEndThatTakeNoBytes) {
  std::string nested = "T0[10] x\n";
  std::string doubled = "T0 a\nT0 b\n";
  for (int i = 0; i < 14; ++i) {
    const std::string begin = "====\nMSG: a/T" + std::to_string(i) + "\n";
    const std::string next = "T" + std::to_string(i + 1);
    nested += begin + next + "[10] x\n";
    doubled += begin + next + " a\n" + next + " b\n";
  }
  const std::string end = "====\nMSG: a/T14\n";
  const std::uint8_t bytes[200] = {};
  for (const std::string& definition :
       {nested + end, doubled + end, std::string("T[199990] x\n====\nMSG: a/T\n")}) {
    try {
      DescribedMessage::read("a/B", definition, bytes, 0);
      ADD_FAILURE() << definition;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()), "the message has too many parts");
    }
  }
  // Arrays of a fixed length of none, in each of many elements.
  std::string empty = "T[] x\n====\nMSG: a/T\nuint8 y\n";
  for (int i = 0; i < 3000; ++i) empty += "U[0] f" + std::to_string(i) + "\n";
  std::vector<std::uint8_t> elements(90004);
  const std::uint32_t length = 90000;
  std::memcpy(elements.data(), &length, sizeof length);
  EXPECT_THROW(DescribedMessage::read("a/B", empty, elements.data(), elements.size()), Error);
  // A few are none too many, and many are not where each has its byte.
  EXPECT_NO_THROW(DescribedMessage::read("a/B", "T[900] x\n====\nMSG: a/T\n", bytes, 0));
  const std::vector<std::uint8_t> many(90000);
  EXPECT_NO_THROW(DescribedMessage::read("a/B", "uint8[90000] x\n", many.data(), many.size()));
}

// One definition after the other, and back: each message is read by its own.
TEST(DescribedMessage, EachIsReadByItsOwnDefinition) {
  const std::uint8_t bytes[2] = {1, 2};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(DescribedMessage::read("a/B", "uint8 x\nuint8 y\n", bytes, 2)["y"].number(), 2.0);
    EXPECT_EQ(DescribedMessage::read("a/B", "uint8 y\nuint8 x\n", bytes, 2)["y"].number(), 1.0);
    EXPECT_EQ(DescribedMessage::read("a/C", "uint16 y\n", bytes, 2)["y"].number(), 513.0);
  }
}

}  // namespace
}  // namespace pf_resampling
