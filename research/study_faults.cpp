// What filters do, and say, when something goes wrong; `study faults` is this program.
#include <algorithm>
#include <cstdio>
#include <thread>

#include "research/studies/fault_study.hpp"
#include "research/studies/report.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/progress_bar.hpp"

namespace pf_resampling {
namespace {

/// What every study can be told.
void add_study_options(CommandLine* line, int seeds) {
  line->option<int>("seeds", "N", seeds, "runs per configuration, with seeds 1 to N");
  line->option<int>("jobs", "N", "runs at a time (default: the number of processors)");
  line->option<std::string>("json", "FILE",
                            "write all figures, of every run and of the table, as JSON");
  line->option<std::string>("csv", "FILE", "write a row of figures for every run");
  for (const char* name : {"bag", "world"}) line->reads(name);
  for (const char* name : {"json", "csv"}) line->writes(name);
}

int jobs_of(const CommandLine& line) {
  const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  return line.has("jobs") ? line.get<int>("jobs") : static_cast<int>(processors);
}

void write(const CommandLine& line, const StudyReport& report) {
  std::printf("%s", to_text(report).c_str());
  if (line.has("json")) write_file(line.text("json"), to_json_text(report));
  if (line.has("csv")) write_file(line.text("csv"), to_csv(report));
}

std::string file_name(const std::string& path) {
  return path.substr(path.find_last_of('/') + 1);
}

int study_faults(const std::vector<std::string>& arguments) {
  CommandLine line("study faults",
                   "What a filter does and reports when something goes wrong: each fault is "
                   "injected into the\nrecording by itself.");
  line.positional("bag", "a recording with ground truth and beacon ranges, or landmarks");
  line.option<double>("share", "SHARE", 0.4, "share of the drive before the fault");
  line.option<std::string>("fault", "WORDS", "",
                           "only faults whose name contains this, besides no fault and kidnapping");
  add_study_options(&line, 20);
  add_filter_options(&line);
  line.example("study faults plaza2.bag --csv faults.csv");
  line.example("study faults plaza2.bag --fault 'an hour ahead' --seeds 3");
  if (!line.parse(arguments)) return 0;
  const auto path = line.text("bag");
  const RecordedDrive drive = naming(path, [&] { return read_drive(path); });
  FaultStudyOptions options;
  if (drive.beacons.empty()) {
    apply_filter_options(line, &options.fastslam);
  } else {
    apply_filter_options(line, &options.beacon_mcl);
  }
  options.share = line.get<double>("share");
  options.only = line.text("fault");
  options.seeds = line.get<int>("seeds");
  options.jobs = jobs_of(line);
  ProgressBar bar("study", 30 * static_cast<std::uint64_t>(std::max(0, options.seeds)));
  const FaultStudy result = naming(path, [&] {
    return run_fault_study(file_name(path), drive, options,
                           [&](std::uint64_t done) { bar.update(done); });
  });
  write(line, report_of(result));
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("study", argc, argv, pf_resampling::study_faults);
}
