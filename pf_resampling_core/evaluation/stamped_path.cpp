#include "pf_resampling_core/evaluation/stamped_path.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

bool is_finite(const TruePose& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) &&
         (!pose.heading || std::isfinite(*pose.heading));
}

bool is_finite(const EstimatedPose& pose) {
  return std::isfinite(pose.pose.x) && std::isfinite(pose.pose.y) &&
         std::isfinite(pose.pose.heading) && pose.covariance.allFinite();
}

template <typename Stamped>
void check(const std::vector<Stamped>& path, const char* name) {
  if (path.empty()) throw Error(std::string(name) + " is empty: it needs at least one pose");
  for (std::size_t i = 0; i < path.size(); ++i) {
    const std::string which = std::string(name) + ": pose " + std::to_string(i + 1) + " of " +
                              std::to_string(path.size());
    if (!std::isfinite(path[i].time) || !is_finite(path[i])) {
      throw Error(which + " is not finite (time " + std::to_string(path[i].time) + " s)");
    }
    if (i > 0 && path[i].time < path[i - 1].time) {
      throw Error(which + " goes back in time, from " + std::to_string(path[i - 1].time) + " to " +
                  std::to_string(path[i].time) + " s: sort the poses by their stamps");
    }
  }
}

template <typename Stamped>
double usual_gap(const std::vector<Stamped>& path) {
  constexpr double kLeast = 1.0;
  if (path.size() < 2) return kLeast;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < path.size(); ++i) {
    intervals.push_back(path[i].time - path[i - 1].time);
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return std::max(kLeast, 3.0 * *middle);
}

double between_angles(double from, double to, double share) {
  return wrap_angle(from + share * wrap_angle(to - from));
}

TruePose between(const TruePose& from, const TruePose& to, double share) {
  TruePose result;
  result.x = from.x + share * (to.x - from.x);
  result.y = from.y + share * (to.y - from.y);
  if (from.heading && to.heading) {
    result.heading = between_angles(*from.heading, *to.heading, share);
  }
  return result;
}

EstimatedPose between(const EstimatedPose& from, const EstimatedPose& to, double share) {
  EstimatedPose result;
  result.pose.x = from.pose.x + share * (to.pose.x - from.pose.x);
  result.pose.y = from.pose.y + share * (to.pose.y - from.pose.y);
  result.pose.heading = between_angles(from.pose.heading, to.pose.heading, share);
  result.covariance = from.covariance + share * (to.covariance - from.covariance);
  return result;
}

template <typename Stamped>
std::optional<Stamped> interpolate_path(const std::vector<Stamped>& path, double time,
                                        double max_gap) {
  const auto after =
      std::upper_bound(path.begin(), path.end(), time,
                       [](double value, const Stamped& pose) { return value < pose.time; });
  if (after == path.begin()) return std::nullopt;
  const auto before = after - 1;
  if (before->time == time) return *before;
  if (after == path.end() || after->time - before->time > max_gap) return std::nullopt;
  Stamped result = between(*before, *after, (time - before->time) / (after->time - before->time));
  result.time = time;
  return result;
}

/// Indices of poses that are each at least `length` from the one before: the path without standing.
std::vector<std::size_t> key_poses(const std::vector<TruePose>& path, double length) {
  std::vector<std::size_t> keys = {0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const TruePose& last = path[keys.back()];
    if (std::hypot(path[i].x - last.x, path[i].y - last.y) >= length) keys.push_back(i);
  }
  return keys;
}

/// Length of the chords that give a direction of travel.
double chord_length(const std::vector<TruePose>& path) {
  constexpr double kShareOfExtent = 0.02;
  return kShareOfExtent * extent_diagonal(path);
}

/// Direction of travel at every pose; empty if the path never moves.
std::vector<double> travel_directions(const std::vector<TruePose>& path) {
  const double length = chord_length(path);
  if (!(length > 0.0)) return {};
  const std::vector<std::size_t> keys = key_poses(path, length);
  if (keys.size() < 2) return {};

  // One direction per chord, valid at the chord's middle; between two middles along the arc, unless
  // the robot turned back between them.
  const std::size_t chords = keys.size() - 1;
  std::vector<double> directions(chords);
  std::vector<double> middles(chords);
  for (std::size_t c = 0; c < chords; ++c) {
    const TruePose& from = path[keys[c]];
    const TruePose& to = path[keys[c + 1]];
    directions[c] = std::atan2(to.y - from.y, to.x - from.x);
    middles[c] = 0.5 * (from.time + to.time);
  }
  std::vector<double> result(path.size());
  std::size_t chord = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    while (chord + 1 < chords && i >= keys[chord + 1]) ++chord;
    const double time = path[i].time;
    const bool is_late = time >= middles[chord];
    result[i] = directions[chord];
    if (is_late ? chord + 1 == chords : chord == 0) continue;
    const std::size_t first = is_late ? chord : chord - 1;
    const double duration = middles[first + 1] - middles[first];
    const double turn = wrap_angle(directions[first + 1] - directions[first]);
    if (duration > 0.0 && std::abs(turn) < 0.5 * kPi) {
      result[i] = wrap_angle(directions[first] + turn * (time - middles[first]) / duration);
    }
  }
  return result;
}

