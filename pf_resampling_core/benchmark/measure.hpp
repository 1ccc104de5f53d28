#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>

namespace pf_resampling {

/// Registers one measurement by the name section/row/contender/size: `run` does it once. The
/// processor's time is taken, which other programs on the machine disturb least; `with_threads`
/// takes the wall's. `prepare` is called before each repetition and not measured.
inline void measure(const std::string& section, const std::string& row,
                    const std::string& contender, int size, const std::function<void()>& run,
                    bool with_threads = false, const std::function<void()>& prepare = {}) {
  const std::string name = section + "/" + row + "/" + contender + "/" + std::to_string(size);
  auto* registered = benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    if (prepare) prepare();
    for (auto _ : state) {
      static_cast<void>(_);
      run();
      benchmark::ClobberMemory();
    }
  });
  registered->Unit(benchmark::kMicrosecond);
  if (with_threads) registered->UseRealTime();
}

/// Runs what is registered, by Google Benchmark's options. Returns the exit code for main.
inline int run_all(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace pf_resampling
