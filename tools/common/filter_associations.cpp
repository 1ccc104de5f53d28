#include "tools/common/filter_associations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "tools/common/batch_slam.hpp"

namespace pf_resampling {
namespace {

struct Pair {
  double distance;
  std::size_t seen, landmark;
};

double usual_gate(const std::vector<PointLandmark>& map) {
  constexpr double kLeast = 0.5;  // m
  if (map.size() < 2) return kLeast;
  std::vector<double> distances;
  for (const PointLandmark& landmark : map) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const PointLandmark& other : map) {
      if (&other == &landmark) continue;
      nearest = std::min(nearest, (landmark.position - other.position).norm());
    }
    distances.push_back(nearest);
  }
  return std::max(kLeast, 0.5 * median(std::move(distances)));
}

// A path of few poses, at any time.
Pose2 robot_at(const std::vector<StampedPose>& path, const std::vector<StampedPose>& odometry,
               double time) {
  const auto after =
      std::upper_bound(path.begin(), path.end(), time,
                       [](double t, const StampedPose& pose) { return t < pose.time; });
  const StampedPose& before = after == path.begin() ? *after : *(after - 1);
  const Pose2 start = pose_at(odometry, before.time);
  const auto by_odometry = [&](double t) {
    return compose(before.pose, relative(start, pose_at(odometry, t)));
  };
  const Pose2 here = by_odometry(time);
  if (after == path.begin() || after == path.end()) return here;
  const double share = (time - before.time) / (after->time - before.time);
  const Pose2 missing = relative(by_odometry(after->time), after->pose);
  return compose(here, {share * missing.x, share * missing.y, share * missing.heading});
}

}  // namespace

std::vector<StampedScan> associated_by(const FilterResult& result, const Recording& recording) {
  check_path(result.path, "path");
  check_path(recording.odometry, "odometry");
  if (result.map.size() > kMostBatchLandmarks) {  // the gate looks at all pairs
    throw Error("a map of " + std::to_string(result.map.size()) +
                " landmarks: the batch solution takes " + std::to_string(kMostBatchLandmarks) +
                " at most; give a part of the recording (rosbag filter)");
  }
  const double gate = usual_gate(result.map);
  std::vector<StampedScan> scans = recording.scans;
  for (StampedScan& scan : scans) {
    const auto sensor = recording.frames.find(scan.frame);
    if (sensor == recording.frames.end()) continue;
    const Pose2 robot = robot_at(result.path, recording.odometry, scan.time);
    const Pose2 eye = compose(robot, to_pose2(sensor->second));
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < scan.landmarks.size(); ++i) {
      SeenLandmark& seen = scan.landmarks[i];
      const double direction = eye.heading + seen.bearing;
      const Eigen::Vector2d place(eye.x + seen.range * std::cos(direction),
                                  eye.y + seen.range * std::sin(direction));
      for (std::size_t j = 0; j < result.map.size(); ++j) {
        const double distance = (place - result.map[j].position).norm();
        if (distance <= gate) pairs.push_back({distance, i, j});
      }
      seen.id = -1;
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
    std::set<std::size_t> taken;  // landmarks
    for (const Pair& pair : pairs) {
      SeenLandmark& seen = scan.landmarks[pair.seen];
      if (seen.id < 0 && taken.insert(pair.landmark).second) seen.id = result.map[pair.landmark].id;
    }
  }
  return scans;
}

}  // namespace pf_resampling
