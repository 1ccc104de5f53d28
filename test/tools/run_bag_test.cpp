#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <rosbag/view.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>

#include "pf_resampling_core/test/says.hpp"
#include "test/bag_topics.hpp"
#include "test/beacon_mcl_drive.hpp"
#include "test/run_program.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

/// Which topics a bag of the drive has.
struct Content {
  bool odometry = true;
  bool ranges = true;
  bool beacons = true;
  bool sensor_ranges = false;  // as sensor_msgs/Range
};

void write_drive(const std::string& path, double seconds, const Content& content = {}) {
  BagWriter bag(path);
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(seconds)) {
    if (const auto* beacons = std::get_if<BeaconArray::ConstPtr>(&message)) {
      if (content.beacons) bag.write_latched("/beacons", (*beacons)->header.stamp, **beacons);
    } else if (const auto* odometry = std::get_if<nav_msgs::Odometry::ConstPtr>(&message)) {
      const ros::Time stamp = (*odometry)->header.stamp;
      if (content.odometry) bag.write("/odom", stamp, **odometry);
      geometry_msgs::PoseStamped truth;
      truth.header.stamp = stamp;
      truth.header.frame_id = "map";
      truth.pose = to_pose_message(BeaconMclDrive::truth(stamp));
      bag.write("/ground_truth", stamp, truth);
      bag.write("/tf", stamp, as_transform(**odometry));
    } else if (const auto* range = std::get_if<BeaconRange::ConstPtr>(&message)) {
      if (content.ranges) bag.write("/ranges", (*range)->header.stamp, **range);
      if (!content.sensor_ranges) continue;
      sensor_msgs::Range sensed;
      sensed.header.stamp = (*range)->header.stamp;
      sensed.header.frame_id = "beacon_" + std::to_string((*range)->beacon);
      sensed.range = static_cast<float>((*range)->range);
      bag.write("/sensor_ranges", sensed.header.stamp, sensed);
    }
  }
  bag.finish();
}

class RunBag : public testing::Test {
 protected:
  void SetUp() override { write_drive(in_, 20.0); }

  ProgramResult run(const std::string& arguments) const {
    return run_program("run_bag " + arguments);
  }
  static void expect_error(const std::string& arguments, const std::vector<std::string>& words) {
    expect_failure("run_bag " + arguments, 1, words);
  }

  TemporaryDirectory directory_;
  std::string in_ = directory_.file("in.bag");
  std::string out_ = directory_.file("out.bag");
};

TEST_F(RunBag, SameSeedGivesTheSameBytesAtAnyNumberOfThreads) {
  const std::string options = " --set particles=3000 ";
  const auto bytes = [&](const std::string& more) {
    const ProgramResult result = run("beacon_mcl " + in_ + " " + out_ + options + more);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    return read_file(out_);
  };
  const std::string first = bytes("--seed 7 --threads 1");
  EXPECT_GT(first.size(), read_file(in_).size());
  EXPECT_TRUE(first == bytes("--seed 7 --threads 1")) << "twice in a row";
  EXPECT_TRUE(first == bytes("--seed 7 --threads 2")) << "with two threads";
  EXPECT_FALSE(first == bytes("--seed 8 --threads 1")) << "with another seed";
}

TEST_F(RunBag, TheOutputHoldsInputsAndOutputsInOrderOfTime) {
  const ProgramResult result = run("beacon_mcl " + in_ + " " + out_);
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.error, "");
  for (const char* word : {"wall time", "CPU time", "peak memory", "x real time"}) {
    EXPECT_TRUE(says(result.out, word));
  }
  auto counts = counts_of(out_);
  for (const auto& [topic, count] : counts_of(in_)) {
    if (topic == "/tf") continue;
    EXPECT_EQ(counts[topic], count) << topic;
  }
  EXPECT_GT(counts["/pose"], 190u);
  EXPECT_EQ(counts["/tf"], 201u + counts["/pose"]);
  for (const char* topic :
       {"/path", "/particlecloud", "/particles", "/markers", "/status", "/diagnostics"}) {
    EXPECT_GT(counts[topic], 5u) << topic;
  }
  const rosbag::Bag bag = open_bag(out_);
  rosbag::View view(bag);
  ros::Time last;
  double error = 1e9;
  for (const rosbag::MessageInstance& message : view) {
    EXPECT_GE(message.getTime(), last);
    last = message.getTime();
    if (const auto pose = message.instantiate<geometry_msgs::PoseWithCovarianceStamped>()) {
      EXPECT_EQ(message.getTime(), pose->header.stamp);
      const Pose2 truth = BeaconMclDrive::truth(pose->header.stamp);
      error =
          std::hypot(pose->pose.pose.position.x - truth.x, pose->pose.pose.position.y - truth.y);
    }
  }
  EXPECT_EQ(latched_in(out_).count("/beacons"), 1u);
  EXPECT_LT(error, 0.5);

  // Run again on its own output: what the first run wrote is replaced.
  const std::string again = directory_.file("again.bag");
  ASSERT_EQ(run("beacon_mcl " + out_ + " " + again).exit_code, 0);
  EXPECT_EQ(counts_of(again), counts_of(out_));
  const auto poses_of = [](const std::string& path) {
    const rosbag::Bag from = open_bag(path);
    rosbag::View poses(from, rosbag::TopicQuery("/pose"));
    std::vector<double> numbers;
    for (const rosbag::MessageInstance& message : poses) {
      const auto pose = message.instantiate<geometry_msgs::PoseWithCovarianceStamped>();
      numbers.push_back(pose->pose.pose.position.x);
      numbers.push_back(pose->pose.pose.position.y);
    }
    return numbers;
  };
  EXPECT_EQ(poses_of(again), poses_of(out_));
}

