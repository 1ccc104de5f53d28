#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <tf2_msgs/TFMessage.h>

#include <boost/make_shared.hpp>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "src/messages/rejects.hpp"

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
  bad.push_back(bad_odometry(odometry, "NaN position", R::not_finite,
                             [](auto* m) { m->pose.pose.position.x = kNan; }));
  bad.push_back(bad_odometry(odometry, "infinite position", R::not_finite,
                             [](auto* m) { m->pose.pose.position.y = kInfinity; }));
  bad.push_back(bad_odometry(odometry, "NaN orientation", R::not_finite,
                             [](auto* m) { m->pose.pose.orientation.w = kNan; }));
  bad.push_back(bad_odometry(odometry, "no orientation", R::not_unit_quaternion, [](auto* m) {
    m->pose.pose.orientation = geometry_msgs::Quaternion();
  }));
  bad.push_back(bad_odometry(odometry, "long quaternion", R::not_unit_quaternion,
                             [](auto* m) { m->pose.pose.orientation.w = 2.0; }));
  bad.push_back(bad_odometry(odometry, "wrong frame", R::wrong_frame,
                             [](auto* m) { m->header.frame_id = "world"; }));
  bad.push_back(bad_odometry(odometry, "wrong child frame", R::wrong_frame,
                             [](auto* m) { m->child_frame_id = "wheel"; }));
  bad.push_back(bad_odometry(odometry, "NaN covariance", R::not_finite,
                             [](auto* m) { m->pose.covariance[7] = kNan; }));
  bad.push_back(bad_odometry(odometry, "negative covariance", R::impossible_variance,
                             [](auto* m) { m->pose.covariance[0] = -1.0; }));
  bad.push_back(bad_odometry(odometry, "crooked covariance", R::impossible_variance,
                             [](auto* m) { m->pose.covariance[1] = 1.0; }));
  bad.push_back(bad_odometry(odometry, "covariance beyond the world", R::impossible_variance,
                             [](auto* m) { m->pose.covariance[7] = 1e160; }));
  bad.push_back(bad_odometry(odometry, "no stamp", R::no_stamp,
                             [](auto* m) { m->header.stamp = ros::Time(); }));
  bad.push_back(bad_odometry(odometry, "again", R::out_of_order,
                             [](auto* m) { m->header.stamp -= ros::Duration(0.05); }));
  bad.push_back(bad_odometry(odometry, "late", R::out_of_order,
                             [](auto* m) { m->header.stamp -= ros::Duration(0.3); }));
  bad.push_back(bad_odometry(odometry, "from the past", R::time_jump,
                             [](auto* m) { m->header.stamp -= ros::Duration(60.0); }));
  bad.push_back(bad_odometry(odometry, "from the future", R::time_gap,
                             [](auto* m) { m->header.stamp += ros::Duration(60.0); }));
  bad.push_back(bad_odometry(odometry, "jumping", R::pose_jump,
                             [](auto* m) { m->pose.pose.position.x += 100.0; }));
  bad.push_back(bad_odometry(odometry, "at the end of the world", R::pose_jump,
                             [](auto* m) { m->pose.pose.position.x = 1e300; }));
  bad.push_back(bad_odometry(odometry, "after 2038", R::impossible_stamp,
                             [](auto* m) { m->header.stamp = ros::TIME_MAX; }));

  bad.push_back(
      bad_initial_pose(now, "NaN", R::not_finite, [](auto* m) { m->pose.pose.position.x = kNan; }));
  bad.push_back(bad_initial_pose(now, "wrong frame", R::wrong_frame,
                                 [](auto* m) { m->header.frame_id = "odom"; }));
  bad.push_back(bad_initial_pose(now, "no orientation", R::not_unit_quaternion,
                                 [](auto* m) { m->pose.pose.orientation.w = 0.0; }));
  bad.push_back(bad_initial_pose(now, "negative covariance", R::impossible_variance,
                                 [](auto* m) { m->pose.covariance[35] = -0.1; }));
  bad.push_back(bad_initial_pose(now, "covariance beyond the world", R::impossible_variance,
                                 [](auto* m) { m->pose.covariance[0] = 1e160; }));
  bad.push_back(bad_initial_pose(now, "infinite covariance", R::not_finite,
                                 [](auto* m) { m->pose.covariance[0] = kInfinity; }));

  bad.push_back(bad_transform("NaN", kNan, 1.0));
  bad.push_back(bad_transform("no rotation", 0.0, 0.0));
  bad.push_back(bad_initial_pose(now, "at the end of the world", R::filter_error,
                                 [](auto* m) { m->pose.pose.position.x = 1e200; }));
  bad.push_back(bad_transform("at the end of the world", 1e200, 1.0));
  return bad;
}

}  // namespace pf_resampling::bad_inputs
