#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace pf_resampling {

/// A message of a type that is not known when this is compiled, read by the definition that comes
/// with it: in the header of its connection, live and in bags.
class DescribedMessage {
 public:
  /// `type`: "apriltag_ros/AprilTagDetectionArray"; `definition`: its text and those of all types
  /// in it, as ROS puts them together. Throws Error if they do not describe `size` bytes at `data`.
  static DescribedMessage read(const std::string& type, const std::string& definition,
                               const std::uint8_t* data, std::size_t size);

  /// A field by its name, also of a field of a field: "pose.pose.position". Throws Error, naming
  /// it, if there is none.
  const DescribedMessage& operator[](const std::string& name) const;
  /// A number, or a time or duration in seconds. Throws Error for anything else.
  double number() const;
  const std::string& text() const { return text_; }
  /// Of a time.
  std::uint32_t seconds() const { return seconds_; }
  std::uint32_t nanoseconds() const { return nanoseconds_; }
  /// Of an array.
  const std::vector<DescribedMessage>& elements() const { return elements_; }

 private:
  friend class DescribedMessageReader;
  bool is_number_ = false;
  double number_ = 0.0;
  std::uint32_t seconds_ = 0, nanoseconds_ = 0;
  std::string text_;
  std::map<std::string, DescribedMessage> fields_;
  std::vector<DescribedMessage> elements_;
};

}  // namespace pf_resampling
