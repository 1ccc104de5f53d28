#include "research/studies/study_definition.hpp"

#include <set>

#include "pf_resampling_core/error.hpp"
#include "research/studies/builtin_studies.hpp"
#include "src/configuration/yaml_section.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

std::string beside(const std::string& folder, const std::string& path) {
  const bool is_file = path.find('/') != std::string::npos || path.find('.') != std::string::npos;
  return path.empty() || path.front() == '/' || folder.empty() || !is_file ? path
                                                                           : folder + "/" + path;
}

StudiedFilter read_filter_kind(YamlSection& file) {
  file.require("filter");
  std::string name;
  file.read("filter", &name);
  if (name == "fastslam") return StudiedFilter::fastslam;
  if (name == "beacon_mcl") return StudiedFilter::beacon_mcl;
  file.fail("filter", "is \"" + name + "\", has to be fastslam or beacon_mcl");
}

StudyProblem read_problem(YamlSection& section, const std::string& folder) {
  StudyProblem problem;
  section.require("name");
  section.read("name", &problem.name);
  section.read("world", &problem.world);
  section.read("bag", &problem.bag);
  section.read("duration", &problem.duration);
  section.read("clip", &problem.clip);
  section.read("config", &problem.config);
  section.read("calibrated", &problem.is_calibrated);
  if (problem.world.empty() == problem.bag.empty()) {
    section.fail("name", "needs either a world or a bag");
  }
  for (std::string* path : {&problem.world, &problem.bag, &problem.config}) {
    *path = beside(folder, *path);
  }
  return problem;
}

StudyFilter read_filter(YamlSection& section, const std::string& group) {
  StudyFilter filter;
  filter.group = group;
  section.require("name");
  section.read("name", &filter.name);
  section.read_texts("settings", &filter.settings);
  section.read("calibrated", &filter.is_calibrated);
  std::string estimator = "filter";
  section.read("estimator", &estimator);
  if (estimator == "ekf_slam") {
    filter.estimator = Estimator::ekf_slam;
  } else if (estimator != "filter") {
    section.fail("estimator", "is \"" + estimator + "\", has to be filter or ekf_slam");
  }
  return filter;
}

void read_group(YamlSection& group, std::vector<StudyFilter>* filters) {
  std::string name;
  group.require("name");
  group.read("name", &name);
  group.read_sections(
      "filters", [&](YamlSection& section) { filters->push_back(read_filter(section, name)); });
}

/// Every filter with each number of particles.
std::vector<StudyFilter> with_particles(const std::vector<StudyFilter>& filters,
                                        const std::vector<int>& particles) {
  if (particles.empty()) return filters;
  std::vector<StudyFilter> all;
  for (const StudyFilter& filter : filters) {
    for (const int count : particles) {
      all.push_back(filter);
      all.back().name += " M=" + std::to_string(count);
      all.back().settings["particles"] = std::to_string(count);
    }
  }
  return all;
}

}  // namespace

StudyDefinition parse_study(const std::string& text, const std::string& source,
                            const std::string& folder) {
  YamlSection file = YamlSection::of_text(text, source);
  StudyDefinition study;
  file.require("study");
  file.read("study", &study.name);
  study.title = study.name;
  file.read("title", &study.title);
  study.filter = read_filter_kind(file);
  file.read("preset", &study.preset);
  file.read_texts("settings", &study.settings);
  file.read("trials", &study.trials);
  file.read("block", &study.block);
  file.read("reference", &study.reference);
  file.read("times_schemes", &study.times_schemes);
  file.read_sections("problems", [&](YamlSection& section) {
    study.problems.push_back(read_problem(section, folder));
  });
  file.read_sections("groups", [&](YamlSection& group) { read_group(group, &study.filters); });
  std::vector<int> particles;
  file.read_list("particles", &particles);
  study.filters = with_particles(study.filters, particles);
  file.finish();
  if (study.reference.empty() && !study.filters.empty()) {
    study.reference = study.filters.front().name;
  }
  try {
    check(study);
  } catch (const Error& error) {
    throw Error(source + ": " + error.what());
  }
  return study;
}

StudyDefinition load_study(const std::string& name_or_path) {
  const auto builtin = builtin_study_texts().find(name_or_path);
  if (builtin != builtin_study_texts().end()) {
    return parse_study(builtin->second, name_or_path, "");
  }
  if (name_or_path.find('/') == std::string::npos && name_or_path.find('.') == std::string::npos) {
    std::string known;
    for (const auto& [name, text] : builtin_study_texts()) known += name + ", ";
    throw Error("study \"" + name_or_path + "\" is unknown; known: " + known +
                "or the path of a study's YAML file");
  }
  const std::size_t slash = name_or_path.rfind('/');
  return parse_study(read_file(name_or_path), name_or_path,
                     slash == std::string::npos ? "" : name_or_path.substr(0, slash));
}

void check(const StudyDefinition& study) {
  const auto check_names = [](const auto& list, const std::string& what) {
    if (list.empty()) throw Error("a study needs " + what + ", and there is none");
    std::set<std::string> names;
    for (const auto& each : list) {
      if (each.name.empty()) throw Error("the name of " + what + " is empty");
      if (each.name.find_first_of(",\"\n/") != std::string::npos) {
        throw Error("the name '" + each.name +
                    "' has a comma, a quote, a slash or a line's end: take another");
      }
      if (!names.insert(each.name).second) throw Error("there are two of the name " + each.name);
    }
    return names;
  };
  check_names(study.problems, "a problem");
  const std::set<std::string> filters = check_names(study.filters, "a filter");
  if (filters.count(study.reference) == 0) {
    throw Error("reference is '" + study.reference + "', which is none of the filters");
  }
  if (study.trials < 1 || study.trials > kMostTrials) {
    throw Error("trials is " + std::to_string(study.trials) + ": it has to be 1 to " +
                std::to_string(kMostTrials));
  }
  if (study.block < 1 || study.block > kMostTrials) {
    throw Error("block is " + std::to_string(study.block) + ": it has to be 1 to " +
                std::to_string(kMostTrials));
  }
  for (const StudyProblem& problem : study.problems) {
    if (!(problem.clip >= 0.0 && problem.clip < 1.0)) {
      throw Error("problem " + problem.name + ": clip is " + std::to_string(problem.clip) +
                  ", has to be in [0, 1)");
    }
    if (!(problem.duration >= 0.0 && problem.duration <= 1e6)) {
      throw Error("problem " + problem.name + ": duration is " + std::to_string(problem.duration) +
                  " s, has to be in [0, 1000000]");
    }
    if (problem.is_calibrated &&
        (study.filter != StudiedFilter::beacon_mcl || problem.world.empty())) {
      throw Error("problem " + problem.name +
                  ": only beacon_mcl in a world can be calibrated; for a recording give a "
                  "calibration by config");
    }
  }
  for (const StudyFilter& filter : study.filters) {
    if (filter.estimator == Estimator::ekf_slam && study.filter != StudiedFilter::fastslam) {
      throw Error("filter " + filter.name + ": ekf_slam is for studies of fastslam");
    }
  }
}

}  // namespace pf_resampling
