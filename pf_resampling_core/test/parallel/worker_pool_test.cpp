#include "pf_resampling_core/parallel/worker_pool.hpp"

#include <gtest/gtest.h>

#include <sys/resource.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

constexpr std::int64_t kBlock = WorkerPool::kBlockSize;

TEST(WorkerPool, DoesEveryElementOnceWhateverTheNumberOfThreads) {
  for (int threads = 1; threads <= 5; ++threads) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (const std::int64_t count : {std::int64_t{0}, std::int64_t{1}, kBlock - 1, kBlock,
                                     kBlock + 1, 2 * kBlock, 17 * kBlock + 5}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, " << count << " elements");
      std::vector<int> visits(static_cast<std::size_t>(count), 0);
      pool.for_each_block(count, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) ++visits[static_cast<std::size_t>(i)];
      });
      EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), count);
    }
  }
}

// What a block computes must not depend on the number of threads: so blocks are the same.
TEST(WorkerPool, BlocksAreTheSameForAnyNumberOfThreads) {
  const std::int64_t count = 9 * kBlock + 100;
  std::set<std::pair<std::int64_t, std::int64_t>> expected;
  for (std::int64_t begin = 0; begin < count; begin += kBlock) {
    expected.insert({begin, std::min(count, begin + kBlock)});
  }
  for (int threads = 1; threads <= 4; ++threads) {
    WorkerPool pool(threads);
    std::mutex mutex;
    std::multiset<std::pair<std::int64_t, std::int64_t>> blocks;
    pool.for_each_block(count, [&](std::int64_t begin, std::int64_t end) {
      const std::lock_guard<std::mutex> lock(mutex);
      blocks.insert({begin, end});
    });
    EXPECT_EQ(blocks.size(), expected.size());
    EXPECT_EQ((std::set<std::pair<std::int64_t, std::int64_t>>(blocks.begin(), blocks.end())),
              expected);
  }
}

// Round after round with a body of its own each: a worker that comes late to one must not work on
// the next with the old body, nor do a block twice.
TEST(WorkerPool, ManyRoundsFollowEachOther) {
  WorkerPool pool(3);
  for (std::int64_t round = 0; round < 3000; ++round) {
    std::atomic<std::int64_t> sum{0};
    const std::int64_t count = (1 + round % 5) * kBlock + round % 7;
    pool.for_each_block(count, [&sum, round](std::int64_t begin, std::int64_t end) {
      sum += (end - begin) * (round + 1);
    });
    ASSERT_EQ(sum.load(), count * (round + 1)) << "round " << round;
  }
}

TEST(WorkerPool, RefusesAnImpossibleNumberOfThreads) {
  for (const int threads : {0, -1, 1025}) {
    const std::string said = refusal([&] { WorkerPool pool(threads); });
    EXPECT_TRUE(says(said, "threads is " + std::to_string(threads)));
    EXPECT_TRUE(says(said, "[1, 1024]"));
  }
}

// A process of its own has room for some of the stacks only. A thread left running would abort it.
TEST(WorkerPool, SaysThatTheSystemStartsFewer) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need all of the address space";
#endif
  const auto start = [] {
    const rlimit room = {rlim_t{1} << 30, rlim_t{1} << 30};
    setrlimit(RLIMIT_AS, &room);
    try {
      const WorkerPool pool(1024);
    } catch (const Error& error) {
      std::fputs(error.what(), stderr);
      std::_Exit(0);
    }
    std::_Exit(1);
  };
  EXPECT_EXIT(start(), testing::ExitedWithCode(0), "threads is 1024, but the system starts only");
}

}  // namespace
}  // namespace pf_resampling
