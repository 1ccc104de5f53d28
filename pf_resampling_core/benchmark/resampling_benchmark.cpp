#include <memory>
#include <vector>

#include "pf_resampling_core/benchmark/measure.hpp"
#include "pf_resampling_core/benchmark/peers.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

/// Every scheme from linear and from log-weights to counts and ancestor indices, beside MRPT
/// (log-weights to indices). Weights are drawn from (0, 1) and normalised. Not the same work: ours
/// also gives the counts, and keeps survivors in their slots; MRPT allocates its results in every
/// call.
namespace pf_resampling {
namespace {

struct Input {
  Eigen::ArrayXd weights;
  Eigen::ArrayXd log_weights;
  std::vector<double> log_weights_for_peers;
};

std::shared_ptr<Input> make_input(int particles) {
  auto input = std::make_shared<Input>();
  input->weights.resize(particles);
  RandomStream(1, RandomPurpose::test, 0).fill_uniform(0, particles, input->weights.data());
  input->weights /= input->weights.sum();
  input->log_weights = input->weights.log();
  input->log_weights_for_peers.assign(input->log_weights.begin(), input->log_weights.end());
  return input;
}

void measure_all(int particles) {
  const std::shared_ptr<Input> input = make_input(particles);
  const std::string linear = "from linear weights";
  const std::string logs = "from log-weights";

  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    const std::string row = to_string(scheme);
    ResamplingOptions options;
    options.scheme = scheme;
    const auto resampler = std::make_shared<Resampler>(options);
    const auto step = std::make_shared<std::uint32_t>(0);
    measure(linear, row, "ours", particles, [=] {
      resampler->resample(input->weights, particles,
                          RandomStream(1, RandomPurpose::resampling, ++*step));
    });
  }
  for (const ResamplingScheme scheme : all_values<ResamplingScheme>()) {
    const std::string row = to_string(scheme);
    ResamplingOptions options;
    options.scheme = scheme;
    const auto resampler = std::make_shared<Resampler>(options);
    const auto step = std::make_shared<std::uint32_t>(0);
    const auto log_weights = std::make_shared<Eigen::ArrayXd>(input->log_weights);
    const auto normalized = std::make_shared<Eigen::ArrayXd>(input->weights);
    measure(logs, row, "ours", particles, [=] {
      normalize(*log_weights, *normalized);
      resampler->resample(*normalized, particles,
                          RandomStream(1, RandomPurpose::resampling, ++*step));
    });
#if defined(PF_RESAMPLING_WITH_MRPT)
    const auto mrpt = [&](MrptScheme method) {
      const auto ancestors = std::make_shared<std::vector<std::size_t>>();
      measure(logs, row, "MRPT", particles,
              [=] { mrpt_resample(method, input->log_weights_for_peers, ancestors.get()); });
    };
    if (scheme == ResamplingScheme::multinomial) mrpt(MrptScheme::multinomial);
    if (scheme == ResamplingScheme::residual) mrpt(MrptScheme::residual);
    if (scheme == ResamplingScheme::stratified) mrpt(MrptScheme::stratified);
    if (scheme == ResamplingScheme::systematic) mrpt(MrptScheme::systematic);
#endif
  }
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  for (const int particles : {1000, 10000, 1000000}) pf_resampling::measure_all(particles);
  return pf_resampling::run_all(argc, argv);
}
