#include "pf_resampling_core/filters/fastslam/fastslam.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

// Odometry with a full covariance: x, y and heading of the step are correlated.
OdometryIncrement some_motion() {
  OdometryIncrement increment;
  increment.duration = 0.2;
  increment.mean = {0.5, 0.1, 0.2};
  increment.covariance << 0.0100, 0.0010, 0.0020, 0.0010, 0.0064, -0.0010, 0.0020, -0.0010, 0.0025;
  return increment;
}

RangeBearingObservation exact_observation(const Pose2& robot, const Pose2& sensor,
                                          const Eigen::Vector2d& landmark, int id) {
  const Pose2 eye = compose(robot, sensor);
  const Eigen::Vector2d offset = landmark - Eigen::Vector2d(eye.x, eye.y);
  return {id, offset.norm(), wrap_angle(std::atan2(offset.y(), offset.x()) - eye.heading)};
}

// Range and bearing, by their definition.
Eigen::Vector2d observed(const Eigen::Vector3d& robot, const Eigen::Vector2d& landmark,
                         const Pose2& sensor) {
  const RangeBearingObservation z =
      exact_observation({robot[0], robot[1], robot[2]}, sensor, landmark, 0);
  return {z.range, z.bearing};
}

// Derivatives by central differences: independent of the formulas under test.
Eigen::Matrix<double, 2, 5> derivatives(const Eigen::Vector3d& robot,
                                        const Eigen::Vector2d& landmark, const Pose2& sensor) {
  Eigen::Matrix<double, 2, 5> result;
  const double step = 1e-6;
  for (int k = 0; k < 5; ++k) {
    Eigen::Vector3d pose_high = robot, pose_low = robot;
    Eigen::Vector2d mark_high = landmark, mark_low = landmark;
    if (k < 3) {
      pose_high[k] += step;
      pose_low[k] -= step;
    } else {
      mark_high[k - 3] += step;
      mark_low[k - 3] -= step;
    }
    Eigen::Vector2d difference =
        observed(pose_high, mark_high, sensor) - observed(pose_low, mark_low, sensor);
    difference[1] = wrap_angle(difference[1]);
    result.col(k) = difference / (2.0 * step);
  }
  return result;
}

FastSlamOptions quiet_options(int particles) {
  FastSlamOptions options;
  options.particles = particles;
  options.strategy.renewal = Renewal::none;
  options.sensor.range_sigma_share = 0.0;
  return options;
}

// A first scan from a robot that has not moved: every particle gets the same landmarks.
void see_from_origin(FastSlam* filter, const std::vector<Eigen::Vector2d>& landmarks,
                     const Pose2& sensor) {
  std::vector<RangeBearingObservation> scan;
  for (std::size_t k = 0; k < landmarks.size(); ++k) {
    scan.push_back(exact_observation({}, sensor, landmarks[k], static_cast<int>(k)));
  }
  filter->update({}, scan, sensor);
}

