#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <tf2_msgs/TFMessage.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "pf_resampling_core/test/says.hpp"
#include "src/messages/rejects.hpp"
#include "test/pipeline_outputs.hpp"

/// Messages that no pipeline can use, of the inputs that both have.
namespace pf_resampling::bad_inputs {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct BadInput {
  std::string name;
  std::variant<nav_msgs::Odometry::ConstPtr, geometry_msgs::PoseWithCovarianceStamped::ConstPtr,
               tf2_msgs::TFMessage::ConstPtr>
      message;
  std::string input;
  RejectReason reason;
};

template <typename Change>
BadInput bad_odometry(nav_msgs::Odometry odometry, const std::string& name, RejectReason reason,
                      Change change) {
  change(&odometry);
  return {name, boost::make_shared<nav_msgs::Odometry>(odometry), "odom", reason};
}

template <typename Change>
BadInput bad_initial_pose(ros::Time stamp, const std::string& name, RejectReason reason,
                          Change change) {
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header.stamp = stamp;
  pose.header.frame_id = "map";
  pose.pose.pose.orientation.w = 1.0;
  change(&pose);
  return {name, boost::make_shared<geometry_msgs::PoseWithCovarianceStamped>(pose), "initialpose",
          reason};
}

inline BadInput bad_transform(const std::string& name, double x, double quaternion_w) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "base_link";
  transform.child_frame_id = "mast";
  transform.transform.translation.x = x;
  transform.transform.rotation.w = quaternion_w;
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return {name, boost::make_shared<tf2_msgs::TFMessage>(message), "tf", RejectReason::not_finite};
}

/// `now`: stamp of the newest odometry that was given; `odometry`: what can come 0.05 s later.
inline std::vector<BadInput> all(ros::Time now, const nav_msgs::Odometry& odometry) {
  using R = RejectReason;
  std::vector<BadInput> bad;
  const auto add_odometry = [&](const char* name, R reason, auto change) {
    bad.push_back(bad_odometry(odometry, name, reason, change));
  };
  const auto add_pose = [&](const char* name, R reason, auto change) {
    bad.push_back(bad_initial_pose(now, name, reason, change));
  };
  add_odometry("NaN position", R::not_finite, [](auto* m) { m->pose.pose.position.x = kNan; });
  add_odometry("infinite position", R::not_finite,
               [](auto* m) { m->pose.pose.position.y = kInfinity; });
  add_odometry("NaN orientation", R::not_finite,
               [](auto* m) { m->pose.pose.orientation.w = kNan; });
  add_odometry("no orientation", R::not_unit_quaternion,
               [](auto* m) { m->pose.pose.orientation = geometry_msgs::Quaternion(); });
  add_odometry("long quaternion", R::not_unit_quaternion,
               [](auto* m) { m->pose.pose.orientation.w = 2.0; });
  add_odometry("wrong frame", R::wrong_frame, [](auto* m) { m->header.frame_id = "world"; });
  add_odometry("wrong child frame", R::wrong_frame, [](auto* m) { m->child_frame_id = "wheel"; });
  add_odometry("NaN covariance", R::not_finite, [](auto* m) { m->pose.covariance[7] = kNan; });
  add_odometry("negative covariance", R::impossible_variance,
               [](auto* m) { m->pose.covariance[0] = -1.0; });
  add_odometry("crooked covariance", R::impossible_variance,
               [](auto* m) { m->pose.covariance[1] = 1.0; });
  add_odometry("covariance beyond the world", R::impossible_variance,
               [](auto* m) { m->pose.covariance[7] = 1e160; });
  add_odometry("no stamp", R::no_stamp, [](auto* m) { m->header.stamp = ros::Time(); });
  add_odometry("again", R::out_of_order, [](auto* m) { m->header.stamp -= ros::Duration(0.05); });
  add_odometry("late", R::out_of_order, [](auto* m) { m->header.stamp -= ros::Duration(0.3); });
  add_odometry("from the past", R::time_jump,
               [](auto* m) { m->header.stamp -= ros::Duration(60.0); });
  add_odometry("from the future", R::time_gap,
               [](auto* m) { m->header.stamp += ros::Duration(60.0); });
  add_odometry("jumping", R::pose_jump, [](auto* m) { m->pose.pose.position.x += 100.0; });
  add_odometry("at the end of the world", R::impossible_position,
               [](auto* m) { m->pose.pose.position.x = 1e300; });
  add_odometry("after 2038", R::impossible_stamp, [](auto* m) { m->header.stamp = ros::TIME_MAX; });

  add_pose("NaN", R::not_finite, [](auto* m) { m->pose.pose.position.x = kNan; });
  add_pose("wrong frame", R::wrong_frame, [](auto* m) { m->header.frame_id = "odom"; });
  add_pose("no orientation", R::not_unit_quaternion,
           [](auto* m) { m->pose.pose.orientation.w = 0.0; });
  add_pose("negative covariance", R::impossible_variance,
           [](auto* m) { m->pose.covariance[35] = -0.1; });
  add_pose("covariance beyond the world", R::impossible_variance,
           [](auto* m) { m->pose.covariance[0] = 1e160; });
  add_pose("infinite covariance", R::not_finite,
           [](auto* m) { m->pose.covariance[0] = kInfinity; });

  bad.push_back(bad_transform("NaN", kNan, 1.0));
  bad.push_back(bad_transform("no rotation", 0.0, 0.0));
  add_pose("at the end of the world", R::impossible_position,
           [](auto* m) { m->pose.pose.position.x = 1e200; });
  bad.push_back(bad_transform("at the end of the world", 1e200, 1.0));
  return bad;
}

