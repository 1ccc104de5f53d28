// run_bag fastslam, on the reference world and on a recording.
#include <gtest/gtest.h>
#include <rosbag/view.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "common/bag.hpp"
#include "common/bag_contents.hpp"
#include "common/files.hpp"
#include "pf_resampling/ParticleErrors.h"
#include "pf_resampling/conversions.hpp"
#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/fastslam/saved_map.hpp"
#include "run_program.hpp"

namespace pf_resampling {
namespace {

// Odometry comes at 40 Hz from 1 s on, scans at every fifth of a second; both have the stamp 20 s.
constexpr double kAtAScan = 20.0;
constexpr double kBetweenScans = 20.1;
constexpr double kForever = std::numeric_limits<double>::infinity();

/// The messages of a bag between two times, without the topics `left_out`. At both cuts odometry is
/// included, so that no motion is lost, a scan only at the end. What is latched comes along.
void cut(const std::string& in, const std::string& out, double from, double until,
         const std::set<std::string>& left_out = {}) {
  const rosbag::Bag bag = open_bag(in);
  rosbag::View view(bag);
  BagWriter writer(out);
  for (const rosbag::MessageInstance& message : view) {
    const double time = message.getTime().toSec();
    const std::string& topic = message.getTopic();
    if (left_out.count(topic) > 0) continue;
    const bool is_latched = topic == "/tf_static" || topic == "/ground_truth_landmarks";
    const bool is_within =
        time <= until + 1e-6 &&
        (topic == "/landmarks" && from > view.getBeginTime().toSec() ? time > from + 1e-6
                                                                     : time >= from - 1e-6);
    if (is_latched || is_within) writer.copy(message);
  }
  writer.finish();
}

std::map<std::string, std::uint64_t> counts_of(const std::string& path) {
  std::map<std::string, std::uint64_t> counts;
  for (const BagTopic& topic : topics_of(open_bag(path))) counts[topic.name] = topic.messages;
  return counts;
}

double distance(const TruePose& truth, const EstimatedPose& pose) {
  return std::hypot(truth.x - pose.pose.x, truth.y - pose.pose.y);
}

/// Of the poses of a run's output, from a time on, against the truth at the same times: m.
struct PoseErrors {
  double mean = 0.0;
  double worst = 0.0;
  double last = 0.0;
};
PoseErrors pose_errors(const std::string& path, double from = 0.0) {
  const rosbag::Bag bag = open_bag(path);
  const std::vector<TruePose> truth = read_truth(bag, "/ground_truth");
  const std::vector<EstimatedPose> poses = read_poses(bag, "/pose");
  EXPECT_EQ(truth.size(), poses.size());
  PoseErrors errors;
  int count = 0;
  for (std::size_t i = 0; i < std::min(truth.size(), poses.size()); ++i) {
    EXPECT_NEAR(truth[i].time, poses[i].time, 1e-6);
    if (poses[i].time < from) continue;
    errors.last = distance(truth[i], poses[i]);
    errors.worst = std::max(errors.worst, errors.last);
    errors.mean += errors.last;
    ++count;
  }
  errors.mean /= count;
  return errors;
}

/// RMS of the last map against the landmarks of the same ids, m: the filter begins where the truth
/// does, so both have the same frame.
double map_rms(const std::string& path) {
  const rosbag::Bag bag = open_bag(path);
  const auto map = read_landmark_map(bag, "/landmark_map").value();
  const auto truth = read_landmark_map(bag, "/ground_truth_landmarks").value();
  EXPECT_FALSE(map.empty());
  double sum = 0.0;
  for (const PointLandmark& landmark : map) {
    const auto same = std::find_if(truth.begin(), truth.end(), [&](const PointLandmark& other) {
      return other.id == landmark.id;
    });
    EXPECT_NE(same, truth.end()) << "landmark " << landmark.id;
    if (same != truth.end()) sum += (landmark.position - same->position).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(map.size()));
}

ProgramResult run(const std::string& arguments) {
  return run_program("run_bag fastslam " + arguments);
}

void expect_success(const std::string& arguments) {
  const ProgramResult result = run(arguments);
  ASSERT_EQ(result.exit_code, 0) << arguments << "\n" << result.error;
  EXPECT_EQ(result.error, "") << arguments;
}

void simulate(const std::string& path, const std::string& more) {
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + path + " " + more).exit_code, 0);
}

const std::vector<std::string> kMethods = {"known", "maximum_likelihood", "mutual_exclusion"};

std::string with_method(const std::string& method) {
  return " --set association/method=" + method;
}

