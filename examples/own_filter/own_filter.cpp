// A particle filter of one's own, renewed by the package's strategies: a robot drives a circle and
// measures its distance to three posts. Prints its error under resampling and under compensation.
#include <cmath>
#include <cstdio>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

using namespace pf_resampling;

// The mean error (m) of the last 100 of 200 steps.
double drive(const StrategyOptions& options) {
  const Pose2 posts[] = {{0.0, 0.0, 0.0}, {10.0, 0.0, 0.0}, {0.0, 10.0, 0.0}};
  const double sigma = 0.2;  // m, of a distance
  const int count = 500;
  const RandomStream places(1, RandomPurpose::initialization, 0);
  Eigen::ArrayXd x(count), y(count), heading(count), log_weight(count), weight(count);
  Eigen::ArrayXi ancestor = Eigen::ArrayXi::LinSpaced(count, 0, count - 1);
  places.fill_uniform(0, count, x.data());
  places.fill_uniform(count, count, y.data());
  places.fill_uniform(2 * count, count, heading.data());
  x *= 10.0, y *= 10.0, heading = kPi * (2.0 * heading - 1.0);
  log_weight.setConstant(-std::log(count));

  // What a filter offers of its population: its arrays, and how to copy and blend particles.
  Population population{&x, &y, &heading, &log_weight, &weight, &ancestor};
  population.select = [&](ConstIndices ancestors) {
    for (Eigen::ArrayXd* column : {&x, &y, &heading}) {
      const Eigen::ArrayXd before = *column;
      for (int i = 0; i < count; ++i) (*column)[i] = before[ancestors[i]];
    }
  };
  population.blend = [&](const std::vector<BlendPair>& pairs) {
    blend_poses(pairs, x, y, heading);
  };

  Strategy strategy(options);
  Pose2 robot{8.0, 5.0, 0.5 * kPi};
  double error = 0.0;
  for (std::uint32_t step = 1; step <= 200; ++step) {
    const auto stream = [&](RandomPurpose purpose) { return RandomStream(2, purpose, step); };
    const RandomStream noise = stream(RandomPurpose::motion);
    robot = compose(robot, {0.3, 0.0, 0.1});
    for (int i = 0; i < count; ++i) {
      const auto number = static_cast<std::uint64_t>(2 * i);
      const Pose2 motion{0.3 + 0.03 * noise.normal(number), 0.0,
                         0.1 + 0.03 * noise.normal(number + 1)};
      const Pose2 moved = compose({x[i], y[i], heading[i]}, motion);
      x[i] = moved.x, y[i] = moved.y, heading[i] = moved.heading;
    }
    const Pose2& post = posts[step % 3];
    const double measured = std::hypot(robot.x - post.x, robot.y - post.y) +
                            sigma * stream(RandomPurpose::simulation_observation).normal(0);
    log_weight -= 0.5 *
                  (((x - post.x).square() + (y - post.y).square()).sqrt() - measured).square() /
                  (sigma * sigma);
    const WeightSummary summary = normalize(log_weight, weight);
    strategy.renew(summary.effective_sample_size, count, false, stream, population);
    if (step > 100)
      error += std::hypot((weight * x).sum() - robot.x, (weight * y).sum() - robot.y) / 100.0;
  }
  return error;
}

int main() {
  StrategyOptions options;
  options.excitation.method = Excitation::regularized;
  for (const Renewal renewal : {Renewal::resampling, Renewal::compensation}) {
    options.renewal = renewal;
    std::printf("%s: off by %.2f m\n", strategy_of(options).c_str(), drive(options));
  }
}
