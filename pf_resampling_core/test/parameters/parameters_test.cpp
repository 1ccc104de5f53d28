#include "pf_resampling_core/parameters/parameters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <set>
#include <sstream>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/options.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

struct Sample {
  bool flag = false;
  int count = 5;
  double share = 0.25;
  double width = 2.0;
  Schedule schedule = Schedule::always;
};

ParameterList parameters_of(Sample* sample) {
  return {boolean_parameter("flag", &sample->flag, "A switch."),
          integer_parameter("group/count", &sample->count, -3, 12, "A count."),
          real_parameter("group/share", &sample->share, 0.0, 1.0, "", "A share."),
          real_above_parameter("group/deep/width", &sample->width, 0.0, 50.0, "m", "A width."),
          choice_parameter("schedule", &sample->schedule, "A choice.")};
}

const Parameter& named(const ParameterList& list, const std::string& name) {
  return *std::find_if(list.begin(), list.end(),
                       [&](const Parameter& parameter) { return parameter.name == name; });
}

std::string refusal_by(const ParameterList& list, const std::string& name,
                       const std::string& value) {
  try {
    set_parameter(list, name, value);
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << name << " took '" << value << "'";
  return "";
}

void expect_parts(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) {
    EXPECT_TRUE(says(text, part));
  }
  EXPECT_FALSE(says(text, "\n"));
}

// Name -> value of YAML as this library writes it: comments, and a line for each.
std::map<std::string, std::string> parse_yaml(const std::string& yaml) {
  std::map<std::string, std::string> values;
  std::istringstream lines(yaml);
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == '#') continue;
    const std::size_t colon = line.find(": ");
    EXPECT_NE(colon, std::string::npos) << line;
    std::string value = line.substr(colon + 2);
    if (value.size() >= 2 && value.front() == '"') value = value.substr(1, value.size() - 2);
    EXPECT_TRUE(values.emplace(line.substr(0, colon), value).second) << "twice: " << line;
  }
  return values;
}

// Of each type, and the ends of the ranges; the parameter server may hold a whole number as a real
// one.
TEST(Parameters, ValuesOfTheRangeAreTaken) {
  Sample sample;
  const ParameterList list = parameters_of(&sample);
  const struct {
    const char *name, *value, *now;
  } cases[] = {{"flag", "0", "false"},
               {"flag", "true", "true"},
               {"flag", "false", "false"},
               {"flag", "1", "true"},
               {"group/count", "-3", "-3"},
               {"group/count", "12", "12"},
               {"group/count", "7.0", "7"},
               {"group/share", "0", "0"},
               {"group/share", "1", "1"},
               {"group/share", "1e-3", "0.001"},
               {"group/deep/width", "1e-12", "1.0e-12"},
               {"group/deep/width", "50", "50"},
               {"schedule", "every_n", "every_n"}};
  for (const auto& test : cases) {
    set_parameter(list, test.name, test.value);
    EXPECT_EQ(named(list, test.name).get(), test.now) << test.name;
  }
  EXPECT_TRUE(sample.flag);
  EXPECT_EQ(sample.count, 7);
  EXPECT_EQ(sample.share, 0.001);
  EXPECT_EQ(sample.width, 50.0);
  EXPECT_EQ(sample.schedule, Schedule::every_n);
}

// With the parameter, the value and the range; 2.5 lies in [-3, 12], so what else is wanted is
// said.
TEST(Parameters, WhatIsNoValueIsRefusedAndChangesNothing) {
  Sample sample;
  const ParameterList list = parameters_of(&sample);
  const struct {
    const char* name;
    std::vector<std::string> values;
    const char* wanted;
  } bad[] = {{"flag", {"", "yes", "TRUE ", "2", "tru"}, "one of true, false"},
             {"group/count",
              {"", "x", "2.5", "1 2", "nan", "inf", "99999999999999999999", "5x", "-4", "13"},
              "a whole number in [-3, 12]"},
             {"group/share",
              {"", "x", "nan", "inf", "-inf", "1e999", "0,5", "0.5m", "0.5 0.5", "--1", "-1e-9",
               "1.0000001"},
              "in [0, 1]"},
             {"group/deep/width", {"", "nan", "-1", "0", "50.1"}, "in (0, 50] m"},
             {"schedule",
              {"", "Always", "alway", "always "},
              "one of never, always, effective_sample_size, every_n"}};
  for (const auto& test : bad) {
    for (const std::string& value : test.values) {
      const std::string before = named(list, test.name).get();
      expect_parts(refusal_by(list, test.name, value),
                   {"parameter " + std::string(test.name), "'" + value + "'", test.wanted});
      EXPECT_EQ(named(list, test.name).get(), before) << test.name << " '" << value << "'";
    }
  }
  const ParameterList large = {integer_parameter("count", &sample.count, 1, 10000000, "A count.")};
  expect_parts(refusal_by(large, "count", "0"), {"[1, 10000000]"});
}

