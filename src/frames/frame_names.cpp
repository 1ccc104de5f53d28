#include "src/frames/frame_names.hpp"

#include "src/configuration/text_parameter.hpp"

namespace pf_resampling {

void add_parameters(FrameNames* frames, ParameterList* list) {
  list->push_back(
      name_parameter("frames/map", &frames->map, "Frame of poses, beacons and landmarks."));
  list->push_back(name_parameter("frames/odom", &frames->odom,
                                 "Frame that odometry messages have in header.frame_id."));
  list->push_back(
      name_parameter("frames/base", &frames->base,
                     "Frame of the robot, which odometry messages have in child_frame_id."));
  list->push_back(real_parameter("frames/transform_tolerance", &frames->transform_tolerance, 0.0,
                                 100.0, "s",
                                 "The transform map -> odom is stamped this far in the future."));
}

}  // namespace pf_resampling
