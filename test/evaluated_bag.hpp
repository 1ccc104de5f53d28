#pragma once

#include <geometry_msgs/Pose.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "test/run_program.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {

inline constexpr double kEvaluatedStart = 1000.0;  // s

inline geometry_msgs::Pose pose_at(double x, double y, double heading) {
  geometry_msgs::Pose pose;
  pose.position.x = x;
  pose.position.y = y;
  pose.orientation.z = std::sin(0.5 * heading);
  pose.orientation.w = std::cos(0.5 * heading);
  return pose;
}

/// A folder for bags, and what evaluate_bag says of one of them.
class EvaluatedBag : public ::testing::Test {
 protected:
  nlohmann::json evaluate(const std::string& arguments) const {
    const std::string file = directory_.file("out.json");
    const ProgramResult result = run_program("evaluate_bag " + arguments + " --json " + file);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    EXPECT_EQ(result.error, "");
    return nlohmann::json::parse(read_file(file));
  }
  TemporaryDirectory directory_;
};

}  // namespace pf_resampling
