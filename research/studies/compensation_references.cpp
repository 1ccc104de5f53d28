// What others measured, beside the study.
#include <algorithm>
#include <array>
#include <cmath>

#include "research/studies/average.hpp"
#include "research/studies/compensation_study.hpp"
#include "research/studies/markdown.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

using Figures = CompensationFigures;

constexpr double kPrototypeDrives = 100.0;
constexpr double kVacuous = -1.0;  // distinct particles of a compensation, which rejects none

/// In order: calls, N_eff, distinct, eq. 5, eq. 5 at the end, map, map at the end, eq. 6, landmarks
/// and poses inside their 95 % ellipses.
constexpr std::size_t kColumns = 10;
struct PrototypeRow {
  const char* variant;
  std::array<double, kColumns> values;
};

const std::array<double Figures::*, kColumns> kColumnFigures = {
    &Figures::calls,         &Figures::effective_sample_size, &Figures::distinct,
    &Figures::feature_error, &Figures::feature_error_end,     &Figures::map_error,
    &Figures::map_error_end, &Figures::position_error,        &Figures::map_inside,
    &Figures::pose_inside};

/// The throw-away program by which the method was tried before it was built: the same world, 100
/// drives, random numbers and code of its own.
const std::vector<PrototypeRow>& prototype() {
  constexpr double none = kVacuous;
  static const std::vector<PrototypeRow> rows = {
      {"RSR", {59.3, 78.1, 17.5, 0.286, 0.312, 0.244, 0.307, 0.349, 0.505, 0.565}},
      {"NR", {0.0, 12.5, 100.0, 0.357, 0.592, 0.251, 0.310, 0.468, 0.469, 0.369}},
      {"systematic", {59.3, 78.1, 17.5, 0.286, 0.312, 0.244, 0.307, 0.349, 0.505, 0.565}},
      {"multinomial", {58.5, 78.3, 13.0, 0.274, 0.321, 0.242, 0.320, 0.333, 0.454, 0.516}},
      {"stratified", {59.3, 78.2, 16.4, 0.268, 0.286, 0.228, 0.283, 0.329, 0.513, 0.585}},
      {"PR", {60.6, 77.9, 20.6, 0.275, 0.300, 0.229, 0.294, 0.336, 0.538, 0.626}},
      {"PR unbiased", {72.5, 74.1, 19.2, 0.277, 0.289, 0.234, 0.285, 0.338, 0.519, 0.603}},
      {"RBR", {72.1, 74.0, 28.5, 0.288, 0.301, 0.198, 0.235, 0.367, 0.840, 0.880}},
      {"RBR unbiased", {99.2, 62.9, 19.7, 0.276, 0.298, 0.230, 0.295, 0.345, 0.524, 0.584}},
      {"compensation", {55.6, 78.7, none, 0.228, 0.289, 0.215, 0.288, 0.278, 0.384, 0.375}},
      {"compensation random", {55.7, 78.8, none, 0.223, 0.285, 0.210, 0.284, 0.272, 0.379, 0.366}},
      {"compensation roulette",
       {54.3, 79.5, none, 0.222, 0.273, 0.209, 0.273, 0.269, 0.387, 0.376}},
      {"compensation moment_matched",
       {54.9, 78.5, none, 0.230, 0.301, 0.216, 0.300, 0.284, 0.559, 0.404}},
      {"compensation 10 %", {76.4, 72.1, none, 0.305, 0.342, 0.206, 0.231, 0.391, 0.893, 0.916}},
      {"compensation 20 %", {71.1, 74.5, none, 0.281, 0.288, 0.208, 0.238, 0.355, 0.788, 0.837}},
      {"compensation 50 %", {61.0, 77.4, none, 0.242, 0.267, 0.211, 0.261, 0.303, 0.533, 0.592}},
      {"compensation T_N=0.25",
       {21.0, 51.2, none, 0.263, 0.277, 0.211, 0.255, 0.329, 0.661, 0.724}},
      {"compensation T_N=0.5", {34.5, 67.0, none, 0.233, 0.254, 0.205, 0.250, 0.292, 0.513, 0.563}},
      {"compensation T_N=1", {180.2, 88.9, none, 0.227, 0.350, 0.226, 0.350, 0.272, 0.255, 0.078}},
      {"compensation M=50", {54.6, 39.5, none, 0.228, 0.296, 0.216, 0.295, 0.280, 0.369, 0.344}},
      {"compensation M=10", {48.0, 8.1, none, 0.263, 0.385, 0.255, 0.385, 0.321, 0.296, 0.195}},
      {"RSR M=500", {61.5, 388.6, 83.7, 0.270, 0.272, 0.204, 0.240, 0.330, 0.731, 0.802}}};
  return rows;
}

