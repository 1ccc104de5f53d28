#include <array>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"
#include "pf_resampling_core/filters/fastslam/past_lines.hpp"
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
  reader.refuse(printable(reader.word(1)) + " is not a method of data association");
}

// Numbers are read before they are put together: Eigen does not stand an exception between them.
Eigen::Matrix2d covariance_of(const LineReader& reader, std::size_t first) {
  const double xx = reader.real(first);
  const double xy = reader.real(first + 1);
  const double yy = reader.real(first + 2);
  Eigen::Matrix2d covariance;
  covariance << xx, xy, xy, yy;
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
  std::array<double, 7> c{};
  for (std::size_t i = 1; i < c.size(); ++i) c[i] = reader->real(i);
  map->pose.covariance << c[1], c[2], c[3], c[2], c[4], c[5], c[3], c[5], c[6];
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

// One particle: its numbers are put at the end of those of all, its map likewise. Memory grows with
// what is in the file, never with what it says is to come.
void read_particle(LineReader* reader, std::vector<std::vector<double>>* columns, SavedMap* map) {
  reader->take("particle", columns->size() + 1);
  FastSlamParticles particle;
  std::size_t word = 0;
  FastSlamParticles::for_each_column(particle, [&](const char*, ColumnKind kind, auto& column) {
    column.setZero(1);
    if (kind == ColumnKind::ancestor) return;
    const double number = reader->real(word + 1);
    using Number = typename std::decay_t<decltype(column)>::Scalar;
    column[0] = static_cast<Number>(number);
    (*columns)[word++].push_back(number);
  });
  reader->refuse_if(fault_of(particle, 0));
  const std::int64_t count =
      reader->integer(word + 1, static_cast<std::int64_t>(map->landmarks.size()));
  std::vector<ParticleLandmark> landmarks;
  std::int64_t previous = -1;
  for (std::int64_t i = 0; i < count; ++i) {
    reader->take("has", 7);
    ParticleLandmark landmark;
    landmark.id = reader->integer(1, map_checks::kLargestId);
    landmark.mean = {reader->real(2), reader->real(3)};
    landmark.covariance = covariance_of(*reader, 4);
    landmark.log_odds = reader->real(7);
    reader->refuse_if(fault_of(landmark, previous, *map));
    previous = landmark.id;
    landmarks.push_back(landmark);
  }
  map->particle_maps.push_back(std::move(landmarks));
}

void read_particles(LineReader* reader, SavedMap* map) {
  std::size_t saved = 0;
  FastSlamParticles::for_each_column(map->particles, [&](const char*, ColumnKind kind, auto&) {
    saved += kind == ColumnKind::ancestor ? 0 : 1;
  });
  reader->take("particles", 1);
  const std::int64_t count = reader->integer(1, map_checks::kMostParticles);
  std::vector<std::vector<double>> columns(saved);
  for (std::int64_t i = 0; i < count; ++i) read_particle(reader, &columns, map);
  std::size_t next = 0;
  FastSlamParticles::for_each_column(
      map->particles, [&](const char*, ColumnKind kind, auto& column) {
        column.setZero(count);
        if (kind == ColumnKind::ancestor) return;
        using Number = typename std::decay_t<decltype(column)>::Scalar;
        column =
            Eigen::Map<const Eigen::ArrayXd>(columns[next++].data(), count).template cast<Number>();
      });
}

void read_odometry_errors(LineReader* reader, SavedMap* map) {
  OdometryErrorState& errors = map->odometry_errors;
  reader->take("odometry_velocity", 3);
  errors.velocity = {reader->real(1), reader->real(2), reader->real(3)};
  for (int row = 0; row < OdometryErrorEstimator::kCount; ++row) {
    reader->take("odometry_errors_covariance", static_cast<std::size_t>(row) + 1);
    for (int column = 0; column <= row; ++column) {
      errors.covariance(row, column) = errors.covariance(column, row) =
          reader->real(static_cast<std::size_t>(column) + 1);
    }
  }
  errors.means.setZero(map->particles.size(), OdometryErrorEstimator::kCount);
  for (Eigen::Index i = 0; i < errors.means.rows(); ++i) {
    reader->take("odometry_errors", OdometryErrorEstimator::kCount);
    for (int error = 0; error < OdometryErrorEstimator::kCount; ++error) {
      errors.means(i, error) = reader->real(static_cast<std::size_t>(error) + 1);
    }
  }
  reader->refuse_if(fault_of(errors, map->particle_maps.size()));
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
  read_particles(reader, &map);
  read_odometry_errors(reader, &map);
  map.observations_since_redraw =
      reader->take_count("scans_since_redraw", std::numeric_limits<std::int64_t>::max());
  map.redraws_refused_in_a_row = static_cast<int>(
      reader->take_count("redraws_refused_in_a_row", std::numeric_limits<int>::max() - 1));
  map.past = read_past_lines(reader);
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