/// Of an observation. `add`: takes name, reason and change.
template <typename Add>
void add_bad_headers(const Add& add) {
  using R = RejectReason;
  add("unknown frame", R::unknown_frame, [](auto* m) { m->header.frame_id = "somewhere"; });
  add("no stamp", R::no_stamp, [](auto* m) { m->header.stamp = ros::Time(); });
  add("after 2038", R::impossible_stamp, [](auto* m) { m->header.stamp = ros::TIME_MAX; });
  add("3 s in ns", R::impossible_stamp, [](auto* m) { m->header.stamp.nsec = 3000000000U; });
  add("old", R::old, [](auto* m) { m->header.stamp -= ros::Duration(3.0); });
  add("far ahead", R::ahead_of_odometry, [](auto* m) { m->header.stamp += ros::Duration(1e6); });
  add("early", R::before_odometry, [](auto* m) { m->header.stamp -= ros::Duration(50.0); });
}

/// A bad message of a pipeline, and what has to be counted.
template <typename Message>
struct BadMessage {
  std::string name;
  Message message;
  std::string input;
  RejectReason reason;
};

/// Adds all().
template <typename Message>
void add_all(ros::Time now, const nav_msgs::Odometry& odometry,
             std::vector<BadMessage<Message>>* bad) {
  for (const BadInput& input : all(now, odometry)) {
    std::visit(
        [&](const auto& message) {
          bad->push_back({input.name, message, input.input, input.reason});
        },
        input.message);
  }
}

/// Puts each, alone, into a drive of 20 s, after the odometry of 12 s: it is counted and reported,
/// and changes nothing.
template <typename AnyRig>
void expect_to_change_nothing(const std::vector<BadMessage<typename AnyRig::Message>>& all_bad) {
  using Drive = typename AnyRig::Drive;
  const auto drive = Drive::messages(20.0);
  AnyRig good;
  good.feed(drive);
  ASSERT_EQ(good.pipeline.rejects().total(), 0u);
  ASSERT_LT(good.error(), 0.5);
  int odometries = 0;
  const auto middle = std::find_if(drive.begin(), drive.end(),
                                   [&](const auto& message) {
                                     return AnyRig::is_odometry(message) && ++odometries == 121;
                                   }) +
                      1;
  for (const auto& bad : all_bad) {
    SCOPED_TRACE(bad.input + ", " + bad.name);
    AnyRig run;
    run.feed({drive.begin(), middle});
    ASSERT_EQ(run.out.poses.back().header.stamp, Drive::at(12.0));
    const auto before = run.particles();
    const std::size_t poses = run.out.poses.size();
    run.feed({bad.message});
    EXPECT_TRUE(same_particles(before, run.particles()));
    EXPECT_EQ(run.out.poses.size(), poses) << "it was answered with a pose";
    EXPECT_EQ(run.rejected(bad.input, bad.reason), 1u);
    EXPECT_EQ(run.pipeline.rejects().total(), 1u);

    run.feed({middle, drive.end()});
    EXPECT_TRUE(same_bytes(run.out.poses, good.out.poses));
    EXPECT_TRUE(same_bytes(run.out.clouds, good.out.clouds));
    const FilterStatus& status = run.out.statuses.back();
    ASSERT_EQ(status.rejects.size(), 1u);
    EXPECT_EQ(status.rejects[0].input, bad.input);
    EXPECT_EQ(status.rejects[0].reason, to_string(bad.reason));
    EXPECT_EQ(status.rejects[0].count, 1u);
    const std::string key = "rejected " + bad.input + " " + to_string(bad.reason);
    EXPECT_EQ(value_of(run.out.diagnostics.back(), key).substr(0, 2), "1,");
    bool warned = false;
    for (const auto& diagnostics : run.out.diagnostics) {
      warned = warned ||
               (diagnostics.status[1].level == diagnostic_msgs::DiagnosticStatus::WARN &&
                diagnostics.status[1].message.find("1 messages rejected") != std::string::npos);
    }
    EXPECT_TRUE(warned);
    ASSERT_EQ(run.out.log.size(), 1u);
    EXPECT_TRUE(says(run.out.log[0], to_string(bad.reason)));
  }
}

}  // namespace pf_resampling::bad_inputs
