// Runs a range of seeds of filters on one problem; `study` hands out the ranges and makes tables.
#include <cmath>
#include <cstdio>
#include <iostream>

#include "pf_resampling_core/error.hpp"
#include "research/studies/scheme_times.hpp"
#include "research/studies/study_trials.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

/// Empty where there is no figure.
std::string cell(double value) {
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

std::vector<std::string> cells(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(cell(value));
  return texts;
}

StudyDefinition definition_in(const json& request) {
  StudyDefinition study;
  study.filter =
      request.at("filter") == "fastslam" ? StudiedFilter::fastslam : StudiedFilter::beacon_mcl;
  study.preset = request.at("preset");
  study.settings = request.at("settings").get<Settings>();
  for (const json& each : request.at("filters")) {
    StudyFilter filter;
    filter.name = each.at("name");
    if (each.at("estimator") == "ekf_slam") filter.estimator = Estimator::ekf_slam;
    if (each.at("estimator") == "dead_reckoning") filter.estimator = Estimator::dead_reckoning;
    filter.is_calibrated = each.at("calibrated");
    filter.settings = each.at("settings").get<Settings>();
    study.filters.push_back(filter);
  }
  return study;
}

StudyProblem problem_in(const json& request) {
  StudyProblem problem;
  problem.name = request.at("name");
  (request.at("kind") == "world" ? problem.world : problem.bag) = request.at("source");
  problem.duration = request.at("duration_given");
  problem.clip = request.at("clip");
  problem.config = request.at("config");
  problem.is_calibrated = request.at("calibrated");
  return problem;
}

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
};

/// Exact, and with numbers that JSON has not: infinite ones.
std::string text_of(const std::vector<double>& values) {
  std::string text;
  char number[32];
  for (const double value : values) {
    std::snprintf(number, sizeof(number), "%.17g ", value);
    text += number;
  }
  return text;
}

json about(const StudyDefinition& study, const Experiment& experiment) {
  json places = json::array();
  for (const DrawnPlace& place : experiment.places) {
    places.push_back({place.kind, place.id, cell(place.x), cell(place.y)});
  }
  return {{"problem", experiment.about},
          {"figures", experiment.figures},
          {"curves", experiment.curves},
          {"times", cells(experiment.times)},
          {"places", places},
          {"parameters", parameters_of_all(study)}};
}

/// Trials by seed and filter, as cells, time of computation first; curves by filter and curve;
/// paths of seed 1.
json trials(const Experiment& experiment, std::uint64_t first, std::uint64_t last) {
  json trials = json::array();
  json paths = json::array();
  std::vector<std::vector<CurveSums>> sums;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    std::vector<DrawnPath> drawn;
    json of_seed = json::array();
    const std::vector<Trial> run = experiment.run(seed, seed == 1 ? &drawn : nullptr);
    sums.resize(run.size());
    for (std::size_t f = 0; f < run.size(); ++f) {
      std::vector<double> figures = run[f].figures;
      figures.insert(figures.begin(), run[f].processor_ms);
      of_seed.push_back(cells(figures));
      sums[f].resize(run[f].curves.size());
      for (std::size_t c = 0; c < sums[f].size(); ++c) sums[f][c].add(run[f].curves[c]);
    }
    trials.push_back(of_seed);
    for (const DrawnPath& path : drawn) {
      for (const EstimatedPose& pose : path.poses) {
        paths.push_back({path.name, cell(pose.time), cell(pose.pose.x), cell(pose.pose.y),
                         cell(pose.pose.heading)});
      }
    }
  }
  json curves = json::array();
  for (const std::vector<CurveSums>& of_filter : sums) {
    json of = json::array();
    for (const CurveSums& each : of_filter) {
      of.push_back({text_of(each.sum), text_of(each.squares), text_of(each.count)});
    }
    curves.push_back(of);
  }
  return {{"trials", trials}, {"sums", curves}, {"paths", paths}};
}

int run_trials(const std::vector<std::string>& arguments) {
  CommandLine line("run_trials",
                   "Runs a range of seeds of filters on one problem: what `study` does with the\n"
                   "JSON that it writes to the standard input. Use `study`.");
  line.flag("scheme-times", "instead, measure the time of one resampling");
  line.example("run_trials --scheme-times");
  if (!line.parse(arguments)) return 0;
  if (line.get<bool>("scheme-times")) {
    std::printf("%s", scheme_times().c_str());
    return 0;
  }
  try {
    const json request = json::parse(std::cin);
    const StudyDefinition study = definition_in(request);
    const Experiment experiment = experiment_of(study, problem_in(request.at("problem")));
    json out = about(study, experiment);
    out.update(trials(experiment, request.at("first"), request.at("last")));
    std::printf("%s\n", out.dump().c_str());
  } catch (const json::exception& error) {
    throw Error(std::string("the standard input is no request of `study`: ") + error.what());
  }
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("run_trials", argc, argv, pf_resampling::run_trials);
}