const FigureDescription& description_of(double Figures::*figure) {
  return *std::find_if(figure_descriptions().begin(), figure_descriptions().end(),
                       [&](const FigureDescription& each) { return each.value == figure; });
}

/// The prototype tells no standard errors but says that its scatter is like ours: the same drives
/// in distribution, other random numbers.
double combined_error(const MeanEstimate& ours) {
  return ours.standard_error * std::sqrt(1.0 + ours.count / kPrototypeDrives);
}

std::string beside_prototype(const CompensationStudy& study) {
  std::vector<std::string> headings = {"Ours / prototype (difference in combined standard errors)"};
  for (const auto figure : kColumnFigures) headings.emplace_back(description_of(figure).heading);
  std::string table = markdown_heading(headings);
  int compared = 0;
  Average sizes, distinct;  // differences
  std::vector<std::string> outside;
  for (const PrototypeRow& row : prototype()) {
    const CompensationCell* cell = study.find(row.variant);
    if (cell == nullptr) continue;
    std::vector<std::string> cells = {row.variant};
    for (std::size_t i = 0; i < kColumns; ++i) {
      const FigureDescription& figure = description_of(kColumnFigures[i]);
      const MeanEstimate ours = cell->mean(figure.value);
      const double theirs = row.values[i];
      if (theirs == kVacuous) {
        cells.emplace_back("–");
        continue;
      }
      const std::string both =
          fixed(ours.mean, figure.decimals) + " / " + fixed(theirs, figure.decimals);
      const double error = combined_error(ours);
      if (error < 1e-9 * std::max(1.0, std::abs(ours.mean))) {  // the same in all drives
        cells.push_back(both);
        continue;
      }
      const double distance = (ours.mean - theirs) / error;
      ++compared;
      if (cell->variant.settings.count("particles") == 0) {
        if (figure.value == &Figures::effective_sample_size) sizes.add(ours.mean - theirs);
        if (figure.value == &Figures::distinct) distinct.add(ours.mean - theirs);
      }
      if (std::abs(distance) > 3.0) {
        outside.push_back(std::string(row.variant) + ", " + figure.heading + " (" +
                          fixed(distance, 1) + ")");
      }
      cells.push_back(both + " (" + fixed(distance, 1) + ")");
    }
    table += markdown_row(cells);
  }
  if (compared == 0) return "";
  std::string text =
      "## Beside the prototype\n\n"
      "Before this package was written, the method was tried in a throw-away program: the same "
      "world, 100 drives, code and random numbers of its own. It states no standard errors but for "
      "eq. 5 (0.007 to 0.010 m, as ours); the combined one takes its scatter to be like ours.\n\n"
      "**" +
      std::to_string(compared - static_cast<int>(outside.size())) + " of " +
      std::to_string(compared) + " figures are within three combined standard errors.**";
  for (std::size_t i = 0; i < outside.size(); ++i) {
    text += (i == 0 ? " Outside: " : "; ") + outside[i] + (i + 1 < outside.size() ? "" : ".");
  }
  const auto beside = [](double difference) {
    return fixed(std::abs(difference), 2) + (difference < 0.0 ? " below" : " above");
  };
  text +=
      " All filters share their drives, so these are not independent. What is outside is small "
      "and much the same in each: over the filters with 100 particles, N_eff is on average " +
      beside(sizes.value()) + " and the distinct particles " + beside(distinct.value()) +
      " the prototype's. Over which instants the prototype averages is not known (the start, "
      "where all particles are distinct, as one more of them is worth some 0.1 and 0.5); the "
      "rest of N_eff, half a percent, we cannot explain.";
  return text + "\n\n" + table;
}