// The proposal of FastSLAM 2.0 is the posterior of an extended Kalman filter over the pose, taken
// scan entry by scan entry, and the weight is the product of the innovations' densities. Both
// computed here with dense matrices and numeric derivatives. 40000 draws: sample means are within 5
// standard errors, sample covariances within 5 % of the larger variances, with a probability of a
// false alarm below 1e-5.
TEST(FastSlam, ProposalAndWeightAreThoseOfTheKalmanFilter) {
  const Pose2 sensor{0.3, -0.1, 0.4};
  const std::vector<Eigen::Vector2d> landmarks = {{3.0, 1.0}, {2.0, -2.5}};
  const int count = 40000;
  FastSlam filter(quiet_options(count), 1);
  see_from_origin(&filter, landmarks, sensor);
  const LandmarkSensorOptions& model = filter.options().sensor;
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();
  noise.diagonal() << model.range_sigma * model.range_sigma,
      model.bearing_sigma * model.bearing_sigma;

  // The scan: what a robot elsewhere than expected would see.
  const Pose2 truth{0.6, 0.05, 0.17};
  std::vector<RangeBearingObservation> scan;
  for (int k = 0; k < 2; ++k)
    scan.push_back(exact_observation(truth, sensor, landmarks[static_cast<std::size_t>(k)], k));

  const OdometryIncrement motion = some_motion();
  Eigen::Vector3d mean(motion.mean.x, motion.mean.y, motion.mean.heading);
  Eigen::Matrix3d covariance = motion.covariance;
  double log_weight = 0.0;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d& landmark = landmarks[static_cast<std::size_t>(k)];
    // The landmark's covariance is that of its first observation, mapped through the inverse of the
    // observation.
    const Eigen::Matrix2d first =
        derivatives(Eigen::Vector3d::Zero(), landmark, sensor).rightCols<2>();
    const Eigen::Matrix2d uncertain = first.inverse() * noise * first.inverse().transpose();
    const Eigen::Matrix<double, 2, 5> jacobian = derivatives(mean, landmark, sensor);
    const Eigen::Matrix<double, 2, 3> by_pose = jacobian.leftCols<3>();
    const Eigen::Matrix2d by_landmark = jacobian.rightCols<2>();
    const Eigen::Matrix2d innovation_covariance =
        by_pose * covariance * by_pose.transpose() +
        by_landmark * uncertain * by_landmark.transpose() + noise;
    Eigen::Vector2d innovation = Eigen::Vector2d(scan[static_cast<std::size_t>(k)].range,
                                                 scan[static_cast<std::size_t>(k)].bearing) -
                                 observed(mean, landmark, sensor);
    innovation[1] = wrap_angle(innovation[1]);
    const Eigen::Matrix<double, 3, 2> gain =
        covariance * by_pose.transpose() * innovation_covariance.inverse();
    mean += gain * innovation;
    covariance = ((Eigen::Matrix3d::Identity() - gain * by_pose) * covariance).eval();
    log_weight += -0.5 * innovation.dot(innovation_covariance.inverse() * innovation) -
                  0.5 * std::log((2.0 * kPi * innovation_covariance).determinant());
  }

  filter.update(motion, scan, sensor);
  const FastSlamParticles& particles = filter.particles();
  const double n = count;
  const Eigen::Vector3d sample_mean(particles.x.mean(), particles.y.mean(),
                                    particles.heading.mean());
  Eigen::Matrix3d sample_covariance = Eigen::Matrix3d::Zero();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d offset =
        Eigen::Vector3d(particles.x[i], particles.y[i], particles.heading[i]) - sample_mean;
    sample_covariance += offset * offset.transpose() / n;
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(sample_mean[k], mean[k], 5.0 * std::sqrt(covariance(k, k) / n))
        << "component " << k;
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(sample_covariance(k, j), covariance(k, j),
                  0.05 * std::sqrt(covariance(k, k) * covariance(j, j)))
          << "entry " << k << ", " << j;
    }
  }
  // All particles began alike, so all weigh the same and the likelihood of the scan is that weight.
  EXPECT_NEAR(filter.status().log_likelihood, log_weight, 1e-6);
  EXPECT_NEAR(filter.status().effective_sample_size, n, 1e-6 * n);
}

// A robot at rest with exact odometry: the landmark's filter is a linear one to first order, and n
// equal observations leave 1/n of the first one's covariance.
TEST(FastSlam, LandmarkCovarianceFallsWithTheNumberOfObservations) {
  FastSlam filter(quiet_options(3), 1);
  const Eigen::Vector2d landmark(4.0, 3.0);
  const int observations = 16;
  for (int k = 0; k < observations; ++k)
    filter.update({}, {exact_observation({}, {}, landmark, 7)});
  const std::vector<LandmarkEstimate> map = filter.map();
  ASSERT_EQ(map.size(), 1u);
  EXPECT_EQ(map[0].id, 7);
  EXPECT_NEAR((map[0].mean - landmark).norm(), 0.0, 1e-9);
  // Along the line of sight σ² / n, across it (σ_bearing · range)² / n.
  const Eigen::Vector2d along = landmark.normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  const LandmarkSensorOptions& model = filter.options().sensor;
  EXPECT_NEAR(along.dot(map[0].covariance * along), std::pow(model.range_sigma, 2) / observations,
              1e-9);
  EXPECT_NEAR(across.dot(map[0].covariance * across),
              std::pow(5.0 * model.bearing_sigma, 2) / observations, 1e-9);
}

