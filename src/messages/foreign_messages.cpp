#include "src/messages/foreign_messages.hpp"

#include <cmath>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "src/messages/described_message.hpp"

namespace pf_resampling {
namespace {

using Scan = LandmarkObservationArray;
using Tags = tf2_msgs::TFMessage;
using Landmarks = std::variant<LandmarkObservationArray, tf2_msgs::TFMessage>;

const char* const kAprilTags = "apriltag_ros/AprilTagDetectionArray";
const char* const kFiducials = "fiducial_msgs/FiducialTransformArray";
const char* const kAruco = "aruco_msgs/MarkerArray";
const char* const kMrptLandmarks = "mrpt_msgs/ObservationRangeBearing";
const char* const kUwbDriver = "uwb_driver/UwbRange";
const char* const kGtec = "gtec_msgs/Ranging";

// No frame of a robot has such a name.
const char* const kDetectedTag = "detected tag ";

DescribedMessage described(const topic_tools::ShapeShifter& message) {
  std::vector<std::uint8_t> bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), message.size());
  message.write(stream);
  try {
    return DescribedMessage::read(message.getDataType(), message.getMessageDefinition(),
                                  bytes.data(), bytes.size());
  } catch (const Error& error) {
    throw Error("a " + message.getDataType() + " cannot be read: " + error.what());
  }
}

std_msgs::Header header_of(const DescribedMessage& header) {
  std_msgs::Header read;
  // As they are: the constructor throws for stamps that no clock has, which the checks reject.
  read.stamp.sec = header["stamp"].seconds();
  read.stamp.nsec = header["stamp"].nanoseconds();
  read.frame_id = header["frame_id"].text();
  return read;
}

// Ids beyond what a landmark can have are those of no landmark.
int id_of(const DescribedMessage& id) {
  const double number = id.number();
  return number >= 0.0 && number <= 2147483647.0 ? static_cast<int>(number) : -1;
}

void add_tag(const std_msgs::Header& header, const DescribedMessage& id,
             const DescribedMessage& place, Tags* tags) {
  if (id_of(id) < 0) return;
  geometry_msgs::TransformStamped tag;
  tag.header = header;
  tag.child_frame_id = detected_tag_name(id_of(id));
  tag.transform.translation.x = place["x"].number();
  tag.transform.translation.y = place["y"].number();
  tag.transform.translation.z = place["z"].number();
  tag.transform.rotation.w = 1.0;  // a tag's place alone counts
  tags->transforms.push_back(tag);
}

// Several tags on a board, which are seen as one: no landmark has its place.
void add_bundle(const std_msgs::Header& header, const std::vector<DescribedMessage>& ids,
                Tags* tags) {
  geometry_msgs::TransformStamped bundle;
  bundle.header = header;
  bundle.child_frame_id = std::string(kDetectedTag) + "bundle of";
  for (const DescribedMessage& id : ids) bundle.child_frame_id += " " + std::to_string(id_of(id));
  tags->transforms.push_back(bundle);
}

// Where a driver's message has its tags.
struct TagFields {
  const char* list;
  const char* id;
  bool id_is_list;  // of one; a detection with several ids is a bundle, which is no landmark
  const char* place;
};
constexpr TagFields kInAprilTags{"detections", "id", true, "pose.pose.pose.position"};
constexpr TagFields kInFiducials{"transforms", "fiducial_id", false, "transform.translation"};
constexpr TagFields kInAruco{"markers", "id", false, "pose.pose.position"};

Tags tags_in(const DescribedMessage& message, const TagFields& fields) {
  Tags tags;
  const std_msgs::Header header = header_of(message["header"]);
  for (const DescribedMessage& seen : message[fields.list].elements()) {
    const DescribedMessage& id = seen[fields.id];
    if (fields.id_is_list && id.elements().size() != 1) {
      if (!id.elements().empty()) add_bundle(header, id.elements(), &tags);
      continue;
    }
    add_tag(header, fields.id_is_list ? id.elements().front() : id, seen[fields.place], &tags);
  }
  return tags;
}

// Ranges along the line of sight become ranges in the plane.
Scan mrpt_landmarks_in(const DescribedMessage& message) {
  Scan scan;
  scan.header = header_of(message["header"]);
  scan.header.frame_id = message["header.frame_id"].text();
  for (const DescribedMessage& seen : message["sensed_data"].elements()) {
    LandmarkObservation observation;
    observation.id = id_of(seen["id"]);
    observation.range = seen["range"].number() * std::cos(seen["pitch"].number());
    observation.bearing = seen["yaw"].number();
    observation.range_variance = std::pow(message["sensor_std_range"].number(), 2);
    observation.bearing_variance = std::pow(message["sensor_std_yaw"].number(), 2);
    scan.observations.push_back(observation);
  }
  return scan;
}

}  // namespace

std::vector<std::string> foreign_landmark_types() {
  return {kAprilTags, kFiducials, kAruco, kMrptLandmarks};
}

std::vector<std::string> foreign_range_types() {
  return {kUwbDriver, kGtec};
}

std::string detected_tag_name(int id) {
  return kDetectedTag + std::to_string(id);
}

bool is_detected_tag(const std::string& frame) {
  return frame.rfind(kDetectedTag, 0) == 0;
}

std::optional<int> id_of_detected_tag(const std::string& frame) {
  if (!is_detected_tag(frame)) return std::nullopt;
  std::istringstream number(frame.substr(std::string(kDetectedTag).size()));
  int id = 0;
  if (!(number >> id) || id < 0) return std::nullopt;
  return id;
}

Landmarks landmarks_in(const topic_tools::ShapeShifter& message) {
  const std::string& type = message.getDataType();
  if (type == kAprilTags) return tags_in(described(message), kInAprilTags);
  if (type == kFiducials) return tags_in(described(message), kInFiducials);
  if (type == kAruco) return tags_in(described(message), kInAruco);
  if (type == kMrptLandmarks) return mrpt_landmarks_in(described(message));
  throw Error("landmarks come as " + type + ", which is not known; see doc/other_drivers.md");
}

BeaconRange range_in(const topic_tools::ShapeShifter& message, const std::string& antenna,
                     ros::Time arrival) {
  const std::string& type = message.getDataType();
  BeaconRange range;
  range.header.frame_id = antenna;
  if (type == kUwbDriver) {
    const DescribedMessage uwb = described(message);
    range.header.stamp = header_of(uwb["header"]).stamp;
    range.beacon = id_of(uwb["responder_id"]);
    range.range = uwb["distance"].number();
    range.variance = std::pow(uwb["distance_err"].number(), 2);
    return range;
  }
  if (type == kGtec) {
    const DescribedMessage gtec = described(message);
    range.header.stamp = arrival;
    range.beacon = id_of(gtec["anchorId"]);
    range.range = 0.001 * gtec["range"].number();
    return range;
  }
  throw Error("ranges come as " + type + ", which is not known; see doc/other_drivers.md");
}

}  // namespace pf_resampling
