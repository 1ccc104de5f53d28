#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace pf_resampling {

/// A queue in one piece of memory, so that an element by number is one access.
template <typename T>
class Ring {
 public:
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return items_[(front_ + i) & (items_.size() - 1)]; }
  const T& operator[](std::size_t i) const { return items_[(front_ + i) & (items_.size() - 1)]; }
  T& front() { return items_[front_]; }

  void push_back(T item) {
    if (size_ == items_.size()) grow();
    (*this)[size_++] = std::move(item);
  }

  void pop_front() {
    front() = T{};
    front_ = (front_ + 1) & (items_.size() - 1);
    --size_;
  }

 private:
  void grow() {
    std::vector<T> larger(items_.empty() ? 8 : 2 * items_.size());  // a power of two
    for (std::size_t i = 0; i < size_; ++i) larger[i] = std::move((*this)[i]);
    items_ = std::move(larger);
    front_ = 0;
  }

  std::vector<T> items_;
  std::size_t front_ = 0;
  std::size_t size_ = 0;
};

}  // namespace pf_resampling
