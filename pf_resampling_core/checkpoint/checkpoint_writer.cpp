#include <cmath>

#include "pf_resampling_core/checkpoint/checkpoint.hpp"
#include "pf_resampling_core/checkpoint/checkpoint_lines.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"

namespace pf_resampling {
namespace {

using checkpoint_lines::kLatest;
using checkpoint_lines::kNanoseconds;
using text_file::line_of;
using text_file::LineWriter;

void append(double value, std::string* text) {
  text_file::append(value, text);
}

void append(std::int64_t value, std::string* text) {
  *text += " " + std::to_string(value);
}

void append(const Pose2& pose, std::string* text) {
  for (const double value : {pose.x, pose.y, pose.heading}) append(value, text);
}

template <typename Value>
std::string one(std::string text, const Value& value) {
  append(value, &text);
  return text;
}

// Seconds and nanoseconds.
std::string stamp_line(const std::string& keyword, std::int64_t stamp) {
  return one(one(keyword, stamp / kNanoseconds), stamp % kNanoseconds);
}

void write_covariance(const std::string& keyword, const std::optional<Eigen::Matrix3d>& covariance,
                      LineWriter* writer) {
  if (!covariance) return;
  const Eigen::Matrix3d& c = *covariance;
  writer->line(line_of(keyword, c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)));
}

void write_progress(const SavedProgress& progress, LineWriter* writer) {
  writer->line("# stamps, in seconds and nanoseconds: of the first odometry, of what the filter");
  writer->line("# has used of it, of the last observation");
  writer->line(stamp_line("first_odometry", progress.first_odometry));
  writer->line(stamp_line("used", progress.used));
  writer->line(stamp_line("last_observation", progress.last_observation));
  writer->line("# probability of being lost; mean of the innovations, normalised and squared");
  writer->line(line_of("lost", progress.lost_probability, progress.normalized_innovation));
  writer->line("# odometry since: stamp; x, y, heading as received, and continuous over jumps;");
  writer->line("# whether there are covariances (xx xy xh yy yh hh): as received, of the step");
  writer->line(one("odometry_offset", progress.odometry_offset));
  writer->line("odometry " + std::to_string(progress.odometry.size()));
  for (const SavedOdometry& odometry : progress.odometry) {
    const std::string text =
        one(one(stamp_line("sample", odometry.stamp), odometry.received), odometry.pose);
    writer->line(text + (odometry.covariance ? " 1" : " 0") +
                 (odometry.step_covariance ? " 1" : " 0"));
    write_covariance("covariance", odometry.covariance, writer);
    write_covariance("step_covariance", odometry.step_covariance, writer);
  }
}

void write_particles(const BeaconMclParticles& particles, LineWriter* writer) {
  for (const char* line : BeaconMclParticles::kLinesMean) writer->line(line);
  writer->line("particles " + std::to_string(particles.size()));
  const Eigen::Index radios = particles.scale.cols();
  for (Eigen::Index i = 0; i < particles.size(); ++i) {
    std::string of_particle = "particle";
    std::vector<std::string> of_radios(static_cast<std::size_t>(radios), "radio");
    BeaconMclParticles::for_each_column(
        particles, [&](const char*, ColumnKind kind, const auto& column) {
          if (kind == ColumnKind::ancestor) {
            append(static_cast<std::int64_t>(column(i, 0)), &of_particle);
          } else if (has_one_number<decltype(column)>) {
            append(static_cast<double>(column(i, 0)), &of_particle);
          } else {
            for (Eigen::Index radio = 0; radio < radios; ++radio) {
              append(static_cast<double>(column(i, radio)),
                     &of_radios[static_cast<std::size_t>(radio)]);
            }
          }
        });
    writer->line(of_particle);
    for (const std::string& line : of_radios) writer->line(line);
  }
}

void write_filter(const SavedBeaconMcl& filter, LineWriter* writer) {
  writer->line("# id, 1 if its height is unknown, x, y, z");
  writer->line("beacons " + std::to_string(filter.beacons.size()));
  for (const Beacon& beacon : filter.beacons) {
    writer->line(line_of("beacon " + std::to_string(beacon.id) + (beacon.is_planar ? " 1" : " 0"),
                         beacon.position.x(), beacon.position.y(), beacon.position.z()));
  }
  writer->line("step " + std::to_string(filter.step));
  writer->line(one("time", filter.time));
  writer->line("updates_since_renewal " + std::to_string(filter.updates_since_renewal));
  writer->line("requested_particles " + std::to_string(filter.requested_particles));
  writer->line(one("dead_reckoning", filter.dead_reckoning));
  writer->line("# what was learnt of the ranges' noise: squares, and of how many");
  writer->line(line_of("range_noise", filter.range_squares, filter.range_count));
  writer->line("# likelihood of the ranges: slow and fast mean, and of how many");
  writer->line(one(line_of("likelihood", filter.slow_likelihood, filter.fast_likelihood),
                   filter.likelihoods));
  writer->line("radios " + std::to_string(filter.calibration_times.size()));
  for (const double time : filter.calibration_times) writer->line(one("radio_time", time));
  writer->line(one("first_range_time", filter.first_range_time));
  writer->line(
      "# beacon, range, variance; x, y, z of the antenna on the robot; dead reckoning and");
  writer->line("# time when it was taken");
  writer->line("ranges " + std::to_string(filter.ranges.size()));
  for (const SavedBeaconMcl::Range& range : filter.ranges) {
    const RangeObservation& seen = range.observation;
    const std::string text =
        line_of("range " + std::to_string(seen.beacon), seen.range, seen.variance, seen.antenna.x(),
                seen.antenna.y(), seen.antenna.z());
    writer->line(one(one(text, range.pose), range.time));
  }
  write_particles(filter.particles, writer);
}

template <typename WriteFilter>
void write(const std::string& path, const char* filter, const SavedProgress& progress,
           const WriteFilter& write_filter_lines) {
  const text_file::ClassicLocale locale;
  LineWriter writer(text_file::kCheckpoint, path);
  writer.line("# What a filter knows, to go on from; metres, radians, seconds; x forward, y left.");
  writer.line("# The last line covers every byte: do not edit.");
  writer.line(std::string("filter ") + filter);
  write_progress(progress, &writer);
  write_filter_lines(&writer);
  writer.finish();
}

void refuse_if(const std::string& fault) {
  if (!fault.empty()) throw Error("checkpoint to write: " + fault + "; reset the filter");
}

}  // namespace

