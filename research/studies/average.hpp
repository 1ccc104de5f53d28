#pragma once

namespace pf_resampling {

/// A mean that values are added to.
class Average {
 public:
  void add(double value) {
    sum_ += value;
    ++count_;
  }
  /// 0 of no values.
  double value() const { return count_ > 0 ? sum_ / count_ : 0.0; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

}  // namespace pf_resampling
