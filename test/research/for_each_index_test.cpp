#include "research/studies/for_each_index.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

TEST(ForEachIndex, CallsEachOnceAndCountsThem) {
  for (const int jobs : {1, 3, 100}) {
    std::vector<std::atomic<int>> calls(20);
    std::vector<std::uint64_t> progress;
    for_each_index(
        calls.size(), jobs, [&](std::size_t i) { ++calls[i]; },
        [&](std::uint64_t done) { progress.push_back(done); });
    for (const auto& count : calls) EXPECT_EQ(count, 1);
    ASSERT_EQ(progress.size(), calls.size());
    for (std::size_t i = 0; i < progress.size(); ++i) EXPECT_EQ(progress[i], i + 1);
  }
}

TEST(ForEachIndex, RethrowsAndEnds) {
  std::atomic<int> calls = 0;
  const auto work = [&](std::size_t) {
    ++calls;
    throw std::runtime_error("a trial that failed");
  };
  EXPECT_THROW(for_each_index(1000, 3, work, [](std::uint64_t) {}), std::runtime_error);
  EXPECT_LE(calls, 3);
}

TEST(ForEachIndex, SaysThatTheSystemStartsFewer) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need all of the address space";
#endif
  const auto start = [] {
    const rlimit room = {rlim_t{1} << 30, rlim_t{1} << 30};
    setrlimit(RLIMIT_AS, &room);
    try {
      for_each_index(
          1000000, 5000, [](std::size_t) {}, [](std::uint64_t) {});
    } catch (const Error& error) {
      std::fputs(error.what(), stderr);
      std::_Exit(0);
    }
    std::_Exit(1);
  };
  EXPECT_EXIT(start(), testing::ExitedWithCode(0), "does not start 5000 jobs at a time");
}

}  // namespace
}  // namespace pf_resampling
