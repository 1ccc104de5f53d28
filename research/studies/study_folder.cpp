#include "research/studies/study_folder.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "research/studies/for_each_index.hpp"
#include "research/studies/scheme_times.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kFormat = 1;
const char* const kStudyFile = "study.json";

// ---- The definition as JSON --------------------------------------------------------------------

json to_json(const StudyDefinition& study) {
  json problems = json::array();
  for (const StudyProblem& problem : study.problems) {
    problems.push_back({{"name", problem.name},
                        {"kind", problem.world.empty() ? "bag" : "world"},
                        {"source", problem.world.empty() ? problem.bag : problem.world},
                        {"duration_given", problem.duration},
                        {"clip", problem.clip},
                        {"config", problem.config},
                        {"calibrated", problem.is_calibrated}});
  }
  json filters = json::array();
  for (const StudyFilter& filter : study.filters) {
    filters.push_back(
        {{"name", filter.name},
         {"group", filter.group},
         {"estimator", filter.estimator == Estimator::ekf_slam ? "ekf_slam" : "filter"},
         {"calibrated", filter.is_calibrated},
         {"settings", filter.settings}});
  }
  return {{"format", kFormat},
          {"study", study.name},
          {"title", study.title},
          {"filter", study.filter == StudiedFilter::fastslam ? "fastslam" : "beacon_mcl"},
          {"preset", study.preset},
          {"settings", study.settings},
          {"trials", study.trials},
          {"block", study.block},
          {"reference", study.reference},
          {"times_schemes", study.times_schemes},
          {"problems", problems},
          {"filters", filters}};
}

/// A number of trials or the size of a block. Throws Error for what is none.
int count_in(const json& about, const std::string& key) {
  const json& value = about.at(key);
  // First as a double, which holds any number: one that is too large must not become a small int.
  const double number = value.get<double>();
  if (!value.is_number() || !(number >= 1.0 && number <= kMostTrials) ||
      number != std::floor(number)) {
    throw Error("its " + key + " is no whole number from 1 to " + std::to_string(kMostTrials));
  }
  return static_cast<int>(number);
}

StudyDefinition from_json(const json& about) {
  StudyDefinition study;
  study.name = about.at("study");
  study.title = about.at("title");
  study.filter =
      about.at("filter") == "fastslam" ? StudiedFilter::fastslam : StudiedFilter::beacon_mcl;
  study.preset = about.at("preset");
  study.settings = about.at("settings").get<Settings>();
  study.trials = count_in(about, "trials");
  study.block = count_in(about, "block");
  study.reference = about.at("reference");
  study.times_schemes = about.at("times_schemes");
  for (const json& each : about.at("problems")) {
    StudyProblem problem;
    problem.name = each.at("name");
    (each.at("kind") == "world" ? problem.world : problem.bag) = each.at("source");
    problem.duration = each.at("duration_given");
    problem.clip = each.at("clip");
    problem.config = each.at("config");
    problem.is_calibrated = each.at("calibrated");
    study.problems.push_back(problem);
  }
  for (const json& each : about.at("filters")) {
    StudyFilter filter;
    filter.name = each.at("name");
    filter.group = each.at("group");
    if (each.at("estimator") == "ekf_slam") filter.estimator = Estimator::ekf_slam;
    filter.is_calibrated = each.at("calibrated");
    filter.settings = each.at("settings").get<Settings>();
    study.filters.push_back(filter);
  }
  return study;
}

std::string file_of(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

/// Whether there is something that is neither a study nor what another shard begins one with.
bool is_foreign(const std::string& folder) {
  if (!fs::is_directory(folder)) return fs::exists(folder);
  const std::string being_written = std::string(kStudyFile) + ".part-";
  bool is_other = false;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name == kStudyFile) return false;
    is_other = is_other || (name != "blocks" && name.rfind(being_written, 0) != 0);
  }
  return is_other;
}

/// What `work` makes of the study.json of a folder, which may hold anything. Throws Error that
/// names the file.
template <typename Work>
auto read_study(const std::string& folder, const Work& work) {
  const std::string path = file_of(folder, kStudyFile);
  if (!fs::exists(path)) {
    throw Error(folder + ": there is no study in it (no " + std::string(kStudyFile) + ")");
  }
  const std::string text = read_file(path);
  const std::string remedy = "; take another folder";
  try {
    const json about = json::parse(text);
    const json& format = about.at("format");
    if (!format.is_number()) throw Error("is damaged");
    if (format != kFormat) {
      throw Error("format " + format.dump() + " is unknown; known: " + std::to_string(kFormat));
    }
    return work(about);
  } catch (const json::exception&) {
    throw Error(path + ": is damaged" + remedy);
  } catch (const Error& error) {
    throw Error(path + ": " + error.what() + remedy);
  }
}

