#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "pf_resampling_core/benchmark/measure.hpp"
#include "pf_resampling_core/benchmark/peers.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

/// One full step of range-beacon localization: motion with noise, likelihood of six ranges,
/// normalisation, systematic resampling, estimate. Beside it MRPT's CMonteCarloLocalization2D with
/// a CBeaconMap. The drive is the same circle for both, and every filter has to be where the robot
/// is at the end.
namespace pf_resampling {
namespace {

constexpr int kSteps = 512;  // around the circle, then again
constexpr double kRadius = 10.0;
constexpr double kSigma = 0.5;           // of the ranges, m
constexpr double kSigmaPosition = 0.03;  // of the motion of one step, m
constexpr double kSigmaHeading = 0.01;

struct Drive {
  std::vector<BeaconPosition> beacons = {{-5, -5},  {15, -5}, {15, 25},
                                         {-15, 25}, {-15, 8}, {5, 10}};
  double length = 2.0 * kPi * kRadius / kSteps;
  double turn = 2.0 * kPi / kSteps;
  std::vector<Pose2> poses;                 // after each step; it starts at the origin along x
  std::vector<std::vector<double>> ranges;  // after each step

  Drive() {
    std::mt19937_64 random(1);
    std::normal_distribution<double> noise(0.0, kSigma);
    Pose2 pose;
    for (int step = 0; step < kSteps; ++step) {
      pose.x += length * std::cos(pose.heading);
      pose.y += length * std::sin(pose.heading);
      pose.heading += turn;
      poses.push_back(pose);
      ranges.emplace_back();
      for (const BeaconPosition& beacon : beacons) {
        ranges.back().push_back(std::hypot(beacon.x - pose.x, beacon.y - pose.y) + noise(random));
      }
    }
  }
};

// Ours with the same work: calibration known, noise known, resampling at every step.
BeaconMclOptions same_work(int particles, int threads) {
  BeaconMclOptions options;
  options.particles = particles;
  options.threads = threads;
  options.strategy.schedule = Schedule::always;
  options.strategy.excitation.method = Excitation::none;
  options.ranges.sigma = kSigma;
  options.calibration.estimation = CalibrationEstimation::off;
  options.noise_estimation.ranges = false;
  options.noise_estimation.odometry = false;
  options.yaw_rate_bias.estimate = false;
  options.recovery.enabled = false;
  options.initialization.method = Initialization::gaussian;
  options.initialization.sigma_position = 0.01;
  options.initialization.sigma_heading = 0.01;
  return options;
}

class Ours {
 public:
  Ours(const BeaconMclOptions& options, const Drive& drive) : filter_(options, beacons(drive), 1) {
    increment_.duration = 0.2;
    increment_.mean.x = drive.length;
    increment_.mean.heading = drive.turn;
    increment_.covariance.diagonal() << kSigmaPosition * kSigmaPosition,
        kSigmaPosition * kSigmaPosition, kSigmaHeading * kSigmaHeading;
    for (const std::vector<double>& ranges : drive.ranges) {
      ranges_.emplace_back();
      for (std::size_t beacon = 0; beacon < ranges.size(); ++beacon) {
        RangeObservation observation;
        observation.beacon = static_cast<int>(beacon);
        observation.range = ranges[beacon];
        observation.variance = kSigma * kSigma;
        ranges_.back().push_back(observation);
      }
    }
  }

  void step(int step) {
    filter_.update(increment_, ranges_[static_cast<std::size_t>(step)]);
    mean_ = filter_.estimate().mean;
  }
  double mean_x() const { return mean_.x; }
  double mean_y() const { return mean_.y; }

 private:
  static std::vector<Beacon> beacons(const Drive& drive) {
    std::vector<Beacon> all;
    for (std::size_t i = 0; i < drive.beacons.size(); ++i) {
      Beacon beacon;
      beacon.id = static_cast<int>(i);
      beacon.position = {drive.beacons[i].x, drive.beacons[i].y, 0.0};
      beacon.is_planar = true;
      all.push_back(beacon);
    }
    return all;
  }

  BeaconMcl filter_;
  OdometryIncrement increment_;
  std::vector<std::vector<RangeObservation>> ranges_;
  Pose2 mean_;
};

// Measures a filter and checks that it knows where it is: a fast filter that is lost is no peer.
template <typename Filter>
void measure_filter(const std::string& contender, int particles, std::shared_ptr<Filter> filter,
                    const Drive& drive, bool with_threads = false) {
  const auto step = std::make_shared<int>(0);
  const auto warned = std::make_shared<bool>(false);
  measure(
      "6 beacons, every step", "one full step", contender, particles,
      [=, &drive] {
        filter->step(*step);
        const Pose2& truth = drive.poses[static_cast<std::size_t>(*step)];
        const double error = std::hypot(filter->mean_x() - truth.x, filter->mean_y() - truth.y);
        if (!(error < 2.0) && !*warned) {
          *warned = true;
          std::fprintf(stderr, "\n%s with %d particles is %.1f m off\n", contender.c_str(),
                       particles, error);
        }
        *step = (*step + 1) % kSteps;
      },
      with_threads);
}

#if defined(PF_RESAMPLING_WITH_MRPT)
class Mrpt {
 public:
  Mrpt(int particles, const Drive& drive)
      : drive_(drive), filter_(particles, drive.beacons, kSigma) {}

  void step(int step) {
    filter_.step(drive_.length, drive_.turn, kSigmaPosition, kSigmaHeading,
                 drive_.ranges[static_cast<std::size_t>(step)]);
  }
  double mean_x() const { return filter_.mean_x(); }
  double mean_y() const { return filter_.mean_y(); }

 private:
  const Drive& drive_;
  MrptBeaconMcl filter_;
};
#endif

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  using namespace pf_resampling;
  const Drive drive;
  for (const int particles : {1000, 10000, 100000}) {
    measure_filter("ours", particles, std::make_shared<Ours>(same_work(particles, 1), drive),
                   drive);
    measure_filter("ours, 2 threads (wall)", particles,
                   std::make_shared<Ours>(same_work(particles, 2), drive), drive, true);
    BeaconMclOptions learning;
    learning.particles = particles;
    learning.initialization = same_work(particles, 1).initialization;
    measure_filter("ours, as shipped", particles, std::make_shared<Ours>(learning, drive), drive);
#if defined(PF_RESAMPLING_WITH_MRPT)
    measure_filter("MRPT", particles, std::make_shared<Mrpt>(particles, drive), drive);
#endif
  }
  return pf_resampling::run_all(argc, argv);
}
