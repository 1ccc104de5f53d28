#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/segment.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {

/// A whole drive: its segments, and the present estimate of all that they speak of.
struct SegmentGraph {
  std::vector<std::shared_ptr<const Segment>> segments;  ///< shared by copies of the graph
  /// m, rad, map frame: of each segment, and behind them the newest pose. The first is the frame:
  /// it is known.
  std::vector<Pose2> bases;
  std::vector<Eigen::Vector2d> landmarks;  ///< m
  SensorConstants constants = SensorConstants::Zero();
  SensorConstants constants_sigma = SensorConstants::Zero();  ///< of their prior about 0
  NoiseScales noise;
  /// Weight of the odometry of each segment; see slip_square().
  std::vector<double> motion_shares;

  const Pose2& newest() const { return bases.back(); }
};

/// y of a segment that stands at place `s` of the graph, at the graph's estimate, less where it was
/// condensed.
Eigen::VectorXd difference(const SegmentGraph& graph, std::size_t s, const Segment& segment);

/// A segment's data without what they are condensed to, moved to the graph's estimate.
Segment at_estimate(const SegmentGraph& graph, std::size_t s);

/// Gauss and Newton's equations of a graph, sparse: the unknowns are the bases but the first, the
/// landmarks and the constants.
class SegmentEquations {
 public:
  /// Lays out the structure, which must not change any more.
  explicit SegmentEquations(const SegmentGraph& graph);

  /// Hessian and gradient at the graph's estimate; returns the cost.
  double linearize(const SegmentGraph& graph);
  /// After linearize(): what `segment` says of what segment `s` of the graph says, `times` over.
  double add(const SegmentGraph& graph, std::size_t s, const Segment& segment, double times);
  /// After linearize(): that landmarks are known to `sigma` (m), so that those of which nothing
  /// else is said leave the rest determined.
  void add_to_landmarks(double sigma);
  double cost(const SegmentGraph& graph) const;

  /// Factorises Hessian + damping·diagonal. False if that is not positive definite.
  bool factorize(double damping);
  double log_determinant() const;
  Eigen::VectorXd step() const { return solve(-gradient_); }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;
  void move(const Eigen::VectorXd& step, SegmentGraph* graph) const;

  /// J·directions, J how y of a segment at place `s` follows the unknowns; a column each.
  Eigen::MatrixXd to_segment(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                             const Eigen::MatrixXd& directions) const;
  /// Adds Jᵀ·values.
  void from_segment(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                    const Eigen::MatrixXd& values, Eigen::MatrixXd* directions) const;

  /// First unknown of a base (1 on), of a landmark, of the constants.
  int base_at(std::size_t base) const { return at_[base - 1]; }
  int landmark_at(std::size_t landmark) const { return at_[bases_ + landmark]; }
  int constants_at() const { return at_.back(); }
  Eigen::Index size() const { return gradient_.size(); }
  /// The Hessian's own block of a landmark, and of the odometry's constants.
  Eigen::Matrix2d landmark_information(std::size_t landmark) const;
  OdometryInformation odometry_information() const;

  /// Draws from the Gaussian whose information was factorised: a column each. `pulled`: likewise,
  /// Hessian times draw.
  void draw(int count, const RandomStream& stream, Eigen::MatrixXd* draws,
            Eigen::MatrixXd* pulled) const;

 private:
  struct Column {
    std::vector<int> rows;  // blocks in the order of elimination, ascending, itself the last
    std::vector<int> offsets;
  };
  void order_blocks(const SegmentGraph& graph);
  std::vector<int> blocks_of(std::size_t s, const Segment& segment) const;
  template <typename Block>
  void add_block(int row_block, int column_block, const Block& block);
  template <typename Block>
  void add_to_diagonal(int block, const Block& values);

  std::size_t bases_ = 0;  // that are unknown
  std::size_t landmarks_ = 0;
  std::vector<int> sizes_;     // of blocks
  std::vector<int> position_;  // of blocks in the order of elimination
  std::vector<int> at_;        // first unknown of each block
  std::vector<Column> columns_;
  std::vector<int> first_of_position_;
  Eigen::SparseMatrix<double> hessian_;  // upper triangle, in the order of elimination
  Eigen::VectorXd gradient_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>>
      root_;
  bool is_analyzed_ = false;
};

/// Weights of a segment's kinds of data at place `s` under the graph's noise and motion shares,
/// relative to those that it was condensed with.
std::array<double, kDataKinds> weights_of(const SegmentGraph& graph, std::size_t s,
                                          const Segment& segment);

/// Information of the prior of the constants.
SensorConstants constants_information(const SegmentGraph& graph);

/// Squared error, in standard deviations, of the odometry of a segment as a whole: three degrees of
/// freedom. Where wheels slipped it is large. 0 where the data are gone.
double slip_square(const SegmentGraph& graph, std::size_t segment);

struct SegmentSolution {
  bool is_solved = false;
  double cost = 0.0;
  double log_determinant = 0.0;
  int steps = 0;
  int relinearized = 0;
};

/// Least cost, from the graph's estimate on: with damping, as many steps as it takes; segments are
/// condensed anew where they have moved or where their odometry turns out to be wrong. Unless it is
/// solved, nothing changes. `equations`, if given, is left factorised at the solution.
SegmentSolution solve(double robust_width, SegmentGraph* graph,
                      std::unique_ptr<SegmentEquations>* equations = nullptr);

/// Deviations of what a particle carries from the estimate: a row per particle; columns: two for
/// each landmark, the constants, the newest pose. What a Rao-Blackwellised particle keeps as a
/// covariance is taken out. Antithetic pairs.
Eigen::MatrixXd draw_deviations(const SegmentEquations& equations, const SegmentGraph& graph,
                                int particles, const RandomStream& stream);

}  // namespace pf_resampling
