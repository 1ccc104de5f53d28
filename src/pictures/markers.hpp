#pragma once

#include <std_msgs/ColorRGBA.h>
#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

namespace pf_resampling {

/// Where markers are drawn and until when.
struct MarkerFrame {
  std::string frame;
  ros::Time stamp;
};

/// A marker of a type of visualization_msgs::Marker, called `name` and `id`, where the frame is.
visualization_msgs::Marker make_marker(const MarkerFrame& frame, const std::string& name, int id,
                                       int type);

geometry_msgs::Point make_point(double x, double y, double z);

/// Color number `index` of a palette whose neighbours differ clearly (hue by the golden ratio).
std_msgs::ColorRGBA palette_color(int index, float alpha);

/// A cylinder with its id above for every beacon, colored by its place in the list. `size`: height
/// in m, to be chosen from the size of the scene.
visualization_msgs::MarkerArray beacon_markers(const MarkerFrame& frame,
                                               const std::vector<Beacon>& beacons, double size);

/// A ring around `beacon` where the antenna is by this distance (m; scale and bias taken out of the
/// measured range); a 3-D beacon's ring is where its sphere cuts the antenna's height. `index`: the
/// beacon's place in the list, for color and marker id; `lifetime`: s; `width`: of the line, m.
visualization_msgs::Marker range_ring_marker(const MarkerFrame& frame, const Beacon& beacon,
                                             int index, double distance, double antenna_height,
                                             double lifetime, double width);

/// The ellipse that holds the position with about 86 % (2 sigma) under a Gaussian, and a line for
/// the heading; `width`: of the line, m.
visualization_msgs::MarkerArray pose_ellipse_markers(const MarkerFrame& frame,
                                                     const PoseEstimate& estimate, double width);

/// Size of the scene that `beacons` span: the diagonal of their bounding box, at least 1 m.
double extent_of(const std::vector<Beacon>& beacons);

bool is_finite(const visualization_msgs::Marker& marker);

}  // namespace pf_resampling
