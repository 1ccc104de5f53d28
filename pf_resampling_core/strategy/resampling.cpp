#include "pf_resampling_core/strategy/resampling.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {
namespace {

template <typename Enum>
struct Named {
  Enum value;
  const char* name;
};

constexpr Named<ResamplingScheme> kSchemes[] = {
    {ResamplingScheme::multinomial, "multinomial"},
    {ResamplingScheme::residual, "residual"},
    {ResamplingScheme::systematic, "systematic"},
    {ResamplingScheme::residual_systematic, "residual_systematic"},
    {ResamplingScheme::residual_then_systematic, "residual_then_systematic"},
    {ResamplingScheme::stratified, "stratified"},
    {ResamplingScheme::partial, "partial"},
    {ResamplingScheme::rank_based, "rank_based"},
    {ResamplingScheme::ssp, "ssp"},
    {ResamplingScheme::killing, "killing"},
};

constexpr Named<WeightsAfter> kWeightsAfter[] = {
    {WeightsAfter::reset, "reset"},
    {WeightsAfter::unbiased, "unbiased"},
};

template <typename Enum, std::size_t kCount>
std::string name_of(const Named<Enum> (&list)[kCount], Enum value) {
  for (const Named<Enum>& item : list) {
    if (item.value == value) return item.name;
  }
  return "unknown";
}

template <typename Enum, std::size_t kCount>
Enum value_of(const Named<Enum> (&list)[kCount], const std::string& name, const char* what) {
  std::string known;
  for (const Named<Enum>& item : list) {
    if (name == item.name) return item.value;
    known += known.empty() ? "" : ", ";
    known += item.name;
  }
  throw Error(std::string(what) + " '" + name + "' is unknown; known are " + known);
}

bool chooses_who_takes_part(ResamplingScheme scheme) {
  return scheme == ResamplingScheme::partial || scheme == ResamplingScheme::rank_based;
}

[[noreturn]] void bad_option(const std::string& name, double value, const std::string& range) {
  throw Error("resampling: " + name + " is " + std::to_string(value) + "; it must be " + range);
}

void check(const ResamplingOptions& options) {
  if (chooses_who_takes_part(options.inner_scheme)) {
    throw Error("resampling: inner_scheme is " + to_string(options.inner_scheme) +
                "; it must be one of the others, neither partial nor rank_based");
  }
  if (!(options.partial_low >= 0.0 && options.partial_low <= 1.0)) {
    bad_option("partial_low", options.partial_low, "in [0, 1]");
  }
  if (!(options.partial_high > options.partial_low && std::isfinite(options.partial_high))) {
    bad_option("partial_high", options.partial_high,
               "finite and greater than partial_low, " + std::to_string(options.partial_low));
  }
  if (!(options.rank_max >= 1.0 && options.rank_max <= 2.0)) {
    bad_option("rank_max", options.rank_max, "in [1, 2]");
  }
}

void check_sizes(const ResamplingOptions& options, std::int64_t particles, int copies) {
  if (particles == copies) return;
  const bool killing = options.scheme == ResamplingScheme::killing ||
                       (options.scheme == ResamplingScheme::rank_based &&
                        options.inner_scheme == ResamplingScheme::killing);
  if (killing || options.scheme == ResamplingScheme::partial) {
    throw Error("resampling: " + std::to_string(copies) + " particles were asked for from " +
                std::to_string(particles) + ", but " + (killing ? "killing" : "partial") +
                " keeps the number of particles; choose another scheme to change it");
  }
}

}  // namespace

const std::vector<ResamplingScheme>& all_resampling_schemes() {
  static const std::vector<ResamplingScheme> all = [] {
    std::vector<ResamplingScheme> values;
    for (const auto& item : kSchemes) values.push_back(item.value);
    return values;
  }();
  return all;
}

std::string to_string(ResamplingScheme scheme) {
  return name_of(kSchemes, scheme);
}

ResamplingScheme resampling_scheme_from_string(const std::string& name) {
  return value_of(kSchemes, name, "resampling scheme");
}

const std::vector<WeightsAfter>& all_weights_after() {
  static const std::vector<WeightsAfter> all = {WeightsAfter::reset, WeightsAfter::unbiased};
  return all;
}

std::string to_string(WeightsAfter policy) {
  return name_of(kWeightsAfter, policy);
}

WeightsAfter weights_after_from_string(const std::string& name) {
  return value_of(kWeightsAfter, name, "policy for weights after resampling");
}

void draw_counts(ResamplingScheme scheme, const ScaledWeights& weights, const RandomStream& stream,
                 ResamplingWorkspace* work, int* counts) {
  switch (scheme) {
    case ResamplingScheme::multinomial:
      return multinomial(weights, stream, work, counts);
    case ResamplingScheme::residual:
      return residual(weights, stream, work, counts);
    case ResamplingScheme::systematic:
      return systematic(weights, stream.uniform(0), counts);
    case ResamplingScheme::residual_systematic:
      return residual_systematic(weights, stream.uniform(0), counts);
    case ResamplingScheme::residual_then_systematic:
      return residual_then_systematic(weights, stream.uniform(0), counts);
    case ResamplingScheme::stratified:
      return stratified(weights, stream, work, counts);
    case ResamplingScheme::ssp:
      return ssp(weights, stream, work, counts);
    case ResamplingScheme::killing:
      return killing(weights, stream, work, counts);
    case ResamplingScheme::partial:
    case ResamplingScheme::rank_based:
      break;
  }
  throw Error("resampling: " + to_string(scheme) + " cannot be used inside another scheme");
}

Resampler::Resampler(const ResamplingOptions& options) : options_(options) {
  check(options_);
}

ResamplingResult Resampler::resample(ConstArray weights, int size, const RandomStream& stream) {
  const ScaledWeights scaled = scale_weights(weights.data(), weights.size(), size, &work_.rescaled);
  check_sizes(options_, scaled.size, size);
  int* counts = grow(&counts_, scaled.size);
  int* ancestors = grow(&ancestors_, size);
  double* log_weights = grow(&log_weights_, size);

  SharedMass shared;
  switch (options_.scheme) {
    case ResamplingScheme::partial:
      shared = partial(scaled, options_, stream, &work_, counts);
      break;
    case ResamplingScheme::rank_based:
      rank_based(scaled, options_, stream, &work_, counts);
      break;
    default:
      draw_counts(options_.scheme, scaled, stream, &work_, counts);
  }
  Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);
  counts_to_ancestors(Eigen::Map<const Eigen::ArrayXi>(counts, scaled.size), ancestors_map);

  if (chooses_who_takes_part(options_.scheme) && options_.weights_after == WeightsAfter::unbiased) {
    equal_log_weights_ = 0;
    if (options_.scheme == ResamplingScheme::partial) {
      log_weights_after_partial(scaled, shared, &work_, ancestors, size, log_weights);
    } else {
      log_weights_after_rank_based(scaled, &work_, ancestors, size, log_weights);
    }
  } else if (equal_log_weights_ != size) {
    std::fill(log_weights, log_weights + size, -log_vector(static_cast<double>(size)));
    equal_log_weights_ = size;
  }
  return {Eigen::Map<const Eigen::ArrayXi>(counts, scaled.size),
          Eigen::Map<const Eigen::ArrayXi>(ancestors, size),
          Eigen::Map<const Eigen::ArrayXd>(log_weights, size)};
}

}  // namespace pf_resampling