/// Makes a folder inside the study's, if there is none. Throws Error if something else is there: a
/// link could lead into a folder of somebody else.
void make_folder(const fs::path& path) {
  const fs::file_type there = fs::symlink_status(path).type();
  if (there == fs::file_type::not_found) {
    fs::create_directories(path);
  } else if (there != fs::file_type::directory) {
    throw Error(path.string() + " is " +
                (there == fs::file_type::symlink ? "a symbolic link" : "no folder") +
                "; remove or rename it");
  }
}

/// With files found from wherever the study goes on.
StudyDefinition with_whole_paths(StudyDefinition study) {
  for (StudyProblem& problem : study.problems) {
    const bool is_file = problem.world.find_first_of("/.") != std::string::npos;
    for (std::string* path : {&problem.bag, &problem.config, is_file ? &problem.world : nullptr}) {
      if (path == nullptr || path->empty()) continue;
      *path = fs::absolute(*path).lexically_normal().string();
    }
  }
  return study;
}

/// Problems without what was found of them, and without the folders their files are in: a study may
/// be moved, and is still the same.
json without_places(json problems) {
  for (json& problem : problems) {
    for (const char* found : {"duration", "closures", "lost_error"}) problem.erase(found);
    for (const char* path : {"source", "config"}) {
      problem[path] = fs::path(problem.at(path).get<std::string>()).filename().string();
    }
  }
  return problems;
}

/// The key in which two studies differ, or "". What an older program did not write is no
/// difference.
std::string difference(const json& there, const json& about) {
  for (const auto& [key, value] : about.items()) {
    if (key == "trials" || !there.contains(key)) continue;
    const bool is_same = key == "problems" ? without_places(there[key]) == without_places(value)
                                           : there[key] == value;
    if (!is_same) return key;
  }
  return "";
}

// ---- Numbers as text ---------------------------------------------------------------------------

/// An empty cell where there is no figure.
std::string cell(double value) {
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

std::string exact(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), " %.17g", value);
  return text;
}

// ---- Blocks ------------------------------------------------------------------------------------

/// Sums over trials at every time of a curve: what means and deviations are made of.
struct CurveSums {
  std::vector<double> sum, squares, count;

  void add(const std::vector<double>& curve) {
    for (std::vector<double>* values : {&sum, &squares, &count}) values->resize(curve.size(), 0.0);
    for (std::size_t i = 0; i < curve.size(); ++i) {
      if (std::isnan(curve[i])) continue;
      sum[i] += curve[i];
      squares[i] += curve[i] * curve[i];
      count[i] += 1.0;
    }
  }
  void add(const CurveSums& other) {
    for (auto [to, from] :
         {std::make_pair(&sum, &other.sum), std::make_pair(&squares, &other.squares),
          std::make_pair(&count, &other.count)}) {
      to->resize(from->size(), 0.0);
      for (std::size_t i = 0; i < from->size(); ++i) (*to)[i] += (*from)[i];
    }
  }
};

/// What the drives of a block gave.
struct BlockResults {
  std::vector<std::vector<Trial>> trials;      ///< by seed, by filter; without curves
  std::vector<std::vector<CurveSums>> curves;  ///< by filter, by curve
};

std::string to_text(const BlockResults& results) {
  std::string text;
  for (const std::vector<Trial>& of_seed : results.trials) {
    for (const Trial& trial : of_seed) {
      text += "trial" + exact(trial.processor_ms);
      for (const double figure : trial.figures) text += exact(figure);
      text += "\n";
    }
  }
  for (const std::vector<CurveSums>& of_filter : results.curves) {
    for (const CurveSums& sums : of_filter) {
      for (const std::vector<double>* values : {&sums.sum, &sums.squares, &sums.count}) {
        text += "curve";
        for (const double value : *values) text += exact(value);
        text += "\n";
      }
    }
  }
  return text + "end\n";
}

std::vector<double> numbers_of(const char* text) {
  std::vector<double> numbers;
  char* end = nullptr;
  for (double number = std::strtod(text, &end); end != text; number = std::strtod(text, &end)) {
    numbers.push_back(number);
    text = end;
  }
  return numbers;
}

