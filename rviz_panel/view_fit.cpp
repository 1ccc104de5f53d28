#include "rviz_panel/view_fit.hpp"

namespace pf_resampling {
namespace {

constexpr double kSmallestScene = 4.0;  // m
// Parts of the window that the scene fills: in a new view, and in one that is no longer good.
constexpr double kGoodFill = 0.8;
constexpr double kPoorFill = 0.5;
constexpr double kMostFill = 0.95;
constexpr double kHalfLine = 8.0;  // of a finding's text, in heights of its letters

Eigen::Vector2d planar(const geometry_msgs::Point& point) {
  return {point.x, point.y};
}

}  // namespace

void Scene::take(const visualization_msgs::MarkerArray& markers) {
  std::map<std::string, Eigen::AlignedBox2d> seen;
  for (const visualization_msgs::Marker& marker : markers.markers) {
    const Eigen::Vector2d place = planar(marker.pose.position);
    if (marker.ns == "landmarks") {
      if (marker.action == visualization_msgs::Marker::DELETE) parts_.clear();  // no map any more
      for (const auto& point : marker.points) seen[marker.ns].extend(planar(point));
    } else if (marker.ns == "findings") {
      const Eigen::Vector2d half(kHalfLine * marker.scale.z, 0.0);
      seen[marker.ns].extend(place - half).extend(place + half);
    } else if (marker.ns == "beacons" || marker.ns == "pose_heading") {
      seen[marker.ns].extend(place);
    }
  }
  for (const auto& [name, box] : seen) {
    // A robot's path stays to be seen.
    if (name == "pose_heading") {
      parts_[name].extend(box);
    } else {
      parts_[name] = box;
    }
  }
}

Eigen::AlignedBox2d Scene::box() const {
  Eigen::AlignedBox2d all;
  for (const auto& [name, box] : parts_) all.extend(box);
  return all;
}

TopView fitted_view(const Eigen::AlignedBox2d& scene, const Eigen::Vector2d& window,
                    const TopView& present) {
  const Eigen::Vector2d sizes = scene.sizes().cwiseMax(kSmallestScene);
  const Eigen::Vector2d seen = window / present.scale;
  const Eigen::Vector2d middle(present.x, present.y);
  const Eigen::Vector2d half = kMostFill / 2.0 * seen;
  const bool holds_all = Eigen::AlignedBox2d(middle - half, middle + half).contains(scene);
  if (holds_all && sizes.cwiseQuotient(seen).maxCoeff() >= kPoorFill) return present;
  return {scene.center().x(), scene.center().y(),
          kGoodFill * window.cwiseQuotient(sizes).minCoeff()};
}

}  // namespace pf_resampling
