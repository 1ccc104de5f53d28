// Wheels that slipped, as RangeMemory tells: the newest ranges are not where the odometry leads.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {
namespace {

constexpr double kUnnoticed = 3.0;            // s that wheels slip until ranges show it
constexpr double kFewest = 3.0;               // ranges in that time
constexpr double kOff = 9.0;                  // most of a squared residual that counts
constexpr double kContradicted = 2.0;         // their mean
constexpr double kSlipMargin = 7.0;           // of the logarithm of the evidence
constexpr double kSlipMemory = 5.0;           // s
constexpr double kSpans[] = {2.0, 4.0, 8.0};  // s

}  // namespace

// Whether the newest ranges, of more radios than one, do not fit where the odometry leads.
bool RangeMemory::contradicts_odometry() const {
  // What ranges are worth, or where radios are that nobody listed, is not known yet.
  const bool is_known = beacons_.size() >= 2 || time_ > kRigid;
  if (modes_.empty() || !are_judged_ || !is_known) return false;
  const RangeMode& mode = modes_.front();
  std::vector<double> sums(radios_.size(), 0.0), counts(radios_.size(), 0.0);
  for (std::size_t k = graph_.ranges.size(); k-- > 0 && times_[k] > time_ - kUnnoticed;) {
    for (const HeldRange& range : graph_.ranges[k]) {
      const auto radio = static_cast<std::size_t>(range.radio);
      if (!mode.estimate.takes_part[radio]) continue;
      const double residual = residual_in(mode, k, range);
      sums[radio] += std::min(kOff, residual * residual);
      counts[radio] += 1.0;
    }
  }
  // The radio that fits worst may itself be wrong.
  const auto worst = std::max_element(sums.begin(), sums.end()) - sums.begin();
  sums[static_cast<std::size_t>(worst)] = counts[static_cast<std::size_t>(worst)] = 0.0;
  const double count = std::accumulate(counts.begin(), counts.end(), 0.0);
  return count >= kFewest && std::accumulate(sums.begin(), sums.end(), 0.0) > kContradicted * count;
}

// Wheels that are locked say that the robot stands while it slides as fast as ever.
Eigen::Matrix3d RangeMemory::slip_covariance_of(const OdometryIncrement& motion) const {
  double speed = 0.0;
  for (const OdometryIncrement& driven : graph_.motions) {
    const double length = std::hypot(driven.mean.x, driven.mean.y);
    if (driven.duration > 0.0) speed = std::max(speed, length / driven.duration);
  }
  return slip_covariance(speed, motion.duration);
}

bool RangeMemory::has_slipped() const {
  return has_slipped_since(time_ - kSlipMemory);
}

bool RangeMemory::has_slipped_since(double begin) const {
  for (std::size_t k = graph_.motions.size(); k-- > 0 && times_[k + 1] > begin;) {
    if (graph_.slipped[k]) return true;
  }
  return false;
}

// Whether anything changed. What the odometry itself says of slips is kept.
bool RangeMemory::distrust_newest(double span) {
  bool has_changed = false;
  const auto first = static_cast<std::size_t>(first_that_moves(modes_.front()));
  for (std::size_t k = first; k < graph_.motions.size(); ++k) {
    OdometryIncrement& motion = graph_.motions[k];
    if (times_[k + 1] <= time_ - span || graph_.slipped[k]) continue;
    graph_.slipped[k] = true;
    if (!motion.slip_covariance.isZero()) continue;
    motion.slip_covariance = slip_covariance_of(motion);
    has_changed = true;
  }
  return has_changed;
}

// Of those that the odometry itself says may have slipped: whether the ranges bear it out.
void RangeMemory::judge_suspected_motions() {
  std::vector<std::size_t> suspected;
  const auto first = static_cast<std::size_t>(first_that_moves(modes_.front()));
  for (std::size_t k = graph_.motions.size(); k-- > first && times_[k + 1] > time_ - kUnnoticed;) {
    if (!graph_.slipped[k] && !graph_.motions[k].slip_covariance.isZero()) suspected.push_back(k);
  }
  if (suspected.empty()) return;
  const std::vector<OdometryIncrement> motions = graph_.motions;
  for (const std::size_t k : suspected) graph_.motions[k].slip_covariance.setZero();
  RangeMode sound = modes_.front();
  solve_newest(&sound);
  graph_.motions = motions;
  if (log_probability(sound) + kSlipMargin > log_probability(modes_.front())) return;
  for (const std::size_t k : suspected) graph_.slipped[k] = true;
}

// Of the newest motions as many as explain the ranges best. Wheels that slipped just now may go on
// to, without a margin.
void RangeMemory::try_slip() {
  judge_suspected_motions();
  const bool goes_on = has_slipped_since(time_ - kSpans[0]);
  if (!goes_on && !contradicts_odometry()) return;
  const auto before = std::pair(graph_.motions, graph_.slipped);
  auto best = before;
  bool is_better = false;
  double most = log_probability(modes_.front()) + (goes_on ? 0.0 : kSlipMargin);
  for (const double span : kSpans) {
    std::tie(graph_.motions, graph_.slipped) = before;
    if (!distrust_newest(span)) continue;
    RangeMode mode = modes_.front();
    solve_newest(&mode);
    if (!mode.belief.is_usable || log_probability(mode) <= most) continue;
    most = log_probability(mode);
    best = {graph_.motions, graph_.slipped};
    is_better = true;
  }
  std::tie(graph_.motions, graph_.slipped) = std::move(best);
  if (!is_better) return;
  for (RangeMode& mode : modes_) solve_newest(&mode);
  weigh_modes();
}

// Those that are apart by less than the memory of the newest are one.
std::vector<RangeSlip> RangeMemory::slips() const {
  std::vector<RangeSlip> slips;
  if (modes_.empty()) return slips;
  const RangeEstimate& estimate = modes_.front().estimate;
  std::size_t driven_to = 0;  // keyframe
  Pose2 driven;               // there by the odometry, from where the slip began
  for (std::size_t k = 0; k < graph_.motions.size(); ++k) {
    if (!graph_.slipped[k]) continue;
    if (slips.empty() || times_[k] > slips.back().end + kSlipMemory) {
      slips.push_back({times_[k], 0.0, 0.0, pose_of(estimate.keyframes[k])});
      driven_to = k;
      driven = Pose2{};
    }
    for (; driven_to <= k; ++driven_to) {
      driven = compose(driven, corrected_motion(graph_.motions[driven_to],
                                                estimate.keyframes[driven_to], estimate.constants));
    }
    const Pose2 moved = relative(slips.back().pose, pose_of(estimate.keyframes[k + 1]));
    slips.back().end = times_[k + 1];
    slips.back().size = std::hypot(moved.x - driven.x, moved.y - driven.y);
  }
  return slips;
}

}  // namespace pf_resampling
