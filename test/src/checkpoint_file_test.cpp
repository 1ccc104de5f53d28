#include "src/checkpoint/checkpoint.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

class CheckpointFile : public testing::Test {
 protected:
  // What is in the file of a checkpoint.
  template <typename Checkpoint>
  std::string written(const Checkpoint& checkpoint) const {
    write_saved(kCheckpointFile, path_, checkpoint);
    return directory_.content("a.checkpoint");
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.file("a.checkpoint");
};

SavedProgress some_progress() {
  SavedProgress progress;
  progress.first_odometry.fromNSec(100000000001);
  progress.used.fromNSec(112040000000);
  progress.last_observation = progress.used;
  progress.speed.driven = 1.25;
  progress.speed.slipping = 0.5;
  progress.speed.moving = 31.5;
  progress.speed.moves = 630;
  progress.lost_probability = 1.0 / 3.0;
  progress.normalized_innovation = 1.1;
  progress.odometry_offset = {0.1, -0.2, 0.3};
  for (int i = 0; i < 3; ++i) {
    OdometrySample odometry;
    odometry.stamp = ros::Time(112.0 + 0.1 * i);
    odometry.received = {i / 3.0, -i / 7.0, 0.1 * i};
    odometry.pose = {i / 9.0, i / 11.0, -0.1 * i};
    if (i > 0) odometry.covariance = Eigen::Matrix3d(0.1 * i * Eigen::Matrix3d::Identity());
    if (i > 1) {
      Eigen::Matrix3d step;
      step << 0.2, 0.01, 0.02, 0.01, 0.3, 0.03, 0.02, 0.03, 0.4 / 3.0;
      odometry.step_covariance = step;
      odometry.may_slip = true;
    }
    progress.odometry.push_back(odometry);
  }
  return progress;
}

void expect_example(const SavedProgress& read) {
  const SavedProgress example = some_progress();
  EXPECT_EQ(read.first_odometry, example.first_odometry);
  EXPECT_EQ(read.speed.driven, example.speed.driven);
  EXPECT_EQ(read.speed.moves, example.speed.moves);
  EXPECT_EQ(read.lost_probability, example.lost_probability);
  ASSERT_EQ(read.odometry.size(), 3u);
  EXPECT_EQ(read.odometry[2].received.heading, example.odometry[2].received.heading);
  EXPECT_EQ(read.odometry[2].step_covariance, example.odometry[2].step_covariance);
}

const std::vector<Beacon> kBeacons = {
    {-1, {0.0, 0.0, 0.5}, false}, {2, {20.0, 0.0, 0.0}, true}, {30, {8.0, 1.0 / 3.0, 0.0}, true}};

BeaconMclOptions learning_options(CalibrationEstimation estimation) {
  BeaconMclOptions options;
  options.particles = 60;
  options.initialization.method = Initialization::from_ranges;
  options.calibration.estimation = estimation;
  options.yaw_rate_bias.estimate = true;
  options.noise_estimation.ranges = options.noise_estimation.odometry = true;
  options.recovery.enabled = true;
  options.strategy.schedule = Schedule::every_n;
  options.strategy.every_n = 3;
  return options;
}

// One step on a circle; from the 120th on somewhere else, so that particles are injected.
void step(int t, BeaconMcl* filter) {
  const double angle = 0.1 * t;
  const Pose2 truth = {(t < 120 ? 5.0 : 17.0) + 3.0 * std::cos(angle), 4.0 + 3.0 * std::sin(angle),
                       angle + kPi / 2};
  OdometryIncrement odometry;
  if (t > 0) append(OdometryNoise{}, {0.3, 0.015, 0.1}, 0.5, &odometry);
  const Beacon& beacon = kBeacons[static_cast<std::size_t>(t) % 3];
  const double range =
      0.3 + std::hypot(beacon.position.x() - truth.x, beacon.position.y() - truth.y);
  filter->update(odometry, {{beacon.id, range, 0.0, Eigen::Vector3d(0.1, 0.0, 0.4)}});
}

// Saved at any of some steps, written, read and loaded by another filter: from there on to the bit
// what the first one does, whatever it learns.
TEST_F(CheckpointFile, BeaconMclGoesOnToTheBit) {
  for (const CalibrationEstimation estimation :
       {CalibrationEstimation::off, CalibrationEstimation::shared}) {
    const BeaconMclOptions options = learning_options(estimation);
    for (const int cut : {10, 79, 101}) {
      BeaconMcl first(options, kBeacons, 3);
      EXPECT_THROW(first.saved(), Error);
      for (int t = 0; t < cut; ++t) step(t, &first);
      ASSERT_TRUE(first.is_initialized());
      const std::string saved = written(BeaconMclCheckpoint{some_progress(), first.saved()});
      const BeaconMclCheckpoint checkpoint =
          read_saved<BeaconMclCheckpoint>(kCheckpointFile, path_);
      expect_example(checkpoint.progress);
      EXPECT_EQ(written(checkpoint), saved);
      BeaconMcl second(options, kBeacons, 3);
      second.load(checkpoint.filter);
      for (int t = cut; t < 160; ++t) {
        step(t, &first);
        step(t, &second);
      }
      EXPECT_GT(second.status().injected, 0);
      EXPECT_EQ(written(BeaconMclCheckpoint{some_progress(), second.saved()}),
                written(BeaconMclCheckpoint{some_progress(), first.saved()}));
      EXPECT_EQ(first.estimate().mean.x, second.estimate().mean.x);
    }
  }
}

TEST_F(CheckpointFile, AnotherCountIsDrawnAtTheNextUpdate) {
  const BeaconMclOptions options = learning_options(CalibrationEstimation::shared);
  BeaconMcl first(options, kBeacons, 3);
  for (int t = 0; t < 50; ++t) step(t, &first);
  BeaconMclOptions more = options;
  more.particles = 100;
  BeaconMcl second(more, kBeacons, 3);
  second.load(first.saved());
  EXPECT_EQ(second.particles().size(), 60);
  step(50, &second);
  EXPECT_EQ(second.particles().size(), 100);
}

TEST_F(CheckpointFile, BeaconMclRefusesWhatDoesNotFitAndStaysAsItIs) {
  const BeaconMclOptions options = learning_options(CalibrationEstimation::shared);
  BeaconMcl filter(options, kBeacons, 3);
  for (int t = 0; t < 50; ++t) step(t, &filter);
  const SavedBeaconMcl good = filter.saved();
  step(50, &filter);
  const std::string before = written(BeaconMclCheckpoint{some_progress(), filter.saved()});
  SavedBeaconMcl moved = good;
  moved.beacons[1].position.x() += 0.01;
  SavedBeaconMcl fewer = good;
  fewer.beacons.pop_back();
  for (const SavedBeaconMcl& other : {moved, fewer}) {
    const std::string said = pf_resampling::refusal([&] { filter.load(other); });
    EXPECT_TRUE(says(said, "with other beacons"));
    EXPECT_FALSE(says(said, "\n"));
  }
  BeaconMclOptions other = options;
  other.calibration.estimation = CalibrationEstimation::off;
  BeaconMcl differently(other, kBeacons, 3);
  EXPECT_THROW(differently.load(good), Error);
  EXPECT_EQ(written(BeaconMclCheckpoint{some_progress(), filter.saved()}), before);
}

SavedMap small_map() {
  FastSlamOptions options;
  options.particles = 3;
  FastSlam filter(options, 1);
  RangeBearingObservation seen = {4, 3.0, 0.5};
  for (int i = 0; i < 3; ++i) filter.update({}, {seen});
  return saved_map(&filter, 3);
}

// That the map itself comes back is tested with the files of maps.
const Eigen::AlignedBox2d kScene(Eigen::Vector2d(-1.0 / 3.0, -2.0), Eigen::Vector2d(7.0, 0.1));

TEST_F(CheckpointFile, FastSlamsComesBackWithItsMap) {
  const FastSlamCheckpoint checkpoint = {some_progress(), kScene, small_map()};
  const std::string saved = written(checkpoint);
  const FastSlamCheckpoint read = read_saved<FastSlamCheckpoint>(kCheckpointFile, path_);
  expect_example(read.progress);
  EXPECT_EQ(read.scene.min(), kScene.min());
  EXPECT_EQ(read.scene.max(), kScene.max());
  ASSERT_EQ(read.filter.particles.size(), 3);
  EXPECT_EQ(read.filter.particles.x[2], checkpoint.filter.particles.x[2]);
  EXPECT_EQ(read.filter.particle_maps[2][0].mean, checkpoint.filter.particle_maps[2][0].mean);
  EXPECT_EQ(written(read), saved);
}

template <typename Checkpoint>
std::string refusal_of(const std::string& path) {
  return refusal([&] { read_saved<Checkpoint>(kCheckpointFile, path); });
}

TEST_F(CheckpointFile, OneOfAnotherFilterAndOtherFilesAreRefused) {
  write_saved(kCheckpointFile, path_, FastSlamCheckpoint{some_progress(), kScene, small_map()});
  EXPECT_EQ(refusal_of<BeaconMclCheckpoint>(path_),
            "checkpoint " + path_ +
                ": filter: \"beacon_mcl\" expected, \"fastslam\" found; take another copy or start "
                "without it");
  write_map_file(path_, small_map());
  EXPECT_TRUE(says(refusal_of<FastSlamCheckpoint>(path_), "is not how a checkpoint begins"));
  EXPECT_TRUE(says(refusal_of<FastSlamCheckpoint>(directory_.file("none")), "cannot be read"));
  EXPECT_THROW(write_saved(kCheckpointFile, directory_.file("none/a"),
                           FastSlamCheckpoint{some_progress(), kScene, small_map()}),
               Error);
}

}  // namespace
}  // namespace pf_resampling
