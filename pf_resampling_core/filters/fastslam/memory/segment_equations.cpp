#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

Eigen::Vector2d rotated(double angle, const Eigen::Vector2d& v) {
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
}

Eigen::Vector2d place(const Pose2& pose) {
  return {pose.x, pose.y};
}

}  // namespace

SegmentEquations::SegmentEquations(const SegmentGraph& graph, const std::vector<int>* last)
    : bases_(graph.segments.size()), landmarks_(graph.landmarks.size()) {
  sizes_.assign(bases_, 3);
  sizes_.insert(sizes_.end(), landmarks_, 2);
  sizes_.push_back(kSensorConstants);
  std::vector<int> last_blocks;
  if (last != nullptr) {
    last_blocks.push_back(static_cast<int>(bases_) - 1);
    for (const int landmark : *last) last_blocks.push_back(static_cast<int>(bases_) + landmark);
  }
  last_blocks.push_back(static_cast<int>(sizes_.size()) - 1);
  order_blocks(graph, last_blocks);
}

// Of a segment: base, end, tracks, constants; -1: known.
std::vector<int> SegmentEquations::blocks_of(std::size_t s, const Segment& segment) const {
  std::vector<int> blocks = {static_cast<int>(s) - 1, static_cast<int>(s)};
  for (const int landmark : segment.landmarks) {
    blocks.push_back(static_cast<int>(bases_) + landmark);
  }
  blocks.push_back(static_cast<int>(sizes_.size()) - 1);
  return blocks;
}

// Those of `last` in that order behind the others, the constants behind all: they touch everything.
// The others by approximate minimum degree.
void SegmentEquations::order_blocks(const SegmentGraph& graph, const std::vector<int>& last) {
  const int count = static_cast<int>(sizes_.size());
  std::vector<std::vector<int>> blocks;  // of each segment
  std::vector<std::vector<std::size_t>> segments(static_cast<std::size_t>(count));  // of each block
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    blocks.push_back(blocks_of(s, *graph.segments[s]));
    blocks.back().pop_back();  // the constants
    for (const int block : blocks.back()) {
      if (block >= 0) segments[static_cast<std::size_t>(block)].push_back(s);
    }
  }
  const int others = count - 1;
  std::vector<int> free_at(static_cast<std::size_t>(count), 0);  // among those that are not last
  for (const int block : last) free_at[static_cast<std::size_t>(block)] = -1;
  std::vector<int> free;
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(count));
  std::vector<int> noted_for(static_cast<std::size_t>(count), -1);
  for (int block = 0; block < others; ++block) {
    std::vector<int>& of_block = neighbours[static_cast<std::size_t>(block)];
    for (const std::size_t s : segments[static_cast<std::size_t>(block)]) {
      for (const int neighbour : blocks[s]) {
        if (neighbour < 0 || noted_for[static_cast<std::size_t>(neighbour)] == block) continue;
        noted_for[static_cast<std::size_t>(neighbour)] = block;
        of_block.push_back(neighbour);
      }
    }
    std::sort(of_block.begin(), of_block.end());
    if (of_block.empty()) {
      unseen_.push_back(block);
      of_block.push_back(block);
    }
    int& at = free_at[static_cast<std::size_t>(block)];
    if (at < 0) continue;
    at = static_cast<int>(free.size());
    free.push_back(block);
  }
  const int free_count = static_cast<int>(free.size());
  Eigen::SparseMatrix<double> pattern(free_count, free_count);
  for (int at = 0; at < free_count; ++at) {
    pattern.startVec(at);
    for (const int neighbour :
         neighbours[static_cast<std::size_t>(free[static_cast<std::size_t>(at)])]) {
      const int row = free_at[static_cast<std::size_t>(neighbour)];
      if (row >= 0) pattern.insertBack(row, at) = 1.0;
    }
  }
  pattern.finalize();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);

  std::vector<int> block_at;  // in the order of elimination
  for (int i = 0; i < free_count; ++i) {
    block_at.push_back(free[static_cast<std::size_t>(order.indices()[i])]);
  }
  block_at.insert(block_at.end(), last.begin(), last.end());
  position_.assign(static_cast<std::size_t>(count), 0);
  for (int i = 0; i < count; ++i) {
    position_[static_cast<std::size_t>(block_at[static_cast<std::size_t>(i)])] = i;
  }
  at_.assign(static_cast<std::size_t>(count), 0);
  int unknowns = 0;
  for (const int block : block_at) {
    at_[static_cast<std::size_t>(block)] = unknowns;
    if (block == last.front()) last_at_ = unknowns;
    unknowns += sizes_[static_cast<std::size_t>(block)];
  }
  gradient_.setZero(unknowns);

  columns_.assign(static_cast<std::size_t>(count), {});
  Eigen::Index entries = 0;
  for (int i = 0; i < count; ++i) {
    const int block = block_at[static_cast<std::size_t>(i)];
    Column& column = columns_[static_cast<std::size_t>(i)];
    if (i == others) {
      for (int row = 0; row < others; ++row) column.rows.push_back(row);
    } else {
      for (const int neighbour : neighbours[static_cast<std::size_t>(block)]) {
        const int row = position_[static_cast<std::size_t>(neighbour)];
        if (row < i) column.rows.push_back(row);
      }
      std::sort(column.rows.begin(), column.rows.end());
    }
    column.rows.push_back(i);
    int offset = 0;
    for (const int row : column.rows) {
      column.offsets.push_back(offset);
      offset += sizes_[static_cast<std::size_t>(block_at[static_cast<std::size_t>(row)])];
    }
    const int size = sizes_[static_cast<std::size_t>(block)];
    entries += size * (offset - size) + size * (size + 1) / 2;
  }
  hessian_.resize(unknowns, unknowns);
  hessian_.resizeNonZeros(entries);
  int next = 0;
  for (int i = 0; i < count; ++i) {
    const int block = block_at[static_cast<std::size_t>(i)];
    const Column& column = columns_[static_cast<std::size_t>(i)];
    for (int c = 0; c < sizes_[static_cast<std::size_t>(block)]; ++c) {
      hessian_.outerIndexPtr()[at_[static_cast<std::size_t>(block)] + c] = next;
      for (const int row : column.rows) {
        const int row_block = block_at[static_cast<std::size_t>(row)];
        const int rows = row == i ? c + 1 : sizes_[static_cast<std::size_t>(row_block)];
        for (int r = 0; r < rows; ++r) {
          hessian_.innerIndexPtr()[next++] = at_[static_cast<std::size_t>(row_block)] + r;
        }
      }
    }
  }
  hessian_.outerIndexPtr()[unknowns] = next;
}

