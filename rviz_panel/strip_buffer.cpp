#include "rviz_panel/strip_buffer.hpp"

#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

// Messages in slightly wrong order are not a jump of time.
constexpr double kJumpBack = 1.0;  // s

}  // namespace

StripBuffer::StripBuffer(double length, std::size_t columns, double largest_gap)
    : length_(length),
      width_(length / static_cast<double>(columns)),
      largest_gap_(largest_gap),
      bins_(columns) {}

void StripBuffer::add(double stamp, double value) {
  if (!std::isfinite(stamp) || !std::isfinite(value) || stamp < 0.0) return;
  if (newest_ && stamp < newest_stamp_ - kJumpBack) clear();
  stamp = newest_ ? std::max(stamp, newest_stamp_) : stamp;
  const long index = std::lround(std::floor(stamp / width_));
  Bin& bin = bins_[static_cast<std::size_t>(index) % bins_.size()];
  if (bin.index != index) {
    bin = {index, value, value, 0.0, 0, newest_ && stamp - newest_stamp_ <= largest_gap_};
  }
  bin.low = std::min(bin.low, value);
  bin.high = std::max(bin.high, value);
  bin.sum += value;
  ++bin.count;
  newest_ = value;
  newest_stamp_ = stamp;
  newest_index_ = index;
}

void StripBuffer::clear() {
  std::fill(bins_.begin(), bins_.end(), Bin{});
  newest_.reset();
}

std::vector<StripBuffer::Column> StripBuffer::columns() const {
  std::vector<Column> columns;
  if (!newest_) return columns;
  const long size = static_cast<long>(bins_.size());
  for (long index = std::max(0L, newest_index_ - size + 1); index <= newest_index_; ++index) {
    const Bin& bin = bins_[static_cast<std::size_t>(index) % bins_.size()];
    if (bin.index != index) continue;
    const double middle = (static_cast<double>(index) + 0.5) * width_;
    columns.push_back({std::max(0.0, newest_stamp_ - middle), bin.low, bin.high,
                       bin.sum / static_cast<double>(bin.count), bin.follows && !columns.empty()});
  }
  return columns;
}

}  // namespace pf_resampling
