#pragma once

#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {

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

/// Size of the scene that `beacons` span: the diagonal of their bounding box, at least 1 m.
double extent_of(const std::vector<Beacon>& beacons);

}  // namespace pf_resampling
