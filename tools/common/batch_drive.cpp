#include "tools/common/batch_drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "tools/common/progress_bar.hpp"
#include "tools/common/text.hpp"

namespace pf_resampling {
namespace {

// s: between two poses of the graph the odometry turns by so little that its scales act on the
// chord.
constexpr double kLongestStep = 0.5;
// The loss, in standard deviations, narrowed from solution to solution: at first every observation
// pulls, so that loops close from afar; at last misread ones hardly do.
constexpr std::array<double, 3> kLossWidths = {30.0, 10.0, 4.0};
constexpr int kIterations = 100;
// Their equations take 2.4 GB. An hour's drive has 7,200, or as many as it has observations.
constexpr int kMostPoses = 100000;

SmoothingResult smooth_with(double robust_width, SmoothingGraph* graph) {
  SmoothingOptions options;
  options.iterations = kIterations;
  options.robust_width = robust_width;
  return smooth(options, graph);
}

// Of drive_to(). Not an integer: a clock may be set by more seconds than one holds.
double steps_between(double from, double to) {
  return std::ceil((to - from) / kLongestStep);
}

}  // namespace

void check_size(const std::vector<StampedPose>& odometry, const std::vector<double>& times) {
  double last = odometry.front().time;
  double poses = 1.0;
  for (const double time : times) {
    poses += steps_between(last, time);
    last = time;
  }
  poses += steps_between(last, odometry.back().time);
  if (poses <= kMostPoses) return;
  double gap = 0.0;
  double begin = odometry.front().time;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    const double duration = odometry[i].time - odometry[i - 1].time;
    if (duration > gap) begin = odometry[i - 1].time;
    gap = std::max(gap, duration);
  }
  const std::string most = std::to_string(kMostPoses) + " at most";
  if (2.0 * steps_between(0.0, gap) > poses) {
    throw Error("the odometry has a gap of " + fixed(gap, 0) + " s after " + fixed(begin, 3) +
                " s: the batch solution would need " + fixed(poses, 0) + " poses and takes " +
                most + "; if the clock was set, cut the recording there (rosbag filter)");
  }
  throw Error("the batch solution would need " + fixed(poses, 0) + " poses and takes " + most +
              ": give a part of the recording (rosbag filter)");
}

BatchDrive::BatchDrive(const std::vector<StampedPose>& odometry, OdometryBetween motion_between,
                       GaussianPrior prior, double robust_width)
    : motion_between_(std::move(motion_between)), robust_width_(robust_width) {
  check_path(odometry, "odometry");
  if (!(odometry.back().time > odometry.front().time)) {
    throw Error("the odometry has no duration: it needs two stamps");
  }
  graph.prior = std::move(prior);
  graph.poses = {graph.prior.pose};
  times = {odometry.front().time};
}

void BatchDrive::drive_to(double time) {
  const double last = times.back();
  const int steps = static_cast<int>(steps_between(last, time));
  for (int step = 1; step <= steps; ++step) {
    const double next = step == steps ? time : last + (time - last) * step / steps;
    graph.motions.push_back(motion_between_(times.back(), next));
    graph.poses.push_back(
        compose(graph.poses.back(), corrected_motion(graph.motions.back(), graph.constants)));
    times.push_back(next);
  }
}

StampedPose BatchDrive::newest_at(double time) const {
  const MotionFactor motion = motion_between_(times.back(), time);
  return {time, compose(graph.poses.back(), corrected_motion(motion, graph.constants))};
}

std::vector<StampedPose> BatchDrive::path_at(const std::vector<StampedPose>& stamps) const {
  std::vector<StampedPose> path;
  std::size_t before = 0;
  for (const StampedPose& stamp : stamps) {
    while (before + 2 < times.size() && times[before + 1] <= stamp.time) ++before;
    const auto by_odometry = [&](double time) {
      return compose(graph.poses[before],
                     corrected_motion(motion_between_(times[before], time), graph.constants));
    };
    const double share = (stamp.time - times[before]) / (times[before + 1] - times[before]);
    const Pose2 missing = relative(by_odometry(times[before + 1]), graph.poses[before + 1]);
    path.push_back(
        {stamp.time, compose(by_odometry(stamp.time),
                             {share * missing.x, share * missing.y, share * missing.heading})});
  }
  return path;
}

SmoothingResult BatchDrive::solve() {
  return smooth_with(robust_width_, &graph);
}

SmoothingResult BatchDrive::solve_both_ways() {
  SmoothingGraph narrowed = graph;
  SmoothingResult direct = solve();
  for (const double width : kLossWidths) smooth_with(width, &narrowed);
  SmoothingResult other = smooth_with(robust_width_, &narrowed);
  if (other.fault != SmoothingFault::none) return direct;
  if (direct.fault == SmoothingFault::none && direct.cost <= other.cost) return direct;
  graph = std::move(narrowed);
  return other;
}

OnlineSolution solve_along(const std::vector<StampedPose>& odometry,
                           const std::vector<double>& times,
                           const std::function<void(std::size_t)>& observe,
                           const std::function<bool()>& is_surprising, BatchDrive* drive) {
  OnlineSolution solution;
  auto stamp = odometry.begin();
  // Poses by odometry from the newest on, up to a time.
  const auto go_on = [&](const auto& is_before) {
    for (; stamp != odometry.end() && is_before(stamp->time); ++stamp) {
      if (stamp->time - drive->times.back() > kLongestStep) drive->drive_to(stamp->time);
      solution.path.push_back(drive->newest_at(stamp->time));
    }
  };
  ProgressBar bar("solving", times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    bar.update(i);
    go_on([&](double time) { return time < times[i]; });
    drive->drive_to(times[i]);
    observe(i);
    SmoothingResult result = drive->solve();
    // A loop that closes from afar looks like a misread id at first.
    if (result.fault != SmoothingFault::none || is_surprising()) {
      result = drive->solve_both_ways();
    }
    ++solution.solutions;
    if (result.fault != SmoothingFault::none) ++solution.refused;
  }
  go_on([](double) { return true; });
  return solution;
}

}  // namespace pf_resampling
