#include "pf_resampling_core/smoothing/multifrontal_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>

namespace pf_resampling {
namespace {

// Columns are put into one front although some of their rows then hold zeros: so many of all, or
// any where there are so few columns that calls cost more than numbers.
constexpr double kMostZeros = 0.2;
constexpr int kFewColumns = 12;

// Eigen splits long sums by the sizes of the processor's caches, so that other processors round
// them differently. With fixed sizes, the same seed gives the same bytes on all of them.
const bool kCachesAreSet = (Eigen::setCpuCacheSizes(48 << 10, 1280 << 10, 8 << 20), true);

std::size_t to_size(Eigen::Index number) {
  return static_cast<std::size_t>(number);
}

// The blocks as they are eliminated.
std::vector<int> elimination_order(std::size_t count, const std::vector<std::vector<int>>& terms,
                                   const std::vector<int>& last) {
  std::vector<int> column_of(count, 0);  // among those that are not last
  for (const int block : last) column_of[to_size(block)] = -1;
  std::vector<int> free;
  for (std::size_t block = 0; block < count; ++block) {
    if (column_of[block] < 0) continue;
    column_of[block] = static_cast<int>(free.size());
    free.push_back(static_cast<int>(block));
  }
  const int columns = static_cast<int>(free.size());
  // A row for each block, for those that are in no term, and one for each term.
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < columns; ++column) entries.emplace_back(column, column, 1.0);
  int row = columns;
  for (const std::vector<int>& term : terms) {
    for (const int block : term) {
      const int column = column_of[to_size(block)];
      if (column >= 0) entries.emplace_back(row, column, 1.0);
    }
    ++row;
  }
  Eigen::SparseMatrix<double> is_in(row, columns);
  is_in.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> pattern = is_in.transpose() * is_in;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  std::vector<int> order;
  for (int i = 0; i < columns; ++i) order.push_back(free[to_size(permutation.indices()[i])]);
  order.insert(order.end(), last.begin(), last.end());
  return order;
}

void add_to_rows(const std::vector<int>& rows, const Eigen::MatrixXd& values,
                 Eigen::MatrixXd* matrix) {
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      (*matrix)(rows[i], c) += values(static_cast<Eigen::Index>(i), c);
    }
  }
}

}  // namespace

// The rows of a column are those of the terms that begin with it, and of the columns that lead to
// it in the elimination tree.
MultifrontalCholesky::MultifrontalCholesky(std::vector<int> sizes,
                                           const std::vector<std::vector<int>>& terms,
                                           const std::vector<int>& last)
    : sizes_(std::move(sizes)), at_(sizes_.size()) {
  const int count = static_cast<int>(sizes_.size());
  const std::vector<int> order = elimination_order(sizes_.size(), terms, last);
  std::vector<int> position(sizes_.size());
  for (int i = 0; i < count; ++i) {
    const std::size_t block = to_size(order[to_size(i)]);
    position[block] = i;
    at_[block] = static_cast<int>(size_);
    size_ += sizes_[block];
  }
  // By positions; dense, which is little beside the numbers.
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> has_row;
  has_row.setConstant(count, count, false);
  for (const std::vector<int>& term : terms) {
    int first = count;
    for (const int block : term) first = std::min(first, position[to_size(block)]);
    for (const int block : term) has_row(position[to_size(block)], first) = true;
  }
  double zeros = 0.0;  // of the newest front
  for (int column = 0; column < count; ++column) {
    std::vector<int> blocks;
    for (int row = column + 1; row < count; ++row) {
      if (has_row(row, column)) blocks.push_back(order[to_size(row)]);
    }
    if (!blocks.empty()) {
      const int parent = position[to_size(blocks.front())];
      has_row.col(parent) = has_row.col(parent) || has_row.col(column);
    }
    std::vector<int> others = unknowns_of(blocks);
    const int block = order[to_size(column)];
    const int size = sizes_[to_size(block)];
    const double height = static_cast<double>(others.size());
    bool joins = false;
    if (!fronts_.empty() && !fronts_.back().others.empty() &&
        fronts_.back().others.front() == at(block)) {
      const double columns = static_cast<double>(fronts_.back().columns);
      zeros += columns * (height + size - static_cast<double>(fronts_.back().others.size()));
      const double all = (columns + size) * (0.5 * (columns + size) + height);
      joins = zeros <= kMostZeros * all || columns + size <= kFewColumns;
    }
    if (!joins) {
      zeros = 0.0;
      fronts_.emplace_back().at = at(block);
    }
    fronts_.back().columns += size;
    fronts_.back().others = std::move(others);
    front_of_.resize(front_of_.size() + to_size(size), fronts_.size() - 1);
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    if (!fronts_[f].others.empty()) front_of(fronts_[f].others.front()).children.push_back(f);
  }
}

std::vector<int> MultifrontalCholesky::unknowns_of(const std::vector<int>& blocks) const {
  std::vector<int> unknowns;
  for (const int block : blocks) {
    for (int i = 0; i < sizes_[to_size(block)]; ++i) unknowns.push_back(at(block) + i);
  }
  return unknowns;
}

void MultifrontalCholesky::add(const std::vector<int>& blocks, Eigen::MatrixXd values) {
  std::vector<int> unknowns = unknowns_of(blocks);
  const int first = *std::min_element(unknowns.begin(), unknowns.end());
  Front& front = front_of(first);
  front.terms.push_back(terms_.size());
  front.is_current = false;
  terms_.push_back({front_of_[to_size(first)], std::move(unknowns), std::move(values)});
}

