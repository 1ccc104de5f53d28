#pragma once

#include <ros/time.h>

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/odometry/learnt_motion.hpp"
#include "src/odometry/saved_progress.hpp"

namespace pf_resampling {

/// Where odometry comes from.
enum class OdometrySource { topic, tf };
const EnumNames<OdometrySource>& names_of(OdometrySource);

/// What of an IMU takes the place of the heading of the wheels.
enum class ImuUse { none, yaw_rate, orientation };
const EnumNames<ImuUse>& names_of(ImuUse);

struct OdometryBufferOptions {
  OdometrySource source = OdometrySource::topic;
  ImuUse imu_heading = ImuUse::none;
  double length = 30.0;   ///< s of odometry that are kept, for observations that come late
  int confirmations = 5;  ///< messages in a row that are believed when they all jump alike: false
                          ///< ones come in pairs, and at 10 Hz that is half a second
  /// What no wheeled robot does is a jump of the odometry, whatever was learnt of the robot.
  static constexpr double max_speed = 30.0;      ///< m/s
  static constexpr double max_turn_rate = 20.0;  ///< rad/s
  /// s; after a longer silence messages have to confirm one another.
  static constexpr double max_gap = 5.0;
  /// s; older by more than this, which no network is late by, means that time itself jumped back.
  static constexpr double jump_back = 1.0;
  /// Take the noise of a step from the growth of the messages' covariance, where it grows.
  bool use_covariance = true;
  /// Or else from that of their velocities, where they state one that an odometry may have, unless
  /// the robot stands: drivers state a constant. It is white noise alone, too little for a filter
  /// that does not know scales and drift by itself.
  bool use_twist_covariance = false;
};

/// The parameters of the buffer, in the group "odometry_input".
ParameterList parameters_of(OdometryBufferOptions* options);

/// A pose of dead reckoning, in the odometry frame.
struct StampedOdometry {
  ros::Time stamp;
  Pose2 pose;
  std::optional<Eigen::Matrix3d> covariance;  ///< of (x, y, heading) since the start of odometry
  /// Variances (m^2/s^2, rad^2/s^2) of the mean velocity since the message before, in the frame of
  /// the robot: ahead, to the left, turning. 0: not stated.
  Eigen::Vector3d velocity_variances = Eigen::Vector3d::Zero();
  /// rad; of an IMU, from any zero. Between two messages that have one, the robot turned by their
  /// difference, and drove as far as the poses say.
  std::optional<double> heading;
};

/// Recent odometry, to be integrated between any two stamps within it.
///
/// A message that cannot be the continuation of the last one (it jumps in time or space, judged by
/// what the robot was seen to do) is held back until so many in a row (options.confirmations)
/// continue one another, and none between them fits better to what was there before: false messages
/// that come in pairs then change nothing, while a restarted odometry, or a bag played again, is
/// believed after a few messages. A robot that starts, brakes or turns as it never did is believed
/// as soon as the next messages show that it does.
class OdometryBuffer {
 public:
  enum class Addition {
    added,
    out_of_order,  ///< not newer than the last; dropped
    time_jump,     ///< older by more than jump_back, or newer by more than an hour: held back
                   ///< until others confirm it
    time_gap,      ///< newer by more than max_gap: likewise
    pose_jump,     ///< more than the robot can do, or faster than max_speed or max_turn_rate:
                   ///< likewise
    time_jumped,   ///< the message that confirms a jump of time: the buffer starts over with
                   ///< those held back
    gap_closed,    ///< the message that confirms a gap: those held back were added
    pose_jumped,   ///< the message that confirms a jump of the pose: those held back were
                   ///< added; in the step of the jump the robot moved on as before and after it
  };

  explicit OdometryBuffer(const OdometryBufferOptions& options = {}) : options_(options) {}

  /// Adds a pose; numbers have to be finite. What was more than options.length older than the
  /// newest pose before this call is forgotten, save what is needed from `used` on.
  Addition add(const StampedOdometry& odometry, ros::Time used = ros::TIME_MAX);

  void clear();