// The row's block comes before the column's in the order of elimination.
template <typename Block>
void SegmentEquations::add_block(int row_block, int column_block, const Block& block) {
  const Column& column =
      columns_[static_cast<std::size_t>(position_[static_cast<std::size_t>(column_block)])];
  const int row = position_[static_cast<std::size_t>(row_block)];
  const auto found = std::lower_bound(column.rows.begin(), column.rows.end(), row);
  const int offset = column.offsets[static_cast<std::size_t>(found - column.rows.begin())];
  const int first = at_[static_cast<std::size_t>(column_block)];
  for (int c = 0; c < block.cols(); ++c) {
    double* values = hessian_.valuePtr() + hessian_.outerIndexPtr()[first + c] + offset;
    for (int r = 0; r < block.rows(); ++r) values[r] += block(r, c);
  }
}

template <typename Block>
void SegmentEquations::add_to_diagonal(int block, const Block& values) {
  const int first = at_[static_cast<std::size_t>(block)];
  for (int c = 0; c < values.cols(); ++c) {
    double* last = hessian_.valuePtr() + hessian_.outerIndexPtr()[first + c + 1] - 1;
    for (int r = 0; r <= c; ++r) last[r - c] += values(r, c);
  }
}

double SegmentEquations::linearize(const SegmentGraph& graph) {
  std::fill_n(hessian_.valuePtr(), hessian_.nonZeros(), 0.0);
  gradient_.setZero();
  double cost = 0.0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    cost += add(graph, s, *graph.segments[s], 1.0);
  }
  for (const int block : unseen_) add_to_diagonal(block, Eigen::Matrix2d::Identity());
  const int constants = static_cast<int>(sizes_.size()) - 1;
  const SensorConstants prior = constants_information(graph);
  add_to_diagonal(constants, Eigen::MatrixXd(prior.asDiagonal()));
  gradient_.segment<kSensorConstants>(constants_at()) += prior.cwiseProduct(graph.constants);
  return cost + 0.5 * graph.constants.dot(prior.cwiseProduct(graph.constants));
}