class RunBagFastSlam : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<TemporaryDirectory>();
    world_ = shared_->file("world.bag");
    simulate(world_, "--seed 1");
  }
  static void TearDownTestSuite() { shared_.reset(); }

  void expect_error(const std::string& arguments, const std::vector<std::string>& words) const {
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_TRUE(result.is_one_line_error("run_bag")) << result.out << result.error;
    for (const std::string& word : words) {
      EXPECT_NE(result.error.find(word), std::string::npos) << word << " in " << result.error;
    }
  }

  static std::unique_ptr<TemporaryDirectory> shared_;
  static std::string world_;
  TemporaryDirectory directory_;
  std::string out_ = directory_.file("out.bag");
  std::string map_ = directory_.file("a.map");
};

std::unique_ptr<TemporaryDirectory> RunBagFastSlam::shared_;
std::string RunBagFastSlam::world_;

// ---- the same again ---------------------------------------------------------------------------

/// The bytes of bag and map that a run gives.
std::string bytes_of_run(const std::string& in, const std::string& more,
                         const TemporaryDirectory& directory) {
  const std::string out = directory.file("bytes.bag");
  const std::string map = directory.file("bytes.map");
  expect_success(in + " " + out + " --save-map " + map + " " + more);
  return read_file(out) + read_file(map);
}

TEST_F(RunBagFastSlam, SameSeedGivesTheSameBytesAtAnyNumberOfThreads) {
  for (const std::string& method : kMethods) {
    SCOPED_TRACE(method);
    const auto bytes = [&](const std::string& more) {
      return bytes_of_run(world_, more + with_method(method), directory_);
    };
    const std::string first = bytes("--seed 7 --threads 1");
    EXPECT_GT(first.size(), read_file(world_).size());
    EXPECT_TRUE(first == bytes("--seed 7 --threads 1")) << "twice in a row";
    EXPECT_TRUE(first == bytes("--seed 7 --threads 2")) << "with two threads";
    EXPECT_FALSE(first == bytes("--seed 8 --threads 1")) << "with another seed";
  }
}

TEST_F(RunBagFastSlam, IsReproducibleOnARecording) {
  const std::string recording = std::string(PF_RESAMPLING_DATASETS) + "/mrclam6";
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << recording << " is not there";
  const std::string all = directory_.file("all.bag");
  ASSERT_EQ(run_program("dataset_to_bag mrclam " + recording + " " + all + " --robot 1").exit_code,
            0);
  const std::string in = directory_.file("in.bag");
  const double begin = rosbag::View(open_bag(all)).getBeginTime().toSec();
  cut(all, in, begin, begin + 240.0);
  ASSERT_GT(counts_of(in)["/landmarks"], 100u);
  for (const std::string& method : {kMethods.front(), kMethods.back()}) {
    SCOPED_TRACE(method);
    const auto bytes = [&](const std::string& threads) {
      return bytes_of_run(in, "--seed 1 --threads " + threads + with_method(method), directory_);
    };
    const std::string first = bytes("1");
    EXPECT_TRUE(first == bytes("1")) << "twice in a row";
    EXPECT_TRUE(first == bytes("2")) << "with two threads";
  }
}

// ---- maps -------------------------------------------------------------------------------------

TEST_F(RunBagFastSlam, TheOutputHoldsPosesAndTheMapThatIsSaved) {
  expect_success(world_ + " " + out_ + " --save-map " + map_);
  auto counts = counts_of(out_);
  for (const auto& [topic, count] : counts_of(world_)) {
    if (topic == "/tf") continue;
    EXPECT_EQ(counts[topic], count) << topic;
  }
  EXPECT_EQ(counts["/pose"], counts["/odom"]);
  EXPECT_EQ(counts["/tf"], 2 * counts["/odom"]);
  EXPECT_EQ(counts["/status"], counts["/landmarks"]);
  const auto published = read_landmark_map(open_bag(out_), "/landmark_map").value();
  const SavedMap saved = read_map_file(map_);
  EXPECT_EQ(saved.frame, "map");
  EXPECT_EQ(saved.particles.size(), 1000u);
  ASSERT_EQ(published.size(), 30u);
  ASSERT_EQ(saved.landmarks.size(), 30u);
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(published[i].id, saved.landmarks[i].estimate.id);
    EXPECT_EQ(published[i].position, saved.landmarks[i].estimate.mean);
  }
  // In the last two seconds dead reckoning is off by 1.0 to 1.6 m; both loops are closed then.
  EXPECT_LT(pose_errors(out_, 35.7).worst, 0.9);
  // What is left after alignment is of the size of one sighting's noise at 5 m: 0.13 m.
  const auto truth = read_landmark_map(open_bag(out_), "/ground_truth_landmarks").value();
  EXPECT_LT(evaluate_map(published, truth).rms_aligned.value(), 0.4);
}

