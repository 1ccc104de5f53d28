// Plays a bag to the running beacon_mcl_node and checks what it publishes against the truth in the
// bag. Private parameters: make_bag (a program of this package that writes the bag, with BAG for
// its name), needs (a file without which the test is skipped), rate and seconds (of playing),
// maximum_error (m), inside_share, switch (a node whose strategies are switched meanwhile).
#include <gtest/gtest.h>
#include <ros/ros.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "src/messages/rejects.hpp"
#include "test/filter_listener.hpp"
#include "test/places.hpp"
#include "test/strategy_switcher.hpp"

namespace pf_resampling {
namespace {

// From when the filter itself believes to know the position this well, it has converged.
constexpr double kConvergedSigma = 1.0;  // m

TEST(BeaconMclNode, FollowsTheTruth) {
  ros::NodeHandle node;
  ros::NodeHandle settings("~");
  const auto needs = settings.param<std::string>("needs", "");
  if (!needs.empty() && !std::filesystem::exists(needs)) {
    GTEST_SKIP() << needs << " is not there";
  }
  const TemporaryDirectory directory;
  const std::string bag = directory.file("in.bag");
  const auto make_bag = settings.param<std::string>("make_bag", "");
  ASSERT_EQ(std::system((std::string(kProgramsFolder) + "/" + replaced(make_bag, "BAG", bag) +
                         " > /dev/null")
                            .c_str()),
            0);
  FilterListener heard(&node);
  // The pause lets all subscribers connect.
  const auto switched = settings.param<std::string>("switch", "");
  std::optional<StrategySwitcher> switcher;
  if (!switched.empty()) switcher.emplace(switched, 0.2);
  ASSERT_TRUE(run("rosbag play --quiet --clock --delay 3 --rate " +
                  std::to_string(settings.param("rate", 1.0)) + " --duration " +
                  std::to_string(settings.param("seconds", 1000.0)) + " " + bag + " > /dev/null"));

  if (switcher) {
    EXPECT_GE(switcher->stop(), 1) << "not every strategy had its turn";
  }

  ASSERT_GT(heard.odometry.size(), 100u) << "the bag did not arrive";
  ASSERT_GT(heard.beliefs.size(), 100u) << "the node gave no poses";

  // At odometry rate: from the first pose on, one for every message of odometry, at its stamp.
  const double first = heard.beliefs.begin()->first;
  const double last = heard.beliefs.rbegin()->first;
  EXPECT_LT(first - *heard.odometry.begin(), 20.0) << "the filter took too long to start";
  EXPECT_LT(*heard.odometry.rbegin() - last, 0.5);
  int expected = 0;
  int given = 0;
  for (const double stamp : heard.odometry) {
    if (stamp < first || stamp > last) continue;
    ++expected;
    given += static_cast<int>(heard.beliefs.count(stamp));
  }
  EXPECT_EQ(given, expected);
  EXPECT_EQ(heard.poses, static_cast<int>(heard.beliefs.size())) << "a stamp came twice";

  const auto converged =
      std::find_if(heard.beliefs.begin(), heard.beliefs.end(), [](const auto& entry) {
        return std::sqrt(entry.second.covariance.trace()) < kConvergedSigma;
      });
  ASSERT_NE(converged, heard.beliefs.end()) << "the filter never converged";
  int compared = 0;
  int inside = 0;
  double sum = 0.0;
  double worst = 0.0;
  for (auto truth = heard.truth.upper_bound(converged->first); truth != heard.truth.end();
       ++truth) {
    const auto comparison = compare(heard.beliefs, truth->first, truth->second);
    if (!comparison) continue;
    ++compared;
    inside += comparison->distance <= kThreeSigma ? 1 : 0;
    sum += comparison->error;
    worst = std::max(worst, comparison->error);
  }
  std::printf(
      "converged %.1f s after the start; %d true poses: error mean %.3f m, maximum %.3f m, "
      "inside 3 sigma %.1f %%; %d poses for %d odometry messages\n",
      converged->first - *heard.odometry.begin(), compared, sum / compared, worst,
      100.0 * inside / compared, given, expected);
  EXPECT_GT(compared, 0.9 * expected);
  EXPECT_LT(worst, settings.param("maximum_error", 2.0));
  EXPECT_GE(inside, settings.param("inside_share", 0.95) * compared);

  for (const char* topic :
       {"pose", "tf", "path", "particlecloud", "particles", "markers", "status"}) {
    EXPECT_GT(heard.finite[topic], 3) << topic;
    EXPECT_EQ(heard.not_finite[topic], 0) << topic;
  }
  // Played faster than it was recorded on a machine that others use, messages may come too late
  // for the computation; that they are then dropped and counted is what is wanted.
  std::uint64_t rejected = 0;
  std::string reasons;
  for (const RejectCount& reject : heard.status.rejects) {
    if (reject.reason != to_string(RejectReason::overload)) rejected += reject.count;
    reasons += "\n  " + reject.input + ", " + reject.reason + ": " + std::to_string(reject.count);
  }
  EXPECT_GT(heard.status.updates, 50 * rejected) << "rejected:" << reasons;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_beacon_mcl");
  return RUN_ALL_TESTS();
}
