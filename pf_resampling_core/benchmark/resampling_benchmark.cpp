#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "pf_resampling_core/benchmark/measure.hpp"
#include "pf_resampling_core/benchmark/peers.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

/// Every scheme from linear and from log-weights to counts and ancestor indices, beside a plain
/// loop and MRPT (log-weights to indices). Weights are drawn from (0, 1) and normalised. Not the
/// same work: ours also gives the counts, and keeps survivors in their slots; MRPT allocates its
/// results in every call.
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

// ---- Plain loops: what one writes by hand, linear weights to ascending indices.

struct Plain {
  explicit Plain(int particles) : indices(static_cast<std::size_t>(particles) + 8) {}

  std::mt19937_64 random{1};
  std::uniform_real_distribution<double> uniform{0.0, 1.0};
  std::vector<int> indices;
  std::vector<double> weights;
  std::vector<double> sorted;
};

// Counts by rounding the running sum, indices without a branch on the count.
void plain_systematic(const double* weights, int size, Plain* plain) {
  const double u = plain->uniform(plain->random);
  double sum = 0.0;
  int begin = 0;
  int* indices = plain->indices.data();
  for (int i = 0; i < size; ++i) {
    sum += weights[i];
    const int end = std::min(size, static_cast<int>(std::ceil(sum * size - u)));
    for (int copy = 0; copy < 4; ++copy) indices[begin + copy] = i;
    for (int slot = begin + 4; slot < end; ++slot) indices[slot] = i;
    begin = end;
  }
  for (; begin < size; ++begin) indices[begin] = size - 1;
}

void plain_stratified(const double* weights, int size, Plain* plain) {
  double sum = weights[0];
  int i = 0;
  for (int slot = 0; slot < size; ++slot) {
    const double threshold = (slot + plain->uniform(plain->random)) / size;
    while (sum < threshold && i + 1 < size) sum += weights[++i];
    plain->indices[static_cast<std::size_t>(slot)] = i;
  }
}

void plain_multinomial(const double* weights, int draws, int size, int* indices, Plain* plain) {
  plain->sorted.resize(static_cast<std::size_t>(draws) + 1);
  double total = 0.0;
  for (double& value : plain->sorted) {
    total -= std::log(1.0 - plain->uniform(plain->random));
    value = total;
  }
  double sum = weights[0];
  int i = 0;
  for (int slot = 0; slot < draws; ++slot) {
    const double threshold = plain->sorted[static_cast<std::size_t>(slot)] / total;
    while (sum < threshold && i + 1 < size) sum += weights[++i];
    indices[slot] = i;
  }
}

void plain_residual(const double* weights, int size, Plain* plain) {
  plain->weights.resize(static_cast<std::size_t>(size));
  int* indices = plain->indices.data();
  int taken = 0;
  for (int i = 0; i < size; ++i) {
    const double copies = weights[i] * size;
    const int whole = static_cast<int>(copies);
    for (int copy = 0; copy < whole && taken < size; ++copy) indices[taken++] = i;
    plain->weights[static_cast<std::size_t>(i)] = copies - whole;
  }
  const int draws = size - taken;
  if (draws == 0) return;
  for (double& weight : plain->weights) weight /= draws;
  plain_multinomial(plain->weights.data(), draws, size, indices + taken, plain);
}

void measure_all(int particles) {
  const std::shared_ptr<Input> input = make_input(particles);
  const auto plain = std::make_shared<Plain>(particles);
  const std::string linear = "from linear weights";
  const std::string logs = "from log-weights";

  const auto by_hand = [&](ResamplingScheme scheme) -> void (*)(const double*, int, Plain*) {
    switch (scheme) {
      case ResamplingScheme::systematic:
        return plain_systematic;
      case ResamplingScheme::stratified:
        return plain_stratified;
      case ResamplingScheme::residual:
        return plain_residual;
      case ResamplingScheme::multinomial:
        return [](const double* weights, int size, Plain* p) {
          plain_multinomial(weights, size, size, p->indices.data(), p);
        };
      default:
        return nullptr;
    }
  };

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
    if (const auto loop = by_hand(scheme)) {
      measure(linear, row, "plain loop", particles,
              [=] { loop(input->weights.data(), particles, plain.get()); });
    }
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
    if (const auto loop = by_hand(scheme)) {
      measure(logs, row, "plain loop", particles, [=] {
        double largest = (*log_weights)[0];
        for (const double value : *log_weights) largest = std::max(largest, value);
        double sum = 0.0;
        for (int i = 0; i < particles; ++i) {
          (*normalized)[i] = std::exp((*log_weights)[i] - largest);
          sum += (*normalized)[i];
        }
        for (double& weight : *normalized) weight /= sum;
        loop(normalized->data(), particles, plain.get());
      });
    }
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