TEST_F(RunBag, LeavesOutWhatIsNotWanted) {
  ASSERT_EQ(run("beacon_mcl " + in_ + " " + out_ + " --no-clouds").exit_code, 0);
  auto counts = counts_of(out_);
  EXPECT_EQ(counts.count("/particles") + counts.count("/path") + counts.count("/markers"), 0u);
  EXPECT_EQ(counts.count("/status") + counts.count("/diagnostics"), 2u);
  ASSERT_EQ(run("beacon_mcl " + in_ + " " + out_ + " --pose-only").exit_code, 0);
  counts = counts_of(out_);
  EXPECT_EQ(counts.count("/pose"), 1u);
  EXPECT_EQ(counts.count("/particles") + counts.count("/status") + counts.count("/diagnostics"),
            0u);
}

TEST_F(RunBag, TakesParametersFromFilesAndTheCommandLine) {
  const std::string first =
      directory_.write("a.yaml", "particles: 300\nexcitation: {method: none}\n");
  const std::string second = directory_.write(
      "b.yaml", "particles: 500\ncalibration: [{beacon: -1, scale: 1.0, sigma: 0.1}]\n");
  const ProgramResult result =
      run("beacon_mcl --parameters --config " + first + " --config " + second +
          " --set population/resampling/scheme=stratified --seed 5");
  ASSERT_EQ(result.exit_code, 0) << result.error;
  for (const char* word : {"\nparticles: 500\n", "method: none", "scheme: stratified", "seed: 5"}) {
    EXPECT_TRUE(says(result.out, word));
  }
  // What it prints is a configuration that it takes.
  const std::string all = directory_.write("all.yaml", result.out);
  EXPECT_EQ(run("beacon_mcl --parameters --config " + all).out, result.out);
}

TEST_F(RunBag, EachMistakeGetsOneLine) {
  expect_error("beacon_mcl " + directory_.file("none.bag") + " " + out_, {"none.bag", "no such"});
  expect_error("fastslam9 " + in_ + " " + out_, {"fastslam9", "beacon_mcl"});
  expect_error("beacon_mcl " + in_ + " " + in_, {"is the same file as in.bag"});

  const std::string poor = directory_.file("poor.bag");
  write_drive(poor, 5.0, {true, false, true});
  expect_error("beacon_mcl " + poor + " " + out_,
               {"there are no ranges", "/odom (nav_msgs/Odometry)", "check_bag"});
  write_drive(poor, 5.0, {false, true, true});
  expect_error("beacon_mcl " + poor + " " + out_,
               {"none of its ranges", "/ranges (pf_resampling/BeaconRange)"});
  write_drive(poor, 5.0, {true, true, false});
  expect_error("beacon_mcl " + poor + " " + out_, {"beacons"});
  expect_error("beacon_mcl " + in_ + " " + out_ + " --odom /ranges", {"nav_msgs/Odometry"});

  expect_error("beacon_mcl " + in_ + " " + out_ + " --set population/resampling/scheme=lottery",
               {"population/resampling/scheme", "lottery", "systematic", "stratified"});
  expect_error("beacon_mcl " + in_ + " " + out_ + " --seed -1", {"seed", "-1"});
  expect_error("beacon_mcl " + in_ + " " + out_ + " --config " + directory_.file("no.yaml"),
               {"no.yaml", "no such file"});
  // Every message of odometry is in a frame that nobody expects.
  expect_error("beacon_mcl " + in_ + " " + out_ + " --set frames/base=trailer",
               {"none of its ranges were used", "wrong_frame", "base_link", "trailer"});
  EXPECT_EQ(directory_.listing(), "in.bag poor.bag");
  EXPECT_EQ(run("beacon_mcl " + in_).exit_code, 2);
  EXPECT_EQ(run("beacon_mcl " + in_ + " " + out_ + " --sed 1").exit_code, 2);
}

