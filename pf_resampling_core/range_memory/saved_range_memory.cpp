// How a RangeMemory is saved.
#include "pf_resampling_core/range_memory/saved_range_memory.hpp"

#include <utility>

namespace pf_resampling {

// What a solution uses of it.
void describe(Archive& archive, OdometryIncrement& motion) {
  archive("duration", motion.duration);
  archive("mean", motion.mean);
  archive("covariance", motion.covariance);
  archive("slip_covariance", motion.slip_covariance);
  archive("yaw_rate_sensitivity", motion.yaw_rate_sensitivity);
  archive("turn_scale_sensitivity", motion.turn_scale_sensitivity);
}

void describe(Archive& archive, HeldRange& range) {
  archive("radio", range.radio);
  archive("range", range.range);
  archive("variance", range.variance);
  archive("antenna", range.antenna);
  archive("height", range.height);
  archive("since", range.since);
}

void describe(Archive& archive, RadioAccount& account) {
  int number = static_cast<int>(account);
  describe(archive, number);
  account = static_cast<RadioAccount>(number);
}

void describe(Archive& archive, RangeNoise& noise) {
  archive("range", noise.range);
  archive("translation", noise.translation);
  archive("heading", noise.heading);
  archive("robust_width", noise.robust_width);
}

void describe(Archive& archive, RadioPlace& place) {
  archive("position", place.position);
  archive("covariance", place.covariance);
  archive("probability", place.probability);
}

void describe(Archive& archive, RangePrior& prior) {
  archive("first", prior.first);
  archive("first_sigma", prior.first_sigma);
  archive("constants", prior.constants);
  archive("constants_sigma", prior.constants_sigma);
  archive("yaw_rate_walk", prior.yaw_rate_walk);
}

void describe(Archive& archive, RangeEstimate& estimate) {
  archive("keyframes", estimate.keyframes);
  archive("constants", estimate.constants);
  archive("takes_part", estimate.takes_part);
}

void describe(Archive& archive, RangeBelief& belief) {
  if (!archive.something(belief.is_usable)) {
    belief = RangeBelief{};
    return;
  }
  belief.is_usable = true;
  archive("cost", belief.cost);
  archive("log_evidence", belief.log_evidence);
  archive("covariance", belief.covariance);
}

void describe(Archive& archive, RangePast& past) {
  archive("keyframe", past.keyframe);
  archive("state", past.state);
  archive("constants", past.constants);
  archive("information", past.information);
  archive("gradient", past.gradient);
  archive("log_evidence", past.log_evidence);
}

void describe(Archive& archive, RangeMode& mode) {
  archive("accounts", mode.accounts);
  archive("loose", mode.loose);
  archive("prior", mode.prior);
  archive("estimate", mode.estimate);
  archive("belief", mode.belief);
  archive("past", mode.past);
  archive("settled", mode.settled);
  archive("probability", mode.probability);
}

void describe(Archive& archive, RangeMemory::Radio& radio) {
  archive("id", radio.id);
  archive("ranges", radio.ranges);
  archive("other_places", radio.other_places);
}

void describe(Archive& archive, RangeMemory& memory) {
  archive("first", memory.first_);
  archive("radios", memory.radios_);
  archive("motions", memory.graph_.motions);
  archive("ranges", memory.graph_.ranges);
  archive("times", memory.times_);
  archive("pending", memory.pending_);
  archive("time", memory.time_);
  archive("lever_is_stated", memory.lever_is_stated_);
  archive("noise", memory.noise_);
  archive("modes", memory.modes_);
  archive("before", memory.before_);
  archive("next_solution_of_all", memory.next_solution_of_all_);
  archive("doubt", memory.doubt_);
  archive("are_judged", memory.are_judged_);
  archive("has_turned", memory.has_turned_);
  archive("next_trial", memory.next_trial_);
  archive("trial_steps", memory.trial_steps_);
}

bool RangeMemory::resume(const RangeMemory& saved) {
  for (const RangeMode& mode : saved.modes_) {
    for (std::size_t r = 0; r < saved.radios_.size(); ++r) {
      const bool was_listed = mode.accounts[r] != RadioAccount::unlisted;
      if (was_listed != (listed(saved.radios_[r].id) != nullptr)) return false;
    }
  }
  RangeMemory anew = saved;
  anew.options_ = options_;
  anew.beacons_ = beacons_;
  anew.calibration_ = calibration_;
  for (Radio& radio : anew.radios_) {
    radio.listed.reset();
    if (const Beacon* beacon = listed(radio.id)) radio.listed = *beacon;
    radio.calibration = calibration_of(radio.id);
  }
  for (RangeMode& mode : anew.modes_) mode.prior.metre = prior().metre;
  *this = std::move(anew);
  return true;
}

}  // namespace pf_resampling
