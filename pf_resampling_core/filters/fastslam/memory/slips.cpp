// Where the wheels slipped.
#include <algorithm>
#include <utility>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

// Squared error of three degrees of freedom that names a slip: a chance of 1e-8 without one.
constexpr double kSlip = 40.0;
constexpr double kSlipBegins = 0.05;

// When, in s since segment `s` begins, it is off its odometry: between 5 and 95 % of the squares.
std::pair<double, double> slipping_time(const SegmentGraph& graph, std::size_t s) {
  const Segment& segment = *graph.segments[s];
  const std::vector<Pose2> poses = poses_of(graph, s);
  std::vector<double> sums = {0.0};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const MotionFactor& motion = segment.motions[i];
    const MotionResidual residual =
        motion_residual(motion, motion_root(motion, graph.noise.motion),
                        i == 0 ? Pose2{} : poses[i - 1], poses[i], graph.constants);
    sums.push_back(sums.back() + residual.value.squaredNorm());
  }
  std::pair<double, double> time = {0.0, 0.0};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double duration = segment.motions[i].duration();
    if (sums[i + 1] < kSlipBegins * sums.back()) time.first += duration;
    if (sums[i] < (1.0 - kSlipBegins) * sums.back()) time.second += duration;
  }
  return time;
}

// Of the motion in segment `s`, given all data.
Eigen::Matrix3d motion_covariance(const SegmentGraph& graph, const SegmentEquations& equations,
                                  std::size_t s) {
  const Segment motion_alone;
  Eigen::MatrixXd ends = Eigen::MatrixXd::Zero(motion_alone.size(), 3);
  ends.topRows<3>().setIdentity();
  Eigen::MatrixXd unknowns = Eigen::MatrixXd::Zero(equations.size(), 3);
  equations.from_segment(graph, s, motion_alone, ends, unknowns);
  return unknowns.transpose() * equations.solve(unknowns);
}

}  // namespace

std::vector<Slip> Memory::slips() const {
  std::vector<Slip> slips;
  if (equations_ == nullptr) return slips;
  for (std::size_t s = 0; s < state_.graph.segments.size(); ++s) {
    if (slip_square(state_.graph, s) < kSlip) continue;
    // Where odometry is down-weighted, the solution itself may be loose.
    double distance = 0.0;
    const double square =
        slip_square(state_.graph, s, motion_covariance(state_.graph, *equations_, s), &distance);
    if (square < kSlip) continue;
    const auto [first, last] = slipping_time(state_.graph, s);
    const double begin = state_.begins[s] + first;
    const double end = state_.begins[s] + last;
    if (!slips.empty() && begin - slips.back().end < 1.0) {
      slips.back().end = end;
      slips.back().square = std::max(square, slips.back().square);
      slips.back().distance = std::max(distance, slips.back().distance);
    } else {
      slips.push_back({begin, end, square, distance, state_.graph.bases[s]});
    }
  }
  return slips;
}

}  // namespace pf_resampling
