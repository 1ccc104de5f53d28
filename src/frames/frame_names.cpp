#include "src/frames/frame_names.hpp"

#include "src/configuration/text_parameter.hpp"

namespace pf_resampling {

void add_parameters(FrameNames* frames, ParameterList* list) {
  list->push_back(
      name_parameter("frames/map", &frames->map, "Frame of poses, beacons and landmarks."));
  list->push_back(name_parameter("frames/odom", &frames->odom,
                                 "Frame that the odometry messages have to name."));
  list->push_back(name_parameter("frames/base", &frames->base,
                                 "Frame of the robot that the odometry messages have to name."));
  list->push_back(real_parameter("frames/transform_tolerance", &frames->transform_tolerance, 0.0,
                                 100.0, "s", "By so much map -> odom is dated into the future."));
}

}  // namespace pf_resampling
