#include "src/checkpoint/saved_pose.hpp"

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// What two readings of the odometry of a robot that was not moved may differ by.
constexpr double kSamePosition = 0.1;  // m
constexpr double kSameHeading = 0.1;   // rad

bool reads_the_same(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y) <= kSamePosition &&
         std::abs(wrap_angle(a.heading - b.heading)) <= kSameHeading;
}

std::string text_of(const Pose2& pose) {
  return "(" + number_text(pose.x) + ", " + number_text(pose.y) + ") m, " +
         number_text(pose.heading) + " rad";
}

}  // namespace

std::optional<std::string> reason_against(const SavedPose& saved, const PoseAtStart& now) {
  if (saved.frame != now.frame) {
    return "it is in the frame " + text_file::printable(saved.frame) + ", and frames/map is " +
           now.frame;
  }
  if (now.map.empty()) {
    return "it was saved in " + text_file::printable(saved.map) + ", but no map is loaded now";
  }
  if (saved.map != now.map) {
    return "it was saved in " + text_file::printable(saved.map) + ", and this is " +
           text_file::printable(now.map);
  }
  const double age = 1e-9 * static_cast<double>(now.stamp - saved.stamp);
  if (age < 0.0) {
    return "it is from " + number_text(-age) +
           " s after the first odometry: the clock was set back, or a bag is played again";
  }
  if (age > now.oldest) {
    return "it is " + number_text(age) + " s old, more than pose/oldest, which is " +
           number_text(now.oldest) + " s";
  }
  if (saved.lost > kLikelyLost) {
    return "the filter did not know where it was when it was saved (lost: " +
           number_text(saved.lost) + ")";
  }
  if (reads_the_same(saved.odometry, now.odometry)) return std::nullopt;
  const bool began_anew = reads_the_same(now.odometry, Pose2{});
  if (began_anew && saved.stood_still) return std::nullopt;
  const std::string readings = "the odometry read " + text_of(saved.odometry) +
                               " when it was saved and reads " + text_of(now.odometry) + " now";
  return readings + (began_anew ? ": it was reset, and the robot was driving"
                                : ": the robot was moved meanwhile");
}

PoseEstimate pose_at_start(const SavedPose& saved, const Pose2& odometry) {
  PoseEstimate there = saved.pose;
  if (reads_the_same(saved.odometry, odometry)) {
    there.mean = compose(saved.pose.mean, relative(saved.odometry, odometry));
  }
  return there;
}

void describe(Archive& archive, SavedPose& saved) {
  archive("frame", saved.frame);
  archive("map", saved.map);
  archive("stamp", saved.stamp);
  archive("pose", saved.pose);
  archive("odometry", saved.odometry);
  archive("stood_still", saved.stood_still);
  archive("lost", saved.lost);
}

std::string fault_of(const SavedPose& saved) {
  const Eigen::Matrix3d& covariance = saved.pose.covariance;
  if (!is_in_reach(saved.pose.mean) || !is_in_reach(saved.odometry)) {
    return "a pose is not finite or beyond 1e9 m";
  }
  if (!(covariance.array().abs() <= kFarthestPosition * kFarthestPosition).all()) {
    return "the covariance is not finite or beyond 1e18";
  }
  if (covariance.diagonal().minCoeff() < 0.0) return "a variance is negative";
  if (saved.stamp < 0) return "the stamp is negative";
  if (!(saved.lost >= 0.0 && saved.lost <= 1.0)) {
    return "the probability of being lost is not in [0, 1]";
  }
  return {};
}

void write_saved_pose(const std::string& path, const SavedPose& pose) {
  write_saved(kPoseFile, path, pose);
}

SavedPose read_saved_pose(const std::string& path) {
  return read_saved<SavedPose>(kPoseFile, path);
}

}  // namespace pf_resampling
