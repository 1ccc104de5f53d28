#include "pf_resampling_core/strategy/resampling.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

// Each in a file of its own: schemes/<name>.cpp.
DrawCounts multinomial, residual, stratified, partial, rank_based, ssp, killing;
LogWeightsAfter log_weights_after_partial, log_weights_after_rank_based;

namespace {

void draw_systematic(const ScaledWeights& weights, const ResamplingOptions&,
                     const RandomStream& stream, ResamplingWorkspace*, int* counts) {
  systematic(weights, stream.uniform(0), counts);
}

struct SchemeRow {
  ResamplingScheme scheme;
  const char* name;  // as users write it
  DrawCounts* draw;
  bool keeps_size;     // cannot give more particles than it gets, nor fewer
  bool may_be_inside;  // another scheme; those that may not leave the draw to options.inner_scheme
  LogWeightsAfter* log_weights_after;  // null: all weigh the same
};

// The one table of schemes. Their list, names, parameters, checks and tests all come from it.
// Papers list the second and third of the systematic ones as schemes of their own (Kwak Table II,
// after Bolić, Djurić and Hong 2003; Mahmoud section II.D). Read as they have to be, with floor
// where Kwak prints a bracket and Mahmoud nothing, they take the same particles for the same
// uniform.
using Scheme = ResamplingScheme;
constexpr SchemeRow kSchemes[] = {
    // clang-format off
    //                                                                              keeps  may be log-weights
    // value                           name                        draw             size   inside afterwards
    {Scheme::multinomial,              "multinomial",              multinomial,     false, true,  nullptr},
    {Scheme::residual,                 "residual",                 residual,        false, true,  nullptr},
    {Scheme::systematic,               "systematic",               draw_systematic, false, true,  nullptr},
    {Scheme::residual_systematic,      "residual_systematic",      draw_systematic, false, true,  nullptr},
    {Scheme::residual_then_systematic, "residual_then_systematic", draw_systematic, false, true,  nullptr},
    {Scheme::stratified,               "stratified",               stratified,      false, true,  nullptr},
    {Scheme::partial,                  "partial",                  partial,         true,  false, log_weights_after_partial},
    {Scheme::rank_based,               "rank_based",               rank_based,      false, false, log_weights_after_rank_based},
    {Scheme::ssp,                      "ssp",                      ssp,             false, true,  nullptr},
    {Scheme::killing,                  "killing",                  killing,         true,  true,  nullptr},
    // clang-format on
};

const SchemeRow& row_of(ResamplingScheme scheme) {
  for (const SchemeRow& row : kSchemes) {
    if (row.scheme == scheme) return row;
  }
  throw Error("resampling: scheme " + std::to_string(static_cast<int>(scheme)) + " is unknown");
}

// The scheme in use that keeps the number of particles; null if none does.
const SchemeRow* size_keeper(const ResamplingOptions& options) {
  const SchemeRow& outer = row_of(options.scheme);
  if (outer.keeps_size) return &outer;
  const SchemeRow& inner = row_of(options.inner_scheme);
  return !outer.may_be_inside && inner.keeps_size ? &inner : nullptr;
}

void check(const ResamplingOptions& options) {
  ResamplingOptions copy = options;
  ParameterList parameters;
  add_parameters(&copy, &parameters);
  check_values(parameters);
  if (!(options.partial_high > options.partial_low)) {
    throw Error("resampling: partial_high is " + std::to_string(options.partial_high) +
                "; it must be greater than partial_low, " + std::to_string(options.partial_low));
  }
}

void check_sizes(const ResamplingOptions& options, std::int64_t particles, int copies) {
  const bool may_resize = particles == copies || options.own_scheme;
  const SchemeRow* keeper = may_resize ? nullptr : size_keeper(options);
  if (keeper == nullptr) return;
  throw Error("resampling: " + std::to_string(copies) + " particles were asked for from " +
              std::to_string(particles) + ", but " + keeper->name +
              " keeps the number of particles; choose another scheme to change it");
}

void draw_own(const OwnScheme& scheme, ConstArray weights, int size, const RandomStream& stream,
              int* counts) {
  Eigen::Map<Eigen::ArrayXi> own(counts, weights.size());
  own.setZero();
  scheme(weights, size, stream, own);
  if ((own < 0).any() || own.cast<std::int64_t>().sum() != size) {
    throw Error("resampling: own_scheme gave counts that sum to " +
                std::to_string(own.cast<std::int64_t>().sum()) + ", the smallest of them " +
                std::to_string(own.minCoeff()) + "; they must be 0 or more and sum to " +
                std::to_string(size));
  }
}

}  // namespace

const EnumNames<ResamplingScheme>& names_of(ResamplingScheme) {
  static const EnumNames<ResamplingScheme> names = [] {
    std::vector<std::pair<ResamplingScheme, std::string>> list;
    for (const SchemeRow& row : kSchemes) list.emplace_back(row.scheme, row.name);
    return EnumNames<ResamplingScheme>("resampling scheme", list);
  }();
  return names;
}

