#pragma once

#include <nav_msgs/Odometry.h>

#include <cstdint>
#include <optional>
#include <string>

#include "pf_resampling_core/population/pose_estimate.hpp"
#include "src/messages/rejects.hpp"
#include "src/odometry/odometry_buffer.hpp"

namespace pf_resampling {

/// Odometry on its way into a filter: what of it the filter has used, and what came since.
class DeadReckoning {
 public:
  explicit DeadReckoning(const OdometryBufferOptions& options)
      : length_(options.length), buffer_(options) {}

  /// What became of a message.
  struct Taken {
    std::optional<Rejection> rejection;
    bool time_jumped = false;  ///< all that was known of earlier odometry is forgotten
    /// It jumped to about where it began, as when a bag is played again. Else a clock was set.
    bool began_again = false;
    OdometryIncrement until_jump;  ///< motion before it that the filter has not used
    std::string warning;           ///< for the log; empty if there is none
  };
  /// Takes a checked message. `noise`: of steps whose messages' covariance does not tell.
  /// `heading`: rad, of an IMU at its stamp; see StampedOdometry.
  Taken take(const nav_msgs::Odometry& odometry, const OdometryNoise& noise,
             std::optional<double> heading = std::nullopt);

  /// As if no odometry had come yet; jumps stay counted.
  void clear();

  bool empty() const { return buffer_.empty(); }
  /// Stamp and pose (odometry frame) of the newest message. Not to be called when empty.
  ros::Time newest() const { return buffer_.newest(); }
  const Pose2& newest_pose() const { return buffer_.newest_pose(); }

  /// Whether `stamp` lies between the oldest odometry that is kept and the newest.
  bool covers(ros::Time stamp) const { return buffer_.covers(stamp); }

  /// The stamp that the filter is at, and the motion from there to the newest odometry.
  ros::Time used() const { return used_; }
  const OdometryIncrement& since() const { return since_; }

  /// Whether an observation of this stamp can be used, now or when odometry has come this far:
  /// nothing, or why not. `tolerance`: s by which it may be before used().
  std::optional<Rejection> check_stamp(ros::Time stamp, double tolerance) const;
  /// Whether it is not too far, s, ahead of the newest odometry.
  std::optional<Rejection> check_ahead(ros::Time stamp, double limit) const;

  /// Motion from used() to `stamp`, which odometry has to cover.
  OdometryIncrement until(ros::Time stamp, const OdometryNoise& noise) const;
  /// The filter has used all until `stamp`.
  void use_until(ros::Time stamp, const OdometryNoise& noise);
  /// The filter is at the oldest odometry that is known; at `stamp`, or the newest if that is not
  /// known.
  void restart_at_oldest(const OdometryNoise& noise);
  void restart_at(ros::Time stamp, const OdometryNoise& noise);

  /// Saves it, but for the counts; goes on from what was saved, which has to be without fault.
  void save(SavedProgress* progress) const;
  void resume(const SavedProgress& progress, const OdometryNoise& noise);

  /// The odometry kept is bounded. When that which the filter has not used gets long: the stamp
  /// until which it has to go on without observations.
  std::optional<ros::Time> overdue() const;

  /// Of time back, and of the pose.
  std::uint64_t time_jumps() const { return time_jumps_; }
  std::uint64_t pose_jumps() const { return pose_jumps_; }

 private:
  double length_;
  OdometryBuffer buffer_;
  ros::Time first_;  // stamp of the first odometry, since time jumped back
  ros::Time began_;  // and before that, as long as time did not begin again
  ros::Time used_;
  OdometryIncrement since_;
  std::uint64_t time_jumps_ = 0;
  std::uint64_t pose_jumps_ = 0;
};

/// `estimate` moved rigidly by `motion`; its covariance grows by the motion's.
PoseEstimate moved_by(const PoseEstimate& estimate, const OdometryIncrement& motion);

/// `motion` without a bias of the yaw rate (rad/s, with its sigma).
OdometryIncrement without_yaw_rate_bias(const OdometryIncrement& motion, double bias, double sigma);

}  // namespace pf_resampling
