#include "research/studies/resampling_study.hpp"

#include <algorithm>
#include <optional>

#include "pf_resampling_core/error.hpp"
#include "research/studies/for_each_index.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

void check(const ResamplingStudyOptions& options) {
  if (options.seeds < 1) {
    throw Error("seeds is " + std::to_string(options.seeds) + ": it has to be at least 1");
  }
  if (options.jobs < 1) {
    throw Error("jobs is " + std::to_string(options.jobs) + ": it has to be at least 1");
  }
  if (options.schemes.empty() || options.excitations.empty()) {
    throw Error("a study needs at least one scheme and one excitation");
  }
  check_options(options.errors);
  validate(options.pipeline.filter);
}

std::vector<EstimatedPose> to_path(const std::vector<StampedEstimate>& estimates) {
  std::vector<EstimatedPose> path;
  path.reserve(estimates.size());
  for (const StampedEstimate& estimate : estimates) {
    path.push_back({estimate.stamp.toSec(), estimate.estimate.mean, estimate.estimate.covariance});
  }
  std::stable_sort(path.begin(), path.end(),
                   [](const EstimatedPose& a, const EstimatedPose& b) { return a.time < b.time; });
  return path;
}

void run(const std::vector<BeaconMclMessage>& messages, const std::vector<TruePose>& truth,
         const ResamplingStudyOptions& options, const StudyCell& cell, StudyRun* result) {
  BeaconMclPipelineOptions pipeline = options.pipeline;
  pipeline.seed = result->seed;
  pipeline.filter.threads = 1;
  pipeline.filter.strategy.resampling.scheme = cell.scheme;
  pipeline.filter.strategy.excitation.method = cell.excitation;
  const std::vector<EstimatedPose> path = to_path(run_over_messages(messages, pipeline).estimates);
  if (path.empty() || path.back().time < truth.front().time) return;
  result->errors = evaluate_path(truth, path, options.errors);
  result->errors.samples = {};
  result->has_errors = true;
}

struct Figure {
  std::string name;
  std::function<std::optional<double>(const PathErrors&)> of;  // nothing where a run has none
};

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = [] {
    std::vector<Figure> list;
    const auto add = [&](const std::string& error, AbsoluteErrors PathErrors::*errors) {
      const auto add_one = [&](const std::string& name, double AbsoluteErrors::*value) {
        list.push_back({error + name, [=](const PathErrors& run) -> std::optional<double> {
                          if ((run.*errors).count == 0) return std::nullopt;
                          return (run.*errors).*value;
                        }});
      };
      add_one("_mean", &AbsoluteErrors::mean);
      add_one("_max", &AbsoluteErrors::max);
      add_one("_std", &AbsoluteErrors::std);
    };
    add("cross_track", &PathErrors::cross_track);
    add("along_track", &PathErrors::along_track);
    add("cartesian", &PathErrors::cartesian);
    add("heading", &PathErrors::heading);
    list.push_back({"coverage95", [](const PathErrors& run) { return run.coverage95; }});
    list.push_back(
        {"lost_share", [](const PathErrors& run) { return std::optional(run.lost_share); }});
    list.push_back({"converged_after", [](const PathErrors& run) { return run.converged_after; }});
    return list;
  }();
  return all;
}

json figures_of(const PathErrors& errors) {
  json row;
  for (const Figure& figure : figures()) {
    if (const auto value = figure.of(errors)) row[figure.name] = *value;
  }
  return row;
}

/// Over the runs that were not lost.
MeanEstimate average(const StudyCell& cell, const Figure& figure) {
  std::vector<double> values;
  for (const StudyRun& run : cell.runs) {
    if (StudyCell::is_lost(run)) continue;
    if (const std::optional<double> value = figure.of(run.errors)) values.push_back(*value);
  }
  return mean_of(values);
}

/// Mean Cartesian error of `cell` minus that of `other`, over the seeds with which neither is lost.
MeanEstimate cartesian_difference(const StudyCell& cell, const StudyCell& other) {
  std::vector<double> a, b;
  for (std::size_t i = 0; i < cell.runs.size(); ++i) {
    if (StudyCell::is_lost(cell.runs[i]) || StudyCell::is_lost(other.runs[i])) continue;
    a.push_back(cell.runs[i].errors.cartesian.mean);
    b.push_back(other.runs[i].errors.cartesian.mean);
  }
  return paired_difference(a, b);
}

/// Systematic resampling or, in a study without it, the first scheme.
ResamplingScheme reference_scheme(const ResamplingStudyOptions& options) {
  const auto found =
      std::find(options.schemes.begin(), options.schemes.end(), ResamplingScheme::systematic);
  return found == options.schemes.end() ? options.schemes.front() : *found;
}

json summary_of(const ResamplingStudy& study, const StudyCell& cell) {
  json row = {{"excitation", to_string(cell.excitation)},
              {"scheme", to_string(cell.scheme)},
              {"runs", cell.runs.size()},
              {"lost", cell.lost()}};
  for (const Figure& figure : figures()) row[figure.name] = to_json(average(cell, figure));
  const ResamplingScheme reference = reference_scheme(study.options);
  const Excitation first = study.options.excitations.front();
  if (cell.scheme != reference) {
    row["minus_reference_scheme"] =
        to_json(cartesian_difference(cell, study.cell(reference, cell.excitation)));
  }
  if (cell.excitation != first) {
    row["minus_first_excitation"] =
        to_json(cartesian_difference(cell, study.cell(cell.scheme, first)));
  }
  return row;
}

