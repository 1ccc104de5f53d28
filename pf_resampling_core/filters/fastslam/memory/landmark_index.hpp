#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace pf_resampling {

/// Where the landmarks are, so that those near a place are found without looking at all: square
/// cells in a hash map.
class LandmarkIndex {
 public:
  /// `cell`: side of a cell, m.
  explicit LandmarkIndex(double cell = 4.0) : cell_(cell) {}

  void clear();
  /// Puts `row` at a place, or moves it there.
  void place(int row, const Eigen::Vector2d& position);
  void remove(int row);

  /// Appends the rows within `radius` of `position`, in ascending order.
  void near(const Eigen::Vector2d& position, double radius, std::vector<int>* rows) const;

  const Eigen::Vector2d& position(int row) const {
    return positions_[static_cast<std::size_t>(row)];
  }

 private:
  std::int64_t cell_of(const Eigen::Vector2d& position) const;

  double cell_;
  std::unordered_map<std::int64_t, std::vector<int>> cells_;
  std::vector<Eigen::Vector2d> positions_;  // by row
  std::vector<std::uint8_t> placed_;        // by row
};

}  // namespace pf_resampling
