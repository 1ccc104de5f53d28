#pragma once

#include <Eigen/Core>
#include <cmath>

namespace pf_resampling {

inline constexpr double kPi = 3.14159265358979323846;

/// Angle in radians, brought to [-pi, pi].
inline double wrap_angle(double angle) {
  return std::abs(angle) <= kPi ? angle : std::remainder(angle, 2.0 * kPi);
}

/// A planar pose: position in metres, heading in radians (REP 103: x forward, y left, heading
/// counter-clockwise from x).
struct Pose2 {
  double x = 0.0;
  double y = 0.0;
  double heading = 0.0;
};

/// `first` followed by `second`, the latter given in the frame of the former.
inline Pose2 compose(const Pose2& first, const Pose2& second) {
  const double cosine = std::cos(first.heading);
  const double sine = std::sin(first.heading);
  return {first.x + cosine * second.x - sine * second.y,
          first.y + sine * second.x + cosine * second.y,
          wrap_angle(first.heading + second.heading)};
}

/// The pose `to` seen from the frame `from`: compose(from, relative(from, to)) is `to`.
inline Pose2 relative(const Pose2& from, const Pose2& to) {
  const double cosine = std::cos(from.heading);
  const double sine = std::sin(from.heading);
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  return {cosine * dx + sine * dy, -sine * dx + cosine * dy, wrap_angle(to.heading - from.heading)};
}

/// The derivative of compose(first, second) by the second.
inline Eigen::Matrix3d by_second(const Pose2& first) {
  const double cosine = std::cos(first.heading);
  const double sine = std::sin(first.heading);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  return turn;
}

/// The derivative of compose(first, second) by the first: the second swings about its start.
inline Eigen::Matrix3d by_first(const Pose2& first, const Pose2& second) {
  const double cosine = std::cos(first.heading);
  const double sine = std::sin(first.heading);
  Eigen::Matrix3d swing = Eigen::Matrix3d::Identity();
  swing(0, 2) = -(sine * second.x + cosine * second.y);
  swing(1, 2) = cosine * second.x - sine * second.y;
  return swing;
}

/// A point turned and shifted.
inline Eigen::Vector2d moved(const Eigen::Vector2d& point, const Pose2& by) {
  const Pose2 pose = compose(by, {point.x(), point.y(), 0.0});
  return {pose.x, pose.y};
}

/// A point in the frame `from`: moved(seen_from(from, point), from) is `point`.
inline Eigen::Vector2d seen_from(const Pose2& from, const Eigen::Vector2d& point) {
  const Pose2 pose = relative(from, {point.x(), point.y(), 0.0});
  return {pose.x, pose.y};
}

/// Where that is which `eye` sees at this range and bearing.
inline Eigen::Vector2d place_seen(const Pose2& eye, double range, double bearing) {
  const double direction = eye.heading + bearing;
  return {eye.x + range * std::cos(direction), eye.y + range * std::sin(direction)};
}

/// m: no position is beyond, in x or y.
inline constexpr double kFarthestPosition = 1e9;

}  // namespace pf_resampling
