// Where the robot is in its map: FastSlam::place().
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/models/point_alignment.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr int kParticles = 400;
constexpr double kFrameSigma = 0.3;  // m
constexpr double kTurnSigma = 0.02;
constexpr double kPoseSigma = 0.1;  // m, in the map
const std::vector<Eigen::Vector2d> kPlaces{{4.0, 1.0}, {6.0, 3.0}, {5.0, -2.0}, {7.0, 0.5}};
const Pose2 kRobot{1.0, 0.0, 0.5};

Eigen::Matrix2d own_covariance(std::size_t landmark) {
  Eigen::Matrix2d covariance;
  covariance << 0.04, 0.01, 0.01, 0.02 + 0.01 * static_cast<double>(landmark);
  return covariance;
}

// Particles whose maps are the same but for where they lie as a whole, with poses that differ
// besides; each map's landmarks have errors of their own of `own` times own_covariance().
SavedMap population(double own) {
  SavedMap map;
  map.association = DataAssociation::known;
  FastSlamParticles& particles = map.particles;
  for (Eigen::ArrayXd* column :
       {&particles.x, &particles.y, &particles.heading, &particles.log_weight, &particles.weight}) {
    column->setZero(kParticles);
  }
  particles.weight.setConstant(1.0 / kParticles);
  particles.log_weight = particles.weight.log();
  particles.ancestor = Eigen::ArrayXi::LinSpaced(kParticles, 0, kParticles - 1);
  map.odometry_errors.means.setZero(kParticles, OdometryErrorEstimator::kCount);
  for (std::size_t l = 0; l < kPlaces.size(); ++l) {
    SavedLandmark landmark;
    landmark.estimate.id = static_cast<std::int64_t>(l);
    landmark.estimate.mean = kPlaces[l];
    landmark.estimate.covariance = Eigen::Matrix2d::Identity();
    landmark.estimate.held = 1.0;
    landmark.last_seen = kPlaces[l];
    map.landmarks.push_back(landmark);
  }
  for (int i = 0; i < kParticles; ++i) {
    const RandomStream noise(3, RandomPurpose::test, static_cast<std::uint32_t>(i));
    const Pose2 frame{kFrameSigma * noise.normal(0), kFrameSigma * noise.normal(1),
                      kTurnSigma * noise.normal(2)};
    const Pose2 pose = compose(frame, {kRobot.x + kPoseSigma * noise.normal(3),
                                       kRobot.y + kPoseSigma * noise.normal(4), kRobot.heading});
    particles.x[i] = pose.x;
    particles.y[i] = pose.y;
    particles.heading[i] = pose.heading;
    std::vector<ParticleLandmark> own_map;
    for (std::size_t l = 0; l < kPlaces.size(); ++l) {
      own_map.push_back({static_cast<std::int64_t>(l), moved(kPlaces[l], frame),
                         own * own_covariance(l) + 1e-9 * Eigen::Matrix2d::Identity(), 1.0});
    }
    map.particle_maps.push_back(own_map);
  }
  return map;
}

FastSlam filter_of(const SavedMap& map) {
  FastSlamOptions options;
  options.particles = kParticles;
  FastSlam filter(options, 1);
  filter.load(map);
  return filter;
}

// A variance of 400 draws is wrong by 7 % (one standard error); 30 % are four.
void expect_close(double value, double expected, const char* what) {
  EXPECT_NEAR(value, expected, 0.3 * expected) << what;
}

TEST(Place, WhereTheMapLiesAsAWholeDoesNotCount) {
  FastSlam filter = filter_of(population(0.0));
  const PoseEstimate whole = filter.estimate();
  expect_close(whole.covariance(0, 0), kFrameSigma * kFrameSigma + kPoseSigma * kPoseSigma, "x");
  const PoseEstimate place = filter.place();
  EXPECT_EQ(place.mean.x, whole.mean.x);
  EXPECT_EQ(place.mean.heading, whole.mean.heading);
  expect_close(place.covariance(0, 0), kPoseSigma * kPoseSigma, "x");
  expect_close(place.covariance(1, 1), kPoseSigma * kPoseSigma, "y");
  expect_close(whole.covariance(2, 2), kTurnSigma * kTurnSigma, "heading");
  EXPECT_LT(place.covariance(2, 2), 1e-6);
}

// Maps of landmarks with errors, laid on the true ones by align_points(): 4000 times. The error of
// a variance is 2.2 %; 10 % are more than four of them.
TEST(Place, ErrorsOfTheLandmarksMoveAndTurnTheMap) {
  FastSlam with = filter_of(population(1.0));
  FastSlam without = filter_of(population(0.0));
  const Eigen::Matrix3d of_maps = with.place().covariance - without.place().covariance;
  Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
  const int draws = 4000;
  for (int k = 0; k < draws; ++k) {
    const RandomStream noise(4, RandomPurpose::test, static_cast<std::uint32_t>(k));
    std::vector<Eigen::Vector2d> seen;
    for (std::size_t l = 0; l < kPlaces.size(); ++l) {
      const auto n = static_cast<std::uint32_t>(2 * l);
      const Eigen::Matrix2d root = own_covariance(l).llt().matrixL();
      // A tenth of the errors, so that the alignment is linear in them.
      seen.push_back(kPlaces[l] +
                     0.1 * root * Eigen::Vector2d(noise.normal(n), noise.normal(n + 1)));
    }
    const Pose2 laid = compose(align_points(seen, kPlaces), kRobot);
    const Eigen::Vector3d error(laid.x - kRobot.x, laid.y - kRobot.y,
                                wrap_angle(laid.heading - kRobot.heading));
    expected += 100.0 / draws * error * error.transpose();
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(of_maps(k, k), expected(k, k), 0.1 * expected(k, k)) << k;
  EXPECT_NEAR(of_maps(1, 2), expected(1, 2), 0.1 * std::abs(expected(1, 2)));
}

TEST(Place, WithoutLandmarksItIsTheWholeBelief) {
  SavedMap map = population(0.0);
  map.landmarks.clear();
  for (auto& own : map.particle_maps) own.clear();
  FastSlam filter = filter_of(map);
  EXPECT_EQ(filter.place().covariance, filter.estimate().covariance);
}

TEST(Place, NoiseThatIsAsStatedIsNotDoubted) {
  FastSlamOptions options;
  options.strategy.renewal = Renewal::redraw;
  EXPECT_EQ(FastSlam(options, 1).noise_doubt(), 6.0);
  options.strategy.redraw.learn_noise = false;
  EXPECT_EQ(FastSlam(options, 1).noise_doubt(), 1.0);
  options.strategy.redraw.learn_noise = true;
  options.strategy.renewal = Renewal::resampling;
  EXPECT_EQ(FastSlam(options, 1).noise_doubt(), 1.0);
}

}  // namespace
}  // namespace pf_resampling
