// What filters do, and say, when something goes wrong, as JSON; `study faults` makes tables of it.
#include <cstdio>
#include <string>
#include <vector>

#include "research/studies/fault_study.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/filter_options.hpp"

namespace pf_resampling {
namespace {

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
  line.option<int>("seeds", "N", 20, "runs per fault, with seeds 1 to N");
  line.option<int>("seed", "N", "this seed alone, as JSON: what `study` makes tables of");
  line.option<int>("jobs", "N", "runs at a time (default: the number of processors)");
  line.option<std::string>("json", "FILE",
                           "write all figures, of every run and of the table, as JSON");
  line.reads("bag");
  line.writes("json");
  add_filter_options(&line);
  line.example("study faults plaza2.bag --json faults.json");
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
  for (const char* name : {"seeds", "jobs"}) {
    if (line.has(name) && line.get<int>(name) < 1) {
      throw Error(std::string("--") + name + " has to be at least 1");
    }
  }
  if (line.has("seed")) options.seed = line.get<int>("seed");
  const FaultStudy result =
      naming(path, [&] { return run_fault_study(file_name(path), drive, options); });
  std::printf("%s\n", to_json(result).dump().c_str());
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("study", argc, argv, pf_resampling::study_faults);
}
