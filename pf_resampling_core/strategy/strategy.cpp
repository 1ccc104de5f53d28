#include "pf_resampling_core/strategy/strategy.hpp"

#include <algorithm>
#include <cstdio>

namespace pf_resampling {

const EnumNames<Schedule>& names_of(Schedule) {
  static const EnumNames<Schedule> names(
      "schedule", {{Schedule::never, "never"},
                   {Schedule::always, "always"},
                   {Schedule::effective_sample_size, "effective_sample_size"},
                   {Schedule::every_n, "every_n"}});
  return names;
}

const EnumNames<Renewal>& names_of(Renewal) {
  static const EnumNames<Renewal> names("renewal", {{Renewal::none, "none"},
                                                    {Renewal::resampling, "resampling"},
                                                    {Renewal::compensation, "compensation"},
                                                    {Renewal::redraw, "redraw"}});
  return names;
}

void add_parameters(StrategyOptions* options, const std::vector<Renewal>& renewals,
                    ParameterList* parameters) {
  parameters->push_back(
      choice_parameter("population/schedule", &options->schedule, "When to renew the population."));
  parameters->push_back(basic(real_above_parameter(
      "population/threshold", &options->threshold, 0.0, 1.0, "",
      "effective_sample_size: renew when N_eff drops below this share of the particles.")));
  parameters->push_back(
      integer_parameter("population/every_n", &options->every_n, 1, 1000000,
                        "every_n: number of observations from one renewal to the next."));
  parameters->push_back(real_above_parameter("population/tempering", &options->tempering, 0.0, 1.0,
                                             "",
                                             "Exponent on the likelihood in the weights; below 1 "
                                             "only for comparisons (redraw has its own)."));
  const bool can_redraw = std::count(renewals.begin(), renewals.end(), Renewal::redraw) > 0;
  parameters->push_back(
      basic(choice_parameter("population/renewal", &options->renewal, renewals,
                             can_redraw ? "How to renew: resampling, compensation, redraw (sample "
                                          "all particles anew from all data), or none."
                                        : "How to renew: resampling, compensation, or none.")));
  add_parameters(&options->resampling, parameters);
  add_parameters(&options->compensation, parameters);
  if (can_redraw) add_parameters(&options->redraw, parameters);
  add_parameters(&options->excitation, parameters);
}

std::string strategy_of(const StrategyOptions& options) {
  std::string strategy = to_string(options.schedule);
  char text[60];
  if (options.schedule == Schedule::effective_sample_size) {
    std::snprintf(text, sizeof(text), " < %g", options.threshold);
    strategy += text;
  } else if (options.schedule == Schedule::every_n) {
    strategy += " " + std::to_string(options.every_n);
  }
  strategy += ", " + to_string(options.renewal);
  if (options.renewal == Renewal::redraw) strategy += " and";
  if (options.renewal == Renewal::resampling || options.renewal == Renewal::redraw) {
    strategy += options.resampling.own_scheme ? std::string(" by a scheme of its own")
                                              : " " + to_string(options.resampling.scheme);
  } else if (options.renewal == Renewal::compensation) {
    std::snprintf(text, sizeof(text), " %s %g %%", to_string(options.compensation.pairing).c_str(),
                  100.0 * options.compensation.ratio);
    strategy += text;
  }
  return strategy + ", " + to_string(options.excitation.method);
}

Strategy::Strategy(const StrategyOptions& options)
    : options_(options), resampler_(options.resampling) {
  StrategyOptions copy = options;
  ParameterList parameters;
  add_parameters(&copy, all_values<Renewal>(), &parameters);
  check_values(parameters);
}

void Strategy::set_options(const StrategyOptions& options) {
  Strategy other(options);
  options_ = other.options_;
  resampler_ = std::move(other.resampler_);
}

bool Strategy::is_due(double effective_sample_size, int size, int requested_size) {
  ++observations_since_renewal_;
  if (options_.renewal == Renewal::none) return false;
  if (requested_size != size) return true;
  switch (options_.schedule) {
    case Schedule::never:
      return false;
    case Schedule::always:
      return true;
    case Schedule::effective_sample_size:
      // A threshold of one means after every observation, also when all weights are equal (Kwak
      // section 5.2).
      return options_.threshold >= 1.0 || effective_sample_size < options_.threshold * size;
    case Schedule::every_n:
      return observations_since_renewal_ >= options_.every_n;
  }
  return false;
}

RenewalOutcome Strategy::renew(double effective_sample_size, int requested_size, bool is_urgent,
                               const RandomStreams& streams, const Population& population) {
  const int size = static_cast<int>(population.weight->size());
  if (population.redraw && is_redraw_due(population)) {
    observations_since_redraw_ = 0;
    if (population.redraw(requested_size)) {
      count_renewal();
      return {true, true, requested_size};
    }
  }
  const bool is_now = is_due(effective_sample_size, size, requested_size) ||
                      (is_urgent && options_.schedule != Schedule::never);
  if (!is_now || options_.renewal == Renewal::none) return {};

  RenewalOutcome outcome{true, false, size};
  // Another number of particles can only be drawn.
  switch (requested_size == size ? options_.renewal : Renewal::resampling) {
    case Renewal::none:
      break;
    case Renewal::resampling:
    case Renewal::redraw: {
      const ResamplingResult result =
          select(*population.weight, requested_size, streams(RandomPurpose::resampling));
      population.select(result.ancestors);
      *population.ancestor = result.ancestors;
      *population.log_weight = result.log_weights;
      outcome.distinct_ancestors = result.counts.min(1).sum();
      break;
    }
    case Renewal::compensation: {
      const CompensationResult result =
          compensate(*population.weight, streams(RandomPurpose::compensation));
      population.blend(result.pairs);
      *population.ancestor = Eigen::ArrayXi::LinSpaced(size, 0, size - 1);
      *population.log_weight = result.log_weights;
      break;
    }
  }
  // Mostly one exponential is enough.
  const Eigen::ArrayXd& logs = *population.log_weight;
  if ((logs == logs[0]).all()) {
    population.weight->setConstant(logs.size(), Eigen::Array2d::Constant(logs[0]).exp()[0]);
  } else {
    *population.weight = logs.exp();
  }
  excite(options_.excitation, *population.weight, streams(RandomPurpose::excitation),
         {*population.x, *population.y, *population.heading}, &excitation_workspace_);
  return outcome;
}

bool Strategy::is_redraw_due(const Population& population) {
  if (options_.renewal != Renewal::redraw) return false;
  ++observations_since_redraw_;
  const RedrawOptions& redraw = options_.redraw;
  const auto have_passed = [&](int observations) {
    return static_cast<double>(observations_since_redraw_) >=
           population.redraw_spacing * observations;
  };
  return population.needs_redraw ||
         (population.closes_loop && redraw.closure_absence > 0 &&
          have_passed(redraw.closure_spacing)) ||
         (redraw.every_n > 0 && have_passed(redraw.every_n));
}

ResamplingResult Strategy::select(ConstArray weights, int requested_size,
                                  const RandomStream& stream) {
  const bool resizes = weights.size() != requested_size;
  Resampler& resampler = resizes && keeps_size(options_.resampling) ? resizer_ : resampler_;
  ResamplingResult result = resampler.resample(weights, requested_size, stream);
  count_renewal();
  return result;
}

CompensationResult Strategy::compensate(ConstArray weights, const RandomStream& stream) {
  CompensationResult result = pf_resampling::compensate(options_.compensation, weights, stream);
  count_renewal();
  return result;
}

void Strategy::count_renewal() {
  ++renewals_;
  observations_since_renewal_ = 0;
}

}  // namespace pf_resampling