// Whatever a configuration file has in a value or a name.
TEST(Parameters, RefusalsAreOneLine) {
  double value = 0.5;
  const ParameterList parameters = {real_parameter("share", &value, 0.0, 1.0, "", "A share.")};
  for (const std::string name : {"share", "a\nname"}) {
    const std::string said =
        pf_resampling::refusal([&] { set_parameter(parameters, name, "no\nnumber\r\x01"); });
    EXPECT_TRUE(std::none_of(said.begin(), said.end(), [](char letter) {
      return letter >= 0 && letter < ' ';
    })) << said;
  }
}

// Squares of smaller ones, and ratios of these, leave the range of numbers.
TEST(Parameters, WhatIsAllButAtItsLimitIsRefused) {
  Sample sample;
  const ParameterList list = parameters_of(&sample);
  const std::string told = refusal_by(list, "group/deep/width", "1e-200");
  EXPECT_TRUE(says(told, "group/deep/width is '1e-200'"));
  EXPECT_TRUE(says(told, "1.0e-12 or more"));
  EXPECT_EQ(sample.width, 2.0);
}

TEST(Parameters, TheNearestNameIsSuggested) {
  BeaconMclOptions options;
  const ParameterList list = parameters_of(&options);
  const std::pair<const char*, const char*> misspelt[] = {
      {"population/treshold", "population/threshold"},
      {"particle", "particles"},
      {"excitation/bandwidthscale", "excitation/bandwidth_scale"},
      {"Ranges/sigma", "ranges/sigma"},
      {"population/resampling/sheme", "population/resampling/scheme"}};
  for (const auto& [wrong, right] : misspelt) {
    expect_parts(refusal_by(list, wrong, "1"), {std::string("parameter ") + wrong, right});
  }
  EXPECT_THROW(set_parameter({}, "anything", "1"), Error);
  EXPECT_EQ(refusal_by(list, "undo", "2"), "parameter undo is unknown; leave it out");
  EXPECT_EQ(refusal_by(list, "recovery/window", "3"),
            "parameter recovery/window is unknown; it is fixed at 6 s; leave it out");
}

// What is written for somebody to read begins with what he is likely to need.
TEST(Parameters, TheBasicOnesComeFirst) {
  Sample sample;
  ParameterList list = parameters_of(&sample);
  list[1] = basic(list[1]);
  list[3] = basic(list[3]);
  std::string order;
  for (const Parameter& parameter : basic_first(list)) order += parameter.name + " ";
  EXPECT_EQ(order, "group/count group/deep/width flag group/share schedule ");
}

TEST(Parameters, RealNumbersSurviveTheWayThroughText) {
  double value = 0.0;
  const double largest = std::numeric_limits<double>::max();
  const Parameter parameter = real_parameter("value", &value, -largest, largest, "", "A number.");
  for (const double number :
       {0.0, 0.1, 1.0 / 3.0, 1e-5, 2e7, -123456.789, 1e22, 5e-324, 2.2250738585072014e-308, largest,
        -largest, 0.30000000000000004, 1e-4, 123456789012345680.0}) {
    value = number;
    const std::string text = parameter.get();
    value = 17.0;
    parameter.set_checked(text);
    EXPECT_EQ(value, number) << text;
  }
  value = 0.1;
  EXPECT_EQ(parameter.get(), "0.1");
}

// Every parameter of the filter.
TEST(FilterParameters, NamesAreDifferentAndSpelledAlike) {
  BeaconMclOptions options;
  std::set<std::string> names;
  for (const Parameter& parameter : parameters_of(&options)) {
    EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name;
    EXPECT_TRUE(std::regex_match(parameter.name, std::regex("[a-z][a-z_]*(/[a-z][a-z_]*)*")))
        << parameter.name;
    EXPECT_FALSE(parameter.help.empty()) << parameter.name;
    EXPECT_EQ(parameter.help.back(), '.') << parameter.name;
    EXPECT_EQ(parameter.help.find_first_of("\n|"), std::string::npos) << parameter.name;
  }
  EXPECT_GT(names.size(), 40u);
}

// A value other than the present one, from the parameter's own range.
std::string other_value(const Parameter& parameter) {
  const std::string now = parameter.get();
  switch (parameter.type) {
    case Parameter::Type::boolean:
      return now == "true" ? "false" : "true";
    case Parameter::Type::choice:
      return parameter.choices.front() == now ? parameter.choices.back()
                                              : parameter.choices.front();
    case Parameter::Type::integer:
    case Parameter::Type::real:
      break;
  }
  // The largest, or half of it (ranges may be open below).
  const bool is_largest = std::stod(now) == parameter.maximum;
  std::ostringstream other;
  other << std::fixed << (is_largest ? std::floor(parameter.maximum) / 2.0 : parameter.maximum);
  return other.str();
}

