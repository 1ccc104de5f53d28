#include "rviz_panel/controls.hpp"

#include <gtest/gtest.h>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "pf_resampling_core/error.hpp"
#include "rviz_panel/filter_names.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

const Control* find(const std::vector<ControlGroup>& groups, const std::string& name) {
  for (const ControlGroup& group : groups) {
    for (const Control& control : group.controls) {
      if (control.name == name) return &control;
    }
  }
  return nullptr;
}

template <typename Options>
void expect_every_parameter_has_its_control() {
  Options options;
  const ParameterList parameters = parameters_of(&options.filter);
  const auto groups = controls_of(to_description(parameters));
  const auto values = values_of(to_config(parameters));
  std::size_t count = 0;
  for (const ControlGroup& group : groups) count += group.controls.size();
  EXPECT_EQ(count, parameters.size());
  for (const Parameter& parameter : parameters) {
    const Control* control = find(groups, parameter.name);
    ASSERT_NE(control, nullptr) << parameter.name;
    EXPECT_EQ(control->initial, values.at(parameter.name));
    EXPECT_NE(tooltip_of(*control).find(parameter.help), std::string::npos) << parameter.name;
    ASSERT_EQ(control->choices.size(), parameter.choices.size()) << parameter.name;
    for (std::size_t i = 0; i < parameter.choices.size(); ++i) {
      EXPECT_EQ(control->choices[i].value, parameter.choices[i]);
    }
    if (parameter.type == Parameter::Type::integer || parameter.type == Parameter::Type::real) {
      EXPECT_EQ(control->minimum, parameter.minimum) << parameter.name;
      EXPECT_EQ(control->maximum, parameter.maximum) << parameter.name;
    }
    // What the control sends is what is shown.
    EXPECT_EQ(values_of(request_of(*control, control->initial)),
              (std::map<std::string, std::string>{{parameter.name, control->initial}}));
  }
}

TEST(Controls, EveryParameterOfTheNodesHasItsControl) {
  expect_every_parameter_has_its_control<BeaconMclPipelineOptions>();
  expect_every_parameter_has_its_control<FastSlamPipelineOptions>();
}

TEST(Controls, GroupsNestAndLabelsLeaveThemOut) {
  FastSlamPipelineOptions options;
  const auto groups = controls_of(to_description(parameters_of(&options.filter)));
  EXPECT_EQ(groups[0].name, "");
  for (const ControlGroup& group : groups) {
    if (group.name != "population/resampling") continue;
    EXPECT_EQ(group.label, "resampling");
    ASSERT_GE(group.parent, 0);
    EXPECT_EQ(groups[static_cast<std::size_t>(group.parent)].name, "population");
  }
  EXPECT_EQ(find(groups, "population/resampling/inner_scheme")->label, "inner scheme");
  EXPECT_EQ(find(groups, "population/threshold")->kind, Control::Kind::real);
  EXPECT_EQ(find(groups, "particles")->kind, Control::Kind::integer);
  EXPECT_EQ(find(groups, "population/renewal")->kind, Control::Kind::choice);
  EXPECT_EQ(find(groups, "map/frozen")->kind, Control::Kind::boolean);
}

// As a server made from a .cfg file describes it: choices that are numbers, limits without bounds.
TEST(Controls, ReadsWhatOtherServersDescribe) {
  dynamic_reconfigure::ConfigDescription description;
  description.groups.resize(1);
  description.groups[0].name = "Default";
  dynamic_reconfigure::ParamDescription size;
  size.name = "size";
  size.type = "int";
  size.edit_method =
      "{'enum_description': 'A size', 'enum': [{'name': 'Small', 'type': 'int', 'value': 0, "
      "'description': 'A small one', 'srcline': 4}, {'name': 'Large', 'type': 'int', 'value': 3, "
      "'description': '', 'srcline': 5}]}";
  dynamic_reconfigure::ParamDescription odd;
  odd.name = "odd";
  odd.type = "str";
  odd.edit_method = "{'enum': [";
  description.groups[0].parameters = {size, odd};
  const auto groups = controls_of(description);
  ASSERT_EQ(groups[0].controls.size(), 2u);
  const Control& control = groups[0].controls[0];
  EXPECT_EQ(control.kind, Control::Kind::choice);
  ASSERT_EQ(control.choices.size(), 2u);
  EXPECT_EQ(control.choices[1].name, "Large");
  EXPECT_EQ(control.choices[1].value, "3");
  EXPECT_EQ(request_of(control, "3").ints.at(0).value, 3);
  EXPECT_EQ(groups[0].controls[1].kind, Control::Kind::text);
}

TEST(Controls, ValuesOfAnotherTypeAreNotSent) {
  Control control;
  control.name = "population/threshold";
  control.type = "double";
  EXPECT_EQ(request_of(control, "1e-05").doubles.at(0).value, 1e-5);
  EXPECT_THROW(request_of(control, "much"), Error);
  EXPECT_THROW(request_of(control, ""), Error);
  EXPECT_THROW(request_of(control, "nan"), Error);
  control.type = "int";
  EXPECT_THROW(request_of(control, "1.5"), Error);
  EXPECT_THROW(request_of(control, "3000000000"), Error);
  control.type = "bool";
  EXPECT_THROW(request_of(control, "yes"), Error);
}

TEST(FilterNames, FollowFromTheNodeUnlessTheyAreGiven) {
  const auto resolve = [](const std::string& name) {
    return name[0] == '/' ? name : "/r1/" + name;
  };
  FilterNames names;
  names.node = "fastslam";
  names.reset = "/again";
  const FilterNames all = completed(names, resolve);
  EXPECT_EQ(all.node, "/r1/fastslam");
  EXPECT_EQ(all.status, "/r1/status");
  EXPECT_EQ(all.save_map, "/r1/save_map");
  EXPECT_EQ(all.reset, "/again");
  names.node = "/beacon_mcl";
  EXPECT_EQ(completed(names, resolve).global_localization, "/global_localization");
}

}  // namespace
}  // namespace pf_resampling
