// run_bag fastslam on the reference world, with the help of run_program.hpp.
#include <nav_msgs/Odometry.h>
#include <pf_resampling/ParticleErrors.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_msgs/TFMessage.h>

#include "pf_resampling_core/test/says.hpp"
#include "test/places.hpp"
#include "test/run_bag_fastslam.hpp"

namespace pf_resampling {
namespace {

// ---- the same again ---------------------------------------------------------------------------

/// The bytes of bag and map that a run gives.
std::string bytes_of_run(const std::string& in, const std::string& more,
                         const TemporaryDirectory& directory) {
  const std::string out = directory.file("bytes.bag");
  const std::string map = directory.file("bytes.map");
  expect_success(in + " " + out + " --save-map " + map + " " + more);
  return read_file(out) + read_file(map);
}

TEST_F(RunBagFastSlam, SameSeedGivesTheSameBytes) {
  for (const std::string& method : kMethods) {
    SCOPED_TRACE(method);
    const auto bytes = [&](const std::string& more) {
      return bytes_of_run(world_, more + with_method(method), directory_);
    };
    const std::string first = bytes("--seed 7");
    EXPECT_GT(first.size(), read_file(world_).size());
    EXPECT_TRUE(first == bytes("--seed 7")) << "twice in a row";
    EXPECT_FALSE(first == bytes("--seed 8")) << "with another seed";
  }
}

// ---- particles' errors ------------------------------------------------------------------------

TEST_F(RunBagFastSlam, ParticleErrorsAreThoseOfTheParticlesThatArePublished) {
  // Without delays of the odometry that are estimated, which particles are published without.
  const ProgramResult result =
      run(world_ + " " + out_ + " --set particles=50 --set output/cloud_period=0" +
          " --set odometry_errors/estimate=false");
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "errors of the particles"));
  const rosbag::Bag bag = open_bag(out_);
  std::map<double, TruePose> truths;
  for (const TruePose& truth : read_truth(bag, "/ground_truth")) truths[truth.time] = truth;
  // Scans come with odometry, and with that the particles, in single precision: of 30 m, to 2e-6.
  std::map<double, double> expected;
  rosbag::View clouds(bag, rosbag::TopicQuery("/particles"));
  for (const rosbag::MessageInstance& message : clouds) {
    const auto cloud = message.instantiate<sensor_msgs::PointCloud2>();
    const double time = cloud->header.stamp.toSec();
    double sum = 0.0;
    sensor_msgs::PointCloud2ConstIterator<float> x(*cloud, "x"), y(*cloud, "y");
    int count = 0;
    for (; x != x.end(); ++x, ++y, ++count) {
      sum += std::pow(static_cast<double>(*x) - truths.at(time).x, 2) +
             std::pow(static_cast<double>(*y) - truths.at(time).y, 2);
    }
    ASSERT_EQ(count, 50);
    expected[time] = std::sqrt(sum / count);
  }
  std::uint64_t judged = 0;
  std::uint64_t features = 0;
  rosbag::View errors(bag, rosbag::TopicQuery("/particle_errors"));
  for (const rosbag::MessageInstance& message : errors) {
    const auto error = message.instantiate<ParticleErrors>();
    ++judged;
    EXPECT_NEAR(error->position_rms, expected.at(error->header.stamp.toSec()), 1e-5);
    EXPECT_TRUE(std::isfinite(error->feature_rms));
    EXPECT_GE(error->features, features);
    features = error->features;
  }
  EXPECT_EQ(judged, counts_of(out_)["/landmarks"]);
}

// With one particle its errors are those of the map that is given out.
TEST_F(RunBagFastSlam, FeatureErrorsAreThoseOfTheMapOfTheOnlyParticle) {
  expect_success(world_ + " " + out_ + " --set particles=1 --no-clouds");
  const rosbag::Bag bag = open_bag(out_);
  rosbag::View errors(bag, rosbag::TopicQuery("/particle_errors"));
  ParticleErrors last;
  for (const rosbag::MessageInstance& message : errors) {
    last = *message.instantiate<ParticleErrors>();
  }
  EXPECT_EQ(last.features, 30u);
  EXPECT_NEAR(last.feature_rms, map_rms(out_), 1e-9);
}

TEST_F(RunBagFastSlam, WithoutTheTruthThereAreNoParticleErrors) {
  const std::string in = directory_.file("in.bag");
  cut(world_, in, 0.0, kForever, {"/ground_truth", "/ground_truth_landmarks"});
  const ProgramResult result = run(in + " " + out_ + " --no-clouds");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_FALSE(says(result.out, "errors of the particles"));
  EXPECT_EQ(counts_of(out_).count("/particle_errors"), 0u);
}

