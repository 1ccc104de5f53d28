#include "pf_resampling_core/strategy/population_control.hpp"

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {
namespace {

const EnumNames<Schedule> kSchedules{"schedule",
                                     {{Schedule::never, "never"},
                                      {Schedule::always, "always"},
                                      {Schedule::effective_sample_size, "effective_sample_size"},
                                      {Schedule::every_n, "every_n"}}};
const EnumNames<Renewal> kRenewals{"renewal",
                                   {{Renewal::none, "none"},
                                    {Renewal::resampling, "resampling"},
                                    {Renewal::compensation, "compensation"}}};

bool resampling_keeps_size(const ResamplingOptions& options) {
  const auto keeps = [](ResamplingScheme scheme) {
    return scheme == ResamplingScheme::partial || scheme == ResamplingScheme::killing;
  };
  const bool inner_counts = options.scheme == ResamplingScheme::rank_based;
  return keeps(options.scheme) || (inner_counts && keeps(options.inner_scheme));
}

}  // namespace

const std::vector<Schedule>& all_schedules() {
  return kSchedules.values();
}
std::string to_string(Schedule schedule) {
  return kSchedules.name(schedule);
}
Schedule schedule_from_string(const std::string& name) {
  return kSchedules.value(name);
}

const std::vector<Renewal>& all_renewals() {
  return kRenewals.values();
}
std::string to_string(Renewal renewal) {
  return kRenewals.name(renewal);
}
Renewal renewal_from_string(const std::string& name) {
  return kRenewals.value(name);
}

PopulationControl::PopulationControl(const PopulationControlOptions& options)
    : options_(options), resampler_(options.resampling) {
  if (!(options.threshold > 0.0 && options.threshold <= 1.0)) {
    throw Error("population control: threshold is " + std::to_string(options.threshold) +
                ", has to be in (0, 1]");
  }
  if (options.every_n < 1) {
    throw Error("population control: every_n is " + std::to_string(options.every_n) +
                ", has to be at least 1");
  }
  const double ratio = options.compensation.ratio;
  if (!(ratio > 0.0 && ratio <= 1.0)) {
    throw Error("population control: the compensation's ratio is " + std::to_string(ratio) +
                ", has to be in (0, 1]");
  }
}

void PopulationControl::set_options(const PopulationControlOptions& options) {
  PopulationControl other(options);
  options_ = other.options_;
  resampler_ = std::move(other.resampler_);
}

bool PopulationControl::is_due(double effective_sample_size, int size, int requested_size) {
  ++observations_since_renewal_;
  if (options_.renewal == Renewal::none) return false;
  if (requested_size != size) return true;
  switch (options_.schedule) {
    case Schedule::never:
      return false;
    case Schedule::always:
      return true;
    case Schedule::effective_sample_size:
      // A threshold of one means after every observation, also when all weights are equal (K
      // section 5.2).
      return options_.threshold >= 1.0 || effective_sample_size < options_.threshold * size;
    case Schedule::every_n:
      return observations_since_renewal_ >= options_.every_n;
  }
  return false;
}

ResamplingResult PopulationControl::select(ConstArray weights, int requested_size,
                                           const RandomStream& stream) {
  ++calls_;
  observations_since_renewal_ = 0;
  const bool keeps_size = resampling_keeps_size(options_.resampling);
  const bool resizes = weights.size() != requested_size;
  return (resizes && keeps_size ? resizer_ : resampler_).resample(weights, requested_size, stream);
}

const CompensationResult& PopulationControl::compensate(ConstArray weights,
                                                        const RandomStream& stream) {
  ++calls_;
  observations_since_renewal_ = 0;
  compensation_ = pf_resampling::compensate(options_.compensation, weights, stream);
  return compensation_;
}

}  // namespace pf_resampling
