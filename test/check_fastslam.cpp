// Plays a bag to the running fastslam_node and checks what it publishes against the truth in the
// bag. Private parameters: make_bag (a program of this package that writes the bag, with BAG for
// its name), rate (of playing), restart_at (s of the bag after which the map is saved, the node
// killed and another started with that map; this program starts the nodes then), switch (a node
// whose strategies are switched meanwhile), landmarks (that there are), maximum_error (m), and
// maximum_end_error in the last 2 s, inside_share, maximum_map_error (m, RMS, aligned).
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>
#include <pf_resampling/SaveMap.h>
#include <ros/ros.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/filter_listener.hpp"
#include "test/node_process.hpp"
#include "test/places.hpp"
#include "test/strategy_switcher.hpp"

namespace pf_resampling {
namespace {

const std::string kPrograms = kProgramsFolder;

/// The node as the launch file has it, on parameters of that name; with a folder for its maps, and
/// a map to start with.
void start_node(const std::string& folder, const std::string& map,
                std::optional<NodeProcess>* node) {
  std::vector<std::string> arguments = {"__name:=fastslam", "_map_file/directory:=" + folder};
  if (!map.empty()) arguments.push_back("_map_file/load:=" + map);
  node->emplace(kPrograms + "/fastslam_node", arguments);
  ASSERT_TRUE(ros::service::waitForService("save_map", ros::Duration(20.0)));
}

/// Saves the map of a node in that folder, kills the node and starts another with the map.
void restart(const std::string& folder, std::optional<NodeProcess>* node) {
  SaveMap call;
  call.request.file = "saved.map";
  ASSERT_TRUE(ros::service::call("save_map", call));
  ASSERT_TRUE(call.response.success) << call.response.message;
  ASSERT_TRUE((*node)->is_running());
  (*node)->kill_it();
  ASSERT_FALSE(ros::service::exists("save_map", false)) << "somebody else is there";
  start_node(folder, folder + "/saved.map", node);
}

std::vector<PointLandmark> to_landmarks(const LandmarkMap& map) {
  std::vector<PointLandmark> landmarks;
  for (const Landmark& landmark : map.landmarks) {
    PointLandmark point;
    point.id = landmark.id;
    point.position << landmark.position.x, landmark.position.y;
    landmarks.push_back(point);
  }
  return landmarks;
}

class FastSlamNode : public testing::Test {
 protected:
  void play(double start, double duration) const {
    // The pause lets all subscribers connect.
    ASSERT_TRUE(run("rosbag play --quiet --clock --delay 3 --rate " +
                    std::to_string(settings_.param("rate", 1.0)) + " --start " +
                    std::to_string(start) + " --duration " + std::to_string(duration) + " " + bag_ +
                    " > /dev/null"));
  }

  // From the first pose on, one for every message of odometry, at its stamp, and all finite.
  void expect_all_is_published() {
    ASSERT_GT(heard_.odometry.size(), 1000u) << "the bag did not arrive";
    ASSERT_GT(heard_.beliefs.size(), 1000u) << "the node gave no poses";
    EXPECT_LT(heard_.beliefs.begin()->first - *heard_.odometry.begin(), 0.5);
    EXPECT_LT(*heard_.odometry.rbegin() - heard_.beliefs.rbegin()->first, 0.1);
    for (auto stamp = heard_.odometry.lower_bound(heard_.beliefs.begin()->first);
         stamp != heard_.odometry.end(); ++stamp) {
      EXPECT_EQ(heard_.beliefs.count(*stamp), 1u) << "no pose at " << *stamp;
    }
    EXPECT_EQ(heard_.poses, static_cast<int>(heard_.beliefs.size())) << "a stamp came twice";
    for (const char* topic : {"pose", "tf", "path", "particlecloud", "particles", "markers",
                              "status", "landmark_map"}) {
      EXPECT_GT(heard_.finite[topic], 3) << topic;
      EXPECT_EQ(heard_.not_finite[topic], 0) << topic;
    }
    EXPECT_GE(heard_.finite["tf"], static_cast<int>(heard_.beliefs.size()));
  }

  void expect_poses_are_true() {
    int compared = 0;
    int inside = 0;
    double sum = 0.0;
    double worst = 0.0;
    double worst_at_end = 0.0;
    for (const auto& [time, truth] : heard_.truth) {
      const auto comparison = compare(heard_.beliefs, time, truth);
      if (!comparison) continue;
      ++compared;
      // At the start the place is known without any doubt: nothing to divide by.
      inside += comparison->distance <= kThreeSigma || comparison->error < 1e-6 ? 1 : 0;
      sum += comparison->error;
      worst = std::max(worst, comparison->error);
      if (time > heard_.truth.rbegin()->first - 2.0) {
        worst_at_end = std::max(worst_at_end, comparison->error);
      }
    }
    std::printf(
        "%d true poses: error mean %.3f m, maximum %.3f m, in the last 2 s %.3f m, inside 3 sigma "
        "%.1f %%\n",
        compared, sum / compared, worst, worst_at_end, 100.0 * inside / compared);
    EXPECT_GT(compared, 0.95 * static_cast<double>(heard_.truth.size()));
    EXPECT_LT(worst, settings_.param("maximum_error", 1.0));
    EXPECT_LT(worst_at_end, settings_.param("maximum_end_error", 0.5));
    EXPECT_GE(inside, settings_.param("inside_share", 0.9) * compared);
  }

