#include "pf_resampling_core/smoothing/smoother.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr int kMostSteps = 200;
// The least by which a step is to lower the cost: the solution is where none does. Small against 1,
// which is what chance makes of the cost.
constexpr double kTolerance = 1e-4;
constexpr double kLeastDamping = 1e-6;
constexpr double kLargestDamping = 1e8;
// Nothing else holds a landmark whose sightings were all taken away.
constexpr double kLandmarkInformation = 1e-9;  // 1/m^2

/// All residuals of a graph, in standard deviations and by their weights, and their derivatives.
class LinearGraph {
 public:
  LinearGraph(const SmoothingGraph& graph, double robust_width)
      : landmarks_at_(3 * static_cast<Eigen::Index>(graph.poses.size())),
        constants_at_(landmarks_at_ + 2 * static_cast<Eigen::Index>(graph.landmarks.size())) {
    for (std::size_t i = 0; i < graph.motions.size(); ++i) {
      const MotionFactor& motion = graph.motions[i];
      const MotionResidual r = motion_residual(motion, motion_root(motion, graph.noise.motion),
                                               graph.poses[i], graph.poses[i + 1], graph.constants);
      const Eigen::Index from = 3 * static_cast<Eigen::Index>(i);
      add(r.value, {{from, r.by_from}, {from + 3, r.by_to}, {constants_at_, r.by_constants}});
      cost_ += 0.5 * r.value.squaredNorm();
    }
    for (const SightingFactor& sighting : graph.sightings) {
      const SightingResidual r = sighting_residual(
          sighting, graph.noise, graph.poses[static_cast<std::size_t>(sighting.pose)],
          graph.landmarks[static_cast<std::size_t>(sighting.landmark)], graph.constants);
      const double squared = r.value.squaredNorm();
      const double root = std::sqrt(robust_weight(squared, robust_width));
      add(root * r.value, {{3 * sighting.pose, root * r.by_pose},
                           {landmarks_at_ + 2 * sighting.landmark, root * r.by_landmark},
                           {constants_at_ + SensorConstant::range_scale, root * r.by_constants}});
      cost_ += robust_cost(squared, robust_width);
    }
    const Eigen::Matrix2d loose = std::sqrt(kLandmarkInformation) * Eigen::Matrix2d::Identity();
    for (Eigen::Index l = landmarks_at_; l < constants_at_; l += 2) {
      add(Eigen::Vector2d::Zero(), {{l, loose}});
    }
    const Pose2& known = graph.prior.pose;
    const Pose2& first = graph.poses.front();
    Eigen::VectorXd difference(GaussianPrior::kSize);
    difference << first.x - known.x, first.y - known.y, wrap_angle(first.heading - known.heading),
        graph.constants;
    const Eigen::LLT<Eigen::MatrixXd> prior(graph.prior.information);
    is_finite_ = prior.info() == Eigen::Success;
    const Eigen::MatrixXd root = prior.matrixU();
    const Eigen::VectorXd value = root * difference;
    add(value, {{0, root.leftCols<3>()}, {constants_at_, root.rightCols<kSensorConstants>()}});
    cost_ += 0.5 * value.squaredNorm();

    const Eigen::Index unknowns = constants_at_ + kSensorConstants;
    Eigen::SparseMatrix<double> jacobian(static_cast<Eigen::Index>(residuals_.size()), unknowns);
    jacobian.setFromTriplets(derivatives_.begin(), derivatives_.end());
    information_ = jacobian.transpose() * jacobian;
    gradient_ = jacobian.transpose() *
                Eigen::Map<const Eigen::VectorXd>(residuals_.data(), jacobian.rows());
    is_finite_ = is_finite_ && std::isfinite(cost_) && gradient_.allFinite();
  }

  bool is_finite() const { return is_finite_; }
  double cost() const { return cost_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  const Eigen::SparseMatrix<double>& information() const { return information_; }

  SmoothingGraph moved(SmoothingGraph graph, const Eigen::VectorXd& step) const {
    Eigen::Index at = 0;
    for (Pose2& pose : graph.poses) {
      pose = {pose.x + step[at], pose.y + step[at + 1], wrap_angle(pose.heading + step[at + 2])};
      at += 3;
    }
    for (Eigen::Vector2d& landmark : graph.landmarks) {
      landmark += step.segment<2>(at);
      at += 2;
    }
    graph.constants += step.segment<kSensorConstants>(at);
    return graph;
  }

 private:
  // By the unknowns from `first` on.
  struct Derivative {
    Eigen::Index first;
    Eigen::MatrixXd matrix;
  };

  void add(const Eigen::VectorXd& value, const std::vector<Derivative>& derivatives) {
    const auto row = static_cast<Eigen::Index>(residuals_.size());
    residuals_.insert(residuals_.end(), value.data(), value.data() + value.size());
    for (const auto& [first, matrix] : derivatives) {
      for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
        for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
          derivatives_.emplace_back(row + i, first + j, matrix(i, j));
        }
      }
    }
  }

  Eigen::Index landmarks_at_, constants_at_;
  std::vector<double> residuals_;
  std::vector<Eigen::Triplet<double, Eigen::Index>> derivatives_;
  double cost_ = 0.0;
  bool is_finite_ = false;
  Eigen::VectorXd gradient_;
  Eigen::SparseMatrix<double> information_;
};

}  // namespace

std::optional<double> smooth(double robust_width, SmoothingGraph* graph) {
  SmoothingGraph best = *graph;
  LinearGraph linear(best, robust_width);
  if (!linear.is_finite()) return std::nullopt;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> root;
  root.analyzePattern(linear.information());
  double damping = 0.0;  // none as long as the steps are good
  for (int step = 0; step < kMostSteps && damping <= kLargestDamping; ++step) {
    Eigen::SparseMatrix<double> damped = linear.information();
    damped.diagonal() *= 1.0 + damping;
    root.factorize(damped);
    bool is_better = false;
    if (root.info() == Eigen::Success && (root.vectorD().array() > 0.0).all()) {
      const Eigen::VectorXd move = -root.solve(linear.gradient());
      const double promise = -0.5 * move.dot(linear.gradient());
      for (double share = 1.0; share > 0.1 && !is_better; share *= 0.5) {
        SmoothingGraph moved = linear.moved(best, share * move);
        LinearGraph there(moved, robust_width);
        is_better = there.is_finite() && there.cost() < linear.cost();
        if (!is_better) continue;
        best = std::move(moved);
        linear = std::move(there);
      }
      if (promise < kTolerance) {
        if (!are_plausible(best.constants)) return std::nullopt;
        *graph = std::move(best);
        return linear.cost();
      }
    }
    damping = is_better ? 0.1 * damping : std::max(kLeastDamping, 10.0 * damping);
    if (damping < kLeastDamping) damping = 0.0;
  }
  return std::nullopt;
}

Eigen::SparseMatrix<double> information_of(const SmoothingGraph& graph, double robust_width) {
  return LinearGraph(graph, robust_width).information();
}

}  // namespace pf_resampling