// From equal weights, tempering by 0.3 gives the power 0.3 of the weights; the likelihood that is
// stated is that of all that was seen.
TEST(FastSlam, TemperingTakesUpAShareOfTheLikelihood) {
  const auto after_two_scans = [](double tempering) {
    FastSlamOptions options = quiet_options(100);
    options.version = FastSlamVersion::fastslam_1;  // particles that weigh differently at once
    options.strategy.renewal = Renewal::none;
    options.strategy.tempering = tempering;
    FastSlam filter(options, 2);
    see_from_origin(&filter, {{4.0, 3.0}}, {});
    filter.update(some_motion(), {exact_observation({0.6, 0.1, 0.2}, {}, {4.0, 3.0}, 0)});
    return filter;
  };
  const FastSlam whole = after_two_scans(1.0);
  const FastSlam tempered = after_two_scans(0.3);
  const Eigen::ArrayXd power = whole.particles().weight.pow(0.3);
  ASSERT_GT(whole.particles().weight.maxCoeff(), 0.015);
  EXPECT_LT((tempered.particles().weight - power / power.sum()).abs().maxCoeff(), 1e-12);
  EXPECT_NEAR(tempered.status().log_likelihood, whole.status().log_likelihood, 1e-9);
}

// FastSLAM 1.0 draws from the motion alone, whatever is seen. 20000 draws: means are within 5
// standard errors, variances within 5 % (5 standard errors), with a probability of a false alarm
// below 1e-5.
TEST(FastSlam, VersionOneDrawsFromTheMotion) {
  const int count = 20000;
  FastSlamOptions options = quiet_options(count);
  options.version = FastSlamVersion::fastslam_1;
  options.odometry_errors.estimate = false;
  FastSlam filter(options, 3);
  see_from_origin(&filter, {{3.0, 1.0}, {2.0, -2.5}}, {});
  const Pose2 elsewhere{0.65, 0.0, 0.25};
  const OdometryIncrement motion = some_motion();
  filter.update(motion, {exact_observation(elsewhere, {}, {3.0, 1.0}, 0),
                         exact_observation(elsewhere, {}, {2.0, -2.5}, 1)});
  const FastSlamParticles& particles = filter.particles();
  const Eigen::ArrayXd* columns[] = {&particles.x, &particles.y, &particles.heading};
  const double means[] = {motion.mean.x, motion.mean.y, motion.mean.heading};
  for (int k = 0; k < 3; ++k) {
    const double variance = motion.covariance(k, k);
    const double mean = columns[k]->mean();
    EXPECT_NEAR(mean, means[k], 5.0 * std::sqrt(variance / count)) << k;
    EXPECT_NEAR((*columns[k] - mean).square().mean(), variance, 0.05 * variance) << k;
  }
  // What is seen says which of them are right.
  const PoseEstimate estimate = filter.estimate();
  EXPECT_LT(std::abs(estimate.mean.x - elsewhere.x), std::abs(estimate.mean.x - motion.mean.x));
  EXPECT_LT(estimate.covariance(0, 0), 0.5 * motion.covariance(0, 0));
}

