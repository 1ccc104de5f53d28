// Where the wheels slipped.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Squared error of three degrees of freedom that names a slip: a chance of 1e-8 without one.
constexpr double kSlip = 40.0;
constexpr double kSlipBegins = 0.05;
// How long wheels may have slipped before that shows, s, or before what has just been seen is
// forgotten, since it is elsewhere; and a margin.
constexpr double kUnnoticed = 4.0;
constexpr double kSurprise = 1.5;
constexpr double kMargin = 0.5;
// What is suspected at a time: segments whose odometry contradicts the rest by as much; and of its
// variance that is left then.
constexpr std::size_t kMostSuspected = 3;
constexpr double kSuspected = 16.0;
constexpr double kLeastContradicted = 0.05;
// Hypotheses are as good as the best if the logarithm of the evidence differs by less.
constexpr double kAsGood = 10.0;

// When, in s since segment `first` begins, the motion in [first, end) is off its odometry: between
// 5 and 95 % of the squares.
std::pair<double, double> slipping_time(const SegmentGraph& graph, std::size_t first,
                                        std::size_t end) {
  std::vector<double> sums = {0.0};
  std::vector<double> times = {0.0};
  for (std::size_t s = first; s < end; ++s) {
    Pose2 from;
    const std::vector<Pose2> poses = poses_of(graph, s);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const MotionFactor& motion = graph.segments[s]->motions[i];
      const MotionResidual residual = motion_residual(
          motion, motion_root(motion, graph.noise.motion), from, poses[i], graph.constants);
      sums.push_back(sums.back() + residual.value.squaredNorm());
      times.push_back(times.back() + motion.duration());
      from = poses[i];
    }
  }
  const auto begin = std::lower_bound(sums.begin() + 1, sums.end(), kSlipBegins * sums.back());
  const auto last = std::lower_bound(begin, sums.end(), (1.0 - kSlipBegins) * sums.back());
  return {times[static_cast<std::size_t>(begin - sums.begin()) - 1],
          times[static_cast<std::size_t>(last - sums.begin())]};
}

// Of the motion in segments [first, end), given all data.
Eigen::Matrix3d motion_covariance(const SegmentGraph& graph, const SegmentEquations& equations,
                                  std::size_t first, std::size_t end) {
  const Segment motion_alone;
  Eigen::MatrixXd ends = Eigen::MatrixXd::Zero(motion_alone.size(), 3);
  ends.topRows<3>().setIdentity();
  Eigen::MatrixXd unknowns = Eigen::MatrixXd::Zero(equations.size(), 3);
  Pose2 reached;
  for (std::size_t s = first; s < end; ++s) {
    const Pose2 step = relative(graph.bases[s], graph.bases[s + 1]);
    Eigen::MatrixXd of_step = Eigen::MatrixXd::Zero(equations.size(), 3);
    equations.from_segment(graph, s, motion_alone, ends, of_step);
    unknowns =
        unknowns * by_first(reached, step).transpose() + of_step * by_second(reached).transpose();
    reached = compose(reached, step);
  }
  return unknowns.transpose() * equations.solve(unknowns);
}

// By how much the squares of all data would fall without the odometry of segment `s`, to first
// order (Baarda's data snooping, 1968).
double gain_without_odometry(const SegmentGraph& graph, const SegmentEquations& equations,
                             std::size_t s) {
  const OdometryError error = odometry_error(graph, s, s + 1);
  const Eigen::LLT<Eigen::Matrix3d> root(error.covariance + error.slip_covariance);
  const Eigen::Matrix3d half = root.matrixL().solve(motion_covariance(graph, equations, s, s + 1));
  const Eigen::Matrix3d known = root.matrixL().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(known);
  const Eigen::Vector3d value =
      eigen.eigenvectors().transpose() * root.matrixL().solve(error.value);
  const Eigen::Array3d contradicted = (1.0 - eigen.eigenvalues().array()).max(kLeastContradicted);
  return (value.array().square() / contradicted).sum();
}

}  // namespace

