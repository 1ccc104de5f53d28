#include "research/studies/ekf_slam.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>

#include "pf_resampling_core/geometry.hpp"

namespace pf_resampling {
namespace {

LandmarkSensorOptions sensor_of(double range_sigma, double bearing_sigma) {
  LandmarkSensorOptions sensor;
  sensor.range_sigma = range_sigma;
  sensor.range_sigma_share = 0.0;
  sensor.bearing_sigma = bearing_sigma;
  return sensor;
}

RangeBearingObservation observation_of(int id, double range, double bearing) {
  return {id, range, bearing};
}

/// Pose (x, y, heading) and one landmark behind it.
using State = Eigen::Matrix<double, 5, 1>;

Eigen::Vector2d observed(const State& state) {
  const Eigen::Vector2d offset = state.tail<2>() - state.head<2>();
  return {offset.norm(), wrap_angle(std::atan2(offset.y(), offset.x()) - state[2])};
}

/// By central differences: independent of the formulas under test.
template <int kRows, int kColumns>
Eigen::Matrix<double, kRows, kColumns> derivative(
    const std::function<Eigen::Matrix<double, kRows, 1>(const Eigen::Matrix<double, kColumns, 1>&)>&
        function,
    const Eigen::Matrix<double, kColumns, 1>& at) {
  Eigen::Matrix<double, kRows, kColumns> result;
  const double step = 1e-6;
  for (int k = 0; k < kColumns; ++k) {
    Eigen::Matrix<double, kColumns, 1> high = at, low = at;
    high[k] += step;
    low[k] -= step;
    result.col(k) = (function(high) - function(low)) / (2.0 * step);
  }
  return result;
}

OdometryIncrement some_motion() {
  OdometryIncrement increment;
  increment.duration = 0.2;
  increment.mean = {0.5, 0.1, 0.2};
  increment.covariance << 0.0100, 0.0010, 0.0020, 0.0010, 0.0064, -0.0010, 0.0020, -0.0010, 0.0025;
  return increment;
}

// Moves, finds a landmark and sees it again after another motion: the information form, with
// derivatives by differences, says the same of the whole state.
TEST(EkfSlam, IsTheInformationFilterOnTheSameData) {
  const LandmarkSensorOptions sensor = sensor_of(0.1, 0.02);
  const Eigen::Matrix2d noise = Eigen::Vector2d(0.01, 0.0004).asDiagonal();
  const OdometryIncrement motion = some_motion();
  EkfSlam filter(sensor);
  filter.update(motion, {observation_of(0, 4.0, 0.7)});

  // State and covariance after the first scan, from what is drawn: motion, then observation.
  using Drawn = Eigen::Matrix<double, 5, 1>;
  const std::function<State(const Drawn&)> first = [](const Drawn& drawn) {
    State state;
    state << drawn.head<3>(), drawn[0] + drawn[3] * std::cos(drawn[2] + drawn[4]),
        drawn[1] + drawn[3] * std::sin(drawn[2] + drawn[4]);
    return state;
  };
  Drawn mean;
  mean << 0.5, 0.1, 0.2, 4.0, 0.7;
  Eigen::Matrix<double, 5, 5> drawn = Eigen::Matrix<double, 5, 5>::Zero();
  drawn.topLeftCorner<3, 3>() = motion.covariance;
  drawn.bottomRightCorner<2, 2>() = noise;
  const Eigen::Matrix<double, 5, 5> by_drawn = derivative<5, 5>(first, mean);
  State state = first(mean);
  Eigen::Matrix<double, 5, 5> covariance = by_drawn * drawn * by_drawn.transpose();
  EXPECT_LT((filter.state() - state).norm(), 1e-12);
  EXPECT_LT((filter.covariance() - covariance).norm(), 1e-9);

  // The second motion, by state and increment together.
  using Both = Eigen::Matrix<double, 8, 1>;
  const std::function<State(const Both&)> second = [](const Both& both) {
    State moved = both.head<5>();
    moved[0] += std::cos(both[2]) * both[5] - std::sin(both[2]) * both[6];
    moved[1] += std::sin(both[2]) * both[5] + std::cos(both[2]) * both[6];
    moved[2] += both[7];
    return moved;
  };
  Both both;
  both << state, 0.5, 0.1, 0.2;
  Eigen::Matrix<double, 8, 8> of_both = Eigen::Matrix<double, 8, 8>::Zero();
  of_both.topLeftCorner<5, 5>() = covariance;
  of_both.bottomRightCorner<3, 3>() = motion.covariance;
  const Eigen::Matrix<double, 5, 8> by_both = derivative<5, 8>(second, both);
  state = second(both);
  covariance = by_both * of_both * by_both.transpose();

  const Eigen::Vector2d seen = observed(state) + Eigen::Vector2d(0.05, -0.01);
  filter.update(motion, {observation_of(0, seen[0], seen[1])});
  const std::function<Eigen::Vector2d(const State&)> observing = observed;
  const Eigen::Matrix<double, 2, 5> by_state = derivative<2, 5>(observing, state);
  const Eigen::Matrix<double, 5, 5> information =
      covariance.inverse() + by_state.transpose() * noise.inverse() * by_state;
  const Eigen::Matrix<double, 5, 5> posterior = information.inverse();
  const State corrected =
      state + posterior * by_state.transpose() * noise.inverse() * Eigen::Vector2d(0.05, -0.01);
  EXPECT_LT((filter.state() - corrected).norm(), 1e-7);
  EXPECT_LT((filter.covariance() - posterior).norm(), 1e-7);
}

}  // namespace
}  // namespace pf_resampling