/// A row of K's tables: calls per run, distinct particles, N_eff, eq. 5 (m), seconds; 0 where the
/// table does not have it.
struct PaperRow {
  const char* table;
  const char* name;
  const char* variant;
  double calls, distinct, effective_sample_size, feature_error, seconds;
};

const std::vector<PaperRow>& paper_k() {
  // Table III has sums over 50 runs.
  static const std::vector<PaperRow> rows = {
      {"III, IV", "RSR", "RSR", 2296.0 / 50.0, 13.7583, 78.3545, 0.2719, 0.1646},
      {"III, IV", "PR", "PR", 2301.0 / 50.0, 16.7826, 78.2514, 0.2781, 0.2324},
      {"III, IV", "RBR", "RBR", 2670.0 / 50.0, 26.3222, 74.8688, 0.3004, 0.2468},
      {"V", "random", "compensation random", 0.0, 0.0, 76.187, 0.2487, 1.158},
      {"V", "roulette wheel", "compensation roulette", 0.0, 0.0, 76.189, 0.2547, 0.869},
      {"V", "rank-based", "compensation", 0.0, 0.0, 77.384, 0.2109, 1.108},
      {"VI", "ratio 10 %", "compensation 10 %", 0.0, 0.0, 73.009, 0.3169, 0.241},
      {"VI", "ratio 20 %", "compensation 20 %", 0.0, 0.0, 74.908, 0.2817, 0.386},
      {"VI", "ratio 50 %", "compensation 50 %", 0.0, 0.0, 76.618, 0.2512, 0.694},
      {"VI", "ratio 100 %", "compensation", 0.0, 0.0, 77.384, 0.2109, 1.108}};
  return rows;
}

std::string beside_paper_k(const CompensationStudy& study) {
  std::string table = markdown_heading({"K's table", "Method", "Calls, K", "ours", "Distinct, K",
                                        "ours", "N_eff, K", "ours", "Eq. 5, K (m)", "ours (m)",
                                        "Run-time, K (s)", "whole filter, ours (s)"});
  bool has_rows = false;
  for (const PaperRow& row : paper_k()) {
    const CompensationCell* cell = study.find(row.variant);
    if (cell == nullptr) continue;
    has_rows = true;
    std::vector<std::string> cells = {row.table, row.name};
    const auto add = [&](double printed, int decimals, double Figures::*figure) {
      const bool is_printed = printed > 0.0;
      cells.push_back(is_printed ? fixed(printed, decimals) : "–");
      cells.push_back(is_printed ? with_error(cell->mean(figure), decimals) : "–");
    };
    add(row.calls, 1, &Figures::calls);
    add(row.distinct, 1, &Figures::distinct);
    add(row.effective_sample_size, 1, &Figures::effective_sample_size);
    add(row.feature_error, 3, &Figures::feature_error);
    cells.push_back(fixed(row.seconds, 3));
    cells.push_back(fixed(1e-3 * cell->mean(&Figures::processor_ms).mean, 4));
    table += markdown_row(cells);
  }
  if (!has_rows) return "";
  return "## Beside K's tables\n\n"
         "K's world (its Fig. 5) is not available; ours has its two loops, sensor and noise, but "
         "another geometry, so sizes can be compared and digits cannot. K's figures are averages "
         "over 50 runs without standard errors; its run-time is that of resampling or compensation "
         "alone, on a machine of its time, ours that of the whole filter for one drive.\n\n" +
         table;
}

}  // namespace

std::string references_to_markdown(const CompensationStudy& study) {
  if (!is_reference(study)) return "";
  const std::string prototype = beside_prototype(study);
  const std::string paper = beside_paper_k(study);
  return prototype + (prototype.empty() ? "" : "\n") + paper;
}

}  // namespace pf_resampling
