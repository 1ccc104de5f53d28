// What both pipelines say when more observations come than the queue holds.
#include <gtest/gtest.h>

#include <utility>

#include "pf_resampling_core/test/says.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

template <typename AnyRig>
class Overload : public testing::Test {};
using Rigs = testing::Types<Rig, FastSlamRig>;
TYPED_TEST_SUITE(Overload, Rigs);

// Nothing is worked off: all but the longest queue is dropped. That odometry is there for it tells
// computation that is too slow from odometry that does not come.
TYPED_TEST(Overload, SlowComputationIsToldFromMissingOdometry) {
  auto options = TypeParam::Drive::options();
  options.deferred = true;
  options.queue_length = 5;
  options.max_ahead = 1e6;
  const auto messages = TypeParam::Drive::messages(20.0);  // 101 observations
  TypeParam slow(options), deaf(options);
  slow.feed(messages);
  EXPECT_EQ(slow.pipeline.queued(), 5);
  EXPECT_EQ(slow.rejected(TypeParam::kTopic, RejectReason::overload), 96u);
  EXPECT_EQ(slow.rejected(TypeParam::kTopic, RejectReason::queue_full), 0u);
  EXPECT_TRUE(says(slow.out.log.back(), "wait for computation"));

  bool has_odometry = false;
  for (const auto& message : messages) {
    if (TypeParam::is_odometry(message) && std::exchange(has_odometry, true)) continue;
    deaf.feed({message});
  }
  EXPECT_EQ(deaf.rejected(TypeParam::kTopic, RejectReason::queue_full), 96u);
  EXPECT_EQ(deaf.rejected(TypeParam::kTopic, RejectReason::overload), 0u);
  EXPECT_TRUE(says(deaf.out.log.back(), "wait for odometry"));
}

// Somebody forgot beacons:=. What waits in vain is dropped, which no faster computer would help.
TEST(OverloadOfBeaconMcl, BeaconsThatDoNotComeAreNone) {
  BeaconMclPipelineOptions options = BeaconMclDrive::options();
  options.queue_length = 30;
  options.deferred = true;
  Rig run(options);
  for (const BeaconMclMessage& message : BeaconMclDrive::messages(20.0)) {
    if (!std::holds_alternative<BeaconArray::ConstPtr>(message)) run.feed({message});
    run.pipeline.process_next();
  }
  EXPECT_GT(run.pipeline.rejects().count("ranges", RejectReason::queue_full), 50u);
  EXPECT_EQ(run.pipeline.rejects().count("ranges", RejectReason::overload), 0u);
  const std::string remedy =
      "they come as the list `beacons` of the configuration (beacons:=FILE of the launch file)";
  EXPECT_TRUE(run.has_said("wait for the beacons: the oldest is dropped; " + remedy));
  EXPECT_TRUE(says(run.out.statuses.back().health_text, "Provide them: " + remedy));
  ASSERT_FALSE(run.out.diagnostics.empty());
  for (const diagnostic_msgs::DiagnosticArray& said : run.out.diagnostics) {
    for (const auto& status : said.status) {
      EXPECT_FALSE(says(status.message, "dropped"));
    }
  }
}

}  // namespace
}  // namespace pf_resampling
