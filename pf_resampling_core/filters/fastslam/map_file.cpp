// How a map is saved.

#include <string>
#include <type_traits>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/filters/fastslam/memory/saved_memory.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {

void describe(Archive& archive, DataAssociation& association) {
  std::string name = to_string(association);
  archive.text(&name);
  for (const DataAssociation candidate : all_values<DataAssociation>()) {
    association = candidate;
    if (to_string(candidate) == name) return;
  }
  archive.refuse(text_file::printable(name) + " is not a method of data association");
}

void describe(Archive& archive, SavedLandmark& landmark) {
  PF_RESAMPLING_FIELDS(archive, landmark.estimate.id, landmark.estimate.mean,
                       landmark.estimate.covariance, landmark.estimate.held,
                       landmark.estimate.log_odds, landmark.last_seen);
}

void describe(Archive& archive, FastSlamParticles& particles) {
  describe_columns(archive, particles);
}

void describe(Archive& archive, OdometryErrorState& errors) {
  PF_RESAMPLING_FIELDS(archive, errors.means, errors.covariance, errors.velocity);
}

namespace {

// The maps of all particles one after the other, number by number: there are many.
struct ParticleMaps {
  std::vector<std::vector<ParticleLandmark>>* maps;
};

void describe(Archive& archive, ParticleMaps& particles) {
  std::vector<std::size_t> landmarks;  // of each particle
  for (const auto& map : *particles.maps) landmarks.push_back(map.size());
  archive("landmarks", landmarks);
  particles.maps->resize(landmarks.size());
  std::vector<ParticleLandmark*> all;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    (*particles.maps)[i].resize(landmarks[i]);
    for (ParticleLandmark& landmark : (*particles.maps)[i]) all.push_back(&landmark);
  }
  const auto column = [&](const char* name, auto number_of) {
    std::vector<std::decay_t<decltype(*number_of(nullptr))>> numbers;
    for (ParticleLandmark* landmark : all) numbers.push_back(*number_of(landmark));
    archive(name, numbers);
    for (std::size_t i = 0; i < all.size(); ++i) *number_of(all[i]) = numbers[i];
  };
  column("id", [](ParticleLandmark* landmark) { return &landmark->id; });
  column("x", [](ParticleLandmark* landmark) { return &landmark->mean.x(); });
  column("y", [](ParticleLandmark* landmark) { return &landmark->mean.y(); });
  column("xx", [](ParticleLandmark* landmark) { return &landmark->covariance(0, 0); });
  column("xy", [](ParticleLandmark* landmark) { return &landmark->covariance(0, 1); });
  column("yy", [](ParticleLandmark* landmark) { return &landmark->covariance(1, 1); });
  column("log_odds", [](ParticleLandmark* landmark) { return &landmark->log_odds; });
  for (ParticleLandmark* one : all) one->covariance(1, 0) = one->covariance(0, 1);
}

// What a map has that the filter goes on from: a program of ours wrote it, and nobody edits it.
struct StateOfFilter {
  SavedMap* map;
};

void describe(Archive& archive, StateOfFilter& state) {
  SavedMap& map = *state.map;
  if (!archive.something(map.particles.size() > 0)) return;
  PF_RESAMPLING_FIELDS(archive, map.step, map.next_id, map.observations_since_renewal,
                       map.particles);
  ParticleMaps maps = {&map.particle_maps};
  archive("particle_maps", maps);
  PF_RESAMPLING_FIELDS(archive, map.odometry_errors, map.memory, map.is_lost, map.unplaced_since,
                       map.observations_since_redraw);
}

}  // namespace

void describe(Archive& archive, SavedMap& map) {
  PF_RESAMPLING_FIELDS(archive, map.frame, map.association, map.pose, map.view_range,
                       map.view_bearing, map.landmarks);
  StateOfFilter state = {&map};
  archive.sealed("state", state);
  const std::string fault = fault_of(map);
  if (!fault.empty()) archive.refuse(fault);
}

void write_map_file(const std::string& path, const SavedMap& map) {
  write_saved(kMapFile, path, map);
}

SavedMap read_map_file(const std::string& path) {
  return read_saved<SavedMap>(kMapFile, path);
}

}  // namespace pf_resampling
