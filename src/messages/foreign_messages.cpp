#include "src/messages/foreign_messages.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "src/messages/described_message.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;
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

// What `take` makes of a message that is read by its definition.
template <typename Take>
auto described(const topic_tools::ShapeShifter& message, const Take& take) {
  std::vector<std::uint8_t> bytes(message.size());
  ros::serialization::OStream stream(bytes.data(), message.size());
  message.write(stream);
  std::string fault;
  try {
    return take(read_described(message.getDataType(), message.getMessageDefinition(), bytes.data(),
                               bytes.size()));
  } catch (const Error& error) {
    fault = error.what();
  } catch (const json::exception& error) {  // a field that is not there, or of another type
    fault = error.what();
  }
  throw Error("a " + message.getDataType() + " cannot be read: " + fault);
}

std_msgs::Header header_of(const json& header) {
  std_msgs::Header read;
  // As they are: the constructor throws for stamps that no clock has, which the checks reject.
  read.stamp.sec = header.at("stamp").at("secs");
  read.stamp.nsec = header.at("stamp").at("nsecs");
  read.frame_id = header.at("frame_id");
  return read;
}

// Ids beyond what a landmark can have are those of no landmark.
int id_of(const json& id) {
  const double number = id;
  return number >= 0.0 && number <= 2147483647.0 ? static_cast<int>(number) : -1;
}

void add_tag(const std_msgs::Header& header, const json& id, const json& place, Tags* tags) {
  if (id_of(id) < 0) return;
  geometry_msgs::TransformStamped tag;
  tag.header = header;
  tag.child_frame_id = detected_tag_name(id_of(id));
  tag.transform.translation.x = place.at("x");
  tag.transform.translation.y = place.at("y");
  tag.transform.translation.z = place.at("z");
  tag.transform.rotation.w = 1.0;  // a tag's place alone counts
  tags->transforms.push_back(tag);
}

// Several tags on a board, which are seen as one: no landmark has its place.
void add_bundle(const std_msgs::Header& header, const json& ids, Tags* tags) {
  geometry_msgs::TransformStamped bundle;
  bundle.header = header;
  bundle.child_frame_id = std::string(kDetectedTag) + "bundle of";
  for (const json& id : ids) bundle.child_frame_id += " " + std::to_string(id_of(id));
  tags->transforms.push_back(bundle);
}

// Where a driver's message has its tags.
struct TagFields {
  const char* list;
  const char* id;
  bool id_is_list;    // of one; a detection with several ids is a bundle, which is no landmark
  const char* place;  // a JSON pointer
};
constexpr TagFields kInAprilTags{"detections", "id", true, "/pose/pose/pose/position"};
constexpr TagFields kInFiducials{"transforms", "fiducial_id", false, "/transform/translation"};
constexpr TagFields kInAruco{"markers", "id", false, "/pose/pose/position"};

Tags tags_in(const json& message, const TagFields& fields) {
  Tags tags;
  const std_msgs::Header header = header_of(message.at("header"));
  for (const json& seen : message.at(fields.list)) {
    const json& id = seen.at(fields.id);
    if (fields.id_is_list && id.size() != 1) {
      if (!id.empty()) add_bundle(header, id, &tags);
      continue;
    }
    add_tag(header, fields.id_is_list ? id.front() : id, seen.at(json::json_pointer(fields.place)),
            &tags);
  }
  return tags;
}

// Ranges along the line of sight become ranges in the plane.
Scan mrpt_landmarks_in(const json& message) {
  Scan scan;
  scan.header = header_of(message.at("header"));
  for (const json& seen : message.at("sensed_data")) {
    LandmarkObservation observation;
    observation.id = id_of(seen.at("id"));
    observation.range = seen.at("range").get<double>() * std::cos(seen.at("pitch").get<double>());
    observation.bearing = seen.at("yaw").get<double>();
    observation.range_variance = std::pow(message.at("sensor_std_range").get<double>(), 2);
    observation.bearing_variance = std::pow(message.at("sensor_std_yaw").get<double>(), 2);
    scan.observations.push_back(observation);
  }
  return scan;
}

}  // namespace

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
  if (type == kMrptLandmarks) return described(message, mrpt_landmarks_in);
  const TagFields* const fields = type == kAprilTags   ? &kInAprilTags
                                  : type == kFiducials ? &kInFiducials
                                  : type == kAruco     ? &kInAruco
                                                       : nullptr;
  if (fields == nullptr) {
    throw Error("landmarks come as " + type + ", which is not known; see doc/other_drivers.md");
  }
  return described(message, [&](const json& tags) { return tags_in(tags, *fields); });
}

BeaconRange range_in(const topic_tools::ShapeShifter& message, const std::string& antenna,
                     ros::Time arrival) {
  const std::string& type = message.getDataType();
  if (type != kUwbDriver && type != kGtec) {
    throw Error("ranges come as " + type + ", which is not known; see doc/other_drivers.md");
  }
  return described(message, [&](const json& read) {
    const bool is_gtec = type == kGtec;
    BeaconRange range;
    range.header.frame_id = antenna;
    range.header.stamp = is_gtec ? arrival : header_of(read.at("header")).stamp;
    range.beacon = id_of(read.at(is_gtec ? "anchorId" : "responder_id"));
    range.range =
        is_gtec ? 0.001 * read.at("range").get<double>() : read.at("distance").get<double>();
    if (!is_gtec) range.variance = std::pow(read.at("distance_err").get<double>(), 2);
    return range;
  });
}

}  // namespace pf_resampling
