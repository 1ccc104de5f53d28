#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"

namespace pf_resampling {

/// A column of the table that a user reads at the terminal.
struct Column {
  std::string name;  ///< of the figure in the rows
  std::string heading;
  int decimals = 3;
};

/// What a study found: figures, with no words about them. Rows are flat JSON objects. A cell is
/// text, a number, a truth value, a mean with its standard error (see to_json), or null where there
/// is no figure.
struct StudyReport {
  nlohmann::json about;                     ///< what was studied, with which settings
  std::vector<nlohmann::json> summary;      ///< a row per filter, or fault
  std::vector<Column> columns;              ///< of the summary, at the terminal
  std::vector<nlohmann::json> runs;         ///< a row per run
  std::vector<std::string> figures_of_run;  ///< their order in CSV
};

/// {mean, standard_error, count}; null of no values.
nlohmann::json to_json(const MeanEstimate& estimate);

/// Name and value of the parameters in `given` that differ from those in `usual`, but for those
/// named in `but`.
nlohmann::json changed_parameters(const ParameterList& given, const ParameterList& usual,
                                  const std::set<std::string>& but);

/// What it is about, and the summary as a table in aligned columns.
std::string to_text(const StudyReport& report);
/// All of it: what it is about, "summary" and "runs".
std::string to_json_text(const StudyReport& report);
/// A line per run; the first names the figures. A figure that a run lacks is an empty cell.
std::string to_csv(const StudyReport& report);

}  // namespace pf_resampling
