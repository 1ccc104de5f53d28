#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

// Which column or line of cells a coordinate is in, in units of cells. What is farther out than
// integers reach, where only nonsense is, is in the outermost: it is still found, by its distance.
std::int64_t number_of(double coordinate) {
  constexpr double kOutermost = 1e9;
  const double number = std::floor(coordinate);
  if (!(number > -kOutermost)) return -static_cast<std::int64_t>(kOutermost);
  return static_cast<std::int64_t>(std::min(number, kOutermost));
}

std::int64_t key(std::int64_t column, std::int64_t row) {
  return static_cast<std::int64_t>((static_cast<std::uint64_t>(column) << 32) ^
                                   (static_cast<std::uint64_t>(row) & 0xffffffffu));
}

}  // namespace

void LandmarkIndex::clear() {
  cells_.clear();
  positions_.clear();
  placed_.clear();
}

std::int64_t LandmarkIndex::cell_of(const Eigen::Vector2d& position) const {
  return key(number_of(position.x() / cell_), number_of(position.y() / cell_));
}

void LandmarkIndex::place(int row, const Eigen::Vector2d& position) {
  const std::size_t index = static_cast<std::size_t>(row);
  if (index >= positions_.size()) {
    positions_.resize(index + 1, Eigen::Vector2d::Zero());
    placed_.resize(index + 1, 0);
  }
  const std::int64_t cell = cell_of(position);
  if (placed_[index] != 0 && cell_of(positions_[index]) == cell) {
    positions_[index] = position;
    return;
  }
  remove(row);
  positions_[index] = position;
  placed_[index] = 1;
  cells_[cell].push_back(row);
}

void LandmarkIndex::remove(int row) {
  const std::size_t index = static_cast<std::size_t>(row);
  if (index >= placed_.size() || placed_[index] == 0) return;
  const std::int64_t cell = cell_of(positions_[index]);
  std::vector<int>& rows = cells_.at(cell);
  rows.erase(std::find(rows.begin(), rows.end(), row));
  if (rows.empty()) cells_.erase(cell);
  placed_[index] = 0;
}

void LandmarkIndex::near(const Eigen::Vector2d& position, double radius,
                         std::vector<int>* rows) const {
  const std::size_t before = rows->size();
  const auto column_of = [&](double value) { return number_of(value / cell_); };
  const auto take_from = [&](const std::vector<int>& cell) {
    for (const int row : cell) {
      if ((positions_[static_cast<std::size_t>(row)] - position).squaredNorm() <= radius * radius) {
        rows->push_back(row);
      }
    }
  };
  // A robot that is lost looks everywhere: through all landmarks then, not through all cells.
  const double cells_wide = 2.0 * radius / cell_ + 1.0;
  if (!(cells_wide * cells_wide < static_cast<double>(cells_.size()) + 16.0)) {
    for (const auto& cell : cells_) take_from(cell.second);
  } else {
    for (std::int64_t column = column_of(position.x() - radius);
         column <= column_of(position.x() + radius); ++column) {
      for (std::int64_t line = column_of(position.y() - radius);
           line <= column_of(position.y() + radius); ++line) {
        const auto found = cells_.find(key(column, line));
        if (found != cells_.end()) take_from(found->second);
      }
    }
  }
  // The order must not depend on that of the hash map or of past moves.
  std::sort(rows->begin() + static_cast<std::ptrdiff_t>(before), rows->end());
}

}  // namespace pf_resampling
