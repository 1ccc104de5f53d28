// What the filter saves, and how it goes on from there.

#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

void describe(Archive& archive, Beacon& beacon) {
  PF_RESAMPLING_FIELDS(archive, beacon.id, beacon.position, beacon.is_planar, beacon.sigma);
}

void describe(Archive& archive, RecentRange& range) {
  RangeObservation& seen = range.observation;
  PF_RESAMPLING_FIELDS(archive, seen.beacon, seen.range, seen.variance, seen.antenna, range.pose,
                       range.time);
}

void describe(Archive& archive, BeaconMclParticles& particles) {
  describe_columns(archive, particles);
}

void describe(Archive& archive, SavedBeaconMcl& saved) {
  PF_RESAMPLING_FIELDS(archive, saved.beacons, saved.step, saved.time, saved.updates_since_renewal,
                       saved.dead_reckoning, saved.first_range_time, saved.range_squares,
                       saved.range_count, saved.slow_likelihood, saved.fast_likelihood,
                       saved.likelihoods, saved.calibration_time, saved.ranges, saved.particles,
                       saved.memory, saved.memory_beacons, saved.is_drawn_from_memory,
                       saved.next_solution);
}

SavedBeaconMcl BeaconMcl::saved() const {
  if (!is_initialized()) {
    throw Error("there is nothing to save yet: particles start with the first ranges");
  }
  SavedBeaconMcl saved;
  saved.beacons = beacons_;
  saved.step = step_;
  saved.time = time_;
  saved.updates_since_renewal = strategy_.observations_since_renewal();
  saved.dead_reckoning = dead_reckoning_;
  saved.first_range_time = first_range_time_.value_or(time_);
  saved.range_squares = range_squares_;
  saved.range_count = range_count_;
  saved.slow_likelihood = slow_likelihood_;
  saved.fast_likelihood = fast_likelihood_;
  saved.likelihoods = likelihoods_;
  saved.calibration_time = calibration_time_;
  saved.ranges.assign(recent_.begin(), recent_.end());
  saved.particles = particles_;
  saved.memory = memory_;
  if (memory_) saved.memory_beacons = memory_->beacons();
  saved.is_drawn_from_memory = is_drawn_from_memory_;
  saved.next_solution = next_solution_;
  return saved;
}

void BeaconMcl::load(const SavedBeaconMcl& saved) {
  for (const Beacon& beacon : saved.beacons) {
    const bool is_known = std::any_of(beacons_.begin(), beacons_.end(), [&](const Beacon& other) {
      return other.id == beacon.id && other.is_planar == beacon.is_planar &&
             other.position == beacon.position;
    });
    if (is_known && saved.beacons.size() == beacons_.size()) continue;
    throw Error("population to load: it was saved with other beacons (" +
                std::to_string(saved.beacons.size()) + ", beacon " + std::to_string(beacon.id) +
                " among them) than the " + std::to_string(beacons_.size()) +
                " of the filter; start without it");
  }
  if (saved.beacons.empty() && !beacons_.empty()) {
    throw Error("population to load: it was saved without beacons, the filter has " +
                std::to_string(beacons_.size()) + "; start without it");
  }
  const bool calibrated = (saved.particles.bias_variance > 0.0).any();
  if (calibrated != calibrates()) {
    throw Error("population to load: calibration/estimation is " +
                to_string(options_.calibration.estimation) +
                ", and was not; set it to what it was, or start without the file");
  }

  reset();
  step_ = saved.step;
  time_ = saved.time;
  strategy_.resume(saved.updates_since_renewal);
  dead_reckoning_ = saved.dead_reckoning;
  first_range_time_ = saved.first_range_time;
  range_squares_ = saved.range_squares;
  range_count_ = saved.range_count;
  slow_likelihood_ = saved.slow_likelihood;
  fast_likelihood_ = saved.fast_likelihood;
  likelihoods_ = saved.likelihoods;
  calibration_time_ = saved.calibration_time;
  recent_.assign(saved.ranges.begin(), saved.ranges.end());
  particles_ = saved.particles;
  if (finds_beacons()) start_memory(saved.memory_beacons, {});
  if (memory_) next_solution_ = time_;
  if (memory_ && saved.memory && memory_->resume(*saved.memory)) {
    next_solution_ = saved.next_solution;
    is_drawn_from_memory_ = saved.is_drawn_from_memory;
  }
  start_ancestry();
  status_.effective_sample_size = effective_sample_size(particles_.weight);
}

}  // namespace pf_resampling
