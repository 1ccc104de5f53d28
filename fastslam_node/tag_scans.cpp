#include "fastslam_node/tag_scans.hpp"

#include <cmath>
#include <utility>

#include "src/messages/conversions.hpp"
#include "src/messages/foreign_messages.hpp"
#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

// The messages of one image come at once.
constexpr double kPatience = 0.03;  // s
// Of an axis' height above the plane: half as steep as can be.
constexpr double kSteep = 0.7;
/// Where a sensor looks: along x if its z axis points up, else along z, as the optical frames of
/// cameras (REP 103) do; straight down, to where the image's upper edge is.
double heading_of(const Eigen::Matrix3d& turn) {
  Eigen::Vector3d axis = turn.col(2).z() > kSteep ? turn.col(0) : turn.col(2);
  if (axis.head<2>().norm() < 1.0 - kSteep) axis = -turn.col(1);
  return std::atan2(axis.y(), axis.x());
}

}  // namespace

TagScans::TagScans(const FramePattern& pattern, FrameNames frames)
    : pattern_(pattern), frames_(std::move(frames)) {}

std::optional<int> TagScans::id_of(const std::string& frame) const {
  const std::optional<int> detected = id_of_detected_tag(frame);
  return detected || pattern_.is_empty() ? detected : pattern_.id_of(frame);
}

bool TagScans::is_tag(const geometry_msgs::TransformStamped& transform) const {
  if (is_detected_tag(transform.child_frame_id)) return true;
  if (!id_of(transform.child_frame_id)) return false;
  const std::string parent = without_slash(transform.header.frame_id);
  return parent != without_slash(frames_.map) && parent != without_slash(frames_.odom);
}

std::optional<Rejection> TagScans::take(const geometry_msgs::TransformStamped& transform,
                                        ros::Time odometry, StaticFrames* on_robot) {
  const std::string tag = without_slash(transform.child_frame_id);
  const std::string camera = without_slash(transform.header.frame_id);
  const ros::Time stamp = transform.header.stamp;
  const auto& t = transform.transform.translation;
  if (auto wrong = check(stamp)) return wrong;
  const std::optional<int> id = id_of(tag);
  if (!id) {
    return rejection(RejectReason::unknown_id, "'", tag,
                     "' is no landmark: let the detector report each tag of the bundle by itself "
                     "(apriltag_ros: standalone_tags)");
  }
  if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z)) {
    return rejection(RejectReason::not_finite, "the position of tag '", tag,
                     "' has a NaN or infinity");
  }
  const auto camera_pose = on_robot->pose(frames_.base, camera);
  if (!camera_pose) {
    return rejection(RejectReason::unknown_frame, "where '", camera, "', which sees '", tag,
                     "', is on '", frames_.base,
                     "' is not known: give it on /tf_static, or in the list `sensors` of the "
                     "configuration");
  }
  ros::Time& latest = latest_[tag + " " + camera];
  if (std::exchange(latest, stamp) == stamp) return std::nullopt;

  const Pose2 sensor = {camera_pose->translation().x(), camera_pose->translation().y(),
                        heading_of(camera_pose->linear())};
  const std::string frame = camera + " from above";
  on_robot->add(frames_.base, frame, {sensor.x, sensor.y, 0.0}, sensor.heading);
  const Eigen::Vector3d place = *camera_pose * Eigen::Vector3d(t.x, t.y, t.z);
  LandmarkObservation seen;
  seen.id = *id;
  seen.range = std::hypot(place.x() - sensor.x, place.y() - sensor.y);
  seen.bearing =
      wrap_angle(std::atan2(place.y() - sensor.y, place.x() - sensor.x) - sensor.heading);

  OpenScan& open = open_[camera];
  if (!open.scan.observations.empty() && open.scan.header.stamp != stamp) {
    complete_.push_back(std::exchange(open.scan, {}));
  }
  open.scan.header.stamp = stamp;
  open.scan.header.frame_id = frame;
  open.scan.observations.push_back(seen);
  open.odometry = odometry;
  return std::nullopt;
}

std::vector<LandmarkObservationArray> TagScans::take_complete(ros::Time odometry) {
  for (auto& [camera, open] : open_) {
    if (open.scan.observations.empty()) continue;
    if ((odometry - open.odometry).toSec() >= kPatience) {
      complete_.push_back(std::exchange(open.scan, {}));
    }
  }
  return std::exchange(complete_, {});
}

void TagScans::clear() {
  open_.clear();
  complete_.clear();
  latest_.clear();
}

}  // namespace pf_resampling
