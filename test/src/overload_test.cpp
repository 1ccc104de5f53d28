// What both pipelines say when more observations come than the queue holds.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>

#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

// Nothing is worked off: all but the longest queue is dropped. That odometry is there for it tells
// computation that is too slow from odometry that does not come.
template <typename AnyRig, typename Drive, typename Options, typename Message>
void expect_reasons(Options options, const std::string& input,
                    const std::function<bool(const Message&)>& is_odometry) {
  options.deferred = true;
  options.queue_length = 5;
  options.max_ahead = 1e6;
  const std::vector<Message> messages = Drive::messages(20.0);  // 101 observations
  AnyRig slow(options);
  slow.feed(messages);
  EXPECT_EQ(slow.pipeline.queued(), 5);
  EXPECT_EQ(slow.pipeline.rejects().count(input, RejectReason::overload), 96u);
  EXPECT_EQ(slow.pipeline.rejects().count(input, RejectReason::queue_full), 0u);
  ASSERT_FALSE(slow.out.log.empty());
  EXPECT_NE(slow.out.log.back().find("wait for computation"), std::string::npos);

  AnyRig deaf(options);
  bool has_odometry = false;
  for (const Message& message : messages) {
    if (is_odometry(message) && std::exchange(has_odometry, true)) continue;
    deaf.feed({message});
  }
  EXPECT_EQ(deaf.pipeline.rejects().count(input, RejectReason::queue_full), 96u);
  EXPECT_EQ(deaf.pipeline.rejects().count(input, RejectReason::overload), 0u);
  EXPECT_NE(deaf.out.log.back().find("wait for odometry"), std::string::npos);
}

TEST(Overload, BeaconMclTellsSlowComputationFromMissingOdometry) {
  expect_reasons<Rig, BeaconMclDrive, BeaconMclPipelineOptions, BeaconMclMessage>(
      BeaconMclDrive::options(), "ranges", [](const BeaconMclMessage& message) {
        return std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message);
      });
}

TEST(Overload, FastSlamTellsSlowComputationFromMissingOdometry) {
  expect_reasons<FastSlamRig, FastSlamDrive, FastSlamPipelineOptions, FastSlamMessage>(
      FastSlamDrive::options(), "landmarks", [](const FastSlamMessage& message) {
        return std::holds_alternative<nav_msgs::Odometry::ConstPtr>(message);
      });
}

// Somebody forgot beacons:=. What waits in vain is dropped, which no faster computer would help.
TEST(Overload, BeaconsThatDoNotComeAreNone) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.queue_length = 5;
  Rig run(options);
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(20.0)) {
    if (!std::holds_alternative<BeaconArray::ConstPtr>(message)) run.feed({message});
  }
  EXPECT_GT(run.pipeline.rejects().count("ranges", RejectReason::queue_full), 50u);
  EXPECT_TRUE(
      run.has_said("wait for the beacons: the oldest is dropped; they come on the topic "
                   "beacons (beacons:= names another)"));
  ASSERT_FALSE(run.out.diagnostics.empty());
  for (const diagnostic_msgs::DiagnosticArray& said : run.out.diagnostics) {
    for (const auto& status : said.status) {
      EXPECT_EQ(status.message.find("dropped"), std::string::npos) << status.message;
    }
  }
}

}  // namespace
}  // namespace pf_resampling
