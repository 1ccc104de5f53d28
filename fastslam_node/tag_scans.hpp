#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <pf_resampling/LandmarkObservationArray.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "src/frames/frame_names.hpp"
#include "src/frames/frame_pattern.hpp"
#include "src/frames/static_frames.hpp"
#include "src/messages/rejects.hpp"

namespace pf_resampling {

/// Makes scans of landmarks of what detectors of tags (AprilTag, ArUco) publish: transforms camera
/// → tag on /tf, or messages of which landmarks_in() makes such transforms; all of one image with
/// its stamp. A tag's id is in the name of its frame, its place alone counts, and of that what a
/// range and a bearing in the robot's plane say.
///
/// The tags of an image may come in several messages. Its scan is complete when one of the next
/// image comes, or when odometry has gone on for a moment.
class TagScans {
 public:
  TagScans(const FramePattern& pattern, FrameNames frames);

  /// Whether a transform is the detection of a tag. One from the map or odom frame is not: there
  /// somebody says where a tag is, not where it was seen.
  bool is_tag(const geometry_msgs::TransformStamped& transform) const;

  /// Takes a detection. `odometry`: stamp of the newest. Puts the camera as it is seen from above
  /// into `on_robot`, which has to know the camera: that is the frame of the scans. One that was
  /// there before, as relays of tf send it, is passed over.
  std::optional<Rejection> take(const geometry_msgs::TransformStamped& transform,
                                ros::Time odometry, StaticFrames* on_robot);

  /// The scans that are complete, each once.
  std::vector<LandmarkObservationArray> take_complete(ros::Time odometry);

  void clear();

 private:
  std::optional<int> id_of(const std::string& frame) const;

  struct OpenScan {
    LandmarkObservationArray scan;
    ros::Time odometry;  // the newest when the last tag came
  };

  FramePattern pattern_;
  FrameNames frames_;
  std::map<std::string, OpenScan> open_;  // by the camera's frame
  std::vector<LandmarkObservationArray> complete_;
  std::map<std::string, ros::Time> latest_;  // by the tag's frame and the camera's
};

}  // namespace pf_resampling
