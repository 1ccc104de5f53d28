#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/smoothing/multifrontal_cholesky.hpp"

namespace pf_resampling {

/// Gauss and Newton's equations of a graph, sparse: the unknowns are the bases but the first, the
/// landmarks and the constants. A landmark that no segment has seen stays where it is, and adds
/// nothing to cost and determinant.
class SegmentEquations {
 public:
  /// Lays out the structure, which must not change any more. With `last`, the newest base, these
  /// landmarks and the constants are eliminated last.
  explicit SegmentEquations(const SegmentGraph& graph, const std::vector<int>* last = nullptr);

  /// Hessian and gradient at the graph's estimate; returns the cost.
  double linearize(const SegmentGraph& graph);
  /// The gradient alone.
  double linearize_gradient(const SegmentGraph& graph);
  /// After linearize(): what `segment` says of what segment `s` of the graph says, `times` over.
  double add(const SegmentGraph& graph, std::size_t s, const Segment& segment, double times);
  /// After linearize(): that landmarks are known to `sigma` (m), so that those of which nothing
  /// else is said leave the rest determined.
  void add_to_landmarks(double sigma);
  /// The equations as they are, to be taken back to once more was added.
  struct Mark {
    std::size_t added;
    Eigen::VectorXd gradient;
  };
  Mark mark() const { return {root_.added(), gradient_}; }
  void take_back(const Mark& mark);

  /// Factorises Hessian + damping·diagonal. False if that is not positive definite.
  bool factorize(double damping) { return root_.factorize(damping); }
  double log_determinant() const { return root_.log_determinant(); }
  Eigen::VectorXd step() const { return solve(-gradient_); }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  void set_gradient(const Eigen::VectorXd& gradient) { gradient_ = gradient; }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const { return root_.solve(right); }
  void move(const Eigen::VectorXd& step, SegmentGraph* graph) const;

  /// J·directions, J how y of a segment at place `s` follows the unknowns; a column each.
  Eigen::MatrixXd to_segment(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                             const Eigen::MatrixXd& directions) const;
  /// Adds Jᵀ·values.
  void from_segment(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                    const Eigen::Ref<const Eigen::MatrixXd>& values,
                    Eigen::Ref<Eigen::MatrixXd> directions) const;

  /// First unknown of a base (1 on), of a landmark, of the constants.
  int base_at(std::size_t base) const { return root_.at(static_cast<int>(base) - 1); }
  int landmark_at(std::size_t landmark) const {
    return root_.at(static_cast<int>(bases_ + landmark));
  }
  int constants_at() const { return root_.at(static_cast<int>(bases_ + landmarks_)); }
  Eigen::Index size() const { return gradient_.size(); }
  /// What the Hessian has for a landmark alone, and for the odometry's constants.
  const Eigen::Matrix2d& landmark_information(std::size_t landmark) const {
    return landmark_information_[landmark];
  }
  const OdometryInformation& odometry_information() const { return odometry_information_; }
  /// After factorize(): joint covariance of some landmarks, two rows each.
  Eigen::MatrixXd covariance_of(const std::vector<int>& landmarks) const;
  /// After factorize(): gradient and information of what is eliminated last, in that order, given
  /// all the rest at its best.
  std::pair<Eigen::VectorXd, Eigen::MatrixXd> condensed_to_last() const;

  /// Draws from the Gaussian whose information was factorised: a column each. `pulled`: likewise,
  /// Hessian times draw.
  void draw(int count, const RandomStream& stream, Eigen::MatrixXd* draws,
            Eigen::MatrixXd* pulled) const;

 private:
  std::vector<int> blocks_of(std::size_t s, const Segment& segment) const;

  std::size_t bases_ = 0;  // that are unknown
  std::size_t landmarks_ = 0;
  int last_at_ = 0;          // of what is eliminated last
  std::vector<int> unseen_;  // landmarks of which no segment says anything
  MultifrontalCholesky root_;
  Eigen::VectorXd gradient_;
  std::vector<Eigen::Matrix2d> landmark_information_;
  OdometryInformation odometry_information_;
};

}  // namespace pf_resampling
