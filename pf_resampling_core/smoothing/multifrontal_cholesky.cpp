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

std::size_t to_size(int number) {
  return static_cast<std::size_t>(number);
}

}  // namespace

MultifrontalCholesky::MultifrontalCholesky(std::vector<int> sizes,
                                           const std::vector<std::vector<int>>& terms,
                                           const std::vector<int>& last)
    : sizes_(std::move(sizes)) {
  order_blocks(terms, last);
  find_fronts(terms);
  lay_out_fronts();
}

int MultifrontalCholesky::size_at(int position) const {
  return size_of(block_at_[to_size(position)]);
}

void MultifrontalCholesky::order_blocks(const std::vector<std::vector<int>>& terms,
                                        const std::vector<int>& last) {
  const int count = static_cast<int>(sizes_.size());
  std::vector<int> free_at(sizes_.size(), 0);  // among those that are not last
  for (const int block : last) free_at[to_size(block)] = -1;
  std::vector<int> free;
  for (int block = 0; block < count; ++block) {
    if (free_at[to_size(block)] < 0) continue;
    free_at[to_size(block)] = static_cast<int>(free.size());
    free.push_back(block);
  }
  std::vector<std::vector<std::size_t>> terms_of(free.size());
  for (std::size_t t = 0; t < terms.size(); ++t) {
    for (const int block : terms[t]) {
      const int at = free_at[to_size(block)];
      if (at >= 0) terms_of[to_size(at)].push_back(t);
    }
  }
  const int free_count = static_cast<int>(free.size());
  Eigen::SparseMatrix<double> pattern(free_count, free_count);
  std::vector<int> noted_for(free.size(), -1);
  std::vector<int> neighbours;
  for (int i = 0; i < free_count; ++i) {
    neighbours.assign(1, i);
    noted_for[to_size(i)] = i;
    for (const std::size_t t : terms_of[to_size(i)]) {
      for (const int block : terms[t]) {
        const int at = free_at[to_size(block)];
        if (at < 0 || noted_for[to_size(at)] == i) continue;
        noted_for[to_size(at)] = i;
        neighbours.push_back(at);
      }
    }
    std::sort(neighbours.begin(), neighbours.end());
    pattern.startVec(i);
    for (const int row : neighbours) pattern.insertBack(row, i) = 1.0;
  }
  pattern.finalize();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);

  for (int i = 0; i < free_count; ++i) block_at_.push_back(free[to_size(order.indices()[i])]);
  block_at_.insert(block_at_.end(), last.begin(), last.end());
  position_.resize(sizes_.size());
  at_.resize(sizes_.size());
  int unknowns = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t block = to_size(block_at_[to_size(i)]);
    position_[block] = i;
    at_[block] = unknowns;
    unknowns += sizes_[block];
  }
  diagonal_.setZero(unknowns);
}

// The rows of a column are those of the terms that begin with it, and of the columns that lead to
// it in the elimination tree.
void MultifrontalCholesky::find_fronts(const std::vector<std::vector<int>>& terms) {
  const int count = static_cast<int>(sizes_.size());
  std::vector<std::vector<int>> beginning(sizes_.size());  // positions of the blocks of terms
  for (const std::vector<int>& term : terms) {
    std::vector<int>& begins = beginning[to_size(first_of(term))];
    for (const int block : term) begins.push_back(position_[to_size(block)]);
  }
  std::vector<std::vector<int>> rows(sizes_.size());
  std::vector<std::vector<int>> children(sizes_.size());
  std::vector<int> noted_for(sizes_.size(), -1);
  front_of_.resize(sizes_.size());
  double zeros = 0.0;  // of the newest front
  for (int column = 0; column < count; ++column) {
    std::vector<int>& own = rows[to_size(column)];
    const auto note = [&](const std::vector<int>& positions) {
      for (const int position : positions) {
        if (position <= column || noted_for[to_size(position)] == column) continue;
        noted_for[to_size(position)] = column;
        own.push_back(position);
      }
    };
    note(beginning[to_size(column)]);
    int height = 0;
    for (const int child : children[to_size(column)]) {
      note(rows[to_size(child)]);
    }
    std::sort(own.begin(), own.end());
    if (!own.empty()) children[to_size(own.front())].push_back(column);
    for (const int position : own) height += size_at(position);

    const int size = size_at(column);
    if (!fronts_.empty() && !fronts_.back().others.empty() &&
        fronts_.back().others.front() == column && fronts_.back().end == column) {
      Front& front = fronts_.back();
      int before = 0;
      for (const int position : front.others) before += size_at(position);
      const double columns = static_cast<double>(front.columns);
      const double more = zeros + columns * (height + size - before);
      const double all = (columns + size) * (0.5 * (columns + size) + height);
      if (more <= kMostZeros * all || columns + size <= kFewColumns) {
        zeros = more;
        front.end = column + 1;
        front.columns += size;
        front.others = own;
        front_of_[to_size(column)] = fronts_.size() - 1;
        continue;
      }
    }
    zeros = 0.0;
    Front front;
    front.begin = column;
    front.end = column + 1;
    front.columns = size;
    front.others = own;
    front_of_[to_size(column)] = fronts_.size();
    fronts_.push_back(std::move(front));
  }
}

