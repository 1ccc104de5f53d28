#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <set>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {

/// Size of the scene that the landmarks span: the diagonal of their bounding box, at least 1 m.
double extent_of(const std::vector<LandmarkEstimate>& map);

/// The landmarks as points, and the ellipses that hold them with about 86 % (2 sigma) as lines.
/// `width`: of the line, m.
visualization_msgs::MarkerArray landmark_markers(const MarkerFrame& frame,
                                                 const std::vector<LandmarkEstimate>& map,
                                                 double width);

/// Their ids as text, `height` m high. `labels`: the ids that have a label; those that have no
/// landmark any more are taken away.
visualization_msgs::MarkerArray label_markers(const MarkerFrame& frame,
                                              const std::vector<LandmarkEstimate>& map,
                                              double height, std::set<std::int64_t>* labels);

/// A scan, and what its observations were taken as.
struct ScanPicture {
  Pose2 robot;
  Pose2 sensor;  ///< on the robot
  std::vector<RangeBearingObservation> observations;
  std::vector<ObservationOutcome> outcomes;
};

/// Lines from the sensor: green to the landmarks that were seen again, blue to new ones, red to
/// where something was seen that was not believed. `lifetime`: s.
visualization_msgs::MarkerArray association_markers(const MarkerFrame& frame,
                                                    const ScanPicture& scan,
                                                    const std::vector<LandmarkEstimate>& map,
                                                    double width, double lifetime);

}  // namespace pf_resampling