// Kwak section 5.1: what the weak have learnt of the odometry goes towards what the strong have.
TEST(FastSlam, CompensationBlendsTheErrorsOfTheOdometry) {
  FastSlamOptions options = quiet_options(40);
  options.version = FastSlamVersion::fastslam_1;  // particles that weigh differently at once
  options.odometry_errors.estimate = true;
  options.strategy.schedule = Schedule::never;
  FastSlamOptions compensating = options;
  compensating.strategy.schedule = Schedule::always;
  compensating.strategy.renewal = Renewal::compensation;
  FastSlam carried(options, 9);
  FastSlam blended(options, 9);
  for (FastSlam* filter : {&carried, &blended}) see_from_origin(filter, {{4.0, 3.0}}, {});
  blended.set_options(compensating);
  const RangeBearingObservation seen = exact_observation({0.6, 0.1, 0.2}, {}, {4.0, 3.0}, 0);
  OdometryIncrement motion = some_motion();
  motion.distance_scale_sensitivity = {motion.mean.x, motion.mean.y, 0.0};
  motion.turn_scale_sensitivity = {0.0, 0.0, motion.mean.heading};
  for (FastSlam* filter : {&carried, &blended}) filter->update(motion, {seen});
  ASSERT_TRUE(blended.status().renewed);
  const Eigen::ArrayXXd before = carried.odometry_errors().state().means;
  const Eigen::ArrayXXd after = blended.odometry_errors().state().means;
  ASSERT_NE(before(0, 0), before(1, 0)) << "what all have learnt alike shows nothing";
  std::vector<int> order(40);
  for (int i = 0; i < 40; ++i) order[static_cast<std::size_t>(i)] = i;
  const Eigen::ArrayXd& weight = carried.particles().weight;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return weight[a] < weight[b]; });
  for (std::size_t rank = 0; rank < 20; ++rank) {
    const int low = order[rank];
    const int high = order[39 - rank];
    const double share = weight[low] / (weight[low] + weight[high]);
    for (Eigen::Index k = 0; k < before.cols(); ++k) {
      const double expected = share * before(low, k) + (1.0 - share) * before(high, k);
      EXPECT_NEAR(after(low, k), expected, 1e-12);
      EXPECT_EQ(after(high, k), before(high, k));
    }
  }
}

// Mean and covariance of a mixture: the particles' Gaussians, each with the weight of its particle.
TEST(FastSlam, TheMapIsThatOfTheParticlesByTheirWeights) {
  FastSlamOptions options = quiet_options(20);
  options.version = FastSlamVersion::fastslam_1;  // particles that weigh differently at once
  FastSlam filter(options, 5);
  see_from_origin(&filter, {{4.0, 3.0}, {2.0, -1.0}}, {});
  const Pose2 robot = compose({}, {0.6, 0.0, 0.25});
  filter.update(some_motion(), {exact_observation(robot, {}, {4.1, 3.1}, 0),
                                exact_observation(robot, {}, {2.1, -1.2}, 1)});
  const Eigen::ArrayXd weight = filter.particles().weight;
  ASSERT_EQ(weight.size(), 20);
  const auto [lightest, heaviest] = std::minmax_element(weight.data(), weight.data() + 20);
  ASSERT_GT(*heaviest, 3.0 * *lightest) << "weights that are alike show nothing";
  ASSERT_EQ(filter.rows().size(), 2u);
  for (const int row : filter.rows()) {
    const LandmarkRow data = filter.store().row(row);
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d place(data.x[i], data.y[i]);
      Eigen::Matrix2d covariance;
      covariance << data.xx[i], data.xy[i], data.xy[i], data.yy[i];
      mean += weight[i] * place;
      squares += weight[i] * (covariance + place * place.transpose());
    }
    const std::optional<LandmarkEstimate> landmark = filter.landmark(filter.id_of(row));
    ASSERT_TRUE(landmark);
    EXPECT_NEAR((landmark->mean - mean).norm(), 0.0, 1e-12);
    const Eigen::Matrix2d expected = squares - mean * mean.transpose();
    EXPECT_NEAR((landmark->covariance - expected).norm(), 0.0, 1e-12);
  }
}