  /// Saves what is kept from `from` on, and what tells the velocity there; goes on from there.
  void save(ros::Time from, SavedProgress* progress) const;
  void resume(const SavedProgress& progress);

  /// However close together poses come: as many as of 10,000 s at 20 Hz. What is needed from `used`
  /// on is only kept longer if the owner does not move that on, to the middle at least.
  static constexpr std::size_t kMost = 200000;
  bool is_full() const { return samples_.size() >= kMost; }
  ros::Time middle() const { return samples_[samples_.size() / 2].stamp; }

  bool empty() const { return samples_.empty(); }
  int size() const { return static_cast<int>(samples_.size()); }
  /// Stamps of the oldest and newest pose. Not to be called when empty.
  ros::Time oldest() const { return samples_.front().stamp; }
  ros::Time newest() const { return samples_.back().stamp; }
  /// The newest pose as it was received.
  const Pose2& newest_pose() const { return samples_.back().received; }

  /// Whether `stamp` lies between the oldest and the newest pose, both included.
  bool covers(ros::Time stamp) const;

  /// Motion from `from` to `to`, in the frame of the robot at `from`; poses between messages are
  /// interpolated at constant speed and turn rate. The noise of a step is the growth of the
  /// messages' covariance where that grows, else `noise`; where the wheels may slip, see
  /// LearntMotion, slip_covariance() comes on top. Throws Error when either stamp is not
  /// covered or from > to.
  OdometryIncrement integrate(ros::Time from, ros::Time to, const OdometryNoise& noise) const;

  /// Appends that motion to an increment that ends at `from`.
  void extend(ros::Time from, ros::Time to, const OdometryNoise& noise,
              OdometryIncrement* increment) const;

 private:
  /// Whether `next` may come after a pose, as far as the limits of the options go.
  bool continues(ros::Time stamp, const Pose2& pose, const StampedOdometry& next) const;
  /// Whether it continues the newest pose as far as is known of the robot, too.
  bool continues_newest(const StampedOdometry& next) const;
  /// Whether it fits better to those held back than to the newest pose.
  bool continues_suspects(const StampedOdometry& next) const;
  /// At the newest pose; nothing while that is not known.
  std::optional<Velocity> velocity() const;
  Velocity velocity_of_suspects() const;
  void learn_step(const StampedOdometry& next);
  /// `motion` from the pose before; nothing: as the poses received say.
  void push(const StampedOdometry& odometry, const std::optional<Pose2>& motion = std::nullopt);
  Addition suspect(const StampedOdometry& odometry);
  bool suspects_have_moved() const;
  Pose2 motion_of_jump(ros::Time until) const;
  Addition believe_suspects(Addition suspicion);
  void forget_before(ros::Time stamp);
  Pose2 pose_within(const OdometrySample& first, const OdometrySample& second, double share) const;

  OdometryBufferOptions options_;
  std::deque<OdometrySample> samples_;
  LearntMotion learnt_;
  Pose2 offset_;  // from poses as received to continuous ones: nothing until the odometry jumps
  std::vector<StampedOdometry> suspects_;  // held back: each continues the one before it
  Addition suspicion_ = Addition::added;   // of the first of them
};

/// Growth of the covariance of dead reckoning over one step from `from` to `to`, in the frame of
/// the robot at `from`: Q in after = F before F' + R Q R', F moving the lever arm. Nothing when it
/// does not grow as a covariance has to (a constant one, for instance, says nothing about the
/// step).
std::optional<Eigen::Matrix3d> covariance_growth(const Pose2& from, const Pose2& to,
                                                 const Eigen::Matrix3d& before,
                                                 const Eigen::Matrix3d& after);

/// Covariance of a step of `duration` s whose mean velocity has those variances; with twice their
/// standard deviations, since there is more than white noise. Nothing unless they are what an
/// odometry may have: drivers also write 0, 1e-9 or 1e6 for what they do not know.
std::optional<Eigen::Matrix3d> covariance_of_step(const Eigen::Vector3d& velocity_variances,
                                                  double duration);

}  // namespace pf_resampling
