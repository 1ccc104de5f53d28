#include "src/messages/described_message.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <pf_resampling/FilterStatus.h>
#include <ros/serialization.h>
#include <sensor_msgs/Imu.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

template <typename Message>
std::vector<std::uint8_t> serialized(const Message& message) {
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

using nlohmann::json;

template <typename Message>
json described(const std::vector<std::uint8_t>& bytes) {
  return read_described(ros::message_traits::DataType<Message>::value(),
                        ros::message_traits::Definition<Message>::value(), bytes.data(),
                        bytes.size());
}

// The same bytes as the generated code reads, of types with arrays of both kinds, texts, times.
TEST(ReadDescribed, ReadsWhatTheGeneratedCodeWrites) {
  sensor_msgs::Imu imu;
  imu.header.stamp = ros::Time(1600000000, 250000000);
  imu.header.frame_id = "imu";
  imu.angular_velocity.z = -0.125;
  imu.angular_velocity_covariance[8] = 0.5;
  const json read = described<sensor_msgs::Imu>(serialized(imu));
  EXPECT_EQ(read["header"]["frame_id"], "imu");
  EXPECT_EQ(read["header"]["stamp"]["secs"], 1600000000u);
  EXPECT_EQ(read["header"]["stamp"]["nsecs"], 250000000u);
  EXPECT_EQ(read["angular_velocity"]["z"], -0.125);
  ASSERT_EQ(read["angular_velocity_covariance"].size(), 9u);
  EXPECT_EQ(read["angular_velocity_covariance"][8], 0.5);

  diagnostic_msgs::DiagnosticArray array;
  array.status.resize(2);
  array.status[1].name = "two";
  array.status[1].level = -1;
  array.status[1].values.resize(1);
  array.status[1].values[0].key = "a key";
  const json list = described<diagnostic_msgs::DiagnosticArray>(serialized(array));
  ASSERT_EQ(list["status"].size(), 2u);
  const json& second = list["status"][1];
  EXPECT_EQ(second["name"], "two");
  EXPECT_EQ(second["level"], -1.0);
  EXPECT_EQ(second["values"][0]["key"], "a key");

  FilterStatus status;
  status.renewed = 1;
  status.updates = 1ULL << 40;
  status.observation = -1;
  const json of_filter = described<FilterStatus>(serialized(status));
  EXPECT_EQ(of_filter["renewed"], 1.0);
  EXPECT_EQ(of_filter["updates"], std::ldexp(1.0, 40));
  EXPECT_EQ(of_filter["observation"], -1.0);
}

TEST(ReadDescribed, ReadsEveryTypeOfNumber) {
  std::vector<std::uint8_t> bytes;
  std::string definition;
  std::vector<std::pair<std::string, double>> expected;
  const auto add = [&](const std::string& type, const auto& number) {
    definition += type + " of_" + type + "\n";
    expected.emplace_back("of_" + type, static_cast<double>(number));
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(&number);
    bytes.insert(bytes.end(), begin, begin + sizeof number);
  };
  add("bool", std::uint8_t{1});
  add("char", std::uint8_t{200});
  add("byte", std::int8_t{-100});
  add("int8", std::int8_t{-128});
  add("uint8", std::uint8_t{255});
  add("int16", std::int16_t{-32768});
  add("uint16", std::uint16_t{65535});
  add("int32", std::int32_t{-2147483647});
  add("uint32", std::uint32_t{4294967295u});
  add("int64", std::int64_t{-(1LL << 50)});
  add("uint64", std::uint64_t{1ULL << 63});
  add("float32", -0.25f);
  add("float64", 1e-300);
  const std::int32_t duration[2] = {-2, 500000000};
  const auto* const begin = reinterpret_cast<const std::uint8_t*>(duration);
  bytes.insert(bytes.end(), begin, begin + sizeof duration);
  definition += "duration of_duration\n";
  const json read = read_described("a/B", definition, bytes.data(), bytes.size());
  for (const auto& [field, number] : expected) EXPECT_EQ(read[field], number) << field;
  EXPECT_EQ(read["of_duration"], (json{{"secs", -2}, {"nsecs", 500000000}}));
}

TEST(ReadDescribed, RefusesWhatTheDefinitionDoesNotDescribe) {
  std::vector<std::uint8_t> bytes = serialized(sensor_msgs::Imu());
  bytes.pop_back();
  EXPECT_THROW(described<sensor_msgs::Imu>(bytes), Error);
  bytes.resize(bytes.size() + 2);
  EXPECT_THROW(described<sensor_msgs::Imu>(bytes), Error);
  const std::uint8_t none[4] = {0xff, 0xff, 0xff, 0xff};
  const auto read_as = [&](const std::string& definition) {
    return read_described("a/B", definition, none, sizeof(none));
  };
  EXPECT_THROW(read_as("Unknown x\n"), Error);
  EXPECT_THROW(read_as("string x\n"), Error);  // 4 GB of letters
  EXPECT_THROW(read_as("B x\n"), Error);       // in itself, without end
  EXPECT_THROW(read_as("int32[-1] x\n"), Error);
  EXPECT_EQ(read_as("int32 kConstant=5\n# a comment\nint32 x # another\n")["x"], -1.0);
}

// One definition after the other, and back: each message is read by its own.
TEST(ReadDescribed, EachIsReadByItsOwnDefinition) {
  const std::uint8_t bytes[2] = {1, 2};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(read_described("a/B", "uint8 x\nuint8 y\n", bytes, 2)["y"], 2.0);
    EXPECT_EQ(read_described("a/B", "uint8 y\nuint8 x\n", bytes, 2)["y"], 1.0);
    EXPECT_EQ(read_described("a/C", "uint16 y\n", bytes, 2)["y"], 513.0);
  }
}

}  // namespace
}  // namespace pf_resampling