  // Its shape; where it lies depends on how well the start was seen.
  void expect_map_is_true() {
    EXPECT_EQ(static_cast<int>(heard_.map.landmarks.size()), settings_.param("landmarks", 30));
    ASSERT_FALSE(heard_.map.landmarks.empty());
    MapErrorOptions options;
    options.matching = LandmarkMatching::id;
    const MapErrors errors =
        evaluate_map(to_landmarks(heard_.map), to_landmarks(heard_.true_map), options);
    EXPECT_EQ(errors.false_landmarks, 0);
    ASSERT_TRUE(errors.rms_aligned.has_value());
    std::printf("%d landmarks, RMS error %.3f m, aligned %.3f m\n", errors.landmarks, *errors.rms,
                *errors.rms_aligned);
    EXPECT_LT(*errors.rms_aligned, settings_.param("maximum_map_error", 0.4));
  }

  // While odometry comes, and after the first seconds, in which there is no landmark yet.
  void expect_diagnostics_are_fine() {
    const double first = heard_.beliefs.begin()->first + 2.0;
    const double last = heard_.beliefs.rbegin()->first;
    int fine = 0;
    int all = 0;
    for (const diagnostic_msgs::DiagnosticArray& array : heard_.diagnostics) {
      const double stamp = array.header.stamp.toSec();
      for (const diagnostic_msgs::DiagnosticStatus& status : array.status) {
        if (stamp < first || stamp > last || status.name.rfind("fastslam", 0) != 0) continue;
        ++all;
        fine += status.level == diagnostic_msgs::DiagnosticStatus::OK ? 1 : 0;
        EXPECT_NE(status.level, diagnostic_msgs::DiagnosticStatus::ERROR)
            << stamp << " s: " << status.name << ": " << status.message;
        if (status.level != diagnostic_msgs::DiagnosticStatus::OK) {
          std::printf("%.1f s: %s: %s\n", stamp, status.name.c_str(), status.message.c_str());
        }
      }
    }
    std::printf("diagnostics: %d of %d are fine\n", fine, all);
    EXPECT_GT(all, 60);
    EXPECT_GE(fine, 0.9 * all);
    EXPECT_TRUE(heard_.status.rejects.empty()) << heard_.status.rejects.front().reason;
    // Of 327 observations beyond 13.8, two degrees of freedom, 0.3 are so by chance.
    EXPECT_LE(heard_.status.not_believed, 20u);
  }

  ros::NodeHandle node_;
  ros::NodeHandle settings_{"~"};
  TemporaryDirectory directory_;
  std::string bag_ = directory_.file("in.bag");
  FilterListener heard_{&node_};
};

TEST_F(FastSlamNode, FollowsAndMapsTheTruth) {
  const auto make_bag = settings_.param<std::string>("make_bag", "");
  ASSERT_EQ(
      std::system((kPrograms + "/" + replaced(make_bag, "BAG", bag_) + " > /dev/null").c_str()), 0);
  const double restart_at = settings_.param("restart_at", 0.0);
  const auto switched = settings_.param<std::string>("switch", "");
  constexpr double kToTheEnd = 1e4;
  if (restart_at > 0.0) {
    std::optional<NodeProcess> filter;
    ASSERT_NO_FATAL_FAILURE(start_node(directory_.path(), "", &filter));
    ASSERT_NO_FATAL_FAILURE(play(0.0, restart_at));
    const std::uint64_t updates = heard_.status.updates;
    EXPECT_GT(updates, 50u);
    EXPECT_GT(heard_.map.landmarks.size(), 5u);
    ASSERT_NO_FATAL_FAILURE(restart(directory_.path(), &filter));
    ASSERT_NO_FATAL_FAILURE(play(restart_at, kToTheEnd));
    EXPECT_LT(heard_.status.updates, updates) << "this is no other node";
    EXPECT_TRUE(filter->is_running());
  } else {
    std::optional<StrategySwitcher> switcher;
    if (!switched.empty()) switcher.emplace(switched, 0.1);
    ASSERT_NO_FATAL_FAILURE(play(0.0, kToTheEnd));
    if (switcher) {
      const int rounds = switcher->stop();
      std::printf("%d times through all strategies\n", rounds);
      // The first may have been over before the bag began.
      EXPECT_GE(rounds, 2) << "not every strategy had its turn";
    }
    EXPECT_GE(heard_.status.updates, 170u) << "of 180 scans";
  }
  ASSERT_NO_FATAL_FAILURE(expect_all_is_published());
  expect_poses_are_true();
  expect_map_is_true();
  expect_diagnostics_are_fine();
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_fastslam");
  return RUN_ALL_TESTS();
}