// The filter passes over such a message, and so does what judges it.
TEST_F(RunBagFastSlam, OdometryThatIsNotFiniteCostsNothingElse) {
  const std::string broken = directory_.file("broken.bag");
  {
    const rosbag::Bag bag = open_bag(world_);
    rosbag::View view(bag);
    BagWriter writer(broken);
    int count = 0;
    for (const rosbag::MessageInstance& message : view) {
      if (message.getTime() > view.getBeginTime() + ros::Duration(10.0)) break;
      const auto odometry = message.instantiate<nav_msgs::Odometry>();
      if (message.getTopic() == "/odom" && ++count == 50) {
        odometry->pose.pose.position.x = std::nan("");
        writer.write("/odom", message.getTime(), *odometry);
      } else {
        writer.copy(message);
      }
    }
    writer.finish();
  }
  const ProgramResult result = run(broken + " " + out_ + " --no-clouds");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "not_finite"));
  EXPECT_FALSE(says(result.out, "no errors of the particles"));
  const auto counts = counts_of(out_);
  EXPECT_GT(counts.at("/particle_errors"), 0u);
  EXPECT_GT(counts.at("/pose"), 80u);
}

// A recording in two parts gives the map of the whole, as a table that can be loaded again.
TEST_F(RunBagFastSlam, TakesARecordingInParts) {
  const std::string first = directory_.file("first.bag"), second = directory_.file("second.bag");
  cut(world_, first, 0.0, 20.0);
  cut(world_, second, 20.0, kForever);
  const std::string few = " --pose-only --set particles=20 --map-csv ";
  const std::string whole = directory_.file("whole.csv"), parts = directory_.file("parts.csv");
  expect_success(world_ + " " + out_ + few + whole);
  expect_success(first + " " + out_ + few + parts + " --more " + second);
  EXPECT_EQ(read_file(parts), read_file(whole));
  expect_success(first + " " + out_ + " --pose-only --load-map " + whole +
                 " --set map/frozen=true --set particles=20");
  expect_error(first + " " + out_ + " --more " + second + " --tum " + second, {"second.bag"});
}

// ---- mistakes ---------------------------------------------------------------------------------

TEST_F(RunBagFastSlam, EachMistakeGetsOneLine) {
  const std::string bags = world_ + " " + out_;
  expect_error(directory_.file("none.bag") + " " + out_, {"none.bag", "no such"});
  const std::string poor = directory_.file("poor.bag");
  cut(world_, poor, 0.0, 5.0, {"/landmarks"});
  expect_error(poor + " " + out_, {"/landmarks", "pf_resampling/LandmarkObservationArray",
                                   "/odom (nav_msgs/Odometry)", "--landmarks"});
  cut(world_, poor, 0.0, 5.0, {"/odom"});
  expect_error(poor + " " + out_, {"/odom", "nav_msgs/Odometry", "--odom"});
  // Of the sensor's place only /tf_static tells.
  cut(world_, poor, 0.0, 5.0, {"/tf_static"});
  expect_error(poor + " " + out_, {"none of its landmarks were used", "unknown_frame"});

  cut(world_, poor, 0.0, 5.0);
  expect_success(poor + " " + out_ + " --save-map " + map_ + " --set particles=20");
  std::filesystem::remove(out_);
  expect_error(bags + " --load-map " + world_, {"world.bag", "line ", "is not one of id, x, y"});
  expect_error(bags + " --load-map " + directory_.file("no.map"), {"no.map", "No such file"});
  EXPECT_EQ(directory_.listing(), "a.map poor.bag");

  expect_success(poor + " " + out_ + " --save-map " + map_ + with_method("mutual_exclusion"));
  std::filesystem::remove(out_);
  expect_error(bags + " --load-map " + map_ + with_method("known"),
               {"association/method", "automatic"});
  expect_error(poor + " " + out_ + " --save-map " + directory_.file("no/x.map"),
               {"no/x.map", "folder"});
  EXPECT_EQ(run_program("run_bag beacon_mcl " + bags + " --load-map " + map_).exit_code, 2);
}

// The same drive with its odometry on /tf alone.
TEST_F(RunBagFastSlam, TakesOdometryFromTf) {
  const std::string on_tf = directory_.file("on_tf.bag");
  {
    const rosbag::Bag bag = open_bag(world_);
    rosbag::View view(bag);
    BagWriter writer(on_tf);
    for (const rosbag::MessageInstance& message : view) {
      const auto odometry = message_in<nav_msgs::Odometry>(message);
      if (odometry == nullptr) {
        if (message.getTopic() != "/tf") writer.copy(message);
        continue;
      }
      tf2_msgs::TFMessage tf;
      tf.transforms.resize(1);
      tf.transforms[0].header = odometry->header;
      tf.transforms[0].child_frame_id = odometry->child_frame_id;
      tf.transforms[0].transform.translation.x = odometry->pose.pose.position.x;
      tf.transforms[0].transform.translation.y = odometry->pose.pose.position.y;
      tf.transforms[0].transform.rotation = odometry->pose.pose.orientation;
      writer.write("/tf", message.getTime(), tf);
    }
    writer.finish();
  }
  expect_error(on_tf + " " + out_, {"/odom"});
  expect_success(on_tf + " " + out_ + " --no-clouds --set odometry_input/source=tf");
  EXPECT_LT(pose_errors(out_, 35.7).worst, 0.9);
  const ProgramResult judged = run_program("evaluate_bag " + out_);
  EXPECT_EQ(judged.exit_code, 0) << judged.error;
  EXPECT_FALSE(says(judged.out, "dead reckoning"));
}

}  // namespace
}  // namespace pf_resampling