std::string fault_of(const SavedProgress& progress) {
  if (progress.odometry.empty()) return "there is no odometry";
  std::int64_t previous = -1;
  for (const SavedOdometry& odometry : progress.odometry) {
    if (odometry.stamp <= previous) return "the stamps of the odometry do not ascend";
    previous = odometry.stamp;
  }
  if (previous / kNanoseconds > kLatest) return "a stamp is beyond what ROS 1 can reckon with";
  if (progress.used < progress.odometry.front().stamp || progress.used > previous) {
    return "the odometry does not cover what has been used";
  }
  if (progress.first_odometry < 0 || progress.last_observation < 0) return "a stamp is negative";
  if (!(progress.lost_probability >= 0.0 && progress.lost_probability <= 1.0)) {
    return "the probability of being lost is not in [0, 1]";
  }
  if (!(progress.normalized_innovation >= 0.0)) return "the mean innovation is negative";
  return {};
}

std::string fault_of(const Eigen::AlignedBox2d& scene) {
  if (!scene.min().allFinite() || !scene.max().allFinite()) return "the scene is not finite";
  if (scene.isEmpty()) return "the scene is empty";
  return {};
}

void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint) {
  refuse_if(fault_of(checkpoint.progress));
  refuse_if(fault_of(checkpoint.filter));
  write(path, checkpoint_lines::kBeaconMcl, checkpoint.progress,
        [&](LineWriter* writer) { write_filter(checkpoint.filter, writer); });
}

void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint) {
  refuse_if(fault_of(checkpoint.progress));
  refuse_if(fault_of(checkpoint.scene));
  check_saved_map(checkpoint.filter);
  write(path, checkpoint_lines::kFastSlam, checkpoint.progress, [&](LineWriter* writer) {
    const Eigen::AlignedBox2d& scene = checkpoint.scene;
    writer->line("# smallest x and y, largest x and y, of robot and landmarks so far");
    writer->line(
        line_of("scene", scene.min().x(), scene.min().y(), scene.max().x(), scene.max().y()));
    write_map_lines(checkpoint.filter, writer);
  });
}

}  // namespace pf_resampling
