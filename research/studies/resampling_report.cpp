// The words and tables of a resampling study.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "pf_resampling_core/evaluation/statistics.hpp"
#include "research/studies/markdown.hpp"
#include "research/studies/resampling_study.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

/// A figure of one run; nothing where it has none.
using Figure = std::function<std::optional<double>(const PathErrors&)>;

struct Row {
  std::string name;
  Figure figure;
  int decimals = 3;
  bool has_dead_reckoning = true;
};

/// M's nine rows, under M's names, then what M does not have.
std::vector<Row> rows() {
  std::vector<Row> rows;
  const auto add = [&](const std::string& error, AbsoluteErrors PathErrors::*errors) {
    const auto add_one = [&](const std::string& name, double AbsoluteErrors::*value) {
      rows.push_back({error + "_abs_" + name, [=](const PathErrors& run) -> std::optional<double> {
                        if ((run.*errors).count == 0) return std::nullopt;
                        return (run.*errors).*value;
                      }});
    };
    add_one("avg", &AbsoluteErrors::mean);
    add_one("max", &AbsoluteErrors::max);
    add_one("std", &AbsoluteErrors::std);
  };
  add("XTE", &PathErrors::cross_track);
  add("ATE", &PathErrors::along_track);
  add("Cartesian", &PathErrors::cartesian);
  const auto add_own = [&](const std::string& name, int decimals, const Figure& figure) {
    rows.push_back({name, figure, decimals, false});
  };
  add_own("Inside own 95 % region (%)", 1, [](const PathErrors& run) -> std::optional<double> {
    if (!run.coverage95) return std::nullopt;
    return 100.0 * *run.coverage95;
  });
  add_own("Error above the bound (% of the time)", 1,
          [](const PathErrors& run) { return std::optional<double>(100.0 * run.lost_share); });
  add_own("Converged after (s)", 1, [](const PathErrors& run) { return run.converged_after; });
  return rows;
}

std::string title_of(ResamplingScheme scheme) {
  switch (scheme) {
    case ResamplingScheme::residual_then_systematic:
      return "RSR";
    case ResamplingScheme::stratified:
      return "Stratified";
    case ResamplingScheme::residual:
      return "Residual";
    case ResamplingScheme::systematic:
      return "Systematic";
    case ResamplingScheme::multinomial:
      return "Multinomial";
    default:
      return to_string(scheme);
  }
}

std::string title_of(Excitation excitation) {
  return excitation == Excitation::none ? "Without excitation"
                                        : "With excitation (" + to_string(excitation) + ")";
}

/// Over the runs that were not lost.
MeanEstimate average(const StudyCell& cell, const Figure& figure) {
  std::vector<double> values;
  for (const StudyRun& run : cell.runs) {
    if (StudyCell::is_lost(run)) continue;
    if (const std::optional<double> value = figure(run.errors)) values.push_back(*value);
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

std::string table_of(const ResamplingStudy& study, Excitation excitation) {
  std::vector<std::string> headings = {"Error (m)", "Dead reckoning"};
  std::vector<std::string> lost = {"Lost runs", "–"};
  for (const ResamplingScheme scheme : study.options.schemes) {
    const StudyCell& cell = study.cell(scheme, excitation);
    headings.push_back(title_of(scheme));
    lost.push_back(std::to_string(cell.lost()) + " of " + std::to_string(cell.runs.size()));
  }
  std::string text = markdown_heading(headings);
  for (const Row& row : rows()) {
    const std::optional<double> without =
        row.has_dead_reckoning ? row.figure(study.dead_reckoning) : std::nullopt;
    std::vector<std::string> cells = {row.name, without ? fixed(*without, row.decimals) : "–"};
    for (const ResamplingScheme scheme : study.options.schemes) {
      cells.push_back(
          with_error(average(study.cell(scheme, excitation), row.figure), row.decimals));
    }
    text += markdown_row(cells);
  }
  return text + markdown_row(lost);
}

/// Each scheme against the first excitation's, and against a reference scheme.
std::string differences_of(const ResamplingStudy& study) {
  const std::vector<ResamplingScheme>& schemes = study.options.schemes;
  const std::vector<Excitation>& excitations = study.options.excitations;
  const ResamplingScheme reference =
      std::find(schemes.begin(), schemes.end(), ResamplingScheme::systematic) != schemes.end()
          ? ResamplingScheme::systematic
          : schemes.front();
  std::vector<std::string> headings = {"Difference of Cartesian_abs_avg (m)"};
  for (const ResamplingScheme scheme : schemes) headings.push_back(title_of(scheme));
  std::string text = markdown_heading(headings);
  const auto cell_text = [](const MeanEstimate& difference) {
    if (difference.count == 0) return std::string("–");
    return with_error(difference, 4) + " (" + std::to_string(difference.count) + ")";
  };
  for (const Excitation excitation : excitations) {
    std::vector<std::string> cells = {title_of(excitation) + ": minus " + title_of(reference)};
    for (const ResamplingScheme scheme : schemes) {
      cells.push_back(scheme == reference
                          ? "–"
                          : cell_text(cartesian_difference(study.cell(scheme, excitation),
                                                           study.cell(reference, excitation))));
    }
    text += markdown_row(cells);
  }
  for (std::size_t i = 1; i < excitations.size(); ++i) {
    std::vector<std::string> cells = {title_of(excitations[i]) + " minus " +
                                      title_of(excitations[0])};
    for (const ResamplingScheme scheme : schemes) {
      cells.push_back(cell_text(cartesian_difference(study.cell(scheme, excitations[i]),
                                                     study.cell(scheme, excitations[0]))));
    }
    text += markdown_row(cells);
  }
  return text;
}

/// Parameters that differ from the shipped defaults, apart from what the study varies.
std::string settings_of(const ResamplingStudy& study) {
  BeaconMclPipelineOptions given = study.options.pipeline;
  BeaconMclPipelineOptions defaults;
  const ParameterList parameters = parameters_of(&given);
  const ParameterList default_parameters = parameters_of(&defaults);
  std::string text;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters[i].name;
    if (name == "seed" || name == "threads" || name == "excitation/method" ||
        name == "population/resampling/scheme") {
      continue;
    }
    if (parameters[i].get() == default_parameters[i].get()) continue;
    text += (text.empty() ? "" : ", ") + ("`" + name + "` = " + parameters[i].get());
  }
  for (const auto& [beacon, calibration] : given.calibration) {
    text += (text.empty() ? "" : ", ") +
            ("calibration of " +
             (beacon == -1 ? std::string("all others") : "beacon " + std::to_string(beacon)) +
             ": scale " + fixed(calibration.scale, 4) + ", bias " + fixed(calibration.bias, 3) +
             " m, sigma " + fixed(calibration.sigma, 3) + " m");
  }
  return text.empty() ? "the shipped defaults" : text;
}

bool has(const std::vector<ResamplingScheme>& schemes, ResamplingScheme scheme) {
  return std::find(schemes.begin(), schemes.end(), scheme) != schemes.end();
}

json to_json(const AbsoluteErrors& errors) {
  if (errors.count == 0) return nullptr;
  return {{"mean", errors.mean}, {"max", errors.max}, {"std", errors.std}};
}

json to_json(const PathErrors& errors) {
  return {{"cross_track", to_json(errors.cross_track)},
          {"along_track", to_json(errors.along_track)},
          {"cartesian", to_json(errors.cartesian)},
          {"heading", to_json(errors.heading)}};
}

}  // namespace