// Interrupted at a scan, everything is in the file: what comes then is the same to the bit.
TEST_F(RunBagFastSlam, GoingOnFromASavedMapIsAsIfNothingHadHappened) {
  const std::string before = directory_.file("before.bag");
  const std::string after = directory_.file("after.bag");
  cut(world_, before, 0.0, kAtAScan);
  cut(world_, after, kAtAScan, kForever);
  const std::string whole_out = directory_.file("whole_out.bag");
  const std::string whole_map = directory_.file("whole.map");
  const std::string end_map = directory_.file("end.map");
  for (const std::string& method : kMethods) {
    SCOPED_TRACE(method);
    const std::string options = " --no-clouds --seed 3" + with_method(method);
    expect_success(world_ + " " + whole_out + " --save-map " + whole_map + options);
    expect_success(before + " " + out_ + " --save-map " + map_ + options);
    expect_success(after + " " + out_ + " --load-map " + map_ + " --save-map " + end_map + options);
    EXPECT_TRUE(read_file(end_map) == read_file(whole_map));
    EXPECT_FALSE(read_file(end_map) == read_file(map_));

    const auto poses = read_poses(open_bag(out_), "/pose");
    const auto whole = read_poses(open_bag(whole_out), "/pose");
    ASSERT_GT(poses.size(), 600u);
    ASSERT_GT(whole.size(), poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const EstimatedPose& expected = whole[whole.size() - poses.size() + i];
      ASSERT_EQ(poses[i].time, expected.time);
      ASSERT_EQ(poses[i].pose.x, expected.pose.x) << poses[i].time;
      ASSERT_EQ(poses[i].pose.y, expected.pose.y) << poses[i].time;
      ASSERT_EQ(poses[i].pose.heading, expected.pose.heading) << poses[i].time;
    }
  }
}

struct Moments {
  explicit Moments(const std::vector<double>& values) {
    const double count = static_cast<double>(values.size());
    for (const double value : values) mean += value / count;
    for (const double value : values) variance += std::pow(value - mean, 2) / (count - 1.0);
  }
  double mean = 0.0;
  double variance = 0.0;
};

// Interrupted anywhere else, each particle draws how it got from its last scan to where the map
// was saved: errors are as large as uninterrupted, but not the same. Twelve seeds each; with 22
// degrees of freedom a difference of 6.7 standard errors is one of 1e-6.
TEST_F(RunBagFastSlam, ErrorsAfterGoingOnAreThoseOfUninterruptedRuns) {
  const std::string before = directory_.file("before.bag");
  const std::string after = directory_.file("after.bag");
  cut(world_, before, 0.0, kBetweenScans);
  cut(world_, after, kBetweenScans, kForever);
  std::vector<double> map_errors[2], position_errors[2];
  for (int i = 0; i < 12; ++i) {
    const auto options = [&](int seed) { return " --no-clouds --seed " + std::to_string(seed); };
    expect_success(world_ + " " + out_ + options(1 + i));
    map_errors[0].push_back(map_rms(out_));
    position_errors[0].push_back(pose_errors(out_, kBetweenScans).mean);
    expect_success(before + " " + out_ + " --save-map " + map_ + options(101 + i));
    expect_success(after + " " + out_ + " --load-map " + map_ + options(201 + i));
    EXPECT_EQ(read_landmark_map(open_bag(out_), "/landmark_map")->size(), 30u);
    map_errors[1].push_back(map_rms(out_));
    position_errors[1].push_back(pose_errors(out_, kBetweenScans).mean);
  }
  for (const auto* errors : {&map_errors, &position_errors}) {
    const Moments uninterrupted((*errors)[0]);
    const Moments interrupted((*errors)[1]);
    std::printf("uninterrupted %.3f m (sigma %.3f m), interrupted %.3f m (sigma %.3f m)\n",
                uninterrupted.mean, std::sqrt(uninterrupted.variance), interrupted.mean,
                std::sqrt(interrupted.variance));
    EXPECT_LT(std::abs(interrupted.mean - uninterrupted.mean),
              6.7 * std::sqrt((uninterrupted.variance + interrupted.variance) / 12.0));
  }
}

