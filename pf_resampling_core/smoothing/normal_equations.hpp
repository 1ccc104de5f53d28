#pragma once

#include <Eigen/Core>
#include <vector>

#include "pf_resampling_core/smoothing/multifrontal_cholesky.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// Gauss and Newton's equations H·step = -gradient of a graph.
class NormalEquations {
 public:
  /// Lays out the graph's structure, which must not change any more.
  explicit NormalEquations(const SmoothingGraph& graph);

  /// H and gradient at the graph's estimate. `robust_width`: of sightings, see
  /// robust_cost().
  void linearize(const SmoothingGraph& graph, double robust_width);

  /// Factorises H + damping·diag(H). False if that is not positive definite.
  bool factorize(double damping) { return root_.factorize(damping); }

  /// Natural logarithm of the determinant of what was factorised.
  double log_determinant() const { return root_.log_determinant(); }

  /// What was factorised: a block for each pose, then for each landmark, then the constants.
  const MultifrontalCholesky& root() const { return root_; }
  /// -(what was factorised)⁻¹·gradient.
  Eigen::VectorXd step() const { return -root_.solve(gradient_); }
  const Eigen::VectorXd& gradient() const { return gradient_; }

  /// The graph's estimate, moved by a step.
  void move(const Eigen::VectorXd& step, SmoothingGraph* graph) const;

  /// Half the sum of squares, robust, at the graph's estimate.
  double cost(const SmoothingGraph& graph, double robust_width) const;

  /// First of a pose's, a landmark's and the constants' unknowns.
  int pose_at(int pose) const { return root_.at(pose); }
  int landmark_at(int landmark) const { return root_.at(poses_ + landmark); }
  int constants_at() const { return root_.at(poses_ + landmarks_); }
  /// Number of unknowns.
  Eigen::Index size() const { return gradient_.size(); }

 private:
  void add(const std::vector<int>& blocks, const Eigen::VectorXd& gradient,
           Eigen::MatrixXd hessian);

  int poses_ = 0;
  int landmarks_ = 0;
  std::vector<Eigen::Matrix3d> motion_roots_;
  // Of each pose: itself, the next, the landmarks that were seen from it, the constants.
  std::vector<std::vector<int>> blocks_;
  MultifrontalCholesky root_;
  Eigen::VectorXd gradient_;
};

}  // namespace pf_resampling
