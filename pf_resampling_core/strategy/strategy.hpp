#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"
#include "pf_resampling_core/strategy/excitation.hpp"
#include "pf_resampling_core/strategy/redraw.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {

/// When the population is renewed.
enum class Schedule {
  never,                  ///< Kwak's "NR": the weights are carried on
  always,                 ///< after every observation
  effective_sample_size,  ///< when N_eff < threshold * M (Kwak section 4.2)
  every_n,                ///< after every n-th observation
};
const EnumNames<Schedule>& names_of(Schedule);

/// How it is renewed. To add a way: a line here, its name in strategy.cpp, and there a case in
/// renew().
enum class Renewal {
  none,
  resampling,
  compensation,  ///< weak particles are blended with strong ones (Kwak section 5)
  /// All are drawn anew from what all data say (RedrawOptions tells when); between redraws the
  /// schedule asks for resampling.
  redraw,
};
const EnumNames<Renewal>& names_of(Renewal);

/// When and how a population is renewed, and what is done afterwards against impoverishment: the
/// part of a filter's options that is the same for all filters.
struct StrategyOptions {
  Schedule schedule = Schedule::effective_sample_size;
  /// T_N of Kwak section 5.2, share of M, in (0, 1]; 1 means after every observation.
  double threshold = 0.5;
  int every_n = 1;  ///< observations between renewals under Schedule::every_n, >= 1
  /// Share of what the observations say that the weights take up, in (0, 1]. Less than 1 makes any
  /// filter less sure of itself: the control for what is said of a renewal. Under Renewal::redraw
  /// RedrawOptions::tempering counts instead.
  double tempering = 1.0;
  Renewal renewal = Renewal::resampling;
  ResamplingOptions resampling;
  CompensationOptions compensation;
  RedrawOptions redraw;
  ExcitationOptions excitation;
};

/// The parameters population/... and excitation/..., bound to `options`, which must outlive the
/// list. `renewals`: what the filter can do; the parameters of a redraw are there if that is one.
void add_parameters(StrategyOptions* options, const std::vector<Renewal>& renewals,
                    ParameterList* parameters);

/// The strategy in one line: schedule, renewal, scheme and excitation.
std::string strategy_of(const StrategyOptions& options);

/// Health of a population. Counts are since the start.
struct PopulationStatus {
  int particles = 0;
  /// After the last update's weighing, before its renewal if there was one.
  double effective_sample_size = 0.0;
  double entropy_sample_size = 0.0;  ///< likewise
  /// Particles that have descendants (Kwak section 4.1): of those before the last renewal, ...
  int distinct_ancestors_of_renewal = 0;
  /// ... and of those there were when the population was last drawn, set or loaded; in FastSlam at
  /// the first landmark. An injected particle is a descendant of the one whose place it took.
  int distinct_ancestors_since_start = 0;
  bool renewed = false;  ///< whether the last update renewed the population
  std::int64_t updates = 0;
  std::int64_t renewals = 0;
  std::int64_t redraws = 0;        ///< of the renewals; in BeaconMcl beside them
  std::int64_t weight_resets = 0;  ///< times all weights vanished and were reset to uniform
  std::int64_t injected = 0;       ///< particles, where the robot was lost
  double log_likelihood = 0.0;     ///< of the last update's observations
};

/// A filter's population, as a strategy needs it: the filter's own arrays, an entry per particle,
/// and the two things that the filter alone knows how to do to a particle.
struct Population {
  Eigen::ArrayXd *x, *y;       ///< m
  Eigen::ArrayXd* heading;     ///< rad, in [-pi, pi]
  Eigen::ArrayXd* log_weight;  ///< normalised
  Eigen::ArrayXd* weight;      ///< normalised, linear
  Eigen::ArrayXi* ancestor;    ///< slot before the last renewal