// A pipeline lets no exception out: that of a disk that is full is told of all the same.
TEST_F(RunBag, ADiskThatGetsFullIsAnErrorAndLeavesNothing) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 20000;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  // Where coverage is counted (scripts/coverage), the counts would be cut off at the limit, too:
  // those of this run are written where nobody looks for them.
  setenv("GCOV_PREFIX", directory_.file("counts").c_str(), 1);
  setrlimit(RLIMIT_FSIZE, &limit);
  expect_error("beacon_mcl " + in_ + " " + out_, {"out.bag", "File too large"});
  setrlimit(RLIMIT_FSIZE, &before);
  unsetenv("GCOV_PREFIX");
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(RunBag, BeaconsMayComeFromAFile) {
  const std::string poor = directory_.file("poor.bag");
  write_drive(poor, 10.0, {true, true, false});
  std::string yaml = "beacons:\n";
  for (const Beacon& beacon : BeaconMclDrive::beacons()) {
    yaml += "  - {id: " + std::to_string(beacon.id) +
            ", x: " + std::to_string(beacon.position.x()) +
            ", y: " + std::to_string(beacon.position.y()) + "}\n";
  }
  const std::string beacons = directory_.write("beacons.yaml", yaml);
  const ProgramResult result = run("beacon_mcl " + poor + " " + out_ + " --config " + beacons);
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_GT(counts_of(out_)["/pose"], 90u);
  EXPECT_EQ(counts_of(out_)["/beacons"], 1u) << "for those who judge and draw";
}

// Half of the drive, or the drive from its halves: what is said once, before, is known.
TEST_F(RunBag, TakesAPartOfABagAndSeveral) {
  const auto poses = [&](const std::string& options) {
    const ProgramResult result = run("beacon_mcl " + in_ + " " + out_ + options);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    return counts_of(out_)["/pose"];
  };
  const std::uint64_t all = poses("");
  EXPECT_NEAR(static_cast<double>(poses(" --start 5")), static_cast<double>(all) - 50.0, 15.0);
  EXPECT_EQ(counts_of(out_)["/beacons"], 1u);
  EXPECT_LT(poses(" --duration 5"), all - 20);
  EXPECT_EQ(poses(" --topics odom --topics ranges --topics beacons --topics /tf_static"), all);
  EXPECT_EQ(counts_of(out_).count("/ground_truth"), 0u);
  // The poses as evo reads them.
  poses(" --tum " + directory_.file("path.tum"));
  const std::string path = read_file(directory_.file("path.tum"));
  EXPECT_EQ(static_cast<std::uint64_t>(std::count(path.begin(), path.end(), '\n')), all);
}

TEST_F(RunBag, RangesMayBeOfSensorMsgs) {
  ASSERT_EQ(run("beacon_mcl " + in_ + " " + out_).exit_code, 0);
  const auto poses = counts_of(out_)["/pose"];
  write_drive(in_, 20.0, {true, false, true, true});
  const ProgramResult result = run("beacon_mcl " + in_ + " " + out_);
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(counts_of(out_)["/pose"], poses);
  EXPECT_FALSE(says(result.out, "rejected"));
  EXPECT_EQ(counts_of(out_)["/sensor_ranges"], counts_of(in_)["/sensor_ranges"]);
}

// ---- checkpoints --------------------------------------------------------------------------------

// All of a bag until `cut`, s after its start, and the rest; where sensors are goes into both.
void split(const std::string& path, double cut, const std::string& first, const std::string& rest) {
  const ros::Time end = rosbag::View(open_bag(path)).getBeginTime() + ros::Duration(cut);
  for (const bool is_first : {true, false}) {
    rewrite_bag(path, is_first ? first : rest, [&](const auto& message, BagWriter* writer) {
      const bool is_static = message.getTopic() == "/tf_static";
      if (is_static || (message.getTime() <= end) == is_first) writer->copy(message);
    });
  }
}

// The whole bag at once, and in two runs: what the filter knows at the end is the same, byte for
// byte.
TEST_F(RunBag, GoesOnFromACheckpointToTheSameBytes) {
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + directory_.file("slam.bag") +
                        " --duration 30 --seed 4")
                .exit_code,
            0);
  const struct {
    std::string filter, bag;
  } cases[] = {{"beacon_mcl", in_}, {"fastslam --set particles=40", directory_.file("slam.bag")}};
  const auto file = [&](const char* name) { return directory_.file(name); };
  for (const auto& [filter, bag] : cases) {
    SCOPED_TRACE(filter);
    split(bag, 12.0, file("first.bag"), file("rest.bag"));
    const std::string options = " --seed 3 --pose-only ";
    const auto run_one = [&](const std::string& in, const std::string& more) {
      const ProgramResult result = run(filter + " " + in + " " + out_ + options + more);
      EXPECT_EQ(result.exit_code, 0) << result.error;
      EXPECT_TRUE(says(result.out, "checkpoint written to "));
    };
    run_one(bag, "--save-checkpoint " + file("whole"));
    run_one(file("first.bag"), "--save-checkpoint " + file("half"));
    run_one(file("rest.bag"), "--resume " + file("half") + " --save-checkpoint " + file("both"));
    EXPECT_GT(read_file(file("whole")).size(), 1000u);
    EXPECT_TRUE(read_file(file("whole")) == read_file(file("both")));
    EXPECT_FALSE(read_file(file("whole")) == read_file(file("half")));
  }
  expect_error("beacon_mcl " + in_ + " " + out_ + " --resume " + file("half"),
               {"filter: \"beacon_mcl\" expected, \"fastslam\" found"});
  expect_error("beacon_mcl " + in_ + " " + out_ + " --resume " + file("none"), {"cannot be read"});
}

}  // namespace
}  // namespace pf_resampling
