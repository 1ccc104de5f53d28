#pragma once

#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <ros/time.h>
#include <tf2_msgs/TFMessage.h>
#include <topic_tools/shape_shifter.h>

#include <optional>
#include <string>
#include <variant>

namespace pf_resampling {

/// Messages of other packages that say what a filter takes, read by the definition that comes with
/// them: these packages need not be installed.

/// The name of the frame that stands for a detected tag; see TagScans.
std::string detected_tag_name(int id);
std::optional<int> id_of_detected_tag(const std::string& frame);
/// Whether it is of a tag, or of a bundle of tags, which has no id.
bool is_detected_tag(const std::string& frame);

/// What a message of such a type says: detections of tags as transforms camera -> tag
/// (detected_tag_name()), which TagScans makes scans of, or a scan. The types:
/// apriltag_ros/AprilTagDetectionArray (bundles are left out),
/// fiducial_msgs/FiducialTransformArray, aruco_msgs/MarkerArray, mrpt_msgs/ObservationRangeBearing.
/// Throws Error if the message is not as its definition says, or is of another type.
std::variant<LandmarkObservationArray, tf2_msgs::TFMessage> landmarks_in(
    const topic_tools::ShapeShifter& message);

/// Likewise a range: uwb_driver/UwbRange, gtec_msgs/Ranging. They do not say where on the robot
/// they were measured from: `antenna` does. `arrival`: when it came, the stamp of one without.
BeaconRange range_in(const topic_tools::ShapeShifter& message, const std::string& antenna,
                     ros::Time arrival);

}  // namespace pf_resampling