double SegmentEquations::add(const SegmentGraph& graph, std::size_t s, const Segment& segment,
                             double times) {
  const CondensedSegment& condensed = *segment.condensed;
  const Eigen::Index size = segment.size();
  std::array<double, kDataKinds> weights = weights_of(graph, s, segment);
  for (double& weight : weights) weight *= times;
  const Eigen::VectorXd e = difference(graph, s, segment);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  double cost = 0.0;
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
  for (std::size_t kind = 0; kind < kDataKinds; ++kind) {
    if (condensed.information[kind].size() == 0) continue;
    information += weights[kind] * condensed.information[kind];
    pull += weights[kind] * condensed.gradient[kind];
    cost += weights[kind] * condensed.cost[kind];
  }
  const Eigen::VectorXd by_e = information * e;
  cost += e.dot(pull) + 0.5 * e.dot(by_e);
  pull += by_e;
  // Into directions of the map: the segment's axes turned by its heading.
  const Pose2& base = graph.bases[s];
  const double cosine = std::cos(base.heading);
  const double sine = std::sin(base.heading);
  const Eigen::Index tracks = static_cast<Eigen::Index>(segment.tracks.size());
  for (Eigen::Index k = -1; k < tracks; ++k) {
    const Eigen::Index at = k < 0 ? 0 : 3 + 2 * k;
    const Eigen::VectorXd first = information.col(at);
    information.col(at) = cosine * first - sine * information.col(at + 1);
    information.col(at + 1) = sine * first + cosine * information.col(at + 1);
  }
  for (Eigen::Index k = -1; k < tracks; ++k) {
    const Eigen::Index at = k < 0 ? 0 : 3 + 2 * k;
    const Eigen::RowVectorXd first = information.row(at);
    information.row(at) = cosine * first - sine * information.row(at + 1);
    information.row(at + 1) = sine * first + cosine * information.row(at + 1);
    pull.segment<2>(at) = rotated(base.heading, pull.segment<2>(at));
  }
  // How y, so turned, follows the base.
  Eigen::Matrix<double, Eigen::Dynamic, 3> by_base = Eigen::MatrixXd::Zero(size, 3);
  const auto arm = [&](Eigen::Index at, const Eigen::Vector2d& to) {
    by_base(at, 0) = by_base(at + 1, 1) = -1.0;
    by_base(at, 2) = to.y() - base.y;
    by_base(at + 1, 2) = base.x - to.x();
  };
  arm(0, place(graph.bases[s + 1]));
  by_base(2, 2) = -1.0;
  for (Eigen::Index k = 0; k < tracks; ++k) {
    arm(3 + 2 * k,
        graph.landmarks[static_cast<std::size_t>(segment.landmarks[static_cast<std::size_t>(k)])]);
  }
  Eigen::MatrixXd all(size + 3, size + 3);
  all.bottomRightCorner(size, size) = information;
  for (Eigen::Index c = 0; c < 3; ++c) {
    all.col(c).tail(size).noalias() = information * by_base.col(c);
  }
  all.topRightCorner(3, size) = all.bottomLeftCorner(size, 3).transpose();
  all.topLeftCorner(3, 3).noalias() = by_base.transpose() * all.bottomLeftCorner(size, 3);

  const std::vector<int> blocks = blocks_of(s, segment);
  std::vector<Eigen::Index> begins = {0, 3};
  for (Eigen::Index k = 0; k < tracks; ++k) begins.push_back(6 + 2 * k);
  begins.push_back(6 + 2 * tracks);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b] < 0) continue;
    const int columns = sizes_[static_cast<std::size_t>(blocks[b])];
    const int at = at_[static_cast<std::size_t>(blocks[b])];
    if (b == 0) {
      gradient_.segment(at, 3).noalias() += by_base.transpose() * pull;
    } else {
      gradient_.segment(at, columns) += pull.segment(begins[b] - 3, columns);
    }
    for (std::size_t a = 0; a <= b; ++a) {
      if (blocks[a] < 0) continue;
      const int rows = sizes_[static_cast<std::size_t>(blocks[a])];
      const auto block = all.block(begins[a], begins[b], rows, columns);
      if (a == b) {
        add_to_diagonal(blocks[a], block);
      } else if (blocks[a] == blocks[b]) {  // two tracks of one landmark
        add_to_diagonal(blocks[a], (block + block.transpose()).eval());
      } else if (position_[static_cast<std::size_t>(blocks[a])] <
                 position_[static_cast<std::size_t>(blocks[b])]) {
        add_block(blocks[a], blocks[b], block);
      } else {
        add_block(blocks[b], blocks[a], block.transpose());
      }
    }
  }
  return cost;
}

