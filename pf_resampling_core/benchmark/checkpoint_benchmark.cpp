#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

/// What a filter's part of a checkpoint costs, which is nearly all of it: the copy of the
/// population, for which updates wait, and the writing of it, to the disk of the working directory,
/// which a thread does; and the reading.
namespace pf_resampling {
namespace {

std::string file() {
  return std::filesystem::current_path() / "benchmark.checkpoint";
}

template <typename Saved>
void write(const Saved& saved) {
  write_saved(kCheckpointFile, file(), saved);
}

BeaconMcl localization(int particles) {
  BeaconMclOptions options;
  options.particles = particles;
  options.yaw_rate_bias.estimate = true;
  const std::vector<Beacon> beacons = {
      {1, {0.0, 0.0, 0.0}, true}, {2, {20.0, 0.0, 0.0}, true}, {3, {9.0, 15.0, 0.0}, true}};
  BeaconMcl filter(options, beacons, 1);
  filter.initialize_gaussian({5.0, 5.0, 0.3}, 0.1 * Eigen::Matrix3d::Identity());
  for (const Beacon& beacon : beacons) {
    const double range = std::hypot(beacon.position.x() - 5.0, beacon.position.y() - 5.0);
    OdometryIncrement odometry;
    append(options.odometry, {0.1, 0.0, 0.01}, 0.1, &odometry);
    filter.update(odometry, {{beacon.id, range, 0.0, Eigen::Vector3d::Zero()}});
  }
  return filter;
}

FastSlam mapping(int particles, int landmarks) {
  FastSlamOptions options;
  options.particles = particles;
  FastSlam filter(options, 1);
  std::vector<RangeBearingObservation> scan;
  for (int k = 0; k < landmarks; ++k) {
    scan.push_back({k, 2.0 + 0.1 * k, 3.0 * std::sin(2.4 * k), 0.0, 0.0});
  }
  for (int i = 0; i < 3; ++i) {
    OdometryIncrement odometry;
    append(options.odometry, {0.01, 0.0, 0.001}, 0.1, &odometry);
    filter.update(odometry, scan);
  }
  return filter;
}

void report_size(benchmark::State& state) {
  state.counters["MB"] = 1e-6 * static_cast<double>(std::filesystem::file_size(file()));
  std::filesystem::remove(file());
}

void copy_beacon_mcl(benchmark::State& state) {
  const BeaconMcl filter = localization(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(filter.saved());
}
BENCHMARK(copy_beacon_mcl)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

void write_beacon_mcl(benchmark::State& state) {
  const SavedBeaconMcl saved = localization(static_cast<int>(state.range(0))).saved();
  for (auto _ : state) write(saved);
  report_size(state);
}
BENCHMARK(write_beacon_mcl)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond)->UseRealTime();

void read_beacon_mcl(benchmark::State& state) {
  write(localization(static_cast<int>(state.range(0))).saved());
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_saved<SavedBeaconMcl>(kCheckpointFile, file()));
  }
  report_size(state);
}
BENCHMARK(read_beacon_mcl)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

void copy_fastslam(benchmark::State& state) {
  FastSlam filter = mapping(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(saved_map(&filter, static_cast<int>(state.range(0))));
  }
}
BENCHMARK(copy_fastslam)
    ->Args({1000, 15})
    ->Args({1000, 100})
    ->Args({10000, 15})
    ->Unit(benchmark::kMillisecond);

void write_fastslam(benchmark::State& state) {
  FastSlam filter = mapping(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const SavedMap saved = saved_map(&filter, static_cast<int>(state.range(0)));
  for (auto _ : state) write(saved);
  report_size(state);
}
BENCHMARK(write_fastslam)
    ->Args({1000, 15})
    ->Args({1000, 100})
    ->Args({10000, 15})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void read_fastslam(benchmark::State& state) {
  FastSlam filter = mapping(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  write(saved_map(&filter, static_cast<int>(state.range(0))));
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_saved<SavedMap>(kCheckpointFile, file()));
  }
  report_size(state);
}
BENCHMARK(read_fastslam)
    ->Args({1000, 15})
    ->Args({1000, 100})
    ->Args({10000, 15})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pf_resampling

BENCHMARK_MAIN();
