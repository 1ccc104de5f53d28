#include "rviz_panel/controls.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

template <typename Options>
void expect_a_control_for_each_basic_parameter() {
  Options options;
  const ParameterList parameters = parameters_of(&options.filter);
  auto values = values_of(to_config(parameters));
  std::vector<Control> controls = basic_controls(to_description(parameters));
  for (const Parameter& parameter : parameters) {
    const auto control = std::find_if(controls.begin(), controls.end(), [&](const Control& other) {
      return other.name == parameter.name;
    });
    ASSERT_EQ(control != controls.end(), parameter.is_basic) << parameter.name;
    if (!parameter.is_basic) continue;
    EXPECT_TRUE(says(control->help, parameter.help));
    if (parameter.type != Parameter::Type::boolean) {
      EXPECT_EQ(control->choices, parameter.choices) << parameter.name;
    }
    // What the control sends is what is shown.
    const std::string value = values[parameter.name];
    EXPECT_EQ(values_of(request_of(*control, value)),
              (std::map<std::string, std::string>{{parameter.name, value}}));
  }
}

TEST(Controls, EveryBasicParameterOfTheNodesHasItsControl) {
  expect_a_control_for_each_basic_parameter<BeaconMclPipelineOptions>();
  expect_a_control_for_each_basic_parameter<FastSlamPipelineOptions>();
  FastSlamPipelineOptions options;
  const auto controls = basic_controls(to_description(parameters_of(&options.filter)));
  EXPECT_EQ(controls.front().name, "particles");
  EXPECT_EQ(controls.front().help, "particles\nNumber of particles.\nfrom 1 to 1e+06");
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
  const auto controls = basic_controls(description);
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].choices, (std::vector<std::string>{"0", "3"}));
  EXPECT_EQ(request_of(controls[0], "3").ints.at(0).value, 3);
  EXPECT_TRUE(controls[1].choices.empty());
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

}  // namespace
}  // namespace pf_resampling