TEST_F(RunBagFastSlam, AFrozenMapIsLocalizedInAndStaysAsItIs) {
  expect_success(world_ + " " + out_ + " --no-clouds --save-map " + map_);
  // Another day: other noise, and the robot starts where it did the first time.
  const std::string other = directory_.file("other.bag");
  simulate(other, "--seed 2");
  const std::string in = directory_.file("in.bag");
  {
    const rosbag::Bag bag = open_bag(other);
    rosbag::View view(bag);
    geometry_msgs::PoseWithCovarianceStamped start;
    start.header.stamp = ros::Time(1.0);
    start.header.frame_id = "map";
    start.pose.pose.orientation.w = 1.0;
    start.pose.covariance[0] = start.pose.covariance[7] = 0.01;
    start.pose.covariance[35] = 1e-4;
    BagWriter writer(in);
    bool is_written = false;
    for (const rosbag::MessageInstance& message : view) {
      if (!is_written && message.getTime() >= start.header.stamp) {
        writer.write("/initialpose", start.header.stamp, start);
        is_written = true;
      }
      writer.copy(message);
    }
    writer.finish();
  }
  const std::string map_after = directory_.file("after.map");
  const std::string frozen = " --no-clouds --load-map " + map_ + " --save-map " + map_after +
                             " --seed 5 --set map/frozen=true";
  expect_success(in + " " + out_ + frozen);
  const SavedMap before = read_map_file(map_);
  const SavedMap after = read_map_file(map_after);
  ASSERT_EQ(after.landmarks.size(), before.landmarks.size());
  for (std::size_t i = 0; i < after.landmarks.size(); ++i) {
    EXPECT_EQ(after.landmarks[i].estimate.id, before.landmarks[i].estimate.id);
    EXPECT_EQ(after.landmarks[i].estimate.mean, before.landmarks[i].estimate.mean);
    EXPECT_EQ(after.landmarks[i].estimate.covariance, before.landmarks[i].estimate.covariance);
  }
  // Localized to what the map is worth, all the time.
  const PoseErrors errors = pose_errors(out_);
  std::printf("in the frozen map: error mean %.3f m, maximum %.3f m\n", errors.mean, errors.worst);
  EXPECT_LT(errors.mean, 0.4);
  EXPECT_LT(errors.worst, 1.0);
}

// ---- particles' errors ------------------------------------------------------------------------

TEST_F(RunBagFastSlam, ParticleErrorsAreThoseOfTheParticlesThatArePublished) {
  // Without delays of the odometry that are estimated, which particles are published without.
  const ProgramResult result =
      run(world_ + " " + out_ + " --set particles=50 --set output/cloud_period=0" +
          " --set odometry_errors/estimate=false");
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_NE(result.out.find("particles' errors"), std::string::npos) << result.out;
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
  EXPECT_EQ(result.out.find("particles' errors"), std::string::npos) << result.out;
  EXPECT_EQ(counts_of(out_).count("/particle_errors"), 0u);
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
  // Of the sensor's place only /tf_static tells: without it there are poses, but no map.
  cut(world_, poor, 0.0, 5.0, {"/tf_static"});
  const ProgramResult blind = run(poor + " " + out_ + " --no-clouds");
  EXPECT_EQ(blind.exit_code, 0) << blind.error;
  EXPECT_NE(blind.out.find("unknown_frame"), std::string::npos) << blind.out;
  std::filesystem::remove(out_);

  cut(world_, poor, 0.0, 5.0);
  expect_success(poor + " " + out_ + " --save-map " + map_ + " --set particles=20");
  std::filesystem::remove(out_);
  const std::string whole = read_file(map_);
  std::string damaged = whole;
  char& digit = damaged[damaged.find("landmark 0 ") + 13];
  digit = digit == '7' ? '3' : '7';
  const std::string damaged_map = directory_.write("damaged.map", damaged);
  expect_error(bags + " --load-map " + damaged_map, {"damaged.map", "line", "damaged"});
  const std::string truncated = directory_.write("truncated.map", whole.substr(0, 2000));
  expect_error(bags + " --load-map " + truncated, {"truncated.map", "line", "the file ends"});
  expect_error(bags + " --load-map " + directory_.write("empty.map", ""), {"empty.map"});
  expect_error(bags + " --load-map " + world_, {"world.bag", "line 1", "not how a map begins"});
  expect_error(bags + " --load-map " + directory_.file("no.map"), {"no.map", "No such file"});
  expect_error(bags + " --load-map " + directory_.path(), {directory_.path()});
  EXPECT_EQ(directory_.listing(), "a.map damaged.map empty.map poor.bag truncated.map");

  expect_success(poor + " " + out_ + " --save-map " + map_ + with_method("mutual_exclusion"));
  std::filesystem::remove(out_);
  expect_error(bags + " --load-map " + map_ + with_method("known"),
               {"association/method", "automatic"});
  expect_error(poor + " " + out_ + " --save-map " + directory_.file("no/x.map"),
               {"no/x.map", "folder"});
  expect_error(bags + " --set map/forzen=true", {"map/forzen", "map/frozen"});
  expect_error(bags + " --set population/renewal=both", {"both", "compensation"});
  EXPECT_EQ(run_program("run_bag beacon_mcl " + bags + " --load-map " + map_).exit_code, 2);
}

}  // namespace
}  // namespace pf_resampling
