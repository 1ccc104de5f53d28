#pragma once

#include <gtest/gtest.h>
#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pf_resampling_core/test/says.hpp"
#include "test/bag_topics.hpp"
#include "test/batch_testing.hpp"
#include "test/run_program.hpp"
#include "tools/common/files.hpp"

/// What the tests of `run_bag fastslam` share: the reference world, and what comes out of a run.
namespace pf_resampling {
constexpr double kForever = std::numeric_limits<double>::infinity();

/// The messages of a bag between two times, without the topics `left_out`. At both cuts odometry is
/// included, so that no motion is lost, a scan only at the end. What is latched comes along.
inline void cut(const std::string& in, const std::string& out, double from, double until,
                const std::set<std::string>& left_out = {}) {
  const double begin = rosbag::View(open_bag(in)).getBeginTime().toSec();
  rewrite_bag(in, out, [&](const rosbag::MessageInstance& message, BagWriter* writer) {
    const double time = message.getTime().toSec();
    const std::string& topic = message.getTopic();
    if (left_out.count(topic) > 0) return;
    const bool is_latched = topic == "/tf_static" || topic == "/ground_truth_landmarks";
    const bool is_within =
        time <= until + 1e-6 &&
        (topic == "/landmarks" && from > begin ? time > from + 1e-6 : time >= from - 1e-6);
    if (is_latched || is_within) writer->copy(message);
  });
}

/// Of the poses of a run's output, from a time on, against the truth at the same times: m.
struct PoseErrors {
  double mean = 0.0;
  double worst = 0.0;
  double last = 0.0;
};
inline PoseErrors pose_errors(const std::string& path, double from = 0.0) {
  const rosbag::Bag bag = open_bag(path);
  const std::vector<StampedPose> truth = read_poses(bag, "/ground_truth");
  const std::vector<StampedPose> poses = read_poses(bag, "/pose");
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

// The tests are of the filter that resamples; arguments may choose another.
inline const std::string kRun = "run_bag fastslam --set preset=fast ";

inline ProgramResult run(const std::string& arguments) {
  return run_program(kRun + arguments);
}

inline void expect_success(const std::string& arguments) {
  const ProgramResult result = run(arguments);
  ASSERT_EQ(result.exit_code, 0) << arguments << "\n" << result.error;
  EXPECT_EQ(result.error, "") << arguments;
}

inline void simulate(const std::string& path, const std::string& more) {
  ASSERT_EQ(run_program("simulate_bag indoor_two_loops " + path + " " + more).exit_code, 0);
}

inline const std::vector<std::string> kMethods = {"known", "maximum_likelihood",
                                                  "mutual_exclusion"};

inline std::string with_method(const std::string& method) {
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

  static void expect_error(const std::string& arguments, const std::vector<std::string>& words) {
    expect_failure(kRun + arguments, 1, words);
  }

  inline static std::unique_ptr<TemporaryDirectory> shared_;
  inline static std::string world_;
  TemporaryDirectory directory_;
  std::string out_ = directory_.file("out.bag");
  std::string map_ = directory_.file("a.map");
};

}  // namespace pf_resampling