// A landmark behind the sensor is seen just short of pi and then just beyond it, 0.02 rad apart and
// not almost a full turn. The robot rests where it turned to, with exact odometry, so that only the
// landmark is uncertain: the second of two observations with equal noise R moves it by half of the
// difference, and the difference has the covariance 2 R.
TEST(FastSlam, BearingsDifferByTheShorterArc) {
  for (const double heading : {0.0, 3.0, -3.0}) {
    for (const double yaw : {0.0, 2.5}) {
      SCOPED_TRACE("heading " + std::to_string(heading) + ", sensor turned by " +
                   std::to_string(yaw));
      FastSlamOptions options = quiet_options(3);
      options.odometry_errors.estimate = false;
      FastSlam filter(options, 1);
      const Pose2 sensor{0.0, 0.0, yaw};
      OdometryIncrement turn;
      turn.duration = 1.0;
      turn.mean.heading = heading;
      RangeBearingObservation z = {0, 3.0, kPi - 0.01};
      filter.update(turn, {z}, sensor);
      z.bearing = -kPi + 0.01;
      filter.update({}, {z}, sensor);

      EXPECT_EQ(filter.status().gated, 0);
      const LandmarkSensorOptions& model = filter.options().sensor;
      const double expected = -0.25 * std::pow(0.02 / model.bearing_sigma, 2) -
                              std::log(4.0 * kPi * model.range_sigma * model.bearing_sigma);
      EXPECT_NEAR(filter.status().log_likelihood, expected, 1e-6);
      const std::vector<LandmarkEstimate> map = filter.map();
      ASSERT_EQ(map.size(), 1u);
      const double first = heading + yaw + kPi - 0.01;
      const Eigen::Vector2d along(std::cos(first), std::sin(first));
      const Eigen::Vector2d across(-along.y(), along.x());
      EXPECT_NEAR((map[0].mean - 3.0 * (along + 0.01 * across)).norm(), 0.0, 1e-6);
    }
  }
}

// One control step leaves the pose covariance singular (rank 2): nothing may divide by it.
TEST(FastSlam, TakesASingularPoseCovariance) {
  OdometryNoise noise;
  noise = {};
  noise.translation_per_distance = 0.05;
  noise.slip_per_distance = 0.0;
  noise.heading_per_distance = 0.0;
  noise.heading_per_angle = 0.0;
  noise.heading_per_time = 0.01;
  noise.translation_per_time = 0.0;
  FastSlam filter(quiet_options(50), 3);
  const Eigen::Vector2d landmark(2.0, 1.0);
  filter.update({}, {exact_observation({}, {}, landmark, 0)});
  for (int step = 1; step <= 20; ++step) {
    OdometryIncrement increment;
    append(noise, {0.05, 0.0, 0.0}, 0.025, &increment);
    filter.update(increment, {exact_observation({0.05 * step, 0.0, 0.0}, {}, landmark, 0)});
  }
  EXPECT_TRUE(filter.particles().x.allFinite());
  EXPECT_TRUE(filter.particles().log_weight.allFinite());
  EXPECT_NEAR(filter.estimate().mean.x, 1.0, 0.1);
}

// A misread id is a landmark where none can be: neither pose nor map may follow it.
TEST(FastSlam, DoesNotBelieveWhatIsBeyondTheGate) {
  FastSlam filter(quiet_options(30), 1);
  filter.update(
      {}, {exact_observation({}, {}, {3.0, 0.0}, 0), exact_observation({}, {}, {0.0, 3.0}, 1)});
  RangeBearingObservation misread = exact_observation({}, {}, {0.0, -4.0}, 0);
  filter.update(some_motion(), {misread});
  EXPECT_EQ(filter.status().gated, 1);
  EXPECT_DOUBLE_EQ(filter.outcomes()[0].accepted, 0.0);
  for (const LandmarkEstimate& landmark : filter.map()) {
    if (landmark.id == 0) {
      EXPECT_NEAR((landmark.mean - Eigen::Vector2d(3.0, 0.0)).norm(), 0.0, 1e-9);
    }
  }
  // All particles were refused alike, at the gate: no weight differs by more than the determinant
  // does.
  EXPECT_GT(filter.status().effective_sample_size, 29.0);
}

FastSlamOptions unknown_options(DataAssociation method) {
  FastSlamOptions options = quiet_options(20);
  options.association.method = method;
  return options;
}

