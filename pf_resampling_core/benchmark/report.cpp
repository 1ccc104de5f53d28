#include "pf_resampling_core/benchmark/report.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <vector>

namespace pf_resampling {
namespace {

struct Measurement {
  std::string section;
  std::string row;
  std::string contender;
  int particles;
  bool with_threads;
};

// In order of registration; the benchmark's name is the index.
std::vector<Measurement>& measurements() {
  static std::vector<Measurement> all;
  return all;
}

std::string name_of(const Measurement& measurement) {
  return measurement.section + "/" + measurement.row + "/" + measurement.contender + "/" +
         std::to_string(measurement.particles);
}

bool with_threads(const std::string& name) {
  for (const Measurement& item : measurements()) {
    if (name_of(item) == name) return item.with_threads;
  }
  return false;
}

std::string first_line_with(const char* file, const std::string& key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, key.size(), key) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

std::string in_short(int particles) {
  std::string text = std::to_string(particles);
  int zeros = 0;
  while (text.size() > 1 && text.back() == '0') {
    text.pop_back();
    ++zeros;
  }
  return zeros > 0 ? text + "e" + std::to_string(zeros) : text;
}

// Collects; the table is printed at the end.
class TableReporter : public benchmark::BenchmarkReporter {
 public:
  TableReporter(std::string title, TableUnit unit)
      : title_(std::move(title)), unit_(std::move(unit)) {}

  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      const std::string& name = run.run_name.function_name;
      // In seconds, for all iterations.
      const double time = with_threads(name) ? run.real_accumulated_time : run.cpu_accumulated_time;
      times_[name].push_back(1e9 * time / static_cast<double>(run.iterations));
    }
    std::fprintf(stderr, ".");
  }

  void Finalize() override {
    std::fprintf(stderr, "\n");
    std::printf("%s\n", title_.c_str());
    std::printf("%s, median of the repetitions; (how many times ours)%s\n", unit_.text.c_str(),
                unit_.with_growth ? " [how many times the first column]" : "");
    std::printf("on %s, compiled by g++ %s\n",
                first_line_with("/proc/cpuinfo", "model name").c_str(), __VERSION__);
    std::ifstream load("/proc/loadavg");
    std::string load_average;
    load >> load_average;
    std::printf("load average at the end %s\n", load_average.c_str());
    std::set<int> sizes;
    for (const Measurement& item : measurements()) {
      if (times_.count(name_of(item)) > 0) sizes.insert(item.particles);
    }
    std::string section;
    std::set<std::string> printed;
    for (const Measurement& item : measurements()) {
      if (times_.count(name_of(item)) == 0) continue;
      if (!printed.insert(item.section + item.row + item.contender).second) continue;
      if (item.section != section) {
        section = item.section;
        std::printf("\n%-28s %-22s", section.c_str(), "");
        for (const int size : sizes) std::printf("%18s", in_short(size).c_str());
        std::printf("\n");
      }
      std::printf("  %-26s %-22s", item.row.c_str(), item.contender.c_str());
      for (const int size : sizes) {
        Measurement cell = item;
        cell.particles = size;
        const double time = median(cell);
        cell.contender = "ours";
        const double ours = median(cell);
        char text[40] = "-";
        if (time > 0.0 && ours > 0.0 && item.contender != "ours") {
          std::snprintf(text, sizeof text, "%.2f (%5.1f)", time, time / ours);
        } else if (time > 0.0 && unit_.with_growth) {
          cell.particles = *sizes.begin();
          std::snprintf(text, sizeof text, "%.2f [%5.2f]", time, time / median(cell));
        } else if (time > 0.0) {
          std::snprintf(text, sizeof text, "%.2f        ", time);
        }
        std::printf("%18s", text);
      }
      std::printf("\n");
    }
  }

 private:
  // In the table's unit; 0 where there is none.
  double median(const Measurement& item) const {
    const auto found = times_.find(name_of(item));
    if (found == times_.end()) return 0.0;
    std::vector<double> times = found->second;
    std::sort(times.begin(), times.end());
    const double time = times[times.size() / 2] / unit_.nanoseconds;
    return unit_.per_particle ? time / item.particles : time;
  }

  std::string title_;
  TableUnit unit_;
  std::map<std::string, std::vector<double>> times_;
};

}  // namespace

void measure(const std::string& section, const std::string& row, const std::string& contender,
             int particles, const std::function<void()>& run, bool with_threads,
             const std::function<void()>& prepare) {
  measurements().push_back({section, row, contender, particles, with_threads});
  benchmark::RegisterBenchmark(name_of(measurements().back()).c_str(),
                               [run, prepare](benchmark::State& state) {
                                 if (prepare) prepare();
                                 for (auto _ : state) {
                                   static_cast<void>(_);
                                   run();
                                   benchmark::ClobberMemory();
                                 }
                               });
}

int run_and_report(int argc, char** argv, const std::string& title, const TableUnit& unit) {
  // Defaults first, so that the user's options win.
  std::string repetitions = "--benchmark_repetitions=7";
  std::string least_time = "--benchmark_min_time=0.02";
  std::vector<char*> arguments = {argv[0], &repetitions[0], &least_time[0]};
  arguments.insert(arguments.end(), argv + 1, argv + argc);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  TableReporter reporter(title, unit);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}

}  // namespace pf_resampling