/// Throws Error for a file that is not what to_text() writes for so many seeds.
BlockResults read_block(const std::string& path, std::size_t seeds, const Experiment& experiment,
                        std::size_t filters) {
  BlockResults results;
  results.trials.resize(seeds);
  results.curves.resize(filters);
  std::size_t trial = 0;
  std::vector<std::vector<double>> curves;
  std::istringstream lines(read_file(path));
  bool is_whole = false;
  bool is_good = true;
  for (std::string line; is_good && std::getline(lines, line);) {
    if (line.rfind("trial", 0) == 0) {
      std::vector<double> numbers = numbers_of(line.c_str() + 5);
      is_good = trial < seeds * filters && numbers.size() == experiment.figures.size() + 1;
      if (!is_good) break;
      Trial read;
      read.processor_ms = numbers.front();
      read.figures.assign(numbers.begin() + 1, numbers.end());
      results.trials[trial++ / filters].push_back(read);
    } else if (line.rfind("curve", 0) == 0) {
      curves.push_back(numbers_of(line.c_str() + 5));
      is_good = curves.back().size() == experiment.times.size();
    } else {
      is_whole = line == "end";
      is_good = is_whole;
    }
  }
  const std::size_t per_filter = 3 * experiment.curves.size();
  if (!is_good || !is_whole || trial != seeds * filters || curves.size() != per_filter * filters) {
    throw Error(path + ": is no block of this study; remove it and run the study again");
  }
  for (std::size_t f = 0; f < filters; ++f) {
    for (std::size_t c = 0; c < experiment.curves.size(); ++c) {
      const std::size_t at = f * per_filter + 3 * c;
      results.curves[f].push_back({curves[at], curves[at + 1], curves[at + 2]});
    }
  }
  return results;
}

// ---- Tables ------------------------------------------------------------------------------------

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
  return text;
}

/// Figures of all problems, those of the first one first.
std::vector<std::string> all_figures(const std::vector<Experiment>& experiments) {
  std::vector<std::string> all;
  for (const Experiment& experiment : experiments) {
    for (const std::string& figure : experiment.figures) {
      if (std::find(all.begin(), all.end(), figure) == all.end()) all.push_back(figure);
    }
  }
  return all;
}

std::string row(const std::string& problem, const std::string& filter, std::uint64_t seed,
                const Experiment& experiment, const std::vector<std::string>& figures,
                const Trial& trial) {
  std::string line = problem + "," + filter + "," + std::to_string(seed);
  for (const std::string& figure : figures) {
    const auto found = std::find(experiment.figures.begin(), experiment.figures.end(), figure);
    line += ",";
    if (found == experiment.figures.end()) continue;
    line += cell(trial.figures[static_cast<std::size_t>(found - experiment.figures.begin())]);
  }
  return line + "\n";
}

void add_curves(const std::string& problem, const std::string& filter, const Experiment& experiment,
                const std::vector<CurveSums>& curves, std::string* table) {
  for (std::size_t t = 0; t < experiment.times.size(); ++t) {
    *table += problem + "," + filter + "," + cell(experiment.times[t]);
    for (const CurveSums& sums : curves) {
      const double count = sums.count[t];
      const double mean = count > 0.0 ? sums.sum[t] / count : kNoFigure;
      const double rest = sums.squares[t] - count * mean * mean;
      const double deviation =
          count > 1.0 ? std::sqrt(std::max(0.0, rest) / (count - 1.0)) : kNoFigure;
      *table += "," + cell(count) + "," + cell(mean) + "," + cell(deviation);
    }
    *table += "\n";
  }
}

std::string paths_text(const std::string& problem, const std::vector<DrawnPath>& paths) {
  std::string text;
  for (const DrawnPath& path : paths) {
    for (const EstimatedPose& pose : path.poses) {
      text += problem + "," + path.name + "," + cell(pose.time) + "," + cell(pose.pose.x) + "," +
              cell(pose.pose.y) + "," + cell(pose.pose.heading) + "\n";
    }
  }
  return text;
}

}  // namespace

StudyDefinition definition_in(const std::string& folder) {
  return read_study(folder, from_json);
}