void MultifrontalCholesky::lay_out_fronts() {
  for (Front& front : fronts_) {
    front.at = at_[to_size(block_at_[to_size(front.begin)])];
    int row = static_cast<int>(front.columns);
    for (const int position : front.others) {
      front.offsets.push_back(row);
      const int at = at_[to_size(block_at_[to_size(position)])];
      for (int i = 0; i < size_at(position); ++i) front.other_rows.push_back(at + i);
      row += size_at(position);
    }
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    if (front.others.empty()) continue;
    Front& parent = fronts_[front_of_[to_size(front.others.front())]];
    parent.children.push_back(f);
    for (const int position : front.others) {
      const int row = row_in(parent, position);
      for (int i = 0; i < size_at(position); ++i) front.in_parent.push_back(row + i);
    }
  }
}

int MultifrontalCholesky::row_in(const Front& front, int position) const {
  if (position < front.end) return at_[to_size(block_at_[to_size(position)])] - front.at;
  const auto found = std::lower_bound(front.others.begin(), front.others.end(), position);
  return front.offsets[static_cast<std::size_t>(found - front.others.begin())];
}

int MultifrontalCholesky::first_of(const std::vector<int>& blocks) const {
  int first = static_cast<int>(sizes_.size());
  for (const int block : blocks) first = std::min(first, position_[to_size(block)]);
  return first;
}

void MultifrontalCholesky::clear() {
  terms_.clear();
  diagonal_.setZero();
  for (Front& front : fronts_) {
    front.terms.clear();
    front.is_current = false;
  }
}

void MultifrontalCholesky::add(std::vector<int> blocks, Eigen::MatrixXd values) {
  Eigen::Index row = 0;
  for (std::size_t a = 0; a < blocks.size(); ++a) {
    const int size = size_of(blocks[a]);
    diagonal_.segment(at(blocks[a]), size) += values.diagonal().segment(row, size);
    Eigen::Index column = 0;
    for (std::size_t b = 0; b < a; ++b) {
      const int columns = size_of(blocks[b]);
      if (blocks[a] == blocks[b]) {
        diagonal_.segment(at(blocks[a]), size) +=
            2.0 * values.block(row, column, size, columns).diagonal();
      }
      column += columns;
    }
    row += size;
  }
  const std::size_t front = front_of_[to_size(first_of(blocks))];
  fronts_[front].terms.push_back(terms_.size());
  fronts_[front].is_current = false;
  terms_.push_back({front, std::move(blocks), std::move(values)});
}

void MultifrontalCholesky::take_back(const Mark& mark) {
  while (terms_.size() > mark.terms) {
    Front& front = fronts_[terms_.back().front];
    front.terms.pop_back();
    front.is_current = false;
    terms_.pop_back();
  }
  diagonal_ = mark.diagonal;
}

bool MultifrontalCholesky::factorize(double damping) {
  const bool is_as_damped = damping == damping_;
  damping_ = damping;
  for (Front& front : fronts_) {
    if (!is_as_damped) front.is_current = false;
  }
  for (Front& front : fronts_) {
    if (front.is_current) continue;
    if (!front.others.empty()) {
      fronts_[front_of_[to_size(front.others.front())]].is_current = false;
    }
    assemble(&front);
    Eigen::Ref<Eigen::MatrixXd> own = front.root.topRows(front.columns);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(own);  // in place
    if (factor.info() != Eigen::Success) return false;
    front.is_current = true;
    if (front.others.empty()) continue;
    auto below = front.root.bottomRows(front.update.rows());
    own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
    front.update.selfadjointView<Eigen::Lower>().rankUpdate(below, -1.0);
  }
  return true;
}