// All that take any value of their range: no library is there to be loaded.
ParameterList settable_parameters_of(BeaconMclOptions* options) {
  ParameterList list = parameters_of(options);
  const auto is_library = [](const Parameter& parameter) {
    return parameter.name == "population/resampling/library";
  };
  list.erase(std::find_if(list.begin(), list.end(), is_library));
  return list;
}

// Each is bound to a field of its own: setting it shows in itself and in no other, and each type
// of value is told apart.
TEST(FilterParameters, EachHasAFieldOfItsOwn) {
  BeaconMclOptions options;
  const ParameterList list = settable_parameters_of(&options);
  std::vector<std::string> defaults;
  for (const Parameter& parameter : list) defaults.push_back(parameter.get());
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].set_checked(other_value(list[i]));
    for (std::size_t j = 0; j < list.size(); ++j) {
      EXPECT_EQ(list[j].get() == defaults[j], i != j)
          << "setting " << list[i].name << " and looking at " << list[j].name;
    }
    list[i].set_checked(defaults[i]);
  }
}

TEST(FilterParameters, YamlHoldsEveryOneOnce) {
  BeaconMclOptions options;
  ParameterList list = settable_parameters_of(&options);
  for (const Parameter& parameter : list) parameter.set_checked(other_value(parameter));
  const std::string yaml = to_yaml(list);
  const std::map<std::string, std::string> values = parse_yaml(yaml);
  ASSERT_EQ(values.size(), list.size()) << yaml;
  BeaconMclOptions read;
  ParameterList read_list = settable_parameters_of(&read);
  set_parameters(read_list, values);
  for (std::size_t i = 0; i < list.size(); ++i) {
    EXPECT_EQ(read_list[i].get(), list[i].get()) << list[i].name;
  }
}

// roslaunch and rosparam read YAML 1.1 with PyYAML: there 1e-05 is a word, and off, no, yes and the
// like are truth values unless they are quoted.
TEST(FilterParameters, YamlMeansTheSameToReadersOfYaml11) {
  const std::regex integer("[-+]?(0|[1-9][0-9_]*)");
  const std::regex real("[-+]?[0-9][0-9_]*\\.[0-9_]*([eE][-+][0-9]+)?");
  const std::regex truth("(y|n|yes|no|on|off|true|false|null|~)", std::regex::icase);
  for (const bool others : {false, true}) {
    BeaconMclOptions options;
    ParameterList list = settable_parameters_of(&options);
    std::map<std::string, Parameter::Type> types;
    for (const Parameter& parameter : list) {
      if (others) parameter.set_checked(other_value(parameter));
      types[parameter.name] = parameter.type;
    }
    options.yaw_rate_bias.walk = 1e-5;
    options.calibration.estimation = CalibrationEstimation::off;
    std::istringstream lines(to_yaml(list));
    for (std::string line; std::getline(lines, line);) {
      if (line[0] == '#') continue;
      const std::size_t colon = line.find(": ");
      const std::string value = line.substr(colon + 2);
      switch (types.at(line.substr(0, colon))) {
        case Parameter::Type::boolean:
          EXPECT_TRUE(value == "true" || value == "false") << line;
          break;
        case Parameter::Type::integer:
          EXPECT_TRUE(std::regex_match(value, integer)) << line;
          break;
        case Parameter::Type::real:
          EXPECT_TRUE(std::regex_match(value, integer) || std::regex_match(value, real)) << line;
          break;
        case Parameter::Type::choice:
          EXPECT_FALSE(std::regex_match(value, truth)) << line;
          break;
      }
    }
  }
}

// And where a user writes the bare word, the parameter server hands out false.
TEST(FilterParameters, OffSurvivesReadersOfYaml11) {
  BeaconMclOptions options;
  const ParameterList list = settable_parameters_of(&options);
  set_parameter(list, "calibration/estimation", "false");
  EXPECT_EQ(options.calibration.estimation, CalibrationEstimation::off);
  EXPECT_THROW(set_parameter(list, "population/schedule", "false"), Error);
}

TEST(FilterParameters, CombinationsThatMakeNoSenseAreRefused) {
  const auto expect_refused = [](const BeaconMclOptions& options,
                                 const std::vector<std::string>& parts) {
    const std::string said = pf_resampling::refusal([&] { validate(options); });
    expect_parts(said, parts);
  };
  BeaconMclOptions options;
  EXPECT_NO_THROW(validate(options));
  options.particles = 0;
  expect_refused(options, {"particles", "'0'", "[1, "});
  options = {};
  options.ranges.sigma = std::numeric_limits<double>::quiet_NaN();
  expect_refused(options, {"ranges/sigma", "nan"});
  options = {};
  options.strategy.resampling.partial_high = 1.0;
  options.strategy.resampling.partial_low = 1.0;
  expect_refused(options, {"partial_high", "partial_low"});
}

}  // namespace
}  // namespace pf_resampling
