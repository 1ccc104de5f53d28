#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace pf_resampling {

/// Runs a loop over particles on several threads. The loop is cut into blocks of fixed size
/// whatever the number of threads, so what a block computes does not depend on it.
class WorkerPool {
 public:
  static constexpr std::int64_t kBlockSize = 2048;

  /// `threads` >= 1, the calling thread included. Throws Error if the system does not start as
  /// many.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// body(begin, end) for every block of [0, count); returns when all are done. `body` must not
  /// throw.
  void for_each_block(std::int64_t count,
                      const std::function<void(std::int64_t, std::int64_t)>& body);

 private:
  void end_workers();
  void work();
  void run_blocks();

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable done_;
  const std::function<void(std::int64_t, std::int64_t)>* body_ = nullptr;
  std::int64_t count_ = 0;
  std::int64_t next_ = 0;
  int busy_ = 0;
  std::uint64_t generation_ = 0;
  bool stop_ = false;
};

}  // namespace pf_resampling