  /// Slot i becomes a copy of the former slot ancestors[i], in all that a particle carries but its
  /// weights and its ancestor; ancestors.size() may differ from the number of particles.
  std::function<void(ConstIndices ancestors)> select = nullptr;
  /// Blends the first of each pair with the second, in all that can be blended.
  std::function<void(const std::vector<BlendPair>& pairs)> blend = nullptr;
  /// Draws `size` particles anew from what all data say, with equal weights, each its own ancestor;
  /// false, changing nothing, if it refuses. Empty: the filter cannot, or not now.
  std::function<bool(int size)> redraw = nullptr;
  /// Whether the last observations saw a landmark that was long out of view.
  bool closes_loop = false;
  /// Whether a redraw is due whatever the options say: the belief is wrong.
  bool needs_redraw = false;
  /// Factor of the observations from one redraw to the next: 1, or more where one has become dear.
  double redraw_spacing = 1.0;
};

/// That of particles which have these arrays by these names.
template <typename Particles>
Population population_of(Particles* particles, decltype(Population::select) select,
                         decltype(Population::blend) blend) {
  return {&particles->x,      &particles->y,        &particles->heading, &particles->log_weight,
          &particles->weight, &particles->ancestor, std::move(select),   std::move(blend)};
}

/// Random streams of one update, by their purpose.
using RandomStreams = std::function<RandomStream(RandomPurpose purpose)>;

/// What renew() did.
struct RenewalOutcome {
  bool renewed = false;
  bool redrawn = false;
  int distinct_ancestors = 0;  ///< particles before the renewal that have descendants; 0: none
};

/// Renews a population: one piece of code for all filters.
class Strategy {
 public:
  /// Throws Error for options outside their ranges, naming the option, its value and its range.
  explicit Strategy(const StrategyOptions& options = {});

  /// Other rules from now on; the counts go on. Throws Error, changing nothing, as the constructor
  /// does.
  void set_options(const StrategyOptions& options);

  /// To be called once after each observation update, with normalised weights: if a renewal is due,
  /// selects or blends the particles, gives them their new weights, and excites them.
  /// `effective_sample_size`: of these weights. `requested_size`: how many particles the filter
  /// wants from now on. `is_urgent`: renews before it is due, unless the strategy is never to
  /// renew.
  RenewalOutcome renew(double effective_sample_size, int requested_size, bool is_urgent,
                       const RandomStreams& streams, const Population& population);

  /// Whether a renewal is due, which is asked once after each observation update: when the schedule
  /// says so, or when requested_size differs from size; never if the renewal is `none`.
  bool is_due(double effective_sample_size, int size, int requested_size);

  /// Ancestors and weights of a renewal by resampling. See Resampler::resample. A change of size
  /// that the scheme cannot make (see keeps_size) is made by systematic resampling.
  ResamplingResult select(ConstArray weights, int requested_size, const RandomStream& stream);

  /// What to blend with what in a renewal by compensation, and the weights afterwards. See
  /// pf_resampling::compensate().
  CompensationResult compensate(ConstArray weights, const RandomStream& stream);

  const StrategyOptions& options() const { return options_; }
  /// How many renewals so far.
  std::int64_t renewals() const { return renewals_; }
  /// What Schedule::every_n and RedrawOptions::every_n count; and going on from such a count, for a
  /// population that was saved.
  std::int64_t observations_since_renewal() const { return observations_since_renewal_; }
  std::int64_t observations_since_redraw() const { return observations_since_redraw_; }
  void resume(std::int64_t observations_since_renewal, std::int64_t observations_since_redraw = 0) {
    observations_since_renewal_ = observations_since_renewal;
    observations_since_redraw_ = observations_since_redraw;
  }

 private:
  bool is_redraw_due(const Population& population);
  void count_renewal();

  StrategyOptions options_;
  Resampler resampler_;
  Resampler resizer_;
  ExcitationWorkspace excitation_workspace_;
  std::int64_t renewals_ = 0;
  std::int64_t observations_since_renewal_ = 0;
  std::int64_t observations_since_redraw_ = 0;
};

}  // namespace pf_resampling
