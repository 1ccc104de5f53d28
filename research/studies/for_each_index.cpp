#include "research/studies/for_each_index.hpp"

#include <atomic>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

void for_each_index(std::size_t count, int jobs, const std::function<void(std::size_t)>& work,
                    const std::function<void(std::uint64_t)>& progress) {
  std::atomic<std::size_t> next = 0;
  std::uint64_t done = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  const auto take_and_work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
        const std::lock_guard<std::mutex> lock(mutex);
        progress(++done);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> threads;
  try {
    for (int job = 1; job < jobs && threads.size() + 1 < count; ++job) {
      threads.emplace_back(take_and_work);
    }
  } catch (const std::exception& exception) {
    // Those that have begun end first: a thread that is not joined would end the process.
    const std::lock_guard<std::mutex> lock(mutex);
    next = count;
    failure =
        std::make_exception_ptr(Error("the system does not start " + std::to_string(jobs) +
                                      " jobs at a time (" + exception.what() + "): give fewer"));
  }
  take_and_work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace pf_resampling