RangeBearingObservation without_id(RangeBearingObservation observation) {
  observation.id = -1;
  return observation;
}

TEST(FastSlam, FindsTheLandmarksByLikelihood) {
  for (const DataAssociation method :
       {DataAssociation::maximum_likelihood, DataAssociation::mutual_exclusion}) {
    FastSlam filter(unknown_options(method), 1);
    const std::vector<Eigen::Vector2d> landmarks = {{3.0, 0.0}, {3.0, 3.0}, {0.0, 3.0}};
    for (int scan = 0; scan < 5; ++scan) {
      std::vector<RangeBearingObservation> observations;
      for (const Eigen::Vector2d& landmark : landmarks) {
        observations.push_back(without_id(exact_observation({}, {}, landmark, 0)));
      }
      filter.update({}, observations);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(filter.outcomes()[k].is_new, scan == 0) << to_string(method);
        EXPECT_EQ(filter.outcomes()[k].landmark, static_cast<std::int64_t>(k));
      }
    }
    EXPECT_EQ(filter.status().landmarks, 3);
  }
}

// The second of two equal observations differs from the first by sqrt(2) sigma; at six times that
// it is of the same landmark, at ten times, beyond the outer gate of 64, of another.
TEST(FastSlam, WhatIsBeyondTheOuterGateIsANewLandmark) {
  for (const double deviations : {6.0, 10.0}) {
    FastSlamOptions options = unknown_options(DataAssociation::maximum_likelihood);
    ASSERT_EQ(options.association.new_landmark_gate, 64.0);
    FastSlam filter(options, 1);
    RangeBearingObservation seen = without_id(exact_observation({}, {}, {3.0, 0.0}, 0));
    filter.update({}, {seen});
    seen.range += deviations * std::sqrt(2.0) * options.sensor.range_sigma;
    filter.update({}, {seen});
    EXPECT_EQ(filter.outcomes()[0].is_new, deviations > 8.0);
    EXPECT_EQ(filter.status().landmarks, deviations > 8.0 ? 2 : 1);
  }
}

// The schedule goes by 1 / (sum of squared weights), which is below the exponential of the entropy:
// a threshold between the two renews.
TEST(FastSlam, TheScheduleGoesByTheEffectiveSampleSize) {
  FastSlamOptions options = quiet_options(100);
  options.version = FastSlamVersion::fastslam_1;  // particles that weigh differently at once
  const auto after_two_scans = [&] {
    FastSlam filter(options, 2);
    see_from_origin(&filter, {{4.0, 3.0}}, {});
    filter.update(some_motion(), {exact_observation({0.6, 0.1, 0.2}, {}, {4.0, 3.0}, 0)});
    return filter.status();
  };
  const FastSlamStatus status = after_two_scans();
  ASSERT_LT(status.effective_sample_size, status.entropy_sample_size - 1.0);
  options.strategy.renewal = Renewal::resampling;
  options.strategy.schedule = Schedule::effective_sample_size;
  options.strategy.threshold = 0.005 * (status.effective_sample_size + status.entropy_sample_size);
  EXPECT_TRUE(after_two_scans().renewed);
  options.strategy.threshold = 0.01 * (status.effective_sample_size - 1.0);
  EXPECT_FALSE(after_two_scans().renewed);
}

// Two landmarks 0.5 m apart, seen at once after one of them was known: with mutual exclusion the
// second observation must not be taken as the first landmark.
TEST(FastSlam, MutualExclusionGivesALandmarkOneObservationOfAScan) {
  FastSlamOptions options = unknown_options(DataAssociation::mutual_exclusion);
  options.sensor.range_sigma =
      0.3;  // so wide that both observations lie in the gate of the one landmark
  options.sensor.bearing_sigma = 0.1;
  const std::vector<RangeBearingObservation> both = {
      without_id(exact_observation({}, {}, {3.0, 0.0}, 0)),
      without_id(exact_observation({}, {}, {3.0, 0.5}, 0))};
  FastSlam exclusive(options, 1);
  exclusive.update({}, {both[0]});
  exclusive.update({}, both);
  EXPECT_EQ(exclusive.status().landmarks, 2);
  options.association.method = DataAssociation::maximum_likelihood;
  FastSlam greedy(options, 1);
  greedy.update({}, {both[0]});
  greedy.update({}, both);
  EXPECT_EQ(greedy.status().landmarks, 1);
}

