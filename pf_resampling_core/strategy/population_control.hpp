#pragma once

#include <string>
#include <vector>

#include "pf_resampling_core/population/ancestry.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {

/// When the population is renewed.
enum class Schedule {
  never,                  ///< K "NR": the weights are carried on
  always,                 ///< after every observation
  effective_sample_size,  ///< when N_eff < threshold * M (K section 4.2)
  every_n,                ///< after every n-th observation
};
const std::vector<Schedule>& all_schedules();
std::string to_string(Schedule schedule);
Schedule schedule_from_string(const std::string& name);

/// How it is renewed.
enum class Renewal {
  none,
  resampling,
  compensation,  ///< weak particles are blended with strong ones (K section 5)
};
const std::vector<Renewal>& all_renewals();
std::string to_string(Renewal renewal);
Renewal renewal_from_string(const std::string& name);

struct PopulationControlOptions {
  Schedule schedule = Schedule::effective_sample_size;
  double threshold =
      0.5;  ///< T_N of K section 5.2, share of M, in (0, 1]; 1 means after every observation
  int every_n = 1;  ///< observations between renewals under Schedule::every_n, >= 1
  Renewal renewal = Renewal::resampling;
  ResamplingOptions resampling;
  CompensationOptions compensation;
};

/// When and how a population is renewed; shared by all filters. It sees weights, never particles:
/// the filter carries out what select() decides.
class PopulationControl {
 public:
  explicit PopulationControl(const PopulationControlOptions& options = {});

  /// Other rules from now on; the counts go on. Throws Error, changing nothing, on options outside
  /// their ranges.
  void set_options(const PopulationControlOptions& options);

  /// To be asked once after each observation update. `effective_sample_size` and `size` are of the
  /// current, normalised weights; `requested_size` is how many particles the filter wants from now
  /// on. A renewal is due when the schedule says so, or when requested_size differs from size and
  /// renewal is not `none`.
  bool is_due(double effective_sample_size, int size, int requested_size);

  /// Ancestors and weights afterwards. See Resampler::resample. A change of size that the scheme
  /// cannot make (partial and killing keep theirs) is made by systematic resampling.
  ResamplingResult select(ConstArray weights, int requested_size, const RandomStream& stream);

  /// What to blend with what, and the weights afterwards. See compensate(); holds until the next
  /// call.
  const CompensationResult& compensate(ConstArray weights, const RandomStream& stream);

  const PopulationControlOptions& options() const { return options_; }
  /// How many renewals so far.
  std::int64_t calls() const { return calls_; }
  /// What Schedule::every_n counts; and going on from such a count, for a population that was
  /// saved.
  std::int64_t observations_since_renewal() const { return observations_since_renewal_; }
  void resume(std::int64_t observations_since_renewal) {
    observations_since_renewal_ = observations_since_renewal;
  }

 private:
  PopulationControlOptions options_;
  Resampler resampler_;
  Resampler resizer_;
  CompensationResult compensation_;
  std::int64_t calls_ = 0;
  std::int64_t observations_since_renewal_ = 0;
};

}  // namespace pf_resampling
