// Runs studies: many filters, many seeds; a folder of figures, and the page that shows them.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>

#include "pf_resampling_core/error.hpp"
#include "research/studies/fault_study.hpp"
#include "research/studies/report.hpp"
#include "research/studies/study_folder.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"
#include "tools/common/filter_options.hpp"
#include "tools/common/filter_topics.hpp"
#include "tools/common/progress_bar.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {

namespace {

constexpr const char* kPython = "/usr/bin/python3";

/// What every study can be told.
void add_study_options(CommandLine* line, int seeds) {
  line->option<int>("seeds", "N", seeds, "runs per configuration, with seeds 1 to N");
  line->option<int>("jobs", "N", "runs at a time (default: the number of processors)");
  line->option<std::string>("json", "FILE",
                            "write all figures: of every run, and what the table sums up");
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

/// What `work` makes of a study's folder. Errors of a study name the file that they are about,
/// which may be a world or a bag; every other exception gets the folder's name in front.
template <typename Work>
auto in_folder(const std::string& folder, const Work& work) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(folder + ": " + error.what());
  }
}

StudyShard shard_of(const CommandLine& line) {
  StudyShard shard;
  if (!line.has("shard")) return shard;
  const std::string text = line.text("shard");
  char rest = 0;
  const bool is_read = std::sscanf(text.c_str(), "%d/%d%c", &shard.index, &shard.count, &rest) == 2;
  if (!is_read || shard.index < 1 || shard.index > shard.count) {
    throw UsageError("--shard is '" + text +
                     "': it has to be I/N, for instance 3/10, I from 1 to N");
  }
  --shard.index;
  return shard;
}

/// A recording beside the problems of the study.
void add_bag(const CommandLine& line, StudyDefinition* study) {
  if (!line.has("bag")) return;
  StudyProblem problem;
  problem.bag = line.text("bag");
  problem.name = file_name(problem.bag);
  problem.name = problem.name.substr(0, problem.name.rfind('.'));
  if (line.has("config")) problem.config = line.text("config");
  study->problems.push_back(problem);
}

void run(StudyFolder* folder, const StudyShard& shard, int jobs) {
  const std::uint64_t drives = folder->drives(shard);
  if (drives == 0) return;
  ProgressBar bar("study", drives);
  folder->run(shard, jobs, [&](std::uint64_t done) { bar.update(done); });
}

int run_in(const std::string& path, const StudyDefinition& study, const StudyShard& shard,
           int jobs) {
  StudyFolder folder(path, study);
  run(&folder, shard, jobs);
  const std::size_t missing = folder.missing().size();
  if (missing > 0) {
    std::printf(
        "%zu blocks are missing; when all shards are done: rosrun pf_resampling study merge %s\n",
        missing, path.c_str());
    return 0;
  }
  folder.merge();
  std::printf(
      "%s: %d trials of %zu filters on %zu problems in trials.csv\n"
      "look at it: rosrun pf_resampling study report %s\n",
      path.c_str(), folder.trials(), study.filters.size(), study.problems.size(), path.c_str());
  return 0;
}

int study_of(const std::string& name, const std::vector<std::string>& arguments) {
  CommandLine line(
      "study " + name,
      "Runs a study, problems x filters x seeds, and keeps every trial in a folder. What "
      "is there already is not run again: a study that was interrupted, or is to have "
      "more trials, goes on with the same command.");
  line.positional("folder", "where the study is, or is to be");
  line.option<int>("trials", "N",
                   "seeds 1 to N, instead of those of the study; never fewer than the folder was "
                   "to have before");
  line.option<int>("jobs", "N", "drives at a time (default: the number of processors)");
  line.option<std::string>(
      "shard", "I/N",
      "run part I of N alone, on one of several machines that share the folder; "
      "`study merge` puts the parts together");
  line.option<std::string>("bag", "FILE",
                           "a recording with truth, beside the study's own problems");
  line.option<std::string>("config", "FILE",
                           "YAML file of parameters and lists for it (calibration)");
  for (const char* read : {"bag", "config"}) line.reads(read);
  line.example("study " + name + " my_study --trials 100");
  line.example("study " + name + " my_study --shard 3/10");
  if (!line.parse(arguments)) return 0;
  StudyDefinition study = load_study(name);
  if (line.has("trials")) study.trials = line.get<int>("trials");
  add_bag(line, &study);
  const int jobs = jobs_of(line);
  if (jobs < 1) throw Error("--jobs is " + std::to_string(jobs) + ": it has to be at least 1");
  const StudyShard shard = shard_of(line);
  return in_folder(line.text("folder"),
                   [&] { return run_in(line.text("folder"), study, shard, jobs); });
}