// Where the map may have been bent in place of wheels that slipped, s since the start: before what
// is in doubt now, or was; where what had just been seen was elsewhere; and where odometry
// contradicts the rest most.
std::vector<Memory::Span> Memory::suspected_slips() const {
  const SegmentGraph& graph = state_.graph;
  std::set<int> surprising;  // updates
  for (const RememberedLandmark& landmark : state_.landmarks) {
    if (landmark.id < 0) surprising.insert(landmark.last_seen);
  }
  std::vector<Span> doubts;
  std::vector<Span> surprises;
  std::vector<std::pair<double, std::size_t>> gains;
  bool was_distrusted = false;
  int update = 0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    double time = state_.begins[s];
    for (const MotionFactor& motion : segment.motions) {
      const bool is_distrusted = !motion.slip_covariance.isZero();
      if (is_distrusted && !was_distrusted) doubts.push_back({time - kUnnoticed, time});
      was_distrusted = is_distrusted;
      time += motion.duration();
      if (surprising.count(++update) == 0) continue;
      const double begin = time - kSurprise;
      if (surprises.empty() || begin > surprises.back().end) surprises.push_back({begin, time});
      surprises.back().end = time;
    }
    if (!segment.has_data()) {
      update += static_cast<int>(segment.updates());
      continue;
    }
    const double gain = gain_without_odometry(graph, *equations_, s);
    if (gain > kSuspected) gains.push_back({gain, s});
  }
  std::vector<Span> spans = {{state_.time - kUnnoticed, state_.time}};
  for (const auto* found : {&doubts, &surprises}) {
    const std::size_t newest = std::min(found->size(), kMostSuspected);
    spans.insert(spans.end(), found->end() - static_cast<std::ptrdiff_t>(newest), found->end());
  }
  std::sort(gains.begin(), gains.end(), std::greater<>());
  gains.resize(std::min(gains.size(), kMostSuspected));
  for (const auto& [gain, s] : gains) {
    const int parts =
        std::max(1, static_cast<int>(std::ceil(graph.segments[s]->duration() / kUnnoticed)));
    const double part = graph.segments[s]->duration() / parts;
    for (int k = 0; k < parts; ++k) {
      const double begin = state_.begins[s] + k * part;
      spans.push_back({begin - kMargin, begin + part + kMargin});
    }
  }
  return spans;
}

// Wheels that are locked say that the robot stands while it slides as fast as ever.
Eigen::Matrix3d Memory::slip_covariance_of(const Pose2& motion, double duration) const {
  if (!(duration > 0.0)) return Eigen::Matrix3d::Zero();
  const double speed = std::hypot(motion.x, motion.y) / duration;
  return slip_covariance(std::max(speed, state_.speed), duration);
}

// Takes wheels to have slipped then. False if nothing changes, or cannot be condensed.
bool Memory::distrust(const Span& span) {
  SegmentGraph& graph = state_.graph;
  bool has_changed = false;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    double time = state_.begins[s];
    if (span.end <= time || time + graph.segments[s]->duration() <= span.begin) continue;
    Segment segment = at_estimate(graph, s);
    bool slips = false;
    for (MotionFactor& motion : segment.motions) {
      time += motion.duration();
      if (time <= span.begin || time > span.end || !motion.slip_covariance.isZero()) continue;
      motion.slip_covariance = slip_covariance_of(motion.mean, motion.duration());
      slips = true;
    }
    if (!slips) continue;
    segment.motion_share = 1.0;
    if (!condense(segment.robust_width, &segment)) return false;
    graph.segments[s] = std::make_shared<const Segment>(std::move(segment));
    graph.motion_shares[s] = 1.0;
    has_changed = true;
  }
  return has_changed;
}

// Wheels may have slipped where no doubt has shown it yet. What explains the drive best is kept,
// and with it all that is as good.
void Memory::look_for_slips(double robust_width, double* evidence) {
  if (equations_ == nullptr) return;
  const Memory believed = *this;
  std::vector<std::pair<double, Span>> tried;
  double least = *evidence;
  for (const Span& span : suspected_slips()) {
    Memory slipped = believed;
    if (!slipped.distrust(span)) continue;
    tried.push_back({slipped.solve_closed(robust_width).negative_log_evidence(), span});
    least = std::min(least, tried.back().first);
  }
  Memory slipped = believed;
  bool has_changed = false;
  for (const auto& [of_span, span] : tried) {
    if (of_span < least + kAsGood) has_changed |= slipped.distrust(span);
  }
  if (!has_changed || !slipped.solve_closed(robust_width).is_solved) return;
  *this = std::move(slipped);
  *evidence = least;
}

std::vector<Slip> Memory::slips() const {
  std::vector<Slip> slips;
  if (equations_ == nullptr) return slips;
  const SegmentGraph& graph = state_.graph;
  std::size_t end = 0;
  for (std::size_t first = 0; first < graph.segments.size(); first = end + 1) {
    end = first;
    while (end < graph.segments.size() && slip_square(graph, end) >= kSlip) ++end;
    if (end == first) continue;
    const OdometryError error = odometry_error(graph, first, end);
    // Where odometry is down-weighted, the solution itself may be loose.
    const double square = error.square(motion_covariance(graph, *equations_, first, end));
    if (square < kSlip) continue;
    const auto [since, until] = slipping_time(graph, first, end);
    slips.push_back({state_.begins[first] + since, state_.begins[first] + until, square,
                     error.value.head<2>().norm(), graph.bases[first]});
  }
  return slips;
}

}  // namespace pf_resampling
