// A resampling scheme of one's own: Metropolis resampling (Murray 2012), which never sums the
// weights, so that every slot can be drawn on a processor of its own. Prints, beside the package's
// schemes, how far it is from the right mean, and how much the counts vary: the less, the better.
#include <cmath>
#include <cstdio>

#include "pf_resampling_core/strategy/resampling.hpp"

using namespace pf_resampling;

void metropolis(ConstArray weights, int size, const RandomStream& stream, MutableIndices counts) {
  const int steps = 50;
  for (int slot = 0; slot < size; ++slot) {
    Eigen::Index taken = slot % weights.size();
    for (int step = 0; step < steps; ++step) {
      const auto number = static_cast<std::uint64_t>(2 * (steps * slot + step));
      const auto other = static_cast<Eigen::Index>(stream.uniform(number) * double(weights.size()));
      if (stream.uniform(number + 1) * weights[taken] <= weights[other]) taken = other;
    }
    ++counts[taken];
  }
}

void report(const char* name, const ResamplingOptions& options) {
  const int count = 50, trials = 2000;
  const Eigen::ArrayXd weights = Eigen::ArrayXd::LinSpaced(count, 0.0, 2.0 / count);
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(count), squares = sum;
  Resampler resampler(options);
  for (std::uint32_t trial = 0; trial < trials; ++trial) {
    const RandomStream stream(1, RandomPurpose::resampling, trial);
    const Eigen::ArrayXd counts = resampler.resample(weights, count, stream).counts.cast<double>();
    sum += counts, squares += (counts - count * weights).square();
  }
  std::printf("%-26s mean off by %.3f, variance %.3f\n", name,
              std::sqrt((sum / trials - count * weights).square().mean()),
              (squares / trials).mean());
}

int main() {
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    report(to_string(scheme).c_str(), ResamplingOptions{scheme});
  }
  // A filter takes it the same way: options.strategy.resampling.own_scheme = metropolis.
  ResamplingOptions options;
  options.own_scheme = metropolis;
  report("metropolis", options);
}