StudyFolder::StudyFolder(const std::string& folder, const StudyDefinition& definition)
    : folder_(folder), definition_(with_whole_paths(definition)) {
  check(definition);
  json about = to_json(definition_);
  if (is_foreign(folder)) {
    throw Error(folder + " is neither empty nor does it hold a study; take another folder");
  }
  if (fs::exists(file_of(folder, kStudyFile))) {
    const auto [trials, other] = read_study(folder, [&](const json& there) {
      return std::make_pair(there.contains("trials") ? count_in(there, "trials") : 0,
                            difference(there, about));
    });
    if (!other.empty()) {
      throw Error(folder + " holds another study: its " + other +
                  " differ. Take another folder, or remove this one");
    }
    // Trials that are there, or that another shard was told to run, stay part of the study.
    definition_.trials = std::max(definition_.trials, trials);
    about["trials"] = definition_.trials;
  }
  definition_ = with_usual_estimators(definition_);
  for (const StudyProblem& problem : definition_.problems) {
    experiments_.push_back(experiment_of(definition_, problem));
  }
  make_folder(fs::path(folder) / "blocks");
  for (std::size_t p = 0; p < experiments_.size(); ++p) {
    about["problems"][p].update(experiments_[p].about);
  }
  about["parameters"] = parameters_of_all(definition_);
  about["figures"] = all_figures(experiments_);
  about["curves"] = experiments_.front().curves;
  write_file(file_of(folder, kStudyFile), about.dump(1) + "\n");
}

std::vector<StudyFolder::Block> StudyFolder::blocks() const {
  std::vector<Block> all;
  const auto trials = static_cast<std::uint64_t>(definition_.trials);
  const auto size = static_cast<std::uint64_t>(definition_.block);
  for (std::size_t problem = 0; problem < definition_.problems.size(); ++problem) {
    for (std::uint64_t first = 1; first <= trials; first += size) {
      all.push_back({problem, first, std::min(trials, first + size - 1)});
    }
  }
  return all;
}

std::string StudyFolder::name_of(const Block& block) const {
  char seeds[40];
  std::snprintf(seeds, sizeof(seeds), "-%07llu-%07llu",
                static_cast<unsigned long long>(block.first),
                static_cast<unsigned long long>(block.last));
  return definition_.problems[block.problem].name + seeds;
}

std::string StudyFolder::path_of(const Block& block) const {
  return (fs::path(folder_) / "blocks" / name_of(block)).string();
}

std::vector<StudyFolder::Block> StudyFolder::missing_blocks(const StudyShard& shard) const {
  const std::vector<Block> all = blocks();
  std::vector<Block> missing;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_of_shard =
        static_cast<int>(i % static_cast<std::size_t>(shard.count)) == shard.index;
    if (!is_of_shard) continue;
    // The first seed's paths stand beside its block.
    const std::string paths =
        file_of(folder_, "blocks/" + definition_.problems[all[i].problem].name + "-paths");
    const bool is_there = fs::exists(path_of(all[i])) && (all[i].first > 1 || fs::exists(paths));
    if (!is_there) missing.push_back(all[i]);
  }
  return missing;
}

std::vector<std::string> StudyFolder::missing() const {
  std::vector<std::string> names;
  for (const Block& block : missing_blocks({})) names.push_back(name_of(block));
  return names;
}

std::uint64_t StudyFolder::drives(const StudyShard& shard) const {
  std::uint64_t drives = 0;
  for (const Block& block : missing_blocks(shard)) drives += block.last - block.first + 1;
  return drives;
}

void StudyFolder::run(const StudyShard& shard, int jobs,
                      const std::function<void(std::uint64_t)>& progress) {
  struct Running {
    Block block;
    std::vector<std::vector<Trial>> trials;
    std::atomic<std::size_t> left;
  };
  std::vector<std::unique_ptr<Running>> running;
  std::vector<std::pair<Running*, std::size_t>> drives;  // and which of its block
  for (const Block& block : missing_blocks(shard)) {
    running.push_back(std::make_unique<Running>());
    const std::size_t seeds = block.last - block.first + 1;
    running.back()->block = block;
    running.back()->trials.resize(seeds);
    running.back()->left = seeds;
    for (std::size_t i = 0; i < seeds; ++i) drives.emplace_back(running.back().get(), i);
  }
  const auto finish = [&](Running* whole) {
    BlockResults results;
    results.curves.resize(definition_.filters.size());
    for (std::size_t f = 0; f < results.curves.size(); ++f) {
      results.curves[f].resize(experiments_[whole->block.problem].curves.size());
    }
    // In order of the seeds, whichever was done first.
    for (std::vector<Trial>& of_seed : whole->trials) {
      for (std::size_t f = 0; f < of_seed.size(); ++f) {
        for (std::size_t c = 0; c < of_seed[f].curves.size(); ++c) {
          results.curves[f][c].add(of_seed[f].curves[c]);
        }
      }
      results.trials.push_back(std::move(of_seed));
    }
    write_file(path_of(whole->block), to_text(results));
    whole->trials.clear();
  };
  for_each_index(
      drives.size(), jobs,
      [&](std::size_t i) {
        Running* of = drives[i].first;
        const std::size_t p = of->block.problem;
        const std::uint64_t seed = of->block.first + drives[i].second;
        std::vector<DrawnPath> paths;
        of->trials[drives[i].second] = experiments_[p].run(seed, seed == 1 ? &paths : nullptr);
        if (seed == 1) {
          const std::string& name = definition_.problems[p].name;
          write_file(file_of(folder_, "blocks/" + name + "-paths"), paths_text(name, paths));
        }
        if (--of->left == 0) finish(of);
      },
      progress);
}

