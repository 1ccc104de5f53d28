#pragma once

#include <atomic>
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

  using Body = std::function<void(std::int64_t begin, std::int64_t end)>;

  /// body(begin, end) for every block of [0, count); returns when all are done. `body` must not
  /// throw. `worth_sharing`: up to so many elements take less time than waking threads does.
  void for_each_block(std::int64_t count, const Body& body,
                      std::int64_t worth_sharing = kBlockSize);
  /// Of what takes a few nanoseconds an element.
  static constexpr std::int64_t kManyCheapElements = 32768;

 private:
  void end_workers();
  // What a thread begins with: the same particles in every round, which are in its core's cache.
  struct Share {
    std::int64_t next;
    std::int64_t end;
  };

  void work(std::size_t own_share);
  void run_blocks(std::size_t own_share);

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable wake_;
  const Body* body_ = nullptr;
  std::vector<Share> shares_;
  std::atomic<int> running_{0};  // blocks that were begun and are not done
  std::atomic<std::uint64_t> generation_{0};
  bool stop_ = false;
};

}  // namespace pf_resampling
