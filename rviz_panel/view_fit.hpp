#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <map>
#include <string>

namespace pf_resampling {

/// What landmarks, beacons, findings and the robot span, m.
class Scene {
 public:
  void take(const visualization_msgs::MarkerArray& markers);
  /// Empty before there is something.
  Eigen::AlignedBox2d box() const;

 private:
  std::map<std::string, Eigen::AlignedBox2d> parts_;  // by what they show; not all come each time
};

/// A view from above: what is in its middle, m, and pixels per metre.
struct TopView {
  double x = 0.0, y = 0.0, scale = 1.0;
};

/// A view of the whole scene in a window of these pixels: the present one while it is good enough.
TopView fitted_view(const Eigen::AlignedBox2d& scene, const Eigen::Vector2d& window,
                    const TopView& present);

}  // namespace pf_resampling
