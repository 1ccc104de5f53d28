#include "pf_resampling_core/strategy/compensation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr double kRounding = 1e-12;  // of weights that sum to one

// Throws unless the weights are a distribution, up to their sum, which is returned.
double checked_sum(ConstArray weights) {
  if (weights.size() < 1) throw Error("compensation: there are no weights; give at least one");
  double sum = 0.0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    if (!(weights[i] >= 0.0) || std::isinf(weights[i])) {
      throw Error("compensation: weight " + std::to_string(i) + " of " +
                  std::to_string(weights.size()) + " is " + std::to_string(weights[i]) +
                  "; weights must be finite and >= 0");
    }
    sum += weights[i];
  }
  if (!(sum > 0.0) || std::isinf(sum)) {
    throw Error("compensation: the weights sum to " + std::to_string(sum) +
                "; reset them to uniform");
  }
  return sum;
}

// Slots in ascending order of weight, ties in order of slot.
std::vector<int> ranking(ConstArray weights) {
  struct Ranked {
    double weight;
    int slot;
  };
  std::vector<Ranked> ranked(static_cast<std::size_t>(weights.size()));
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    ranked[i] = {weights[static_cast<Eigen::Index>(i)], static_cast<int>(i)};
  }
  // Without a branch on the weights, which would be guessed wrong half of the time.
  std::sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) {
    const bool less = a.weight < b.weight;
    const bool equal = a.weight == b.weight;
    return less | (equal & (a.slot < b.slot));
  });
  std::vector<int> slots(ranked.size());
  for (std::size_t i = 0; i < ranked.size(); ++i) slots[i] = ranked[i].slot;
  return slots;
}

// For the i-th worst, i in [0, count), the rank of the strong one it is blended with, in
// [weak, size).
std::vector<std::size_t> partners(Pairing pairing, ConstArray weights,
                                  const std::vector<int>& slots, std::size_t weak,
                                  std::size_t count, const RandomStream& stream) {
  std::vector<std::size_t> ranks(count);
  const std::size_t strong = slots.size() - weak;
  if (pairing == Pairing::rank) {
    for (std::size_t i = 0; i < count; ++i) ranks[i] = slots.size() - 1 - i;
    return ranks;
  }
  std::vector<double> uniforms(count);
  stream.fill_uniform(0, static_cast<std::int64_t>(count), uniforms.data());
  if (pairing == Pairing::random) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto drawn = static_cast<std::size_t>(uniforms[i] * static_cast<double>(strong));
      ranks[i] = weak + std::min(drawn, strong - 1);
    }
    return ranks;
  }
  std::vector<double> wheel(strong);
  double sum = 0.0;
  for (std::size_t i = 0; i < strong; ++i) wheel[i] = sum += weights[slots[weak + i]];
  for (std::size_t i = 0; i < count; ++i) {
    // A slice of width zero is never hit: its end is that of the one before it.
    const auto slice = std::upper_bound(wheel.begin(), wheel.end(), uniforms[i] * sum);
    const auto drawn = static_cast<std::size_t>(slice - wheel.begin());
    ranks[i] = weak + std::min(drawn, strong - 1);
  }
  return ranks;
}

BlendPair pair_of(int low, int high, ConstArray weights, double sum, Blend blend) {
  const double weak = weights[low];
  const double strong = weights[high];
  if (blend == Blend::literal) return {low, high, weak / sum, (weak + strong) / sum};
  return {low, high, weak + strong > 0.0 ? weak / (weak + strong) : 0.5};
}

// Every pair, or strong particle with all its weak ones, gets the mean of its weights.
void share_weights(const std::vector<BlendPair>& pairs, Eigen::ArrayXd* weights) {
  Eigen::ArrayXd sums = *weights;
  Eigen::ArrayXd members = Eigen::ArrayXd::Ones(weights->size());
  for (const BlendPair& pair : pairs) {
    sums[pair.high] += (*weights)[pair.low];
    members[pair.high] += 1.0;
  }
  *weights = sums / members;
  for (const BlendPair& pair : pairs) (*weights)[pair.low] = (*weights)[pair.high];
}

double blended(const BlendPair& pair, double low, double high) {
  return pair.share * low + pair.share_of_high() * high;
}

[[noreturn]] void bad_pair(const BlendPair& pair, const std::string& why) {
  throw Error("compensation: slot " + std::to_string(pair.low) + " cannot be blended with slot " +
              std::to_string(pair.high) + ": " + why);
}

}  // namespace

const EnumNames<Pairing>& names_of(Pairing) {
  static const EnumNames<Pairing> names(
      "pairing",
      {{Pairing::rank, "rank"}, {Pairing::random, "random"}, {Pairing::roulette, "roulette"}});
  return names;
}

const EnumNames<Blend>& names_of(Blend) {
  static const EnumNames<Blend> names(
      "blend", {{Blend::normalized, "normalized"}, {Blend::literal, "literal"}});
  return names;
}

const EnumNames<CovarianceTreatment>& names_of(CovarianceTreatment) {
  static const EnumNames<CovarianceTreatment> names(
      "covariance treatment", {{CovarianceTreatment::keep, "keep"},
                               {CovarianceTreatment::moment_matched, "moment_matched"}});
  return names;
}

const EnumNames<CompensatedWeights>& names_of(CompensatedWeights) {
  static const EnumNames<CompensatedWeights> names(
      "policy for weights after compensation",
      {{CompensatedWeights::reset, "reset"}, {CompensatedWeights::pair_mean, "pair_mean"}});
  return names;
}

