#include "pf_resampling_core/parallel/worker_pool.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

WorkerPool::WorkerPool(int threads) {
  if (threads < 1 || threads > 1024) {
    throw Error("threads is " + std::to_string(threads) + ", has to be in [1, 1024]");
  }
  try {
    for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
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

void WorkerPool::for_each_block(std::int64_t count,
                                const std::function<void(std::int64_t, std::int64_t)>& body) {
  // One block, or nobody to share with: waking threads would cost more than the work.
  if (workers_.empty() || count <= kBlockSize) {
    for (std::int64_t begin = 0; begin < count; begin += kBlockSize) {
      body(begin, std::min(count, begin + kBlockSize));
    }
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    body_ = &body;
    count_ = count;
    next_ = 0;
    busy_ = static_cast<int>(workers_.size());
    ++generation_;
  }
  wake_.notify_all();
  run_blocks();
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
  body_ = nullptr;
}

void WorkerPool::work() {
  std::uint64_t seen = 0;
  for (;;) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
    }
    run_blocks();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      --busy_;
    }
    done_.notify_one();
  }
}

void WorkerPool::run_blocks() {
  for (;;) {
    std::int64_t begin = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (next_ >= count_) return;
      begin = next_;
      next_ += kBlockSize;
    }
    (*body_)(begin, std::min(count_, begin + kBlockSize));
  }
}

}  // namespace pf_resampling
