// How a map is saved.

#include <array>
#include <string>
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
struct ParticleMapColumns {
  std::vector<std::size_t> landmarks;  // of each particle
  std::vector<std::int64_t> id;
  std::array<std::vector<double>, 6> numbers;
};
constexpr const char* kNumbers[] = {"x", "y", "xx", "xy", "yy", "log_odds"};

ParticleMapColumns columns_of(const std::vector<std::vector<ParticleLandmark>>& maps) {
  ParticleMapColumns columns;
  for (const std::vector<ParticleLandmark>& map : maps) {
    columns.landmarks.push_back(map.size());
    for (const ParticleLandmark& landmark : map) {
      const Eigen::Matrix2d& c = landmark.covariance;
      const double numbers[] = {landmark.mean.x(), landmark.mean.y(), c(0, 0),
                                c(0, 1),           c(1, 1),           landmark.log_odds};
      columns.id.push_back(landmark.id);
      for (std::size_t k = 0; k < columns.numbers.size(); ++k) {
        columns.numbers[k].push_back(numbers[k]);
      }
    }
  }
  return columns;
}

void describe(Archive& archive, ParticleMapColumns& columns) {
  PF_RESAMPLING_FIELDS(archive, columns.landmarks, columns.id);
  for (std::size_t k = 0; k < columns.numbers.size(); ++k) {
    archive(kNumbers[k], columns.numbers[k]);
  }
}

std::vector<std::vector<ParticleLandmark>> maps_of(const ParticleMapColumns& columns) {
  const auto& [x, y, xx, xy, yy, log_odds] = columns.numbers;
  std::vector<std::vector<ParticleLandmark>> maps(columns.landmarks.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (const std::size_t end = next + columns.landmarks[i]; next < end; ++next) {
      ParticleLandmark landmark;
      landmark.id = columns.id[next];
      landmark.mean = {x[next], y[next]};
      landmark.covariance << xx[next], xy[next], xy[next], yy[next];
      landmark.log_odds = log_odds[next];
      maps[i].push_back(landmark);
    }
  }
  return maps;
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
  ParticleMapColumns columns = columns_of(map.particle_maps);
  archive("particle_maps", columns);
  if (archive.is_reading()) map.particle_maps = maps_of(columns);
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
