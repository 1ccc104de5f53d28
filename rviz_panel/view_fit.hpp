#pragma once

#include <nav_msgs/Path.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>

namespace pf_resampling {

/// Where what a filter shows is: its landmarks or beacons, its path and the robot. Range rings and
/// what was not believed do not count: they reach far out.
class Scene {
 public:
  void take(const nav_msgs::Path& path);
  void take(const visualization_msgs::MarkerArray& markers);

  /// The smallest box around all of it, in metres, in frame(); empty: nothing has come.
  Eigen::AlignedBox2d box() const;
  /// Frame of what came last.
  const std::string& frame() const { return frame_; }

 private:
  std::string frame_;
  Eigen::AlignedBox2d path_, landmarks_, robot_;
  std::map<int, Eigen::Vector2d> beacons_;
};

/// What a view from above shows.
struct TopView {
  double x = 0.0, y = 0.0;  ///< in its middle, m
  double scale = 1.0;       ///< pixels per metre
};

/// The view that a window of width × height pixels should have of a box that is not empty: the
/// present one as long as it shows the box well, or else one with room to grow. At least 5 m are
/// shown. `angle`: of the view, in radians.
TopView fitted_view(const Eigen::AlignedBox2d& box, double width, double height, double angle,
                    const std::optional<TopView>& present);

}  // namespace pf_resampling
