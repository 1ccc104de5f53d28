#include "fastslam_node/landmark_markers.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

using visualization_msgs::Marker;

constexpr int kEllipseSegments = 24;

void add_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Marker* lines) {
  lines->points.push_back(make_point(from.x(), from.y(), 0.0));
  lines->points.push_back(make_point(to.x(), to.y(), 0.0));
}

void add_ellipse(const LandmarkEstimate& landmark, Marker* lines) {
  const auto points = ellipse_points(landmark.mean, landmark.covariance, kEllipseSegments);
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    lines->points.push_back(points[k]);
    lines->points.push_back(points[k + 1]);
  }
}

}  // namespace

double extent_of(const std::vector<LandmarkEstimate>& map) {
  if (map.empty()) return 1.0;
  Eigen::AlignedBox2d box;
  for (const LandmarkEstimate& landmark : map) box.extend(landmark.mean);
  return std::max(1.0, box.diagonal().norm());
}

visualization_msgs::MarkerArray landmark_markers(const MarkerFrame& frame,
                                                 const std::vector<LandmarkEstimate>& map,
                                                 double width) {
  Marker points = make_marker(frame, "landmarks", 0, Marker::SPHERE_LIST);
  points.scale.x = points.scale.y = points.scale.z = 3.5 * width;
  points.color = make_color(1.0F, 0.62F, 0.2F, 1.0F);
  Marker ellipses = make_marker(frame, "landmark_2_sigma", 0, Marker::LINE_LIST);
  ellipses.scale.x = width;
  ellipses.color = make_color(0.3F, 0.85F, 1.0F, 0.9F);
  for (const LandmarkEstimate& landmark : map) {
    points.points.push_back(make_point(landmark.mean.x(), landmark.mean.y(), 0.0));
    add_ellipse(landmark, &ellipses);
  }
  // rviz refuses a list without points; so the marker is taken away.
  if (map.empty()) points.action = ellipses.action = Marker::DELETE;
  visualization_msgs::MarkerArray array;
  array.markers = {points, ellipses};
  return array;
}

visualization_msgs::MarkerArray label_markers(const MarkerFrame& frame,
                                              const std::vector<LandmarkEstimate>& map,
                                              double height, std::set<std::int64_t>* labels) {
  visualization_msgs::MarkerArray array;
  std::set<std::int64_t> present;
  for (const LandmarkEstimate& landmark : map) {
    Marker label =
        make_marker(frame, "landmark_ids", static_cast<int>(landmark.id), Marker::TEXT_VIEW_FACING);
    label.pose.position =
        make_point(landmark.mean.x() + 0.7 * height, landmark.mean.y() + 0.7 * height, 0.0);
    label.scale.z = height;
    label.color = make_color(0.85F, 0.85F, 0.85F, 0.9F);
    label.text = std::to_string(landmark.id);
    array.markers.push_back(label);
    present.insert(landmark.id);
  }
  for (const std::int64_t id : *labels) {
    if (present.count(id) > 0) continue;
    Marker gone =
        make_marker(frame, "landmark_ids", static_cast<int>(id), Marker::TEXT_VIEW_FACING);
    gone.action = Marker::DELETE;
    array.markers.push_back(gone);
  }
  *labels = std::move(present);
  return array;
}

visualization_msgs::MarkerArray association_markers(const MarkerFrame& frame,
                                                    const ScanPicture& scan,
                                                    const std::vector<LandmarkEstimate>& map,
                                                    double width, double lifetime) {
  Marker seen = make_marker(frame, "seen_again", 0, Marker::LINE_LIST);
  seen.color = make_color(0.3F, 1.0F, 0.4F, 0.9F);
  Marker found = make_marker(frame, "seen_first", 0, Marker::LINE_LIST);
  found.color = make_color(0.35F, 0.55F, 1.0F, 1.0F);
  Marker refused = make_marker(frame, "not_believed", 0, Marker::LINE_LIST);
  refused.color = make_color(1.0F, 0.2F, 0.2F, 1.0F);
  const Pose2 eye = compose(scan.robot, scan.sensor);
  const Eigen::Vector2d from(eye.x, eye.y);
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    const RangeBearingObservation& z = scan.observations[k];
    const ObservationOutcome& outcome = scan.outcomes[k];
    const Eigen::Vector2d observed = place_seen(eye, z.range, z.bearing);
    const auto landmark = std::find_if(
        map.begin(), map.end(),
        [&](const LandmarkEstimate& candidate) { return candidate.id == outcome.landmark; });
    if (outcome.landmark < 0 || !outcome.is_believed()) {
      add_line(from, observed, &refused);
    } else if (outcome.is_new || landmark == map.end()) {
      add_line(from, observed, &found);
    } else {
      add_line(from, landmark->mean, &seen);
    }
  }
  visualization_msgs::MarkerArray array;
  for (Marker* lines : {&seen, &found, &refused}) {
    lines->scale.x = width;
    lines->lifetime = ros::Duration(lifetime);
    if (lines->points.empty()) lines->action = Marker::DELETE;
    array.markers.push_back(*lines);
  }
  return array;
}

}  // namespace pf_resampling