// The sum of the terms and of what the children leave; of the rows that are not eliminated, in
// `update`.
void MultifrontalCholesky::assemble(Front* front) const {
  const Eigen::Index columns = front->columns;
  const Eigen::Index others = static_cast<Eigen::Index>(front->other_rows.size());
  front->root.setZero(columns + others, columns);
  front->update.setZero(others, others);
  if (damping_ > 0.0) {
    front->root.diagonal() = damping_ * diagonal_.segment(front->at, columns);
  }
  // From row 0 on of the column.
  const auto column_of = [&](Eigen::Index column) {
    return column < columns ? &front->root.coeffRef(0, column)
                            : &front->update.coeffRef(0, column - columns) - columns;
  };
  std::vector<int> rows;
  for (const std::size_t t : front->terms) {
    const Term& term = terms_[t];
    rows.clear();
    for (const int block : term.blocks) {
      const int row = row_in(*front, position_[to_size(block)]);
      for (int i = 0; i < size_of(block); ++i) rows.push_back(row + i);
    }
    for (std::size_t b = 0; b < rows.size(); ++b) {
      double* column = column_of(rows[b]);
      const double* values = &term.values.coeffRef(0, static_cast<Eigen::Index>(b));
      for (std::size_t a = 0; a < rows.size(); ++a) {
        if (rows[a] >= rows[b]) column[rows[a]] += values[a];
      }
    }
  }
  for (const std::size_t c : front->children) {
    const Front& child = fronts_[c];
    const std::vector<int>& places = child.in_parent;
    for (std::size_t b = 0; b < places.size(); ++b) {
      double* column = column_of(places[b]);
      const double* values = &child.update.coeffRef(0, static_cast<Eigen::Index>(b));
      for (std::size_t a = b; a < places.size(); ++a) column[places[a]] += values[a];
    }
  }
}

double MultifrontalCholesky::log_determinant() const {
  double sum = 0.0;
  for (const Front& front : fronts_) sum += front.root.diagonal().array().log().sum();
  return 2.0 * sum;
}

Eigen::MatrixXd MultifrontalCholesky::forward(Eigen::MatrixXd right) const {
  for (const Front& front : fronts_) {
    auto own = right.middleRows(front.at, front.columns);
    if ((own.array() == 0.0).all()) continue;
    front.root.topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(own);
    const Eigen::Index others = front.update.rows();
    const Eigen::MatrixXd passed_on = front.root.bottomRows(others) * own;
    for (Eigen::Index c = 0; c < right.cols(); ++c) {
      for (Eigen::Index i = 0; i < others; ++i) {
        right(front.other_rows[static_cast<std::size_t>(i)], c) -= passed_on(i, c);
      }
    }
  }
  return right;
}

Eigen::MatrixXd MultifrontalCholesky::backward(Eigen::MatrixXd right) const {
  Eigen::MatrixXd known;
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const Eigen::Index others = front->update.rows();
    known.resize(others, right.cols());
    for (Eigen::Index c = 0; c < right.cols(); ++c) {
      for (Eigen::Index i = 0; i < others; ++i) {
        known(i, c) = right(front->other_rows[static_cast<std::size_t>(i)], c);
      }
    }
    auto own = right.middleRows(front->at, front->columns);
    own.noalias() -= front->root.bottomRows(others).transpose() * known;
    front->root.topRows(front->columns)
        .triangularView<Eigen::Lower>()
        .transpose()
        .solveInPlace(own);
  }
  return right;
}

Eigen::MatrixXd MultifrontalCholesky::times_root(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(right.rows(), right.cols());
  Eigen::MatrixXd of_front;
  for (const Front& front : fronts_) {
    of_front.noalias() = front.root * right.middleRows(front.at, front.columns);
    product.middleRows(front.at, front.columns) += of_front.topRows(front.columns);
    for (Eigen::Index c = 0; c < right.cols(); ++c) {
      for (std::size_t i = 0; i < front.other_rows.size(); ++i) {
        product(front.other_rows[i], c) +=
            of_front(front.columns + static_cast<Eigen::Index>(i), c);
      }
    }
  }
  return product;
}

// (L⁻¹·E)ᵀ·(L⁻¹·E), E the columns of the identity: all rows but those of the ancestors are zero.
Eigen::MatrixXd MultifrontalCholesky::covariance_of(const std::vector<int>& blocks) const {
  Eigen::Index columns = 0;
  for (const int block : blocks) columns += size_of(block);
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(size(), columns);
  columns = 0;
  for (const int block : blocks) {
    for (int i = 0; i < size_of(block); ++i) units(at(block) + i, columns++) = 1.0;
  }
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(columns, columns);
  const Eigen::MatrixXd half = forward(std::move(units));
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(half.transpose());
  return covariance.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd MultifrontalCholesky::trailing_root(int first) const {
  const Eigen::Index count = size() - first;
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(count, count);
  for (const Front& front : fronts_) {
    for (Eigen::Index c = std::max<Eigen::Index>(0, first - front.at); c < front.columns; ++c) {
      const Eigen::Index column = front.at + c - first;
      root.col(column).segment(column, front.columns - c) =
          front.root.col(c).segment(c, front.columns - c);
      for (std::size_t i = 0; i < front.other_rows.size(); ++i) {
        root(front.other_rows[i] - first, column) =
            front.root(front.columns + static_cast<Eigen::Index>(i), c);
      }
    }
  }
  return root;
}

}  // namespace pf_resampling