void StudyFolder::merge() const {
  const std::vector<Block> missing = missing_blocks({});
  if (!missing.empty()) {
    throw Error(folder_ + ": " + std::to_string(missing.size()) + " blocks are missing, first " +
                name_of(missing.front()) + "; run the study with this folder again");
  }
  const std::vector<std::string> figures = all_figures(experiments_);
  std::string trials = "problem,filter,seed," + joined(figures) + "\n";
  std::string times = "problem,filter,seed,processor_ms\n";
  std::string curves = "problem,filter,time";
  for (const std::string& curve : experiments_.front().curves) {
    for (const char* part : {"_count", "_mean", "_sd"}) curves += "," + curve + part;
  }
  curves += "\n";
  std::string paths = "problem,filter,time,x,y,heading\n";
  std::string places = "problem,kind,id,x,y\n";

  const std::size_t filters = definition_.filters.size();
  for (std::size_t p = 0; p < definition_.problems.size(); ++p) {
    const std::string& problem = definition_.problems[p].name;
    const Experiment& experiment = experiments_[p];
    std::vector<std::vector<CurveSums>> sums(filters);
    for (auto& of_filter : sums) of_filter.resize(experiment.curves.size());
    for (const Block& block : blocks()) {
      if (block.problem != p) continue;
      const std::size_t seeds = block.last - block.first + 1;
      const BlockResults results = read_block(path_of(block), seeds, experiment, filters);
      for (std::size_t i = 0; i < seeds; ++i) {
        for (std::size_t f = 0; f < filters; ++f) {
          const std::string& name = definition_.filters[f].name;
          const Trial& trial = results.trials[i][f];
          trials += row(problem, name, block.first + i, experiment, figures, trial);
          if (std::isnan(trial.processor_ms)) continue;
          times += problem + "," + name + "," + std::to_string(block.first + i) + "," +
                   cell(trial.processor_ms) + "\n";
        }
      }
      for (std::size_t f = 0; f < filters; ++f) {
        for (std::size_t c = 0; c < sums[f].size(); ++c) sums[f][c].add(results.curves[f][c]);
      }
    }
    for (std::size_t f = 0; f < filters; ++f) {
      add_curves(problem, definition_.filters[f].name, experiment, sums[f], &curves);
    }
    paths += read_file(file_of(folder_, "blocks/" + problem + "-paths"));
    for (const DrawnPlace& place : experiment.places) {
      places += problem + "," + place.kind + "," + place.id + "," + cell(place.x) + "," +
                cell(place.y) + "\n";
    }
  }
  write_file(file_of(folder_, "trials.csv"), trials);
  write_file(file_of(folder_, "times.csv"), times);
  write_file(file_of(folder_, "curves.csv"), curves);
  write_file(file_of(folder_, "paths.csv"), paths);
  write_file(file_of(folder_, "places.csv"), places);
  if (definition_.times_schemes) write_file(file_of(folder_, "scheme_times.csv"), scheme_times());
}

std::string StudyFolder::row_of(const std::string& problem, const std::string& filter,
                                std::uint64_t seed) const {
  const auto place_of = [](const auto& list, const std::string& name, const std::string& what) {
    std::string known;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].name == name) return i;
      known += (known.empty() ? "" : ", ") + list[i].name;
    }
    throw Error(what + " '" + name + "' is unknown; known: " + known);
  };
  const std::size_t p = place_of(definition_.problems, problem, "problem");
  StudyDefinition alone = definition_;
  alone.filters = {definition_.filters[place_of(definition_.filters, filter, "filter")]};
  const Experiment experiment = experiment_of(alone, alone.problems[p]);
  return row(problem, filter, seed, experiment, all_figures(experiments_),
             experiment.run(seed, nullptr).front());
}

}  // namespace pf_resampling
