#pragma once

#include <Eigen/Core>
#include <vector>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// Gauss and Newton's equations H·step = -gradient of a graph, in an order of elimination that
/// keeps the factor sparse: the drive is cut into segments of poses, each of which touches only the
/// two poses that it is cut off at, what was seen from it, and the constants; then these cuts, the
/// landmarks, the constants, the newest pose. All blocks are dense. All but the cuts is
/// what a filter goes on with: the trailing block of the factor is their joint information.
class NormalEquations {
 public:
  /// Lays out the graph's structure, which must not change any more.
  explicit NormalEquations(const SmoothingGraph& graph);

  /// H and gradient at the graph's estimate. `robust_width`: of sightings, see
  /// robust_cost().
  void linearize(const SmoothingGraph& graph, double robust_width);

  /// Factorises H + damping·diag(H). False if that is not positive definite.
  bool factorize(double damping);

  /// Natural logarithm of the determinant of what was factorised.
  double log_determinant() const;

  /// -(what was factorised)⁻¹·gradient.
  Eigen::VectorXd step() const;
  const Eigen::VectorXd& gradient() const { return gradient_; }

  /// The graph's estimate, moved by a step.
  void move(const Eigen::VectorXd& step, SmoothingGraph* graph) const;

  /// Half the sum of squares, robust, at the graph's estimate.
  double cost(const SmoothingGraph& graph, double robust_width) const;

  /// First of a pose's, a landmark's and the constants' unknowns.
  int pose_at(int pose) const { return pose_at_[static_cast<std::size_t>(pose)]; }
  int landmark_at(int landmark) const { return first_landmark_ + 2 * landmark; }
  int constants_at() const { return constants_; }
  /// Number of unknowns, and of those of the trailing block.
  Eigen::Index size() const { return gradient_.size(); }
  Eigen::Index trailing_size() const;
  /// Lower triangular R with R·Rᵀ the joint information of landmarks, constants and newest pose.
  Eigen::MatrixXd trailing_root() const;
  /// The gradient of the trailing block once all before it is eliminated.
  Eigen::VectorXd trailing_gradient() const;

 private:
  /// Poses that follow each other, without those it is cut off at.
  struct Segment {
    int at = 0;                  // first unknown
    std::vector<int> border;     // unknowns of the rest that it touches, ascending
    Eigen::MatrixXd own;         // Hessian: lower triangle
    Eigen::MatrixXd coupling;    // Hessian: own unknowns by border
    Eigen::MatrixXd own_root;    // factor: lower triangle
    Eigen::MatrixXd eliminated;  // factor: own_root⁻¹·coupling
    Eigen::Index size() const { return own.rows(); }
  };

  void cut_into_segments(int poses);
  void find_borders(const SmoothingGraph& graph);
  template <typename Block>
  void add(int row, int column, const Block& block);
  void add_prior(const SmoothingGraph& graph);
  std::vector<int> prior_places(const GaussianPrior& prior) const;
  Eigen::VectorXd prior_difference(const SmoothingGraph& graph) const;
  Eigen::MatrixXd forward(Eigen::MatrixXd right) const;
  Eigen::MatrixXd backward(Eigen::MatrixXd right) const;

  std::vector<int> pose_at_;     // first unknown of each pose
  std::vector<int> segment_of_;  // of each pose; -1: it is in none
  std::vector<int> segment_at_;  // of each three unknowns before the rest
  std::vector<Segment> segments_;
  int rest_ = 0;  // first unknown of the rest: all that is in no segment
  int first_landmark_ = 0;
  int constants_ = 0;
  std::vector<Eigen::Matrix3d> motion_roots_;
  std::vector<int> prior_places_;
  Eigen::MatrixXd of_rest_;    // Hessian: lower triangle
  Eigen::MatrixXd rest_root_;  // factor: lower triangle
  Eigen::VectorXd gradient_;
};

}  // namespace pf_resampling