std::string to_markdown(const ResamplingStudy& study) {
  const ResamplingStudyOptions& options = study.options;
  const PathErrors& sample = study.dead_reckoning;
  std::ostringstream text;
  text << "# Resampling schemes on " << study.recording << "\n\n"
       << "Seeds 1 to " << options.seeds << ", " << options.pipeline.filter.particles
       << " particles, " << fixed(sample.duration, 1) << " s, the first "
       << fixed(100.0 * options.errors.clip, 0)
       << " % left out of the errors. XTE: cross-track error, orthogonal to the true heading; ATE: "
          "along-track error; both and the Cartesian error as average, maximum and standard "
          "deviation of the absolute value, as in Tables 1 to 3 of Mahmoud et al. Every figure is "
          "the average over the runs that were **not** lost, ± its standard error; a run is lost "
          "if its error is above the bound of "
       << fixed(sample.lost_error, 2)
       << " m for more than a tenth of the time after the first fifth.\n\nSettings: "
       << settings_of(study) << ".\n";
  for (const Excitation excitation : options.excitations) {
    text << "\n## " << title_of(excitation) << "\n\n" << table_of(study, excitation);
  }
  text << "\n## Differences, paired by seed\n\n"
       << "Over the seeds (their number in brackets) with which neither of the two was lost.\n\n"
       << differences_of(study);
  if (has(options.schemes, ResamplingScheme::systematic) &&
      has(options.schemes, ResamplingScheme::residual_then_systematic)) {
    text << "\nRSR (residual, then systematic on the residue: M section II.D) and systematic "
            "resampling take the same particles for the same random number, so with equal seeds "
            "their columns are equal. Where M's tables tell the two apart, they tell apart random "
            "numbers.\n";
  }
  return text.str();
}

std::string to_json_text(const ResamplingStudy& study) {
  json result = {{"recording", study.recording},
                 {"seeds", study.options.seeds},
                 {"particles", study.options.pipeline.filter.particles},
                 {"clip", study.options.errors.clip},
                 {"lost_error", study.dead_reckoning.lost_error},
                 {"dead_reckoning", to_json(study.dead_reckoning)},
                 {"cells", json::array()}};
  for (const StudyCell& cell : study.cells) {
    json runs = json::array();
    for (const StudyRun& run : cell.runs) {
      json entry = {{"seed", run.seed}, {"lost", StudyCell::is_lost(run)}};
      if (run.has_errors) {
        entry.update(to_json(run.errors));
        entry["coverage95"] = run.errors.coverage95 ? json(*run.errors.coverage95) : json(nullptr);
        entry["converged_after"] =
            run.errors.converged_after ? json(*run.errors.converged_after) : json(nullptr);
      }
      runs.push_back(entry);
    }
    result["cells"].push_back({{"scheme", to_string(cell.scheme)},
                               {"excitation", to_string(cell.excitation)},
                               {"lost", cell.lost()},
                               {"runs", runs}});
  }
  return result.dump(1) + "\n";
}

}  // namespace pf_resampling
