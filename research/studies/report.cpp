#include "research/studies/report.hpp"

#include <cmath>

#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr double kTooLarge = 10000.0;  // for a table: as the NEES of copies of one particle

std::string number_text(double value, int decimals) {
  return value > kTooLarge ? "> " + fixed(kTooLarge, 0) : fixed(value, decimals);
}

std::string cell_text(const json& cell, int decimals) {
  if (cell.is_null()) return "–";
  if (cell.is_boolean()) return cell.get<bool>() ? "yes" : "no";
  if (cell.is_string()) return cell.get<std::string>();
  if (cell.is_number()) return number_text(cell.get<double>(), decimals);
  const auto mean = cell.at("mean").get<double>();
  std::string text = number_text(mean, decimals);
  if (cell.at("count").get<int>() > 1 && mean <= kTooLarge) {
    text += " ± " + fixed(cell.at("standard_error").get<double>(), decimals);
  }
  return text;
}

/// One line: objects and lists with their items side by side.
std::string plain_text(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [name, item] : value.items()) {
    text += (text.empty() ? "" : ", ") + (value.is_object() ? name + " = " : "") + plain_text(item);
  }
  return text.empty() ? "none" : text;
}

std::string csv_text(const json& cell) {
  if (cell.is_null() || (cell.is_number_float() && !std::isfinite(cell.get<double>()))) return "";
  if (!cell.is_string()) return cell.dump();
  std::string text = "\"";
  for (const char character : cell.get<std::string>()) {
    text += character == '"' ? "\"\"" : std::string(1, character);
  }
  return text + "\"";
}

}  // namespace

json to_json(const MeanEstimate& estimate) {
  if (estimate.count == 0) return nullptr;
  return {{"mean", estimate.mean},
          {"standard_error", estimate.standard_error},
          {"count", estimate.count}};
}

json changed_parameters(const ParameterList& given, const ParameterList& usual,
                        const std::set<std::string>& but) {
  json changed = json::object();
  for (std::size_t i = 0; i < given.size(); ++i) {
    const std::string& name = given[i].name;
    if (but.count(name) == 0 && given[i].get() != usual[i].get()) changed[name] = given[i].get();
  }
  return changed;
}

std::string to_text(const StudyReport& report) {
  std::string text;
  for (const auto& [name, value] : report.about.items()) {
    text += name + ": " + plain_text(value) + "\n";
  }
  std::vector<std::string> headings;
  for (const Column& column : report.columns) headings.push_back(column.heading);
  Table table(headings);
  for (const json& row : report.summary) {
    std::vector<std::string> cells;
    for (const Column& column : report.columns) {
      cells.push_back(cell_text(row.value(column.name, json()), column.decimals));
    }
    table.add_row(cells);
  }
  return text + "\n" + table.text(0);
}

std::string to_json_text(const StudyReport& report) {
  json all = report.about;
  all["summary"] = report.summary;
  all["runs"] = report.runs;
  return all.dump(1) + "\n";
}

std::string to_csv(const StudyReport& report) {
  std::string text;
  for (const std::string& name : report.figures_of_run) text += (text.empty() ? "" : ",") + name;
  for (const json& run : report.runs) {
    char separator = '\n';
    for (const std::string& name : report.figures_of_run) {
      text += separator + csv_text(run.value(name, json()));
      separator = ',';
    }
  }
  return text + "\n";
}

}  // namespace pf_resampling
