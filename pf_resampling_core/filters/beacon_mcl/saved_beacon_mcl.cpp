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
  BeaconMclProgress& so_far = saved.progress;
  PF_RESAMPLING_FIELDS(archive, so_far.step, so_far.time, so_far.updates_since_renewal,
                       so_far.dead_reckoning, so_far.first_range_time, so_far.range_squares,
                       so_far.range_count, so_far.slow_likelihood, so_far.fast_likelihood,
                       so_far.likelihoods, so_far.calibration_time, so_far.ranges,
                       so_far.is_drawn_from_memory, so_far.next_solution);
  PF_RESAMPLING_FIELDS(archive, saved.beacons, saved.particles, saved.memory, saved.memory_beacons);
}

SavedBeaconMcl BeaconMcl::saved() const {
  if (!is_initialized()) {
    throw Error("there is nothing to save yet: particles start with the first ranges");
  }
  SavedBeaconMcl saved = {beacons_, progress_, particles_, memory_, {}};
  saved.progress.updates_since_renewal = strategy_.observations_since_renewal();
  saved.progress.first_range_time = progress_.first_range_time.value_or(progress_.time);
  if (memory_) saved.memory_beacons = memory_->beacons();
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
  progress_ = saved.progress;
  strategy_.resume(progress_.updates_since_renewal);
  particles_ = saved.particles;
  if (finds_beacons()) start_memory({}, saved.memory_beacons);
  const bool goes_on = memory_ && saved.memory && memory_->resume(*saved.memory);
  progress_.is_drawn_from_memory = goes_on && saved.progress.is_drawn_from_memory;
  if (memory_) {
    progress_.next_solution = goes_on ? saved.progress.next_solution : progress_.time;
  }
  start_ancestry();
  status_.effective_sample_size = effective_sample_size(particles_.weight);
}

}  // namespace pf_resampling
