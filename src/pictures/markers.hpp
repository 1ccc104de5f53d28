#pragma once

#include <pf_resampling/FindingStatus.h>
#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "pf_resampling_core/population/pose_clusters.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"

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
std_msgs::ColorRGBA make_color(float red, float green, float blue, float alpha = 1.0F);

/// Adds the markers of another array.
void append(const visualization_msgs::MarkerArray& more, visualization_msgs::MarkerArray* array);

/// The points of the ellipse that holds a position with about 86 % (2 sigma) under a Gaussian: one
/// more than `segments`, the last is the first.
std::vector<geometry_msgs::Point> ellipse_points(const Eigen::Vector2d& mean,
                                                 const Eigen::Matrix2d& covariance, int segments);

/// That ellipse of a pose as a line; without color.
visualization_msgs::Marker ellipse_marker(const MarkerFrame& frame, const std::string& name, int id,
                                          const PoseEstimate& estimate, double width);

/// Likewise, and an arrow for the heading; `width`: of the line, m.
visualization_msgs::MarkerArray pose_ellipse_markers(const MarkerFrame& frame,
                                                     const PoseEstimate& estimate, double width);

/// The places that fit, if there are several: an ellipse of 2 sigma for each, as thick as `width`,
/// with its share of the weight, `height` m tall. `*shown`: how many there were, so that those
/// which are no more are taken away.
visualization_msgs::MarkerArray hypothesis_markers(const MarkerFrame& frame,
                                                   const PoseClusters& clusters, double width,
                                                   double height, std::size_t* shown);

/// What was found, in red where it is: letters of `height`, m. `lifetime`: s.
visualization_msgs::MarkerArray finding_markers(const MarkerFrame& frame,
                                                const std::vector<FindingStatus>& findings,
                                                double height, double lifetime);

}  // namespace pf_resampling
