#include "pf_resampling_core/filters/fastslam/memory/segment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr double kPeriod = 0.1;  // s
constexpr double kSigma = 0.01;  // rad, of the heading in a period

// At 1 m/s, at a yaw rate (rad/s) that changes steadily.
std::vector<MotionFactor> drive(int count, double yaw_rate, double yaw_acceleration, double noise) {
  const RandomStream random(1, RandomPurpose::test, 0);
  std::vector<MotionFactor> motions;
  for (int i = 0; i < count; ++i) {
    MotionFactor motion;
    motion.mean.x = kPeriod;
    motion.mean.heading = (yaw_rate + (i + 0.5) * kPeriod * yaw_acceleration) * kPeriod +
                          noise * random.normal(static_cast<std::uint64_t>(i));
    motion.covariance = kSigma * kSigma * Eigen::Matrix3d::Identity();
    motion.sensitivity(2, SensorConstant::yaw_rate) = kPeriod;
    motion.sensitivity(2, SensorConstant::delay) = -kPeriod * yaw_acceleration;
    motions.push_back(motion);
  }
  compare_with_noise(&motions);
  return motions;
}

double delay_sensitivity(const MotionFactor& motion) {
  return motion.sensitivity(2, SensorConstant::delay);
}

// Of a robot that drives straight, odometry's noise would be a delay of as long as the velocities'
// memory; one that turns this way and that tells of the delay.
TEST(Segment, NoiseOfTheOdometryIsNoDelay) {
  for (const MotionFactor& motion : drive(50, 0.0, 0.0, kSigma)) {
    EXPECT_EQ(delay_sensitivity(motion), 0.0);
  }
  for (const MotionFactor& motion : drive(50, -2.5, 1.0, kSigma)) {
    EXPECT_EQ(delay_sensitivity(motion), -0.1);
  }
}

// In a curve of 0.2 rad/s a turn is twice its deviation, those of a second are six times theirs; in
// one of 0.1 rad/s, or where the robot drives straight, they say nothing of the scale. All turns of
// a segment do, or none: to choose those that are large is to choose those that noise made large.
// One that is far beyond its noise, between two scans of which the robot turned, is enough.
TEST(Segment, TurnsWithinTheNoiseSayNothingOfTheScale) {
  for (const auto& [yaw_rate, share] : {std::pair{0.0, 0.0}, {0.1, 0.0}, {0.2, 1.0}}) {
    for (const MotionFactor& motion : drive(50, yaw_rate, 0.0, kSigma)) {
      EXPECT_EQ(motion.turn_share, share) << yaw_rate;
    }
  }
  std::vector<MotionFactor> motions = drive(3, 0.0, 0.0, 0.0);
  motions[1].mean.heading = 20.0 * kSigma;
  compare_with_noise(&motions);
  EXPECT_EQ(motions[1].turn_share, 1.0);
}

}  // namespace
}  // namespace pf_resampling