Eigen::MatrixXd SegmentEquations::to_segment(const SegmentGraph& graph, std::size_t s,
                                             const Segment& segment,
                                             const Eigen::MatrixXd& directions) const {
  Eigen::MatrixXd values(segment.size(), directions.cols());
  const Pose2& base = graph.bases[s];
  Eigen::Matrix2d to_base;
  to_base << std::cos(base.heading), std::sin(base.heading), -std::sin(base.heading),
      std::cos(base.heading);
  Eigen::MatrixXd by_base = Eigen::MatrixXd::Zero(3, directions.cols());
  if (s > 0) by_base = directions.middleRows<3>(base_at(s));
  const auto turn = [&](Eigen::Index at, const Eigen::Vector2d& to, int global) {
    const Eigen::Vector2d across(base.y - to.y(), to.x() - base.x);
    values.middleRows<2>(at) = to_base * (directions.middleRows<2>(global) - by_base.topRows<2>() -
                                          across * by_base.row(2));
  };
  turn(0, place(graph.bases[s + 1]), base_at(s + 1));
  values.row(2) = directions.row(base_at(s + 1) + 2) - by_base.row(2);
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
    turn(3 + 2 * static_cast<Eigen::Index>(k), graph.landmarks[landmark], landmark_at(landmark));
  }
  values.bottomRows<kSensorConstants>() = directions.middleRows<kSensorConstants>(constants_at());
  return values;
}

void SegmentEquations::from_segment(const SegmentGraph& graph, std::size_t s,
                                    const Segment& segment,
                                    const Eigen::Ref<const Eigen::MatrixXd>& values,
                                    Eigen::Ref<Eigen::MatrixXd> directions) const {
  const Pose2& base = graph.bases[s];
  Eigen::Matrix2d to_map;
  to_map << std::cos(base.heading), -std::sin(base.heading), std::sin(base.heading),
      std::cos(base.heading);
  Eigen::MatrixXd by_base = Eigen::MatrixXd::Zero(3, values.cols());
  const auto turn = [&](Eigen::Index at, const Eigen::Vector2d& to, int global) {
    const Eigen::MatrixXd turned = to_map * values.middleRows<2>(at);
    directions.middleRows<2>(global) += turned;
    by_base.topRows<2>() -= turned;
    by_base.row(2) -= Eigen::RowVector2d(base.y - to.y(), to.x() - base.x) * turned;
  };
  turn(0, place(graph.bases[s + 1]), base_at(s + 1));
  directions.row(base_at(s + 1) + 2) += values.row(2);
  by_base.row(2) -= values.row(2);
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
    turn(3 + 2 * static_cast<Eigen::Index>(k), graph.landmarks[landmark], landmark_at(landmark));
  }
  if (s > 0) directions.middleRows<3>(base_at(s)) += by_base;
  directions.middleRows<kSensorConstants>(constants_at()) += values.bottomRows<kSensorConstants>();
}

double SegmentEquations::linearize_gradient(const SegmentGraph& graph) {
  gradient_.setZero();
  double cost = 0.0;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const CondensedSegment& condensed = *segment.condensed;
    const std::array<double, kDataKinds> weights = weights_of(graph, s, segment);
    const Eigen::VectorXd e = difference(graph, s, segment);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(segment.size());
    for (std::size_t kind = 0; kind < kDataKinds; ++kind) {
      if (condensed.information[kind].size() == 0) continue;
      const Eigen::VectorXd by_e = weights[kind] * (condensed.information[kind] * e);
      cost += weights[kind] * (condensed.cost[kind] + e.dot(condensed.gradient[kind])) +
              0.5 * e.dot(by_e);
      pull += weights[kind] * condensed.gradient[kind] + by_e;
    }
    from_segment(graph, s, segment, pull, gradient_);
  }
  const SensorConstants prior = constants_information(graph);
  gradient_.segment<kSensorConstants>(constants_at()) += prior.cwiseProduct(graph.constants);
  return cost + 0.5 * graph.constants.dot(prior.cwiseProduct(graph.constants));
}

void SegmentEquations::add_to_landmarks(double sigma) {
  const Eigen::Matrix2d information = Eigen::Matrix2d::Identity() / (sigma * sigma);
  for (std::size_t l = 0; l < landmarks_; ++l) {
    add_to_diagonal(static_cast<int>(bases_ + l), information);
  }
}

