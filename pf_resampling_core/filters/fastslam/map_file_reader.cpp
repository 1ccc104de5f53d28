#include <limits>

#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

using map_checks::fault_of;
using text_file::LineReader;
using text_file::printable;

DataAssociation association_of(const LineReader& reader) {
  for (const DataAssociation association : all_data_associations()) {
    if (to_string(association) == reader.word(1)) return association;
  }
  reader.refuse(printable(reader.word(1)) + " is no data association");
}

Eigen::Matrix2d covariance_of(const LineReader& reader, std::size_t first) {
  Eigen::Matrix2d covariance;
  covariance << reader.real(first), reader.real(first + 1), reader.real(first + 1),
      reader.real(first + 2);
  return covariance;
}

void read_head(LineReader* reader, SavedMap* map) {
  reader->take("frame", 1);
  map->frame = reader->word(1);
  reader->refuse_if(map_checks::fault_of_frame(map->frame));
  reader->take("association", 1);
  map->association = association_of(*reader);
  reader->take("next_id", 1);
  map->next_id = reader->integer(1, map_checks::kLargestId + 1);
  reader->take("step", 1);
  map->step =
      static_cast<std::uint32_t>(reader->integer(1, std::numeric_limits<std::uint32_t>::max()));
  reader->take("scans_since_renewal", 1);
  map->observations_since_renewal = reader->integer(1, std::numeric_limits<std::int64_t>::max());
  reader->take("view", 2);
  map->view_range = reader->real(1);
  map->view_bearing = reader->real(2);
  reader->refuse_if(map_checks::fault_of_view(map->view_range, map->view_bearing));
  reader->take("pose", 3);
  map->pose.mean = {reader->real(1), reader->real(2), reader->real(3)};
  reader->refuse_if(map_checks::fault_of_pose(map->pose.mean));
  reader->take("pose_covariance", 6);
  map->pose.covariance << reader->real(1), reader->real(2), reader->real(3), reader->real(2),
      reader->real(4), reader->real(5), reader->real(3), reader->real(5), reader->real(6);
  reader->refuse_if(map_checks::fault_of_pose_covariance(map->pose.covariance));
}

SavedLandmark read_landmark(LineReader* reader, std::int64_t previous) {
  reader->take("landmark", 10);
  SavedLandmark landmark;
  LandmarkEstimate& estimate = landmark.estimate;
  estimate.id = reader->integer(1, map_checks::kLargestId);
  estimate.mean = {reader->real(2), reader->real(3)};
  estimate.covariance = covariance_of(*reader, 4);
  estimate.held = reader->real(7);
  estimate.log_odds = reader->real(8);
  landmark.last_seen = {reader->real(9), reader->real(10)};
  reader->refuse_if(fault_of(landmark, previous));
  return landmark;
}

// Memory grows with what is in the file, never with what it says is to come.
SavedParticle read_particle(LineReader* reader, const SavedMap& map) {
  reader->take("particle", 6);
  SavedParticle particle;
  particle.pose = {reader->real(1), reader->real(2), reader->real(3)};
  particle.log_weight = reader->real(4);
  particle.weight = reader->real(5);
  reader->refuse_if(fault_of(particle));
  const std::int64_t count = reader->integer(6, static_cast<std::int64_t>(map.landmarks.size()));
  std::int64_t previous = -1;
  for (std::int64_t i = 0; i < count; ++i) {
    reader->take("has", 7);
    ParticleLandmark landmark;
    landmark.id = reader->integer(1, map_checks::kLargestId);
    landmark.mean = {reader->real(2), reader->real(3)};
    landmark.covariance = covariance_of(*reader, 4);
    landmark.log_odds = reader->real(7);
    reader->refuse_if(fault_of(landmark, previous, map));
    previous = landmark.id;
    particle.landmarks.push_back(landmark);
  }
  return particle;
}

void read_odometry_errors(LineReader* reader, SavedMap* map) {
  OdometryErrorState& errors = map->odometry_errors;
  reader->take("odometry_velocity", 3);
  errors.velocity << reader->real(1), reader->real(2), reader->real(3);
  for (int row = 0; row < OdometryErrorEstimator::kCount; ++row) {
    reader->take("odometry_errors_covariance", static_cast<std::size_t>(row) + 1);
    for (int column = 0; column <= row; ++column) {
      errors.covariance(row, column) = errors.covariance(column, row) =
          reader->real(static_cast<std::size_t>(column) + 1);
    }
  }
  errors.means.setZero(static_cast<Eigen::Index>(map->particles.size()),
                       OdometryErrorEstimator::kCount);
  for (Eigen::Index i = 0; i < errors.means.rows(); ++i) {
    reader->take("odometry_errors", OdometryErrorEstimator::kCount);
    for (int error = 0; error < OdometryErrorEstimator::kCount; ++error) {
      errors.means(i, error) = reader->real(static_cast<std::size_t>(error) + 1);
    }
  }
  reader->refuse_if(fault_of(errors, map->particles.size()));
}

}  // namespace

SavedMap read_map_lines(LineReader* reader) {
  SavedMap map;
  read_head(reader, &map);
  reader->take("landmarks", 1);
  const std::int64_t landmarks = reader->integer(1, map_checks::kLargestId);
  for (std::int64_t i = 0; i < landmarks; ++i) {
    const std::int64_t previous = map.landmarks.empty() ? -1 : map.landmarks.back().estimate.id;
    map.landmarks.push_back(read_landmark(reader, previous));
  }
  reader->take("particles", 1);
  const std::int64_t particles = reader->integer(1, map_checks::kMostParticles);
  for (std::int64_t i = 0; i < particles; ++i) map.particles.push_back(read_particle(reader, map));
  read_odometry_errors(reader, &map);
  reader->refuse_if(map_checks::fault_of_whole(map));
  return map;
}

SavedMap read_map_file(const std::string& path) {
  const text_file::ClassicLocale locale;
  LineReader reader(text_file::kMap, path);
  SavedMap map = read_map_lines(&reader);
  reader.take_end();
  return map;
}

}  // namespace pf_resampling