const std::vector<ResamplingScheme>& inner_resampling_schemes() {
  static const std::vector<ResamplingScheme> inner = [] {
    std::vector<ResamplingScheme> schemes;
    for (const SchemeRow& row : kSchemes) {
      if (row.may_be_inside) schemes.push_back(row.scheme);
    }
    return schemes;
  }();
  return inner;
}

const EnumNames<WeightsAfter>& names_of(WeightsAfter) {
  static const EnumNames<WeightsAfter> names(
      "policy for weights after resampling",
      {{WeightsAfter::reset, "reset"}, {WeightsAfter::unbiased, "unbiased"}});
  return names;
}

OwnScheme scheme_of_library(const std::string& path) {
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* function = library == nullptr ? nullptr : dlsym(library, "resampling_scheme");
  if (function == nullptr) {
    const char* reason = dlerror();
    throw Error("resampling: no scheme could be loaded: " +
                (reason != nullptr ? std::string(reason) : path + ": resampling_scheme is null") +
                "; see examples/own_scheme");
  }
  return reinterpret_cast<void (*)(ConstArray, int, const RandomStream&, MutableIndices)>(function);
}

void add_parameters(ResamplingOptions* options, ParameterList* parameters) {
  const std::string group = "population/resampling/";
  parameters->push_back(
      basic(choice_parameter(group + "scheme", &options->scheme, "Resampling scheme.")));
  parameters->push_back(
      choice_parameter(group + "inner_scheme", &options->inner_scheme, inner_resampling_schemes(),
                       "Scheme that partial and rank_based apply to the selected particles."));
  parameters->push_back(real_parameter(
      group + "partial_high", &options->partial_high, 1.0, 1000.0, "",
      "partial: particles with a weight above this multiple of 1/M take part (M particles)."));
  parameters->push_back(real_parameter(
      group + "partial_low", &options->partial_low, 0.0, 1.0, "",
      "partial: particles with a weight below this multiple of 1/M take part (M particles)."));
  parameters->push_back(real_parameter(
      group + "rank_max", &options->rank_max, 1.0, 2.0, "",
      "rank_based: eta_max; the best particle is drawn with probability eta_max/M (M particles)."));
  parameters->push_back(choice_parameter(group + "weights_after", &options->weights_after,
                                         "Weights after partial and rank_based: all equal (reset), "
                                         "or corrected so that the result is unbiased."));
  Parameter library = text_parameter(group + "library", &options->library,
                                     "Shared library with a scheme of your own, taken in place of "
                                     "scheme (examples/own_scheme).");
  library.set_checked = [options](const std::string& path) {
    options->own_scheme = path.empty() ? nullptr : scheme_of_library(path);
    options->library = path;
  };
  parameters->push_back(library);
}

bool keeps_size(const ResamplingOptions& options) {
  return !options.own_scheme && size_keeper(options) != nullptr;
}

void draw_inner_counts(const ScaledWeights& weights, const ResamplingOptions& options,
                       const RandomStream& stream, ResamplingWorkspace* work, int* counts) {
  row_of(options.inner_scheme).draw(weights, options, stream, work, counts);
}

Resampler::Resampler(const ResamplingOptions& options) : options_(options) {
  check(options_);
}

ResamplingResult Resampler::resample(ConstArray weights, int size, const RandomStream& stream) {
  const ScaledWeights scaled = scale_weights(weights.data(), weights.size(), size, &work_.rescaled);
  check_sizes(options_, scaled.size, size);
  const bool is_own = static_cast<bool>(options_.own_scheme);
  int* counts = grow(&counts_, scaled.size);
  int* ancestors = grow(&ancestors_, size);
  double* log_weights = grow(&log_weights_, size);

  const SchemeRow& scheme = row_of(options_.scheme);
  if (is_own) {
    draw_own(options_.own_scheme, weights, size, stream, counts);
  } else {
    scheme.draw(scaled, options_, stream, &work_, counts);
  }
  Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);
  counts_to_ancestors(Eigen::Map<const Eigen::ArrayXi>(counts, scaled.size), ancestors_map);

  const bool is_weighted = !is_own && scheme.log_weights_after != nullptr;
  if (is_weighted && options_.weights_after == WeightsAfter::unbiased) {
    equal_log_weights_ = 0;
    scheme.log_weights_after(scaled, &work_, ancestors, size, log_weights);
  } else if (equal_log_weights_ != size) {
    std::fill(log_weights, log_weights + size, -log_vector(static_cast<double>(size)));
    equal_log_weights_ = size;
  }
  return {Eigen::Map<const Eigen::ArrayXi>(counts, scaled.size),
          Eigen::Map<const Eigen::ArrayXi>(ancestors, size),
          Eigen::Map<const Eigen::ArrayXd>(log_weights, size)};
}

}  // namespace pf_resampling
