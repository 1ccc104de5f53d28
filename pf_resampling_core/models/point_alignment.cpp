#include "pf_resampling_core/models/point_alignment.hpp"

#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using Points = std::vector<Eigen::Vector2d>;

Eigen::Vector2d mean_of(const Points& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

}  // namespace

Pose2 align_points(const Points& from, const Points& to) {
  if (from.empty() || from.size() != to.size()) {
    throw Error("alignment of " + std::to_string(from.size()) + " points to " +
                std::to_string(to.size()) + ": it needs as many of both, and at least one");
  }
  const Eigen::Vector2d from_mean = mean_of(from);
  const Eigen::Vector2d to_mean = mean_of(to);
  // The turn maximises the sum of products of what is turned and its partner.
  double dot = 0.0;
  double cross = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector2d a = from[i] - from_mean;
    const Eigen::Vector2d b = to[i] - to_mean;
    dot += a.dot(b);
    cross += a.x() * b.y() - a.y() * b.x();
  }
  const double heading = dot == 0.0 && cross == 0.0 ? 0.0 : std::atan2(cross, dot);
  const Eigen::Vector2d shift = to_mean - moved(from_mean, {0.0, 0.0, heading});
  return {shift.x(), shift.y(), heading};
}

}  // namespace pf_resampling
