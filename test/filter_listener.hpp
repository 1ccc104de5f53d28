#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/FilterStatus.h>
#include <pf_resampling/LandmarkMap.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "src/messages/conversions.hpp"
#include "test/pipeline_outputs.hpp"

/// What the launch tests of both nodes share: they hear what a node publishes while a bag is
/// played, and compare it with the truth in the bag.
namespace pf_resampling {

// Squared Mahalanobis distance within which 99.73 % of a planar Gaussian lie: what 3 sigma is in
// one dimension (chi-square, 2 degrees of freedom: -2 ln 0.0027).
constexpr double kThreeSigma = 11.829;
struct Belief {
  Pose2 pose;
  Eigen::Matrix2d covariance;
};

/// What was heard. Callbacks come from a thread of their own.
class FilterListener {
 public:
  explicit FilterListener(ros::NodeHandle* node) {
    subscribers_ = {
        listen<geometry_msgs::PoseWithCovarianceStamped>(
            node, "pose",
            [this](const auto& m) {
              const Eigen::Matrix3d covariance = to_covariance3(m.pose.covariance);
              note("pose", is_finite(m.pose.pose) && covariance.allFinite());
              beliefs[m.header.stamp.toSec()] = {to_pose2(m.pose.pose),
                                                 covariance.topLeftCorner<2, 2>()};
              ++poses;
            }),
        listen<geometry_msgs::PoseStamped>(
            node, "ground_truth",
            [this](const auto& m) { truth[m.header.stamp.toSec()] = to_pose2(m.pose); }),
        listen<nav_msgs::Odometry>(
            node, "odom", [this](const auto& m) { odometry.insert(m.header.stamp.toSec()); }),
        listen<tf2_msgs::TFMessage>(node, "/tf",
                                    [this](const auto& m) {
                                      for (const auto& transform : m.transforms) {
                                        const auto& t = transform.transform.translation;
                                        if (transform.header.frame_id != "map") continue;
                                        note("tf", std::isfinite(t.x + t.y + t.z) &&
                                                       is_unit(transform.transform.rotation));
                                      }
                                    }),
        listen<nav_msgs::Path>(node, "path",
                               [this](const auto& m) {
                                 for (const auto& pose : m.poses)
                                   note("path", is_finite(pose.pose));
                               }),
        listen<geometry_msgs::PoseArray>(node, "particlecloud",
                                         [this](const auto& m) {
                                           for (const auto& pose : m.poses)
                                             note("particlecloud", is_finite(pose));
                                         }),
        listen<sensor_msgs::PointCloud2>(
            node, "particles", [this](const auto& m) { note("particles", is_finite(m)); }),
        listen<visualization_msgs::MarkerArray>(node, "markers",
                                                [this](const auto& m) {
                                                  for (const auto& marker : m.markers)
                                                    note("markers", is_finite(marker));
                                                }),
        listen<FilterStatus>(node, "status",
                             [this](const auto& m) {
                               note("status", is_finite(m));
                               status = m;
                             }),
        listen<LandmarkMap>(node, "landmark_map",
                            [this](const auto& m) {
                              note("landmark_map", is_finite(m));
                              map = m;
                            }),
        listen<LandmarkMap>(node, "ground_truth_landmarks",
                            [this](const auto& m) { true_map = m; }),
        listen<diagnostic_msgs::DiagnosticArray>(
            node, "/diagnostics", [this](const auto& m) { diagnostics.push_back(m); })};
  }

  std::map<double, Belief> beliefs;
  std::map<double, Pose2> truth;
  std::set<double> odometry;
  FilterStatus status;
  LandmarkMap map, true_map;  // the last of each
  std::vector<diagnostic_msgs::DiagnosticArray> diagnostics;
  int poses = 0;
  std::map<std::string, int> finite, not_finite;  // by topic

 private:
  template <typename Message>
  ros::Subscriber listen(ros::NodeHandle* node, const std::string& topic,
                         const std::function<void(const Message&)>& take) {
    const boost::function<void(const typename Message::ConstPtr&)> callback =
        [take](const typename Message::ConstPtr& message) { take(*message); };
    return node->subscribe<Message>(topic, 10000, callback);
  }
  void note(const std::string& topic, bool is_finite_message) {
    ++(is_finite_message ? finite : not_finite)[topic];
  }

  std::vector<ros::Subscriber> subscribers_;
};

/// Runs a line of the shell while messages come in; returns whether it succeeded.
inline bool run(const std::string& line) {
  ros::AsyncSpinner spinner(1);
  spinner.start();
  const bool good = std::system(line.c_str()) == 0;
  ros::WallDuration(2.0).sleep();
  spinner.stop();
  return good;
}

inline std::string replaced(std::string text, const std::string& word, const std::string& by) {
  const std::size_t place = text.find(word);
  return place == std::string::npos ? text : text.replace(place, word.size(), by);
}

/// Error and squared Mahalanobis distance of what was believed at a true pose.
struct Comparison {
  double error = 0.0;
  double distance = 0.0;
};

/// Beliefs within half a second around the truth are interpolated; otherwise nothing.
inline std::optional<Comparison> compare(const std::map<double, Belief>& beliefs, double time,
                                         const Pose2& truth) {
  const auto after = beliefs.lower_bound(time - 1e-6);
  if (after == beliefs.end()) return std::nullopt;
  Eigen::Vector2d place(after->second.pose.x, after->second.pose.y);
  if (after->first > time + 1e-6) {
    if (after == beliefs.begin()) return std::nullopt;
    const auto before = std::prev(after);
    if (after->first - before->first > 0.5) return std::nullopt;
    const double share = (time - before->first) / (after->first - before->first);
    place = share * place +
            (1.0 - share) * Eigen::Vector2d(before->second.pose.x, before->second.pose.y);
  }
  const Eigen::Vector2d error = place - Eigen::Vector2d(truth.x, truth.y);
  return Comparison{error.norm(), error.dot(after->second.covariance.inverse() * error)};
}

}  // namespace pf_resampling
