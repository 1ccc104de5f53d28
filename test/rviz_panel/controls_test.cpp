#include "rviz_panel/controls.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

template <typename Options>
void expect_a_control_for_each_basic_parameter() {
  Options options;
  const ParameterList parameters = parameters_of(&options.filter);
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

TEST(Controls, ChoicesThatCannotBeReadAreSetAsText) {
  dynamic_reconfigure::ConfigDescription description;
  description.groups.resize(1);
  description.groups[0].parameters.resize(1);
  description.groups[0].parameters[0].edit_method = "{'enum': [";
  EXPECT_TRUE(basic_controls(description).at(0).choices.empty());
}

}  // namespace
}  // namespace pf_resampling