// A false landmark in plain view that is never seen again goes, one that is out of view stays.
TEST(FastSlam, RemovesLandmarksThatShouldHaveBeenSeen) {
  FastSlamOptions options = unknown_options(DataAssociation::maximum_likelihood);
  options.sensor.maximum_range = 10.0;
  options.sensor.field_of_view = 2.0;
  FastSlam filter(options, 1);
  const auto real = without_id(exact_observation({}, {}, {4.0, 0.0}, 0));
  const auto ghost = without_id(exact_observation({}, {}, {3.0, 1.0}, 0));
  const auto behind = without_id(exact_observation({}, {}, {-3.0, 0.0}, 0));
  filter.update({}, {real, ghost, behind});
  EXPECT_EQ(filter.status().landmarks, 3);
  // From 0.9, less 0.4 a scan, to below -1.5: seven scans.
  for (int scan = 0; scan < 6; ++scan) filter.update({}, {real});
  EXPECT_EQ(filter.status().landmarks, 3);
  filter.update({}, {real});
  EXPECT_EQ(filter.status().landmarks, 2);
}

TEST(FastSlam, RefusesObservationsItCannotUseAndChangesNothing) {
  FastSlam filter(quiet_options(10), 1);
  filter.update({}, {exact_observation({}, {}, {3.0, 1.0}, 0)});
  const FastSlamParticles before = filter.particles();
  RangeBearingObservation bad = exact_observation({}, {}, {3.0, 1.0}, 0);
  for (const double range : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    bad.range = range;
    EXPECT_THROW(filter.update(some_motion(), {bad}), Error);
  }
  bad = without_id(exact_observation({}, {}, {3.0, 1.0}, 0));  // after one with an id
  EXPECT_THROW(filter.update(some_motion(), {bad}), Error);
  EXPECT_TRUE((filter.particles().x == before.x).all());
  EXPECT_TRUE((filter.particles().log_weight == before.log_weight).all());
}

TEST(FastSlam, RefusesOdometryThatIsNotFiniteAndChangesNothing) {
  const RangeBearingObservation good = exact_observation({}, {}, {3.0, 1.0}, 0);
  FastSlam filter(quiet_options(10), 1);
  filter.update({}, {good});
  const FastSlamParticles before = filter.particles();
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    std::vector<OdometryIncrement> motions(5, some_motion());
    motions[0].mean.x = motions[1].mean.y = motions[2].mean.heading = bad;
    motions[3].covariance(2, 1) = bad;
    motions[4].slip_covariance(2, 1) = bad;
    for (const OdometryIncrement& motion : motions) {
      EXPECT_THROW(filter.update(motion, {good}), Error);
      EXPECT_THROW(filter.update(motion, {}), Error);
    }
    EXPECT_THROW(filter.update(some_motion(), {good}, {bad, 0.0, 0.0}), Error);
    EXPECT_THROW(filter.update(some_motion(), {good}, {0.0, 0.0, bad}), Error);
  }
  EXPECT_TRUE((filter.particles().x == before.x).all());
  EXPECT_TRUE((filter.particles().log_weight == before.log_weight).all());
}