json about(const ResamplingStudy& study) {
  BeaconMclPipelineOptions given = study.options.pipeline;
  BeaconMclPipelineOptions shipped;
  json calibration = json::object();
  for (const auto& [beacon, found] : given.calibration) {
    calibration[beacon == -1 ? "others" : "beacon " + std::to_string(beacon)] = {
        {"scale", found.scale}, {"bias", found.bias}, {"sigma", found.sigma}};
  }
  return {{"study", "resampling"},
          {"recording", study.recording},
          {"seeds", study.options.seeds},
          {"particles", given.filter.particles},
          {"duration", study.dead_reckoning.duration},
          {"clip", study.options.errors.clip},
          {"lost_error", study.dead_reckoning.lost_error},
          {"reference_scheme", to_string(reference_scheme(study.options))},
          {"settings", changed_parameters(parameters_of(&given), parameters_of(&shipped),
                                          {"preset", "seed", "threads", "excitation/method",
                                           "population/resampling/scheme"})},
          {"calibration", calibration}};
}

}  // namespace

std::vector<ResamplingScheme> schemes_of_mahmoud() {
  return {ResamplingScheme::residual_then_systematic, ResamplingScheme::stratified,
          ResamplingScheme::residual, ResamplingScheme::systematic, ResamplingScheme::multinomial};
}

int StudyCell::lost() const {
  return static_cast<int>(std::count_if(runs.begin(), runs.end(), is_lost));
}

const StudyCell& ResamplingStudy::cell(ResamplingScheme scheme, Excitation excitation) const {
  const auto found = std::find_if(cells.begin(), cells.end(), [&](const StudyCell& cell) {
    return cell.scheme == scheme && cell.excitation == excitation;
  });
  if (found == cells.end()) {
    throw Error("the study has no " + to_string(scheme) + " with excitation " +
                to_string(excitation));
  }
  return *found;
}

ResamplingStudy run_resampling_study(const std::string& recording,
                                     const std::vector<BeaconMclMessage>& messages,
                                     const std::vector<TruePose>& truth,
                                     const std::vector<EstimatedPose>& odometry,
                                     const ResamplingStudyOptions& options,
                                     const std::function<void(std::uint64_t)>& progress) {
  check(options);
  ResamplingStudy study;
  study.recording = recording;
  study.options = options;
  study.dead_reckoning = evaluate_path(truth, align_at_start(odometry, truth), options.errors);
  study.dead_reckoning.samples = {};
  for (const Excitation excitation : options.excitations) {
    for (const ResamplingScheme scheme : options.schemes) {
      StudyCell cell;
      cell.scheme = scheme;
      cell.excitation = excitation;
      cell.runs.resize(static_cast<std::size_t>(options.seeds));
      for (int seed = 1; seed <= options.seeds; ++seed) {
        cell.runs[static_cast<std::size_t>(seed - 1)].seed = seed;
      }
      study.cells.push_back(cell);
    }
  }

  const std::size_t seeds = static_cast<std::size_t>(options.seeds);
  for_each_index(
      study.cells.size() * seeds, options.jobs,
      [&](std::size_t i) {
        StudyCell& cell = study.cells[i / seeds];
        run(messages, truth, options, cell, &cell.runs[i % seeds]);
      },
      progress);
  return study;
}

StudyReport report_of(const ResamplingStudy& study) {
  StudyReport report;
  report.about = about(study);
  report.figures_of_run = {"excitation", "scheme", "seed", "lost"};
  for (const Figure& figure : figures()) report.figures_of_run.push_back(figure.name);
  report.columns = {{"excitation", "excitation"},
                    {"scheme", "scheme"},
                    {"cartesian_mean", "error (m)"},
                    {"cartesian_max", "largest"},
                    {"cross_track_mean", "across"},
                    {"along_track_mean", "along"},
                    {"coverage95", "inside 95 %"},
                    {"converged_after", "converged (s)", 1},
                    {"lost", "lost runs", 0},
                    {"minus_reference_scheme", "minus reference", 4},
                    {"minus_first_excitation", "minus first excitation", 4}};
  json dead_reckoning = figures_of(study.dead_reckoning);
  dead_reckoning.update({{"excitation", ""}, {"scheme", "dead reckoning"}});
  dead_reckoning.erase("coverage95");  // it states no covariance
  report.summary.push_back(dead_reckoning);
  for (const StudyCell& cell : study.cells) {
    report.summary.push_back(summary_of(study, cell));
    for (const StudyRun& run : cell.runs) {
      json row = run.has_errors ? figures_of(run.errors) : json::object();
      row.update({{"excitation", to_string(cell.excitation)},
                  {"scheme", to_string(cell.scheme)},
                  {"seed", run.seed},
                  {"lost", StudyCell::is_lost(run)}});
      report.runs.push_back(row);
    }
  }
  return report;
}

}  // namespace pf_resampling