void MultifrontalCholesky::take_back(std::size_t added) {
  while (terms_.size() > added) {
    Front& front = fronts_[terms_.back().front];
    front.terms.pop_back();
    front.is_current = false;
    terms_.pop_back();
  }
}

bool MultifrontalCholesky::factorize(double damping) {
  if (std::exchange(damping_, damping) != damping) {
    for (Front& front : fronts_) front.is_current = false;
  }
  std::vector<Eigen::Index> row_of(to_size(size_));  // of unknowns in the front at hand
  for (Front& front : fronts_) {
    if (front.is_current) continue;
    if (!front.others.empty()) front_of(front.others.front()).is_current = false;
    assemble(damping, &row_of, &front);
    Eigen::Ref<Eigen::MatrixXd> own = front.matrix.topLeftCorner(front.columns, front.columns);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(own);  // in place
    if (factor.info() != Eigen::Success) return false;
    front.is_current = true;
    const Eigen::Index others = front.matrix.rows() - front.columns;
    if (others == 0) continue;
    auto below = front.matrix.bottomLeftCorner(others, front.columns);
    own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
    front.matrix.bottomRightCorner(others, others)
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(below, -1.0);
  }
  return true;
}

// The sum of the terms and of what the children leave. Nobody reads the upper triangle.
void MultifrontalCholesky::assemble(double damping, std::vector<Eigen::Index>* row_of,
                                    Front* front) const {
  const Eigen::Index size = front->columns + static_cast<Eigen::Index>(front->others.size());
  front->matrix.setZero(size, size);
  for (Eigen::Index i = 0; i < front->columns; ++i) (*row_of)[to_size(front->at + i)] = i;
  for (std::size_t i = 0; i < front->others.size(); ++i) {
    (*row_of)[to_size(front->others[i])] = front->columns + static_cast<Eigen::Index>(i);
  }
  std::vector<Eigen::Index> rows;
  const auto add = [&](const std::vector<int>& unknowns, const auto& values) {
    rows.clear();
    for (const int unknown : unknowns) rows.push_back((*row_of)[to_size(unknown)]);
    for (std::size_t b = 0; b < rows.size(); ++b) {
      double* column = &front->matrix.coeffRef(0, rows[b]);
      const double* value = &values.coeffRef(0, static_cast<Eigen::Index>(b));
      for (std::size_t a = 0; a < rows.size(); ++a) column[rows[a]] += value[a];
    }
  };
  for (const std::size_t t : front->terms) add(terms_[t].unknowns, terms_[t].values);
  front->matrix.diagonal() *= 1.0 + damping;  // before the children's, which have had theirs
  for (const std::size_t c : front->children) add(fronts_[c].others, fronts_[c].update());
}

double MultifrontalCholesky::log_determinant() const {
  double sum = 0.0;
  for (const Front& front : fronts_) sum += front.root().diagonal().array().log().sum();
  return 2.0 * sum;
}

Eigen::MatrixXd MultifrontalCholesky::forward(Eigen::MatrixXd right) const {
  for (const Front& front : fronts_) {
    auto own = right.middleRows(front.at, front.columns);
    if ((own.array() == 0.0).all()) continue;
    front.root().triangularView<Eigen::Lower>().solveInPlace(own);
    add_to_rows(front.others, -front.below() * own, &right);
  }
  return right;
}

Eigen::MatrixXd MultifrontalCholesky::backward(Eigen::MatrixXd right) const {
  Eigen::MatrixXd known;
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    known.resize(static_cast<Eigen::Index>(front->others.size()), right.cols());
    for (Eigen::Index i = 0; i < known.rows(); ++i)
      known.row(i) = right.row(front->others[to_size(i)]);
    auto own = right.middleRows(front->at, front->columns);
    own.noalias() -= front->below().transpose() * known;
    front->root().transpose().triangularView<Eigen::Upper>().solveInPlace(own);
  }
  return right;
}

Eigen::MatrixXd MultifrontalCholesky::times_root(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(right.rows(), right.cols());
  for (const Front& front : fronts_) {
    const auto own = right.middleRows(front.at, front.columns);
    if ((own.array() == 0.0).all()) continue;
    product.middleRows(front.at, front.columns) +=
        front.root().triangularView<Eigen::Lower>() * own;
    add_to_rows(front.others, front.below() * own, &product);
  }
  return product;
}

// (L⁻¹·E)ᵀ·(L⁻¹·E), E the columns of the identity: all rows but those of the ancestors are zero.
Eigen::MatrixXd MultifrontalCholesky::covariance_of(const std::vector<int>& blocks) const {
  const std::vector<int> unknowns = unknowns_of(blocks);
  const Eigen::Index columns = static_cast<Eigen::Index>(unknowns.size());
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(size_, columns);
  for (Eigen::Index i = 0; i < columns; ++i) units(unknowns[to_size(i)], i) = 1.0;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(columns, columns);
  const Eigen::MatrixXd half = forward(std::move(units));
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(half.transpose());
  return covariance.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd MultifrontalCholesky::trailing_root(int first) const {
  const Eigen::Index count = size_ - first;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(size_, count);
  units.bottomRows(count).setIdentity();
  return times_root(units).bottomRows(count);
}

}  // namespace pf_resampling