void add_parameters(CompensationOptions* options, ParameterList* parameters) {
  const std::string group = "population/compensation/";
  parameters->push_back(choice_parameter(group + "pairing", &options->pairing,
                                         "How weak and strong particles are paired for blending."));
  parameters->push_back(real_parameter(group + "ratio", &options->ratio, 0.0, 1.0, "",
                                       "Share of the weak half of the particles that is blended, "
                                       "weakest first. 0: only the weights change."));
  parameters->push_back(
      choice_parameter(group + "blend", &options->blend,
                       "Blending weights of a pair: normalized, or equations 7 and 8 of Kwak "
                       "(2008) as printed (literal), with which the filter diverges."));
  parameters->push_back(
      choice_parameter(group + "covariance", &options->covariance,
                       "Covariance of what is blended besides the pose (landmarks, calibration): "
                       "that of the weak particle (keep), or moment-matched."));
  parameters->push_back(
      choice_parameter(group + "weights_after", &options->weights_after,
                       "Weights after compensation: all equal (reset), or the mean of each pair."));
}

CompensationResult compensate(const CompensationOptions& options, ConstArray weights,
                              const RandomStream& stream) {
  if (!(options.ratio >= 0.0 && options.ratio <= 1.0)) {
    throw Error("compensation: ratio is " + std::to_string(options.ratio) +
                "; it must be in [0, 1]");
  }
  const double sum = checked_sum(weights);
  const std::vector<int> slots = ranking(weights);
  const std::size_t weak = slots.size() / 2;
  const auto wanted =
      static_cast<std::size_t>(std::round(options.ratio * static_cast<double>(weak)));
  const std::size_t least = options.ratio > 0.0 ? 1 : 0;
  const std::size_t count = std::min(weak, std::max(wanted, least));
  const std::vector<std::size_t> ranks =
      partners(options.pairing, weights, slots, weak, count, stream);

  CompensationResult result;
  result.pairs.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    result.pairs[i] = pair_of(slots[i], slots[ranks[i]], weights, sum, options.blend);
  }

  if (options.weights_after == CompensatedWeights::reset) {
    result.log_weights.setConstant(weights.size(), -std::log(static_cast<double>(weights.size())));
  } else {
    result.log_weights = weights / sum;
    share_weights(result.pairs, &result.log_weights);
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      result.log_weights[i] = log_any_vector(result.log_weights[i]);
    }
  }
  return result;
}

void check_pairs(const std::vector<BlendPair>& pairs, int particles) {
  constexpr std::uint8_t kLow = 1;
  constexpr std::uint8_t kHigh = 2;
  std::vector<std::uint8_t> roles(static_cast<std::size_t>(std::max(particles, 0)), 0);
  for (const BlendPair& pair : pairs) {
    if (pair.low < 0 || pair.low >= particles || pair.high < 0 || pair.high >= particles) {
      bad_pair(pair, "there are " + std::to_string(particles) + " particles");
    }
    if (!(pair.total >= 0.0 && pair.total <= 1.0 + kRounding)) {
      bad_pair(pair, "their shares sum to " + std::to_string(pair.total) + ", more than 1");
    }
    if (!(pair.share >= 0.0 && pair.share <= pair.total)) {
      bad_pair(pair, "its share is " + std::to_string(pair.share) + " and must be in [0, " +
                         std::to_string(pair.total) + "]");
    }
    std::uint8_t& role_of_low = roles[static_cast<std::size_t>(pair.low)];
    std::uint8_t& role_of_high = roles[static_cast<std::size_t>(pair.high)];
    if (pair.low == pair.high || role_of_low != 0 || role_of_high == kLow) {
      bad_pair(pair, "a low slot may be in one pair only, and may not be the high slot of another");
    }
    role_of_low = kLow;
    role_of_high = kHigh;
  }
}

void blend_poses(const std::vector<BlendPair>& pairs, MutableArray x, MutableArray y,
                 MutableArray heading) {
  if (x.size() != y.size() || x.size() != heading.size()) {
    throw Error("compensation: " + std::to_string(x.size()) + " x, " + std::to_string(y.size()) +
                " y and " + std::to_string(heading.size()) +
                " headings; give as many of each as there are particles");
  }
  check_pairs(pairs, static_cast<int>(x.size()));
  for (const BlendPair& pair : pairs) {
    x[pair.low] = blended(pair, x[pair.low], x[pair.high]);
    y[pair.low] = blended(pair, y[pair.low], y[pair.high]);
    double& low = heading[pair.low];
    const double towards = pair.total > 0.0 ? pair.share_of_high() / pair.total : 0.0;
    low = wrap_angle(pair.total * (low + towards * wrap_angle(heading[pair.high] - low)));
  }
}

void blend_means(const std::vector<BlendPair>& pairs, MutableArray values) {
  for (const BlendPair& pair : pairs) {
    values[pair.low] = blended(pair, values[pair.low], values[pair.high]);
  }
}

void blend_covariances(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment,
                       ConstArray first, ConstArray second, MutableArray covariances) {
  if (treatment == CovarianceTreatment::keep) return;
  for (const BlendPair& pair : pairs) {
    const double apart =
        (first[pair.high] - first[pair.low]) * (second[pair.high] - second[pair.low]);
    covariances[pair.low] = blended(pair, covariances[pair.low], covariances[pair.high]) +
                            pair.share * pair.share_of_high() * apart;
  }
}

}  // namespace pf_resampling
