// What FastSlamPipeline does with messages that it cannot use.
#include <gtest/gtest.h>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/bad_inputs.hpp"
#include "test/fastslam_rig.hpp"

namespace pf_resampling {
namespace {

using Drive = FastSlamDrive;
using bad_inputs::kInfinity;
using bad_inputs::kNan;

using BadMessage = bad_inputs::BadMessage<FastSlamMessage>;

/// A scan between the last that was used and the newest odometry, at `now`, that is rejected whole.
template <typename Change>
BadMessage bad_scan(ros::Time now, const std::string& name, RejectReason reason, Change change) {
  LandmarkObservationArray scan = Drive::scan(now - ros::Duration(0.01));
  change(&scan);
  return {name, boost::make_shared<LandmarkObservationArray>(scan), "landmarks", reason};
}

/// Such a scan of one observation.
template <typename Change>
BadMessage bad_observation(ros::Time now, const std::string& name, RejectReason reason,
                           Change change) {
  return bad_scan(now, name, reason, [&](LandmarkObservationArray* scan) {
    scan->observations.resize(1);
    change(&scan->observations.front());
  });
}

std::vector<BadMessage> bad_messages(ros::Time now) {
  using R = RejectReason;
  std::vector<BadMessage> bad;
  const auto add = [&](const char* name, RejectReason reason, auto change) {
    bad.push_back(bad_observation(now, name, reason, change));
  };
  add("NaN range", R::not_finite, [](auto* z) { z->range = kNan; });
  add("infinite range", R::not_finite, [](auto* z) { z->range = kInfinity; });
  add("NaN bearing", R::not_finite, [](auto* z) { z->bearing = kNan; });
  add("infinite bearing", R::not_finite, [](auto* z) { z->bearing = -kInfinity; });
  add("range zero", R::not_positive, [](auto* z) { z->range = 0.0; });
  add("range negative", R::not_positive, [](auto* z) { z->range = -2.0; });
  add("range out of this world", R::impossible_range, [](auto* z) { z->range = 1e9; });
  add("NaN variance", R::not_finite, [](auto* z) { z->range_variance = kNan; });
  add("infinite variance", R::not_finite, [](auto* z) { z->bearing_variance = kInfinity; });
  add("negative variance", R::impossible_variance, [](auto* z) { z->range_variance = -0.01; });
  add("negative variance of the bearing", R::impossible_variance,
      [](auto* z) { z->bearing_variance = -1e-9; });
  add("tiny variance", R::impossible_variance, [](auto* z) { z->range_variance = 1e-300; });
  add("huge variance", R::impossible_variance, [](auto* z) { z->bearing_variance = 1e300; });
  add("no id", R::unknown_id, [](auto* z) { z->id = -1; });
  const auto add_scan = [&](const char* name, RejectReason reason, auto change) {
    bad.push_back(bad_scan(now, name, reason, change));
  };
  add_scan("too many", R::too_many,
           [](auto* m) { m->observations.resize(1001, m->observations.front()); });
  bad_inputs::add_bad_headers(add_scan);
  add_scan("no frame", RejectReason::unknown_frame, [](auto* m) { m->header.frame_id = ""; });
  bad_inputs::add_all(now, Drive::odometry(now + ros::Duration(0.05)), &bad);
  return bad;
}

TEST(FastSlamPipeline, ABadMessageIsCountedReportedAndChangesNothing) {
  bad_inputs::expect_to_change_nothing<FastSlamRig>(bad_messages(Drive::at(12.0)));
}

TEST(FastSlamPipeline, NothingThatIsNotFiniteIsPublishedWhateverComes) {
  const TemporaryDirectory directory;
  // Absurd but finite numbers: what passes the checks has to be such as the filter can take.
  for (const bool with_ids : {true, false}) {
    for (const double absurd : {1e-300, 1e-150, 1e-20, 1e-9, 1e3, 1e6, 1e9, 1e30, 1e160, 1.7e308}) {
      SCOPED_TRACE(absurd);
      FastSlamRig run;
      int id = 100;
      const auto observe = [&](ros::Time stamp, double range, double bearing, double range_variance,
                               double bearing_variance) {
        LandmarkObservationArray scan = Drive::scan(stamp);
        LandmarkObservation z;
        z.range = range;
        z.bearing = bearing;
        z.range_variance = range_variance;
        z.bearing_variance = bearing_variance;
        // Once as a new landmark, once as one that is there.
        for (const int of : {id++, 1}) {
          z.id = of;
          scan.observations.push_back(z);
        }
        for (auto& seen : scan.observations) seen.id = with_ids ? seen.id : -1;
        run.pipeline.handle(scan);
      };
      for (int i = 0; i <= 60; ++i) {
        const ros::Time stamp = Drive::at(0.1 * i);
        run.pipeline.handle(Drive::odometry(stamp));
        if (i % 6 == 1) observe(stamp, absurd, 0.3, 0.0, 0.0);
        if (i % 6 == 2) observe(stamp, 3.0, absurd, 0.0, 0.0);
        if (i % 6 == 3) observe(stamp, 3.0, -0.5, absurd, 0.0);
        if (i % 6 == 4) observe(stamp, 3.0, 1.0, 0.0, absurd);
        if (i % 6 == 5) observe(stamp, absurd, -absurd, absurd, absurd);
      }
      EXPECT_TRUE(all_finite(run.out));
      EXPECT_EQ(run.out.poses.size(), 61u);
      EXPECT_EQ(value_of(run.out.diagnostics.back(), "poses not published"), "0");
      EXPECT_NO_THROW(run.pipeline.save_map(directory.file("map")));

      run.pipeline.handle(initial_pose({}, {absurd, 0.0, 0.0}, absurd));
      nav_msgs::Odometry odometry = Drive::odometry(Drive::at(6.0));
      for (int i = 1; i < 40; ++i) {
        odometry = Drive::odometry(Drive::at(6.0 + 0.1 * i));
        for (const std::size_t k : {0u, 7u, 35u}) {
          odometry.pose.covariance[k] = absurd * static_cast<double>(i);
        }
        run.pipeline.handle(odometry);
        run.pipeline.handle(Drive::scan(odometry.header.stamp));
      }
      EXPECT_TRUE(all_finite(run.out));
    }
  }
}

TEST(FastSlamPipeline, AnObservationThatIsBadDoesNotTakeTheOthersOfItsScanAlong) {
  const auto drive = Drive::messages(20.0);
  FastSlamRig good;
  good.feed(drive);
  FastSlamRig run;
  run.feed(changed<LandmarkObservationArray>(drive, [](LandmarkObservationArray* scan) {
    LandmarkObservation bad = scan->observations.front();
    bad.range = kNan;
    scan->observations.insert(scan->observations.begin(), bad);
  }));
  EXPECT_EQ(run.rejected("landmarks", RejectReason::not_finite), good.out.updates.size());
  EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
}

TEST(FastSlamPipeline, BearingsBeyondAHalfTurnAreTheSameDirections) {
  const auto drive = Drive::messages(10.0);
  FastSlamRig good;
  good.feed(drive);
  FastSlamRig run;
  run.feed(changed<LandmarkObservationArray>(drive, [](LandmarkObservationArray* scan) {
    for (auto& seen : scan->observations) {
      if (seen.bearing < 0.0) seen.bearing += 2.0 * kPi;
    }
  }));
  EXPECT_LT(distance(run.pose(), good.pose()), 1e-6);
}

}  // namespace
}  // namespace pf_resampling
