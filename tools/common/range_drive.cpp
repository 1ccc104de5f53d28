#include "tools/common/range_drive.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr double kOutlyingRange = 4.0;  // standard deviations
constexpr double kLeastMotionNoise =
    1e-4;                              // m or rad per sqrt(s), where none is stated for an axis
constexpr double kSolvedEvery = 0.25;  // s
constexpr int kMostKeyframes = 4000;   // an hour at a metre per second
constexpr int kSolutionsAtTheEnd = 5;  // in which the noise settles

/// The odometry between times that do not go back.
class OdometrySteps {
 public:
  OdometrySteps(const Recording& drive, double begin) : drive_(drive) { start_at(begin); }

  void start_at(double time) {
    time_ = time;
    last_ = pose_at(drive_.odometry, time);
  }

  void append_up_to(double time, OdometryIncrement* increment) {
    if (!(time > time_)) return;
    const Pose2 pose = pose_at(drive_.odometry, time);
    append({}, relative(last_, pose), time - time_, increment);
    last_ = pose;
    time_ = time;
  }

  OdometryIncrement step_to(double time) {
    OdometryIncrement increment;
    append_up_to(time, &increment);
    if (drive_.odometry_noise) {
      increment.covariance =
          increment.duration *
          drive_.odometry_noise->cwiseMax(kLeastMotionNoise).cwiseAbs2().asDiagonal();
    }
    return increment;
  }

 private:
  const Recording& drive_;
  double time_ = 0.0;
  Pose2 last_;
};

Pose2 newest_pose(const RangeMemory& memory) {
  return pose_of(memory.newest(memory.modes().front()).mean.head<4>());
}

// From the keyframe before by odometry, and what is then missing to the keyframe after, in
// proportion to the time.
std::vector<StampedPose> path_of(const Recording& drive, const RangeSolution& solution) {
  const RangeMemory& memory = solution.memory;
  const RangeEstimate& estimate = memory.modes().front().estimate;
  const double begin = drive.odometry.front().time;
  const std::vector<double>& times = memory.keyframe_times();
  std::vector<StampedPose> path;
  std::size_t before = 0;
  OdometrySteps steps(drive, begin + times[0]);
  OdometryIncrement since;
  for (const StampedPose& known : solution.online.path) {
    const double time = known.time - begin;
    if (time < times.front()) {
      path.push_back(known);
      continue;
    }
    while (before + 1 < times.size() && times[before + 1] <= time) {
      ++before;
      steps.start_at(begin + times[before]);
      since = OdometryIncrement{};
    }
    steps.append_up_to(known.time, &since);
    const KeyframeState& from = estimate.keyframes[before];
    Pose2 missing;
    if (before + 1 < times.size()) {
      const Pose2 moved =
          corrected_motion(memory.graph().motions[before], from, estimate.constants);
      const Pose2 off =
          relative(compose(pose_of(from), moved), pose_of(estimate.keyframes[before + 1]));
      const double share = (time - times[before]) / (times[before + 1] - times[before]);
      missing = {share * off.x, share * off.y, share * off.heading};
    }
    const Pose2 pose = compose(pose_of(from), corrected_motion(since, from, estimate.constants));
    path.push_back({known.time, compose(pose, missing)});
  }
  return path;
}

void count_ranges(RangeSolution* solution) {
  const RangeMemory& memory = solution->memory;
  const RangeEstimate& estimate = memory.modes().front().estimate;
  for (std::size_t k = 0; k < memory.graph().ranges.size(); ++k) {
    for (const HeldRange& range : memory.graph().ranges[k]) {
      if (!estimate.takes_part[static_cast<std::size_t>(range.radio)]) continue;
      ++solution->ranges;
      const double value =
          residual_of(range, memory.noise(), estimate.keyframes[k], estimate.constants).value;
      if (std::abs(value) > kOutlyingRange) ++solution->outliers;
    }
  }
}

}  // namespace

RangeSolution solve_ranges(const Recording& drive) {
  if (drive.odometry.empty()) throw Error("there is no odometry: the batch solution needs it");
  RangeMemoryOptions options;
  options.most_keyframes = kMostKeyframes;
  RangeSolution solution;
  solution.memory = RangeMemory(options, drive.beacons);
  RangeMemory& memory = solution.memory;
  OdometrySteps steps(drive, drive.odometry.front().time);
  double next_solution = drive.odometry.front().time;
  auto heard = drive.ranges.begin();
  for (const StampedPose& stamp : drive.odometry) {
    for (; heard != drive.ranges.end() && heard->time <= stamp.time; ++heard) {
      memory.add(steps.step_to(heard->time), heard->ranges);
      if (heard->time < next_solution) continue;
      next_solution = heard->time + kSolvedEvery;
      memory.solve();
      if (!memory.modes().empty()) ++solution.online.solutions;
    }
    memory.add(steps.step_to(stamp.time), {});
    solution.online.path.push_back(
        {stamp.time, memory.modes().empty() ? stamp.pose : newest_pose(memory)});
  }
  for (int i = 0; i < kSolutionsAtTheEnd; ++i) memory.solve_all();
  if (memory.modes().empty()) {
    throw Error("the ranges do not say where the robot was: give those of three beacons or more");
  }
  solution.path = path_of(drive, solution);
  count_ranges(&solution);
  return solution;
}

}  // namespace pf_resampling
