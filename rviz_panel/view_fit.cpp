#include "rviz_panel/view_fit.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

using visualization_msgs::Marker;

constexpr double kSmallestView = 5.0;  // m
// Parts of the window that the box fills: of a new view, and of one that is no longer good.
constexpr double kGoodFill = 0.8;
constexpr double kPoorFill = 0.55;
constexpr double kMostFill = 0.96;

Eigen::Vector2d position_of(const geometry_msgs::Point& point) {
  return {point.x, point.y};
}

}  // namespace

void Scene::take(const nav_msgs::Path& path) {
  frame_ = path.header.frame_id;
  path_.setEmpty();
  for (const auto& pose : path.poses) path_.extend(position_of(pose.pose.position));
}

void Scene::take(const visualization_msgs::MarkerArray& markers) {
  for (const Marker& marker : markers.markers) {
    frame_ = marker.header.frame_id;
    if (marker.ns == "landmarks") {
      landmarks_.setEmpty();
      if (marker.action == Marker::DELETE) continue;
      for (const auto& point : marker.points) landmarks_.extend(position_of(point));
    } else if (marker.ns == "beacons") {
      beacons_[marker.id] = position_of(marker.pose.position);
    } else if (marker.ns == "pose_heading") {
      robot_ = Eigen::AlignedBox2d(position_of(marker.pose.position));
    }
  }
}

Eigen::AlignedBox2d Scene::box() const {
  Eigen::AlignedBox2d box = path_;
  box.extend(landmarks_);
  box.extend(robot_);
  for (const auto& [id, place] : beacons_) box.extend(place);
  return box;
}

TopView fitted_view(const Eigen::AlignedBox2d& box, double width, double height, double angle,
                    const std::optional<TopView>& present) {
  const double cosine = std::abs(std::cos(angle));
  const double sine = std::abs(std::sin(angle));
  const Eigen::Vector2d sizes = box.sizes().cwiseMax(kSmallestView * kGoodFill);
  const Eigen::Vector2d seen(cosine * sizes.x() + sine * sizes.y(),
                             sine * sizes.x() + cosine * sizes.y());
  const Eigen::Vector2d window = Eigen::Vector2d(width, height).cwiseMax(1.0);
  if (present) {
    const Eigen::Vector2d fill = present->scale * seen.cwiseQuotient(window);
    const Eigen::Vector2d off = (box.center() - Eigen::Vector2d(present->x, present->y)).cwiseAbs();
    const Eigen::Vector2d off_seen(cosine * off.x() + sine * off.y(),
                                   sine * off.x() + cosine * off.y());
    const Eigen::Vector2d reach = fill + 2.0 * present->scale * off_seen.cwiseQuotient(window);
    if (fill.maxCoeff() >= kPoorFill && reach.maxCoeff() <= kMostFill) return *present;
  }
  return {box.center().x(), box.center().y(), kGoodFill * window.cwiseQuotient(seen).minCoeff()};
}

}  // namespace pf_resampling
