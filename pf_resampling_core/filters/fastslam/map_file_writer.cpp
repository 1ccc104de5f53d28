#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"
#include "pf_resampling_core/filters/fastslam/past_lines.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

using text_file::append;
using text_file::line_of;
using text_file::LineWriter;

std::string line_of(const SavedLandmark& landmark) {
  const LandmarkEstimate& estimate = landmark.estimate;
  const Eigen::Matrix2d& c = estimate.covariance;
  return line_of("landmark " + std::to_string(estimate.id), estimate.mean.x(), estimate.mean.y(),
                 c(0, 0), c(0, 1), c(1, 1), estimate.held, estimate.log_odds,
                 landmark.last_seen.x(), landmark.last_seen.y());
}

std::string line_of(const ParticleLandmark& landmark) {
  const Eigen::Matrix2d& c = landmark.covariance;
  return line_of("has " + std::to_string(landmark.id), landmark.mean.x(), landmark.mean.y(),
                 c(0, 0), c(0, 1), c(1, 1), landmark.log_odds);
}

void write_odometry_errors(const SavedMap& map, LineWriter* writer) {
  const OdometryErrorState& errors = map.odometry_errors;
  writer->line(
      "# errors of the odometry that stay: distance scale, turn scale, drift, yaw rate, delay;");
  writer->line("# their covariance by rows up to the diagonal; last the mean of each particle");
  writer->line(
      line_of("odometry_velocity", errors.velocity.x(), errors.velocity.y(), errors.velocity.z()));
  for (int row = 0; row < OdometryErrorEstimator::kCount; ++row) {
    std::string text = "odometry_errors_covariance";
    for (int column = 0; column <= row; ++column) append(errors.covariance(row, column), &text);
    writer->line(text);
  }
  for (Eigen::Index i = 0; i < errors.means.rows(); ++i) {
    std::string text = "odometry_errors";
    for (int error = 0; error < OdometryErrorEstimator::kCount; ++error) {
      append(errors.means(i, error), &text);
    }
    writer->line(text);
  }
}

}  // namespace

void write_map_lines(const SavedMap& map, LineWriter* writer) {
  writer->line(
      "# Landmarks, and the particles that go on from here; metres and radians, x forward,");
  writer->line("# y left, in the frame named below. The last line covers every byte: do not edit.");
  writer->line("frame " + map.frame);
  writer->line("association " + to_string(map.association));
  writer->line("next_id " + std::to_string(map.next_id));
  writer->line("step " + std::to_string(map.step));
  writer->line("scans_since_renewal " + std::to_string(map.observations_since_renewal));
  writer->line("# farthest range and widest bearing of any observation");
  writer->line(line_of("view", map.view_range, map.view_bearing));
  writer->line("# x, y, heading; covariance: xx xy xh yy yh hh");
  writer->line(line_of("pose", map.pose.mean.x, map.pose.mean.y, map.pose.mean.heading));
  const Eigen::Matrix3d& c = map.pose.covariance;
  writer->line(line_of("pose_covariance", c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)));
  writer->line(
      "# id, x, y, covariance xx xy yy, share of the weight that holds it, log-odds of its");
  writer->line("# existence, x and y where it was last seen");
  writer->line("landmarks " + std::to_string(map.landmarks.size()));
  for (const SavedLandmark& landmark : map.landmarks) writer->line(line_of(landmark));
  writer->line(FastSlamParticles::kLineMeans);
  writer->line("# id, x, y, covariance xx xy yy, log-odds");
  writer->line("particles " + std::to_string(map.particles.size()));
  for (std::size_t i = 0; i < map.particle_maps.size(); ++i) {
    std::string text = "particle";
    FastSlamParticles::for_each_column(
        map.particles, [&](const char*, ColumnKind kind, const auto& column) {
          if (kind == ColumnKind::ancestor) return;
          append(static_cast<double>(column[static_cast<Eigen::Index>(i)]), &text);
        });
    writer->line(text + " " + std::to_string(map.particle_maps[i].size()));
    for (const ParticleLandmark& landmark : map.particle_maps[i]) writer->line(line_of(landmark));
  }
  write_odometry_errors(map, writer);
  writer->line("scans_since_redraw " + std::to_string(map.observations_since_redraw));
  writer->line("redraws_refused_in_a_row " + std::to_string(map.redraws_refused_in_a_row));
  write_past_lines(map.past, writer);
}

void write_map_file(const std::string& path, const SavedMap& map) {
  check_saved_map(map);
  const text_file::ClassicLocale locale;
  LineWriter file(text_file::kMap, path);
  write_map_lines(map, &file);
  file.finish();
}

}  // namespace pf_resampling