int study_merge(const std::vector<std::string>& arguments) {
  CommandLine line("study merge", "Puts the parts of a study together, which shards have run.");
  line.positional("folder", "the study's folder");
  line.example("study merge my_study");
  if (!line.parse(arguments)) return 0;
  const std::string folder = line.text("folder");
  naming(folder, [&] { StudyFolder(folder, definition_in(folder)).merge(); });
  std::printf("%s: trials.csv and the other tables are written\n", folder.c_str());
  return 0;
}

/// Goes on as a Python script: the one beside this program, as installed, or in the source tree
/// that the program was built from.
[[noreturn]] void become_script(const std::string& name, const std::string& argument) {
  namespace fs = std::filesystem;
  const fs::path beside = fs::read_symlink("/proc/self/exe").parent_path() / name;
  const fs::path source = fs::path(PF_RESAMPLING_RESEARCH) / name;
  for (const fs::path& path : {source, beside}) {
    if (!fs::exists(path)) continue;
    execl(kPython, kPython, path.c_str(), argument.c_str(), static_cast<char*>(nullptr));
    throw Error(std::string(kPython) + ": cannot be run: " + std::strerror(errno));
  }
  throw Error(name + " is neither at " + beside.string() + " nor at " + source.string() +
              ": install pf_resampling again");
}

int study_report(const std::vector<std::string>& arguments) {
  CommandLine line(
      "study report",
      "Writes report/report.html and report.md into a study's folder: tables beside the "
      "paper's, figures, verdicts.");
  line.positional("folder", "the study's folder");
  line.example("study report my_study");
  if (!line.parse(arguments)) return 0;
  const std::string folder = line.text("folder");
  naming(folder, [&] { definition_in(folder); });  // says what is wrong, if it is no study
  become_script("study_report.py", folder);
}

int study_trial(const std::vector<std::string>& arguments) {
  CommandLine line("study trial",
                   "Runs one trial again, and prints its row of trials.csv: the same bytes.");
  line.positional("folder", "the study's folder");
  line.positional("problem", "the first cell of the row");
  line.positional("filter", "the second");
  line.positional("seed", "the third");
  line.example("study trial my_study indoor_two_loops \"compensation 20 %\" 17");
  if (!line.parse(arguments)) return 0;
  const std::string folder = line.text("folder");
  const std::string seed = line.text("seed");
  char* end = nullptr;
  const std::uint64_t number = std::strtoull(seed.c_str(), &end, 10);
  if (seed.empty() || *end != 0 || number < 1 || seed.front() == '-') {
    throw UsageError("seed is '" + seed + "': it has to be a whole number from 1");
  }
  const std::string row = naming(folder, [&] {
    const StudyFolder study(folder, definition_in(folder));
    return study.row_of(line.text("problem"), line.text("filter"), number);
  });
  std::printf("%s", row.c_str());
  return 0;
}

int study_faults(const std::vector<std::string>& arguments) {
  CommandLine line(
      "study faults",
      "What a filter does, and what it says, when something goes wrong: each fault is put into\n"
      "the recording by itself.");
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

const char* const kHelp =
    "Usage: rosrun pf_resampling study STUDY FOLDER [options]\n"
    "       rosrun pf_resampling study COMMAND [arguments]\n"
    "\n"
    "Runs many filters with many seeds, and shows what came of it.\n"
    "\n"
    "Studies (study STUDY --help says more):\n"
    "  kwak        compensation and resampling in FastSLAM (Kwak, Kim and Lee 2008)\n"
    "  mahmoud     resampling schemes in range-beacon localization (Mahmoud et al. 2012)\n"
    "  FILE.yaml   one of your own; research/studies/kwak.yaml explains the file\n"
    "\n"
    "Commands:\n"
    "  report      a page of tables, figures and verdicts from a study's folder\n"
    "  merge       puts together what shards have run\n"
    "  trial       runs one trial again\n"
    "  faults      what filters do, and say, when something goes wrong on a recording\n";

int study(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    throw UsageError("which study? kwak, mahmoud or FILE.yaml; see study --help");
  }
  const std::string& name = arguments.front();
  if (name == "--help") {
    std::printf("%s", kHelp);
    return 0;
  }
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (name == "faults") return study_faults(rest);
  if (name == "merge") return study_merge(rest);
  if (name == "trial") return study_trial(rest);
  if (name == "report") return study_report(rest);
  return study_of(name, rest);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("study", argc, argv, pf_resampling::study);
}
