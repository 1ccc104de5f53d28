#include "tools/common/filter_associations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "tools/common/batch_slam.hpp"

namespace pf_resampling {
namespace {

Pose2 odometry_at(const std::vector<EstimatedPose>& odometry, double time) {
  const double inside = std::clamp(time, odometry.front().time, odometry.back().time);
  return interpolate(odometry, inside, std::numeric_limits<double>::infinity())->pose;
}

// A path of few poses, at any time.
Pose2 pose_at(const std::vector<EstimatedPose>& path, const std::vector<EstimatedPose>& odometry,
              double time) {
  const auto after =
      std::upper_bound(path.begin(), path.end(), time,
                       [](double t, const EstimatedPose& pose) { return t < pose.time; });
  const EstimatedPose& before = after == path.begin() ? *after : *(after - 1);
  const Pose2 start = odometry_at(odometry, before.time);
  const auto by_odometry = [&](double t) {
    return compose(before.pose, relative(start, odometry_at(odometry, t)));
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
  check_map(result.map, "map");
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
    const Pose2 robot = pose_at(result.path, recording.odometry, scan.time);
    const Pose2 eye = compose(robot, to_pose2(sensor->second));
    std::vector<PointLandmark> seen;
    for (SeenLandmark& landmark : scan.landmarks) {
      const double direction = eye.heading + landmark.bearing;
      seen.emplace_back().position = {eye.x + landmark.range * std::cos(direction),
                                      eye.y + landmark.range * std::sin(direction)};
      landmark.id = -1;
    }
    for (const LandmarkMatch& match : match_by_nearest(seen, result.map, gate)) {
      scan.landmarks[match.estimated].id = result.map[match.truth].id;
    }
  }
  return scans;
}

}  // namespace pf_resampling
