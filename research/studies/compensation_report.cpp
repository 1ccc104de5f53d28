// The words and tables of a compensation study.
#include <cmath>
#include <nlohmann/json.hpp>

#include "research/studies/compensation_claims.hpp"
#include "research/studies/compensation_study.hpp"
#include "research/studies/markdown.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;
using Figures = CompensationFigures;

constexpr double kTooLarge = 10000.0;  // for a table

std::string signed_text(double value, int decimals) {
  return (value < 0.0 ? "" : "+") + fixed(value, decimals);
}

std::string difference_text(const MeanEstimate& difference, int decimals) {
  return signed_text(difference.mean, decimals) + " ± " +
         fixed(difference.standard_error, decimals);
}

std::string table_of(const std::vector<Claim>& claims) {
  std::string table = markdown_heading(
      {"Claim", "Difference, paired by drive", "Mean ± s.e.", "in s.e.", "Verdict"});
  for (const Claim& claim : claims) {
    if (!claim.is_known()) {
      table += markdown_row({claim.text, "–", "–", "–", claim.verdict()});
      continue;
    }
    bool is_first = true;
    for (const ClaimedDifference& each : claim.differences) {
      const double distance = each.is_below ? -each.standard_errors() : each.standard_errors();
      table += markdown_row(
          {is_first ? claim.text : "", each.text, difference_text(each.difference, each.decimals),
           signed_text(distance, 1), is_first ? "**" + claim.verdict() + "**" : ""});
      is_first = false;
    }
  }
  return table;
}

/// What the user changed of the paper's filter.
std::string settings_of(const CompensationStudy& study) {
  FastSlamOptions given = study.options.base;
  FastSlamOptions paper = paper_k_options();
  const ParameterList parameters = parameters_of(&given);
  const ParameterList of_paper = parameters_of(&paper);
  std::string text;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].get() == of_paper[i].get()) continue;
    text +=
        (text.empty() ? ", but for `" : ", `") + parameters[i].name + "` = " + parameters[i].get();
  }
  return "those of K (`config/paper_k.yaml`)" + text;
}

std::vector<double Figures::*> error_columns() {
  return {&Figures::calls,          &Figures::feature_error, &Figures::feature_error_end,
          &Figures::position_error, &Figures::map_error,     &Figures::map_error_aligned,
          &Figures::map_error_end,  &Figures::pose_error};
}

std::vector<double Figures::*> belief_columns() {
  return {&Figures::effective_sample_size,
          &Figures::distinct,
          &Figures::distinct_end,
          &Figures::map_inside,
          &Figures::pose_inside,
          &Figures::map_nees,
          &Figures::pose_nees,
          &Figures::processor_ms};
}

/// The variants of a group, and RSR above them for comparison.
std::vector<const CompensationCell*> cells_of(const CompensationStudy& study,
                                              const std::string& group) {
  std::vector<const CompensationCell*> cells;
  const CompensationCell* reference = study.find("RSR");
  if (reference != nullptr && reference->variant.group != group) cells.push_back(reference);
  for (const CompensationCell& cell : study.cells) {
    if (cell.variant.group == group) cells.push_back(&cell);
  }
  return cells;
}

std::string table_of(const std::vector<const CompensationCell*>& cells,
                     const std::vector<double Figures::*>& columns,
                     const std::vector<double Figures::*>& differences,
                     const CompensationCell* reference) {
  std::vector<const FigureDescription*> described, compared;
  for (const FigureDescription& each : figure_descriptions()) {
    for (const auto column : columns) {
      if (each.value == column) described.push_back(&each);
    }
    for (const auto column : differences) {
      if (each.value == column && reference != nullptr) compared.push_back(&each);
    }
  }
  std::vector<std::string> headings = {"Filter"};
  for (const FigureDescription* each : described) headings.emplace_back(each->heading);
  for (const FigureDescription* each : compared) {
    headings.push_back(std::string(each->heading) + " minus RSR's (in s.e.)");
  }
  std::string table = markdown_heading(headings);
  for (const CompensationCell* cell : cells) {
    std::vector<std::string> row = {cell->variant.name};
    for (const FigureDescription* each : described) {
      const MeanEstimate mean = cell->mean(each->value);
      // As the NEES of a population of which one particle has all the weight.
      row.push_back(mean.mean > kTooLarge ? "> " + fixed(kTooLarge, 0)
                                          : with_error(mean, each->decimals));
    }
    for (const FigureDescription* each : compared) {
      const MeanEstimate difference =
          paired_difference(cell->values(each->value), reference->values(each->value));
      const bool is_same = difference.standard_error == 0.0;
      row.push_back(
          cell == reference
              ? "–"
              : signed_text(difference.mean, each->decimals) +
                    (is_same ? ""
                             : " (" + signed_text(difference.mean / difference.standard_error, 1) +
                                   ")"));
    }
    table += markdown_row(row);
  }
  return table;
}

