#include "research/studies/scheme_times.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"
#include "research/studies/study_trials.hpp"

namespace pf_resampling {
namespace {

constexpr int kSamples = 51;
constexpr int kParticlesPerSample = 200000;  // so that a sample is long for the clock

double microseconds(ResamplingScheme scheme, int particles) {
  Eigen::ArrayXd weights(particles);
  RandomStream(1, RandomPurpose::motion, 0).fill_normal(0, particles, weights.data());
  weights = weights.exp();
  ResamplingOptions options;
  options.scheme = scheme;
  Resampler resampler(options);
  const int repetitions = std::max(1, kParticlesPerSample / particles);
  std::vector<double> samples;
  std::uint32_t step = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    const double begin = processor_seconds();
    for (int i = 0; i < repetitions; ++i) {
      resampler.resample(weights, particles, RandomStream(1, RandomPurpose::resampling, step++));
    }
    samples.push_back(1e6 * (processor_seconds() - begin) / repetitions);
  }
  return median(samples);
}

}  // namespace

std::string scheme_times() {
  std::string table = "scheme,particles,microseconds\n";
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    for (const int particles : {100, 300, 1000, 3000, 10000, 30000, 100000}) {
      char line[80];
      std::snprintf(line, sizeof(line), "%s,%d,%.4g\n", to_string(scheme).c_str(), particles,
                    microseconds(scheme, particles));
      table += line;
    }
  }
  return table;
}

}  // namespace pf_resampling
