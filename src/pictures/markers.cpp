#include "src/pictures/markers.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

constexpr int kEllipseSegments = 72;

// Lines of a text, so short that they stand beside the place in the picture.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kLine = 20;  // characters, if words are no longer
  std::istringstream words(text);
  std::string lines, line, word;
  while (words >> word) {
    if (!line.empty() && line.size() + 1 + word.size() > kLine) {
      lines += line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return lines + line;
}

}  // namespace

visualization_msgs::Marker make_marker(const MarkerFrame& frame, const std::string& name, int id,
                                       int type) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame.frame;
  marker.header.stamp = frame.stamp;
  marker.ns = name;
  marker.id = id;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  return marker;
}

geometry_msgs::Point make_point(double x, double y, double z) {
  geometry_msgs::Point point;
  point.x = x;
  point.y = y;
  point.z = z;
  return point;
}

std_msgs::ColorRGBA make_color(float red, float green, float blue, float alpha) {
  std_msgs::ColorRGBA color;
  color.r = red;
  color.g = green;
  color.b = blue;
  color.a = alpha;
  return color;
}

void append(const visualization_msgs::MarkerArray& more, visualization_msgs::MarkerArray* array) {
  array->markers.insert(array->markers.end(), more.markers.begin(), more.markers.end());
}

std::vector<geometry_msgs::Point> ellipse_points(const Eigen::Vector2d& mean,
                                                 const Eigen::Matrix2d& covariance, int segments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const Eigen::Vector2d radii = 2.0 * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  std::vector<geometry_msgs::Point> points;
  for (int k = 0; k <= segments; ++k) {
    const double angle = 2.0 * kPi * (k % segments) / segments;
    const Eigen::Vector2d offset =
        solver.eigenvectors() *
        Eigen::Vector2d(radii[0] * std::cos(angle), radii[1] * std::sin(angle));
    points.push_back(make_point(mean.x() + offset.x(), mean.y() + offset.y(), 0.0));
  }
  return points;
}

visualization_msgs::Marker ellipse_marker(const MarkerFrame& frame, const std::string& name, int id,
                                          const PoseEstimate& estimate, double width) {
  visualization_msgs::Marker ellipse =
      make_marker(frame, name, id, visualization_msgs::Marker::LINE_STRIP);
  ellipse.scale.x = width;
  ellipse.points = ellipse_points({estimate.mean.x, estimate.mean.y},
                                  estimate.covariance.topLeftCorner<2, 2>(), kEllipseSegments);
  return ellipse;
}

visualization_msgs::MarkerArray pose_ellipse_markers(const MarkerFrame& frame,
                                                     const PoseEstimate& estimate, double width) {
  visualization_msgs::Marker ellipse = ellipse_marker(frame, "pose_2_sigma", 0, estimate, width);
  ellipse.color = make_color(1.0F, 0.85F, 0.0F);
  visualization_msgs::Marker arrow =
      make_marker(frame, "pose_heading", 0, visualization_msgs::Marker::ARROW);
  arrow.pose = to_pose_message(estimate.mean);
  arrow.scale.x = 12.0 * width;
  arrow.scale.y = 3.0 * width;
  arrow.scale.z = 3.0 * width;
  arrow.color = ellipse.color;

  visualization_msgs::MarkerArray array;
  array.markers = {ellipse, arrow};
  return array;
}

visualization_msgs::MarkerArray hypothesis_markers(const MarkerFrame& frame,
                                                   const PoseClusters& clusters, double width,
                                                   double height, std::size_t* shown) {
  visualization_msgs::MarkerArray array;
  // One place is where the ellipse of the pose is.
  const std::size_t count = clusters.clusters.size() > 1 ? clusters.clusters.size() : 0;
  for (std::size_t i = 0; i < std::max(count, *shown); ++i) {
    const int id = static_cast<int>(i);
    visualization_msgs::Marker ellipse =
        make_marker(frame, "hypotheses", id, visualization_msgs::Marker::LINE_STRIP);
    visualization_msgs::Marker label =
        make_marker(frame, "hypothesis_weights", id, visualization_msgs::Marker::TEXT_VIEW_FACING);
    if (i < count) {
      const PoseCluster& cluster = clusters.clusters[i];
      ellipse = ellipse_marker(frame, "hypotheses", id, cluster.pose, width);
      ellipse.color = label.color = make_color(1.0F, 0.4F, 0.0F);
      label.scale.z = height;
      label.pose.position = make_point(cluster.pose.mean.x, cluster.pose.mean.y, height);
      label.text = std::to_string(std::lround(100.0 * cluster.weight)) + " %";
    } else {
      ellipse.action = label.action = visualization_msgs::Marker::DELETE;
    }
    array.markers.push_back(ellipse);
    array.markers.push_back(label);
  }
  *shown = count;
  return array;
}

visualization_msgs::MarkerArray finding_markers(const MarkerFrame& frame,
                                                const std::vector<FindingStatus>& findings,
                                                double height, double lifetime) {
  visualization_msgs::MarkerArray array;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    visualization_msgs::Marker text = make_marker(frame, "findings", static_cast<int>(i),
                                                  visualization_msgs::Marker::TEXT_VIEW_FACING);
    text.pose.position = findings[i].place;
    text.pose.position.z = height;  // above all other letters
    text.scale.z = height;
    text.color = make_color(1.0F, 0.2F, 0.2F);
    text.lifetime = ros::Duration(lifetime);
    text.text = wrapped(findings[i].text);
    array.markers.push_back(text);
  }
  return array;
}

}  // namespace pf_resampling