std::string tables_of_variants(const CompensationStudy& study) {
  const CompensationCell* reference = study.find("RSR");
  std::string text;
  std::string group;
  for (const CompensationCell& cell : study.cells) {
    if (cell.variant.group == group) continue;
    group = cell.variant.group;
    const std::vector<const CompensationCell*> cells = cells_of(study, group);
    text += "\n### " + group + "\n\n" +
            table_of(cells, error_columns(), {&Figures::feature_error, &Figures::map_error},
                     reference) +
            "\n" + table_of(cells, belief_columns(), {&Figures::map_inside}, reference);
  }
  return text;
}

const char* const kColumns =
    "Averages over the drives, ± standard error. Eq. 5: RMS feature error over all particles; eq. "
    "6: RMS position error over all particles; both unweighted, as in K, and with the spread of "
    "the particles in them. Map: RMS error of the weighted-mean map, as it is, and after the best "
    "turn and shift (aligned); pose: error of the weighted-mean position. These are averages over "
    "the scans of a drive; *end*: at its end, with both loops closed. Distinct: particles since "
    "the first landmark that have descendants (K section 4.1); it says nothing of a compensation, "
    "which rejects none. Inside: share of the true landmarks, or positions, inside the estimate's "
    "own 95 % ellipse: 0.95 would be honest. NEES: median of the squared Mahalanobis distance of "
    "these: "
    "1.39 would be honest. Processor: time of the filter for one drive of ";

json to_json(const MeanEstimate& estimate) {
  return {{"mean", estimate.mean}, {"standard_error", estimate.standard_error}};
}

json to_json(const std::vector<Claim>& claims) {
  json list = json::array();
  for (const Claim& claim : claims) {
    json differences = json::array();
    for (const ClaimedDifference& each : claim.differences) {
      json entry = to_json(each.difference);
      entry["difference"] = each.text;
      entry["claimed"] = each.is_below ? "below zero" : "above zero";
      entry["holds"] = each.holds();
      differences.push_back(entry);
    }
    list.push_back({{"claim", claim.text},
                    {"verdict", claim.verdict()},
                    {"holds", claim.is_known() ? json(claim.holds()) : json(nullptr)},
                    {"differences", differences}});
  }
  return list;
}

json to_json(const CompensationCell& cell) {
  json figures, runs = json::array();
  for (const FigureDescription& each : figure_descriptions()) {
    figures[each.name] = to_json(cell.mean(each.value));
  }
  for (std::size_t i = 0; i < cell.runs.size(); ++i) {
    json run = {{"seed", i + 1}};
    for (const FigureDescription& each : figure_descriptions()) {
      if (!each.by_the_clock) run[each.name] = cell.runs[i].*each.value;
    }
    runs.push_back(run);
  }
  return {{"name", cell.variant.name},
          {"group", cell.variant.group},
          {"settings", cell.variant.settings},
          {"figures", figures},
          {"runs", runs},
          {"curves",
           {{"feature_error", cell.curves.feature_error},
            {"map_error", cell.curves.map_error},
            {"distinct", cell.curves.distinct},
            {"effective_sample_size", cell.curves.effective_sample_size},
            {"map_inside", cell.curves.map_inside}}}};
}

}  // namespace

std::string verdicts_to_markdown(const CompensationStudy& study) {
  return "## The five points\n\n" + table_of(five_points(study)) + "\n## What K says besides\n\n" +
         table_of(other_claims_of_paper_k(study)) + "\n## What K does not look at\n\n" +
         table_of(claims_of_confidence(study));
}

std::string to_markdown(const CompensationStudy& study) {
  const CompensationStudyOptions& options = study.options;
  std::string text = "# Compensation and resampling in FastSLAM on " + study.world + "\n\n" +
                     "The same " + std::to_string(options.drives) +
                     " simulated drives for every filter (seeds 1 to " +
                     std::to_string(options.drives) +
                     "), so differences are paired. Settings: " + settings_of(study) +
                     ". The verdicts are the program's: a claim *holds* if each of its differences "
                     "is on the claimed side of zero; chance counts as ruled out from three "
                     "standard errors (s.e.) on.\n\n";
  text += verdicts_to_markdown(study);
  const std::string discussion = discussion_to_markdown(study);
  if (!discussion.empty()) text += "\n" + discussion;
  text += "\n## All filters\n\n" + std::string(kColumns) +
          fixed(study.times.empty() ? 0.0 : study.times.back(), 0) +
          " s, by the clock, so different each time.\n" + tables_of_variants(study);
  const std::string references = references_to_markdown(study);
  if (!references.empty()) text += "\n" + references;
  return text;
}

std::string to_json_text(const CompensationStudy& study) {
  json cells = json::array();
  for (const CompensationCell& cell : study.cells) cells.push_back(to_json(cell));
  const json result = {{"world", study.world},
                       {"drives", study.options.drives},
                       {"by_the_clock", json::array({"processor_ms"})},
                       {"times", study.times},
                       {"closures", study.closures},
                       {"five_points", to_json(five_points(study))},
                       {"other_claims_of_paper_k", to_json(other_claims_of_paper_k(study))},
                       {"claims_of_confidence", to_json(claims_of_confidence(study))},
                       {"variants", cells}};
  return result.dump(1) + "\n";
}

}  // namespace pf_resampling
