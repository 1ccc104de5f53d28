// run_bag fastslam on the reference world, with the help of run_program.hpp.
#include "test/run_bag_fastslam.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "test/places.hpp"

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

TEST_F(RunBagFastSlam, OdometryThatIsNotFiniteCostsNothingElse) {
  const std::string broken = directory_.file("broken.bag");
  cut(world_, directory_.file("whole.bag"), 0.0, 11.0);
  int count = 0;
  rewrite_bag(directory_.file("whole.bag"), broken, [&](const auto& message, BagWriter* writer) {
    if (message.getTopic() != "/odom" || ++count != 50) return writer->copy(message);
    const auto odometry = message.template instantiate<nav_msgs::Odometry>();
    odometry->pose.pose.position.x = std::nan("");
    writer->write("/odom", message.getTime(), *odometry);
  });
  const ProgramResult result = run(broken + " " + out_ + " --no-clouds");
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(says(result.out, "not_finite"));
  EXPECT_GT(counts_of(out_).at("/pose"), 80u);
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
  expect_error(poor + " " + out_, {"there are no scans", "/odom (nav_msgs/Odometry)"});
  cut(world_, poor, 0.0, 5.0, {"/odom"});
  expect_error(poor + " " + out_, {"none of its landmarks were used", "check_bag"});
  // Of the sensor's place only /tf_static tells.
  cut(world_, poor, 0.0, 5.0, {"/tf_static"});
  expect_error(poor + " " + out_, {"none of its landmarks were used", "unknown_frame"});

  cut(world_, poor, 0.0, 5.0);
  expect_success(poor + " " + out_ + " --save-map " + map_ + " --set particles=20");
  std::filesystem::remove(out_);
  expect_error(bags + " --load-map " + world_, {"world.bag", "line ", "not the header id,x,y"});
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
  rewrite_bag(world_, on_tf, [](const rosbag::MessageInstance& message, BagWriter* writer) {
    if (const auto odometry = message_in<nav_msgs::Odometry>(message)) {
      writer->write("/tf", message.getTime(), as_transform(*odometry));
    } else if (message.getTopic() != "/tf") {
      writer->copy(message);
    }
  });
  expect_error(on_tf + " " + out_, {"on /tf could be it: set odometry_input/source to tf"});
  expect_success(on_tf + " " + out_ + " --no-clouds --set odometry_input/source=tf");
  EXPECT_LT(pose_errors(out_, 35.7).worst, 0.9);
  const ProgramResult judged = run_program("evaluate_bag " + out_);
  EXPECT_EQ(judged.exit_code, 0) << judged.error;
  EXPECT_FALSE(says(judged.out, "dead reckoning"));
}

}  // namespace
}  // namespace pf_resampling
