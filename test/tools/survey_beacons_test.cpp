#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>
#include <memory>

#include "pf_resampling_core/test/says.hpp"
#include "test/run_program.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/files.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

class SurveyBeacons : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string bag = folder_->file("drive.bag");
    ASSERT_EQ(run_program("simulate_bag beacons_figure8 " + bag + " --duration 150").exit_code, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string survey(const std::string& arguments) {
    const ProgramResult result =
        run_program("survey_beacons " + folder_->file("drive.bag") + " " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    return result.out;
  }

  static const std::vector<SimulatedBeacon>& truth() {
    static const World world = load_world("beacons_figure8");
    return world.beacons;
  }

  static std::unique_ptr<TemporaryDirectory> folder_;
};
std::unique_ptr<TemporaryDirectory> SurveyBeacons::folder_ = std::make_unique<TemporaryDirectory>();

TEST_F(SurveyBeacons, FindsScaleAndBiasOfEach) {
  const std::string file = folder_->file("calibration.yaml");
  const std::string out = survey("--output " + file);
  EXPECT_TRUE(says(out, "beacon 1 is as listed; "));
  const YAML::Node calibration = YAML::Load(read_file(file))["calibration"];
  ASSERT_EQ(calibration.size(), truth().size());
  for (std::size_t b = 0; b < truth().size(); ++b) {
    EXPECT_EQ(calibration[b]["beacon"].as<int>(), truth()[b].beacon.id);
    EXPECT_NEAR(calibration[b]["scale"].as<double>(), truth()[b].errors.scale, 0.02);
    EXPECT_NEAR(calibration[b]["bias"].as<double>(), truth()[b].errors.bias, 0.3);
    EXPECT_NEAR(calibration[b]["sigma"].as<double>(), truth()[b].errors.sigma, 0.1);
  }
}

// In a frame of its own: what can be compared is how far they are from each other.
TEST_F(SurveyBeacons, FindsBeaconsThatNobodyListed) {
  const std::string file = folder_->file("beacons.yaml");
  const std::string out = survey("--unlisted --output " + file);
  EXPECT_TRUE(says(out, "in the frame of the first pose"));
  std::map<int, Eigen::Vector2d> places;
  for (const YAML::Node& beacon : YAML::Load(read_file(file))["beacons"]) {
    places[beacon["id"].as<int>()] = {beacon["x"].as<double>(), beacon["y"].as<double>()};
  }
  ASSERT_EQ(places.size(), truth().size());
  for (const SimulatedBeacon& a : truth()) {
    for (const SimulatedBeacon& b : truth()) {
      EXPECT_NEAR((places[a.beacon.id] - places[b.beacon.id]).norm(),
                  (a.beacon.position - b.beacon.position).head<2>().norm(), 1.0);
    }
  }
  // Another drive is localized among them.
  const ProgramResult run = run_program("run_bag beacon_mcl " + folder_->file("drive.bag") + " " +
                                        folder_->file("out.bag") + " --config " + file);
  EXPECT_EQ(run.exit_code, 0) << run.error;
}

// As other programs publish it: from odom to base_link.
TEST_F(SurveyBeacons, TakesOdometryOnTf) {
  const std::string bag = folder_->file("tf.bag");
  {
    const rosbag::Bag drive(folder_->file("drive.bag"));
    BagWriter writer(bag);
    for (const rosbag::MessageInstance& message : rosbag::View(drive)) {
      const auto odometry = message.instantiate<nav_msgs::Odometry>();
      if (!odometry) {
        writer.copy(message);
        continue;
      }
      tf2_msgs::TFMessage transforms;
      transforms.transforms.resize(1);
      geometry_msgs::TransformStamped& transform = transforms.transforms[0];
      transform.header = odometry->header;
      transform.child_frame_id = odometry->child_frame_id;
      transform.transform.translation.x = odometry->pose.pose.position.x;
      transform.transform.translation.y = odometry->pose.pose.position.y;
      transform.transform.rotation = odometry->pose.pose.orientation;
      writer.write("/tf", message.getTime(), transforms);
    }
    writer.finish();
  }
  const ProgramResult result =
      run_program("survey_beacons " + bag + " --set odometry_input/source=tf");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "beacon 1 is as listed; "));
  EXPECT_EQ(run_program("survey_beacons " + bag).exit_code, 1);
}

TEST_F(SurveyBeacons, NamesTheOneThatIsNotWhereTheListSays) {
  std::string list = "beacons:\n";
  for (const SimulatedBeacon& radio : truth()) {
    const double x = radio.beacon.position.x() + (radio.beacon.id == 2 ? 3.0 : 0.0);
    list += "  - {id: " + std::to_string(radio.beacon.id) + ", x: " + std::to_string(x) +
            ", y: " + std::to_string(radio.beacon.position.y()) + "}\n";
  }
  const std::string out = survey("--config " + folder_->write("wrong.yaml", list));
  EXPECT_TRUE(says(out, "beacon 2 is listed "));
  EXPECT_TRUE(says(out, "beacon 1 is as listed; "));
}

TEST_F(SurveyBeacons, DrawsAPicture) {
  const std::string picture = folder_->file("beacons.png");
  survey("--unlisted --plot " + picture);
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
}

TEST_F(SurveyBeacons, RefusesBadInputInOneLine) {
  const std::string bag = folder_->file("drive.bag");
  const std::string text = folder_->write("text.bag", "not a bag\n");
  for (const std::string& arguments : {folder_->file("missing.bag"), text, bag + " --odom /none",
                                       bag + " --ranges /none", bag + " --plot picture.txt"}) {
    const ProgramResult result = run_program("survey_beacons " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("survey_beacons")) << arguments << "\n" << result.error;
  }
  EXPECT_EQ(run_program("survey_beacons " + bag + " --unlist").exit_code, 2);
}

}  // namespace
}  // namespace pf_resampling
