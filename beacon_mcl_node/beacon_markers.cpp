#include "beacon_mcl_node/beacon_markers.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

constexpr int kRingSegments = 72;
constexpr double kFaintest = 0.3;

// Color number `index` of a palette whose neighbours differ clearly (hue by the golden ratio).
std_msgs::ColorRGBA palette_color(int index, float alpha) {
  const double hue = std::fmod(0.58 + 0.618033988749895 * index, 1.0) * 6.0;
  const auto channel = [hue](double offset) {
    const double k = std::fmod(offset + hue, 6.0);
    return static_cast<float>(1.0 - 0.8 * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return make_color(channel(5.0), channel(3.0), channel(1.0), alpha);
}

}  // namespace

visualization_msgs::MarkerArray beacon_markers(const MarkerFrame& frame,
                                               const std::vector<PlacedBeacon>& places, double size,
                                               double lifetime) {
  visualization_msgs::MarkerArray array;
  int index = 0;
  for (const PlacedBeacon& placed : places) {
    const Eigen::Vector3d& place = placed.beacon.position;
    const bool is_certain = placed.probability == 1.0;
    visualization_msgs::Marker post =
        make_marker(frame, "beacons", index, visualization_msgs::Marker::CYLINDER);
    post.pose.position = make_point(place.x(), place.y(), place.z());
    post.scale.x = post.scale.y = 0.5 * size;
    post.scale.z = size;
    post.color =
        palette_color(placed.color, static_cast<float>(std::max(kFaintest, placed.probability)));
    array.markers.push_back(post);

    visualization_msgs::Marker label =
        make_marker(frame, "beacon_ids", index, visualization_msgs::Marker::TEXT_VIEW_FACING);
    label.pose.position = make_point(place.x(), place.y() + 1.6 * size, place.z() + size);
    label.scale.z = 1.6 * size;
    label.color = palette_color(placed.color, 1.0F);
    label.text = std::to_string(placed.beacon.id);
    if (!is_certain) {
      label.text += " (" + std::to_string(std::lround(100.0 * placed.probability)) + " %)";
    }
    array.markers.push_back(label);

    if (placed.covariance.trace() > 0.0) {
      PoseEstimate there;
      there.mean = {place.x(), place.y(), 0.0};
      there.covariance.topLeftCorner<2, 2>() = placed.covariance;
      visualization_msgs::Marker ellipse =
          ellipse_marker(frame, "beacon_2_sigma", index, there, 0.15 * size);
      ellipse.color = palette_color(placed.color, 0.8F);
      array.markers.push_back(ellipse);
    }
    ++index;
  }
  for (visualization_msgs::Marker& marker : array.markers) {
    marker.lifetime = ros::Duration(lifetime);
  }
  return array;
}

visualization_msgs::Marker range_ring_marker(const MarkerFrame& frame, const PlacedBeacon& place,
                                             int id, double distance, double antenna_height,
                                             double lifetime, double width) {
  const Beacon& beacon = place.beacon;
  visualization_msgs::Marker ring =
      make_marker(frame, "ranges", id, visualization_msgs::Marker::LINE_STRIP);
  ring.scale.x = width;
  ring.color = palette_color(place.color, 0.8F);
  ring.lifetime = ros::Duration(lifetime);
  const double height = beacon.is_planar ? 0.0 : beacon.position.z() - antenna_height;
  const double radius = std::sqrt(std::max(0.0, distance * distance - height * height));
  for (int i = 0; i <= kRingSegments; ++i) {
    const double angle = 2.0 * kPi * (i % kRingSegments) / kRingSegments;
    ring.points.push_back(make_point(beacon.position.x() + radius * std::cos(angle),
                                     beacon.position.y() + radius * std::sin(angle),
                                     antenna_height));
  }
  return ring;
}

double extent_of(const std::vector<PlacedBeacon>& places) {
  if (places.empty()) return 1.0;
  Eigen::AlignedBox3d box;
  for (const PlacedBeacon& place : places) box.extend(place.beacon.position);
  return std::max(1.0, box.diagonal().norm());
}

}  // namespace pf_resampling
