#include "pf_resampling_core/parallel/worker_pool.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr int kPatience = 1000;  // yields of the processor, less than a millisecond

}  // namespace

WorkerPool::WorkerPool(int threads) {
  if (threads < 1 || threads > 1024) {
    throw Error("threads is " + std::to_string(threads) + ", has to be in [1, 1024]");
  }
  try {
    for (int i = 1; i < threads; ++i) {
      workers_.emplace_back([this, i] { work(static_cast<std::size_t>(i)); });
    }
  } catch (const std::exception& exception) {
    // A thread that is not joined would end the process.
    const std::size_t started = workers_.size() + 1;
    end_workers();
    throw Error("threads is " + std::to_string(threads) + ", but the system starts only " +
                std::to_string(started) + " (" + exception.what() + "): set it to fewer");
  }
}

WorkerPool::~WorkerPool() {
  end_workers();
}

void WorkerPool::end_workers() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::for_each_block(std::int64_t count, const Body& body, std::int64_t worth_sharing) {
  // Nobody to share with, or not worth it: waking threads would cost more than the work.
  if (workers_.empty() || count <= std::max(worth_sharing, kBlockSize)) {
    for (std::int64_t begin = 0; begin < count; begin += kBlockSize) {
      body(begin, std::min(count, begin + kBlockSize));
    }
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    body_ = &body;
    shares_.clear();
    const std::int64_t blocks = (count + kBlockSize - 1) / kBlockSize;
    for (std::int64_t i = 0; i < threads(); ++i) {
      shares_.push_back({i * blocks / threads() * kBlockSize,
                         std::min(count, (i + 1) * blocks / threads() * kBlockSize)});
    }
    ++generation_;
  }
  wake_.notify_all();
  run_blocks(0);
  // Not for workers that have not woken up yet: there is nothing left for them.
  while (running_ > 0) std::this_thread::yield();
}

void WorkerPool::work(std::size_t own_share) {
  std::uint64_t seen = 0;
  for (;;) {
    // The next round mostly follows at once, and waking from sleep takes as long as many blocks.
    for (int i = 0; i < kPatience && generation_ == seen; ++i) std::this_thread::yield();
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
    }
    run_blocks(own_share);
  }
}

// Those of its own share, then what is left of the others'.
void WorkerPool::run_blocks(std::size_t own_share) {
  std::unique_lock<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    Share& share = shares_[(own_share + i) % shares_.size()];
    while (share.next < share.end) {
      const Body& body = *body_;
      const std::int64_t begin = share.next;
      const std::int64_t end = std::min(share.end, begin + kBlockSize);
      share.next = end;
      ++running_;
      lock.unlock();
      body(begin, end);
      lock.lock();
      --running_;
    }
  }
}

}  // namespace pf_resampling