TEST(FastSlam, AutomaticAssociationGoesByTheFirstObservations) {
  const auto named = exact_observation({}, {}, {3.0, 1.0}, 7);
  const auto far_away = exact_observation({}, {}, {-4.0, 9.0}, 8);
  FastSlam with_ids(FastSlamOptions(), 1);
  with_ids.update({}, {});
  EXPECT_EQ(with_ids.association(), DataAssociation::automatic);
  with_ids.update({}, {named});
  EXPECT_EQ(with_ids.association(), DataAssociation::known);
  EXPECT_THROW(with_ids.update({}, {without_id(named)}), Error);

  FastSlam without_ids(FastSlamOptions(), 1);
  without_ids.update({}, {without_id(named), without_id(far_away)});
  EXPECT_EQ(without_ids.association(), DataAssociation::mutual_exclusion);
  // An id that is there after all is not used: it says nothing about those found without.
  without_ids.update({}, {named});
  EXPECT_EQ(without_ids.status().landmarks, 2);
  without_ids.reset();
  EXPECT_EQ(without_ids.association(), DataAssociation::automatic);
}

// Numbers in order of discovery are no ids: taken for such, whatever is seen would be one of them.
TEST(FastSlam, LandmarksFoundWithoutIdsAreNotKnownByIdsLater) {
  const auto named = exact_observation({}, {}, {3.0, 1.0}, 0);
  const auto other = exact_observation({}, {}, {-4.0, 9.0}, 1);
  FastSlamOptions options;
  FastSlam filter(options, 1);
  filter.update({}, {without_id(named)});
  options.association.method = DataAssociation::known;
  options.particles = 7;
  EXPECT_TRUE(says(refusal([&] { filter.set_options(options); }), "association/method"));
  EXPECT_EQ(filter.options().association.method, DataAssociation::automatic);
  EXPECT_EQ(filter.options().particles, FastSlamOptions().particles);
  EXPECT_EQ(filter.association(), DataAssociation::mutual_exclusion);
  filter.reset();
  filter.set_options(options);
  filter.update({}, {named});
  EXPECT_EQ(filter.map().front().id, 0);

  // There and back is refused only if something was found in between.
  options.association.method = DataAssociation::maximum_likelihood;
  filter.set_options(options);
  filter.update({}, {without_id(named)});
  options.association.method = DataAssociation::known;
  filter.set_options(options);
  EXPECT_EQ(filter.association(), DataAssociation::known);
  options.association.method = DataAssociation::maximum_likelihood;
  filter.set_options(options);
  filter.update({}, {without_id(other)});
  EXPECT_EQ(filter.status().landmarks, 2);
  options.association.method = DataAssociation::known;
  EXPECT_THROW(filter.set_options(options), Error);
  EXPECT_EQ(filter.association(), DataAssociation::maximum_likelihood);
}

// Between the two gates an observation would be of no landmark, known or new.
TEST(FastSlam, TheGateOfNewLandmarksIsNotBelowThatOfKnownOnes) {
  FastSlamOptions options;
  options.association.gate = 20.0;
  options.association.new_landmark_gate = 19.5;
  const std::string said = refusal([&] { const FastSlam filter(options, 1); });
  EXPECT_TRUE(says(said, "association/new_landmark_gate is 19.5"));
  EXPECT_TRUE(says(said, "has to be at least association/gate, which is 20.0"));
  options.association.new_landmark_gate = 20.0;
  EXPECT_NO_THROW(FastSlam(options, 1));
}

TEST(FastSlam, AnotherStrategyLeavesParticlesAndMapsAsTheyAre) {
  FastSlamOptions options;
  FastSlam filter(options, 1);
  for (int step = 0; step < 10; ++step) {
    filter.update(some_motion(),
                  {exact_observation({0.5 * step, 0.1 * step, 0.2 * step}, {}, {5.0, 1.0}, 0)});
  }
  const FastSlamParticles before = filter.particles();
  const std::vector<LandmarkEstimate> map = filter.map();
  for (const Renewal renewal : all_values<Renewal>()) {
    options.strategy.renewal = renewal;
    options.particles = 150;
    filter.set_options(options);
    EXPECT_TRUE((filter.particles().x == before.x).all());
    EXPECT_TRUE((filter.particles().heading == before.heading).all());
    EXPECT_TRUE((filter.particles().log_weight == before.log_weight).all());
    EXPECT_TRUE(filter.map()[0].mean == map[0].mean);
  }
}

}  // namespace
}  // namespace pf_resampling
