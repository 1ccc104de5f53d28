// What the study of faults says, as tables and as figures.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "research/studies/fault_study.hpp"
#include "research/studies/markdown.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

// The error after a fault is that of the last part of the drive, once the fault is over.
constexpr double kSettled = 30.0;  // s

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

std::string text_of(double value, int decimals) {
  return std::isfinite(value) ? fixed(value, decimals) : "–";
}

/// Medians over the runs.
struct Summary {
  double before = 0.0, during = 0.0, largest = 0.0, after = 0.0;
  double back = 0.0;  // s
  int recovered = 0;
  int alarms = 0;
  double delay = 0.0;  // s
  std::string alarm;   // the most frequent
  bool all_finite = true;
};

Summary summary_of(const FaultResult& result, double lost_error) {
  std::vector<double> before, during, largest, after, back, delay;
  std::map<std::string, int> texts;
  Summary summary;
  const double during_end = std::max(result.end, result.begin + kSettled);
  for (const FaultRun& run : result.runs) {
    before.push_back(run.mean_error(result.begin - kSettled, result.begin));
    during.push_back(run.mean_error(result.begin, during_end));
    largest.push_back(run.largest_error(result.begin, during_end));
    const double settled =
        run.mean_error(std::max(during_end, result.last - kSettled), result.last);
    if (std::isfinite(settled)) after.push_back(settled);
    if (const auto seconds = run.back_after(result.begin, lost_error)) {
      back.push_back(*seconds);
      ++summary.recovered;
    }
    if (run.alarm) {
      ++summary.alarms;
      delay.push_back(run.alarm->delay);
      ++texts[run.alarm->text];
    }
    summary.all_finite = summary.all_finite && run.all_finite;
  }
  summary.before = median(before);
  summary.during = median(during);
  summary.largest = median(largest);
  summary.after = median(after);
  summary.back = median(back);
  summary.delay = median(delay);
  for (const auto& [text, count] : texts) {
    if (summary.alarm.empty() || count > texts[summary.alarm]) summary.alarm = text;
  }
  return summary;
}

}  // namespace

std::string to_markdown(const FaultStudy& study) {
  const std::string of_all = " of " + std::to_string(study.options.seeds);
  std::string text = "# Faults: " + study.recording + "\n\n";
  text += "Medians over " + std::to_string(study.options.seeds) + " seeds. Errors in m" +
          (study.is_in_map ? ", in the filter's map of that moment laid on the true one: " : ": ") +
          "in the 30 s before, while it lasts (30 s at least), the largest "
          "then, and in the last 30 s of the drive. *Good after*: s until the error stays below " +
          fixed(study.lost_error, 2) +
          " m for ten seconds. *Says*: the first diagnostic that was not there before, and after "
          "how many s.\n\n";
  text += markdown_heading({"fault", "before", "during", "largest", "at the end", "good again",
                            "good after", "says so", "after", "says", "all finite"});
  for (const FaultResult& result : study.results) {
    const Summary summary = summary_of(result, study.lost_error);
    text += markdown_row({result.name, text_of(summary.before, 2), text_of(summary.during, 2),
                          text_of(summary.largest, 2), text_of(summary.after, 2),
                          std::to_string(summary.recovered) + of_all, text_of(summary.back, 0),
                          std::to_string(summary.alarms) + of_all, text_of(summary.delay, 1),
                          summary.alarm, summary.all_finite ? "yes" : "**no**"});
  }
  const LostCharacteristic& lost = study.characteristic;
  text +=
      "\n**Am I lost?** Over the runs with kidnapping and without any fault, second by second: "
      "area under the receiver operating characteristic " +
      fixed(lost.area, 3) + " (" + std::to_string(lost.lost_samples) +
      " seconds with an error above " + fixed(study.lost_error, 2) + " m, " +
      std::to_string(lost.good_samples) + " others); above one half in " +
      fixed(100.0 * lost.detected, 1) + " % of the lost seconds and " +
      fixed(100.0 * lost.false_alarms, 2) + " % of the others.\n";
  return text;
}

std::string to_json_text(const FaultStudy& study) {
  using nlohmann::json;
  const auto number = [](double value) {
    return std::isfinite(value) ? json(value) : json(nullptr);
  };
  json faults = json::array();
  for (const FaultResult& result : study.results) {
    const Summary summary = summary_of(result, study.lost_error);
    faults.push_back({{"fault", result.name},
                      {"before", number(summary.before)},
                      {"during", number(summary.during)},
                      {"largest", number(summary.largest)},
                      {"after", number(summary.after)},
                      {"recovered", summary.recovered},
                      {"good_after", number(summary.back)},
                      {"alarms", summary.alarms},
                      {"alarm_delay", number(summary.delay)},
                      {"alarm", summary.alarm},
                      {"all_finite", summary.all_finite}});
  }
  const LostCharacteristic& lost = study.characteristic;
  const json result = {{"recording", study.recording},
                       {"seeds", study.options.seeds},
                       {"lost_error", study.lost_error},
                       {"faults", faults},
                       {"lost",
                        {{"area", lost.area},
                         {"detected", lost.detected},
                         {"false_alarms", lost.false_alarms},
                         {"lost_samples", lost.lost_samples},
                         {"good_samples", lost.good_samples}}}};
  return result.dump(2) + "\n";
}

}  // namespace pf_resampling