bool SegmentEquations::factorize(double damping) {
  if (!is_analyzed_) {
    root_.analyzePattern(hessian_);
    is_analyzed_ = true;
  }
  if (damping == 0.0) {
    root_.factorize(hessian_);
  } else {
    Eigen::SparseMatrix<double> damped = hessian_;
    for (Eigen::Index i = 0; i < damped.cols(); ++i) {
      damped.valuePtr()[damped.outerIndexPtr()[i + 1] - 1] *= 1.0 + damping;
    }
    root_.factorize(damped);
  }
  return root_.info() == Eigen::Success;
}

double SegmentEquations::log_determinant() const {
  const auto& factor = root_.matrixL().nestedExpression();
  double sum = 0.0;
  for (Eigen::Index i = 0; i < factor.cols(); ++i) {
    sum += std::log(factor.valuePtr()[factor.outerIndexPtr()[i]]);
  }
  return 2.0 * sum;
}

Eigen::MatrixXd SegmentEquations::solve(const Eigen::MatrixXd& right) const {
  return root_.solve(right);
}

void SegmentEquations::move(const Eigen::VectorXd& step, SegmentGraph* graph) const {
  for (std::size_t b = 1; b < graph->bases.size(); ++b) {
    const Eigen::Vector3d by = step.segment<3>(base_at(b));
    Pose2& pose = graph->bases[b];
    pose = {pose.x + by.x(), pose.y + by.y(), wrap_angle(pose.heading + by.z())};
  }
  for (std::size_t l = 0; l < graph->landmarks.size(); ++l) {
    graph->landmarks[l] += step.segment<2>(landmark_at(l));
  }
  const SensorConstants by = step.segment<kSensorConstants>(constants_at());
  for (int k = 0; k < kSensorConstants; ++k) {
    double& constant = graph->constants[k];
    const bool is_scale = k == SensorConstant::distance_scale || k == SensorConstant::turn_scale ||
                          k == SensorConstant::range_scale;
    // A scale stays positive: its logarithm is what moves.
    constant =
        is_scale ? (1.0 + constant) * std::exp(by[k] / (1.0 + constant)) - 1.0 : constant + by[k];
  }
}

Eigen::Matrix2d SegmentEquations::landmark_information(std::size_t landmark) const {
  const int at = landmark_at(landmark);
  const double* first = hessian_.valuePtr() + hessian_.outerIndexPtr()[at + 1] - 1;
  const double* second = hessian_.valuePtr() + hessian_.outerIndexPtr()[at + 2] - 1;
  Eigen::Matrix2d information;
  information << first[0], second[-1], second[-1], second[0];
  return information;
}

Eigen::MatrixXd SegmentEquations::covariance_of(const std::vector<int>& landmarks) const {
  const Eigen::Index columns = 2 * static_cast<Eigen::Index>(landmarks.size());
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(size(), columns);
  const auto at = [&](std::size_t i) {
    return landmark_at(static_cast<std::size_t>(landmarks[i]));
  };
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    units.block<2, 2>(at(i), 2 * static_cast<Eigen::Index>(i)).setIdentity();
  }
  const Eigen::MatrixXd solved = solve(units);
  Eigen::MatrixXd covariance(columns, columns);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    covariance.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = solved.middleRows<2>(at(i));
  }
  return 0.5 * (covariance + covariance.transpose());
}

OdometryInformation SegmentEquations::odometry_information() const {
  OdometryInformation information;
  for (int c = 0; c < kOdometryConstants; ++c) {
    const double* last = hessian_.valuePtr() + hessian_.outerIndexPtr()[constants_at() + c + 1] - 1;
    for (int r = 0; r <= c; ++r) information(r, c) = information(c, r) = last[r - c];
  }
  return information;
}

std::pair<Eigen::VectorXd, Eigen::MatrixXd> SegmentEquations::condensed_to_last() const {
  const auto& factor = root_.matrixL().nestedExpression();
  const Eigen::Index size = this->size() - last_at_;
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index c = 0; c < size; ++c) {
    using Factor = Eigen::SparseMatrix<double>;
    for (Factor::InnerIterator entry(factor, last_at_ + c); entry; ++entry) {
      root(entry.row() - last_at_, c) = entry.value();
    }
  }
  const Eigen::VectorXd pulled = root_.matrixL().solve(gradient_);
  return {root * pulled.tail(size), root * root.transpose()};
}

void SegmentEquations::draw(int count, const RandomStream& stream, Eigen::MatrixXd* draws,
                            Eigen::MatrixXd* pulled) const {
  Eigen::MatrixXd normals(size(), count);
  stream.fill_normal(0, size() * count, normals.data());
  *pulled = root_.matrixL().nestedExpression() * normals;
  *draws = root_.matrixU().solve(normals);
}

}  // namespace pf_resampling