/// Rotation, rad, from the odometry's frame to the map's, about the start, over the first 10 % of
/// the true path.
double rotation_of_first_part(const std::vector<EstimatedPose>& odometry,
                              const std::vector<TruePose>& truth, std::size_t start,
                              const Pose2& odometry_start, double max_gap) {
  constexpr double kShareOfPath = 0.1;
  const std::vector<TruePose> rest(truth.begin() + static_cast<std::ptrdiff_t>(start), truth.end());
  const double length = chord_length(rest);
  if (!(length > 0.0)) return 0.0;
  const std::vector<std::size_t> keys = key_poses(rest, length);
  const auto chord = [&](std::size_t k) {
    return std::hypot(rest[keys[k]].x - rest[keys[k - 1]].x, rest[keys[k]].y - rest[keys[k - 1]].y);
  };
  double path_length = 0.0;
  for (std::size_t k = 1; k < keys.size(); ++k) path_length += chord(k);

  double dot = 0.0;
  double cross = 0.0;
  double travelled = 0.0;
  for (std::size_t k = 1; k < keys.size(); ++k) {
    travelled += chord(k);
    // At least two chords, whatever the length of the path.
    if (k > 2 && travelled > kShareOfPath * path_length) break;
    const TruePose& pose = rest[keys[k]];
    const std::optional<EstimatedPose> other = interpolate(odometry, pose.time, max_gap);
    if (!other) continue;
    const double x = pose.x - rest[0].x;
    const double y = pose.y - rest[0].y;
    const double other_x = other->pose.x - odometry_start.x;
    const double other_y = other->pose.y - odometry_start.y;
    dot += other_x * x + other_y * y;
    cross += other_x * y - other_y * x;
  }
  return dot == 0.0 && cross == 0.0 ? 0.0 : std::atan2(cross, dot);
}

}  // namespace

void check_path(const std::vector<TruePose>& path, const char* name) {
  check(path, name);
}
void check_path(const std::vector<EstimatedPose>& path, const char* name) {
  check(path, name);
}

std::vector<EstimatedPose> path_of_place(std::vector<EstimatedPose> path, const Pose2& place) {
  for (EstimatedPose& pose : path) {
    const Pose2 robot = pose.pose;
    pose.pose = compose(robot, place);
    Eigen::Matrix3d lever = Eigen::Matrix3d::Identity();
    lever(0, 2) = robot.y - pose.pose.y;
    lever(1, 2) = pose.pose.x - robot.x;
    pose.covariance = (lever * pose.covariance * lever.transpose()).eval();
  }
  return path;
}

double usual_max_gap(const std::vector<EstimatedPose>& path) {
  return usual_gap(path);
}
double usual_max_gap(const std::vector<TruePose>& path) {
  return usual_gap(path);
}

std::optional<EstimatedPose> interpolate(const std::vector<EstimatedPose>& path, double time,
                                         double max_gap) {
  return interpolate_path(path, time, max_gap);
}

std::optional<TruePose> interpolate(const std::vector<TruePose>& path, double time,
                                    double max_gap) {
  return interpolate_path(path, time, max_gap);
}

double extent_diagonal(const std::vector<TruePose>& path) {
  if (path.empty()) return 0.0;
  double min_x = path[0].x, max_x = path[0].x, min_y = path[0].y, max_y = path[0].y;
  for (const TruePose& pose : path) {
    min_x = std::min(min_x, pose.x);
    max_x = std::max(max_x, pose.x);
    min_y = std::min(min_y, pose.y);
    max_y = std::max(max_y, pose.y);
  }
  return std::hypot(max_x - min_x, max_y - min_y);
}

std::vector<std::optional<double>> track_directions(const std::vector<TruePose>& truth) {
  std::vector<std::optional<double>> result;
  result.reserve(truth.size());
  for (const TruePose& pose : truth) result.push_back(pose.heading);
  const auto is_unknown = [](const std::optional<double>& heading) { return !heading; };
  if (std::none_of(result.begin(), result.end(), is_unknown)) return result;
  const std::vector<double> travel = travel_directions(truth);
  for (std::size_t i = 0; i < travel.size(); ++i) {
    if (!result[i]) result[i] = travel[i];
  }
  return result;
}

std::vector<EstimatedPose> align_at_start(const std::vector<EstimatedPose>& odometry,
                                          const std::vector<TruePose>& truth) {
  check_path(odometry, "odometry");
  check_path(truth, "ground truth");
  const double max_gap = usual_max_gap(odometry);
  std::size_t start = 0;
  std::optional<EstimatedPose> odometry_start;
  for (; start < truth.size(); ++start) {
    odometry_start = interpolate(odometry, truth[start].time, max_gap);
    if (odometry_start) break;
  }
  if (!odometry_start) {
    throw Error("odometry (" + std::to_string(odometry.front().time) + " to " +
                std::to_string(odometry.back().time) + " s) covers no pose of the ground truth (" +
                std::to_string(truth.front().time) + " to " + std::to_string(truth.back().time) +
                " s): their clocks have to agree");
  }
  Pose2 in_map = {truth[start].x, truth[start].y, 0.0};
  if (truth[start].heading) {
    in_map.heading = *truth[start].heading;
  } else {
    in_map.heading = odometry_start->pose.heading +
                     rotation_of_first_part(odometry, truth, start, odometry_start->pose, max_gap);
  }
  std::vector<EstimatedPose> result = odometry;
  for (EstimatedPose& pose : result) {
    pose.pose = compose(in_map, relative(odometry_start->pose, pose.pose));
  }
  return result;
}

}  // namespace pf_resampling
