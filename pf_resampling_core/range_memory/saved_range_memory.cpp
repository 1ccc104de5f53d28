// How a RangeMemory is saved: all data and what was last made of them, without what it was told of
// beacons, calibration and options, see RangeMemory::resume().
#include <utility>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {

// What a solution uses of it.
void describe(Archive& archive, OdometryIncrement& motion) {
  PF_RESAMPLING_FIELDS(archive, motion.duration, motion.mean, motion.covariance,
                       motion.slip_covariance, motion.yaw_rate_sensitivity,
                       motion.turn_scale_sensitivity);
}

void describe(Archive& archive, CorrectableMotion& motion) {
  PF_RESAMPLING_FIELDS(archive, motion.mean, motion.yaw_rate_sensitivity,
                       motion.turn_scale_sensitivity);
}

void describe(Archive& archive, HeldRange& range) {
  PF_RESAMPLING_FIELDS(archive, range.radio, range.range, range.variance, range.antenna,
                       range.height, range.since);
}

void describe(Archive& archive, RadioAccount& account) {
  int number = static_cast<int>(account);
  describe(archive, number);
  account = static_cast<RadioAccount>(number);
}

void describe(Archive& archive, RangeNoise& noise) {
  PF_RESAMPLING_FIELDS(archive, noise.range, noise.translation, noise.heading, noise.robust_width);
}

void describe(Archive& archive, RadioPlace& place) {
  PF_RESAMPLING_FIELDS(archive, place.position, place.covariance, place.probability);
}

void describe(Archive& archive, RangePrior& prior) {
  PF_RESAMPLING_FIELDS(archive, prior.first, prior.first_sigma, prior.constants,
                       prior.constants_sigma, prior.yaw_rate_walk);
}

void describe(Archive& archive, RangeEstimate& estimate) {
  PF_RESAMPLING_FIELDS(archive, estimate.keyframes, estimate.constants, estimate.takes_part);
}

void describe(Archive& archive, RangeBelief& belief) {
  if (!archive.something(belief.is_usable)) {
    belief = RangeBelief{};
    return;
  }
  belief.is_usable = true;
  PF_RESAMPLING_FIELDS(archive, belief.cost, belief.log_evidence, belief.covariance);
}

void describe(Archive& archive, RangePast& past) {
  PF_RESAMPLING_FIELDS(archive, past.keyframe, past.state, past.constants, past.information,
                       past.gradient, past.log_evidence);
}

void describe(Archive& archive, RangeMode& mode) {
  PF_RESAMPLING_FIELDS(archive, mode.accounts, mode.loose, mode.prior, mode.estimate, mode.belief,
                       mode.past, mode.settled, mode.probability);
}

void describe(Archive& archive, RangeMemory::Radio& radio) {
  PF_RESAMPLING_FIELDS(archive, radio.id, radio.ranges, radio.other_places, radio.newest,
                       radio.copied, radio.copies);
}

void describe(Archive& archive, RangeMemory& memory) {
  PF_RESAMPLING_FIELDS(archive, memory.first_, memory.radios_, memory.graph_.motions,
                       memory.graph_.ranges, memory.times_, memory.pending_, memory.time_,
                       memory.lever_is_stated_, memory.odometry_factors_.distance,
                       memory.odometry_factors_.turn, memory.noise_, memory.modes_,
                       memory.next_solution_of_all_, memory.doubt_, memory.are_judged_,
                       memory.has_turned_, memory.next_trial_, memory.trial_steps_);
  archive.if_there("slipped", memory.graph_.slipped);
  memory.graph_.slipped.resize(memory.graph_.motions.size());
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
    radio.calibration = calibration_of(radio.id, calibration_);
  }
  for (RangeMode& mode : anew.modes_) mode.prior.metre = prior().metre;
  *this = std::move(anew);
  return true;
}

}  // namespace pf_resampling
