#pragma once

#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "src/pictures/markers.hpp"

namespace pf_resampling {

/// A beacon at a place where it may be.
struct PlacedBeacon {
  Beacon beacon;                                         ///< there
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< m^2
  double probability = 1.0;
  int color = 0;  ///< the same for all places of a beacon
};

/// For every place a cylinder, the fainter the less likely, with the beacon's id above and, where
/// there are others, the probability; and an ellipse of 2 sigma. `size`: height in m, to be chosen
/// from the size of the scene; `lifetime`: s, 0: for ever.
visualization_msgs::MarkerArray beacon_markers(const MarkerFrame& frame,
                                               const std::vector<PlacedBeacon>& places, double size,
                                               double lifetime);

/// A ring around the place where the antenna is by this distance (m; scale and bias taken out of
/// the measured range); a 3-D beacon's ring is where its sphere cuts the antenna's height. `id`: of
/// the marker; `lifetime`: s; `width`: of the line, m.
visualization_msgs::Marker range_ring_marker(const MarkerFrame& frame, const PlacedBeacon& place,
                                             int id, double distance, double antenna_height,
                                             double lifetime, double width);

/// Size of the scene that they span: the diagonal of their bounding box, at least 1 m.
double extent_of(const std::vector<PlacedBeacon>& places);

}  // namespace pf_resampling
