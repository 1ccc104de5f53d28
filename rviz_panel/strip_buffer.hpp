#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace pf_resampling {

/// A quantity over the last minute, for drawing: as many values as come, in memory that does not
/// grow. Time is divided into columns that keep the smallest, the largest and the mean of the
/// values that fall into them.
class StripBuffer {
 public:
  struct Column {
    double age;  ///< s, of the column's middle, before the newest value
    double low, high, mean;
    bool follows;  ///< values came steadily since the column before: a line may join the two
  };

  /// `length` (s) of time in `columns` columns. Values further apart than `largest_gap` (s) are not
  /// joined.
  explicit StripBuffer(double length = 60.0, std::size_t columns = 300, double largest_gap = 3.0);

  /// A value at time `stamp` (s). Time that jumps back starts anew; values that are not finite are
  /// passed over.
  void add(double stamp, double value);
  void clear();

  double length() const { return length_; }
  bool empty() const { return !newest_; }
  /// The value added last.
  std::optional<double> latest() const { return newest_; }
  /// The columns with values, oldest first.
  std::vector<Column> columns() const;

 private:
  struct Bin {
    long index = -1;  // of time since zero, in columns; -1: empty
    double low = 0.0, high = 0.0, sum = 0.0;
    std::size_t count = 0;
    bool follows = false;
  };

  double length_, width_, largest_gap_;
  std::vector<Bin> bins_;  // a ring: column i is bins_[i modulo size]
  std::optional<double> newest_;
  double newest_stamp_ = 0.0;
  long newest_index_ = 0;
};

}  // namespace pf_resampling
