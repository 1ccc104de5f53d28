#include <limits>
#include <type_traits>

#include "pf_resampling_core/checkpoint/checkpoint.hpp"
#include "pf_resampling_core/checkpoint/checkpoint_lines.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"

namespace pf_resampling {
namespace {

using checkpoint_lines::kNanoseconds;
using text_file::LineReader;

constexpr std::int64_t kMost = 10000000;  // of anything that is listed
constexpr std::int64_t kLargestInt = std::numeric_limits<int>::max();
constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();

std::int64_t stamp_of(const LineReader& reader, std::size_t first) {
  return reader.integer(first, checkpoint_lines::kLatest) * kNanoseconds +
         reader.integer(first + 1, kNanoseconds - 1);
}

std::int64_t take_stamp(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 2);
  return stamp_of(*reader, 1);
}

// Memory grows with what is in the file, never with what it says is to come.
std::int64_t take_count(const std::string& keyword, std::int64_t most, LineReader* reader) {
  reader->take(keyword, 1);
  return reader->integer(1, most);
}

double take_number(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 1);
  return reader->finite(1);
}

int id_of(const LineReader& reader, std::size_t i) {
  return static_cast<int>(reader.integer(i, -kLargestInt, kLargestInt));
}

Pose2 pose_of(const LineReader& reader, std::size_t first) {
  return {reader.finite(first), reader.finite(first + 1), reader.finite(first + 2)};
}

Eigen::Matrix3d take_covariance(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 6);
  const auto c = [&](std::size_t i) { return reader->finite(i); };
  Eigen::Matrix3d covariance;
  covariance << c(1), c(2), c(3), c(2), c(4), c(5), c(3), c(5), c(6);
  return covariance;
}

SavedProgress read_progress(LineReader* reader) {
  SavedProgress progress;
  progress.first_odometry = take_stamp("first_odometry", reader);
  progress.used = take_stamp("used", reader);
  progress.last_observation = take_stamp("last_observation", reader);
  reader->take("lost", 2);
  progress.lost_probability = reader->finite(1);
  progress.normalized_innovation = reader->finite(2);
  reader->take("odometry_offset", 3);
  progress.odometry_offset = pose_of(*reader, 1);
  const std::int64_t samples = take_count("odometry", kMost, reader);
  for (std::int64_t i = 0; i < samples; ++i) {
    reader->take("sample", 10);
    SavedOdometry odometry;
    odometry.stamp = stamp_of(*reader, 1);
    odometry.received = pose_of(*reader, 3);
    odometry.pose = pose_of(*reader, 6);
    const bool has_covariance = reader->integer(9, 1) == 1;
    const bool has_step = reader->integer(10, 1) == 1;
    if (has_covariance) odometry.covariance = take_covariance("covariance", reader);
    if (has_step) odometry.step_covariance = take_covariance("step_covariance", reader);
    progress.odometry.push_back(odometry);
  }
  reader->refuse_if(fault_of(progress));
  return progress;
}

// Numbers of all particles, row by row, as columns.
using Rows = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows rows_of(const std::vector<double>& numbers, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::Map<const Rows>(numbers.data(), rows, columns);
}

BeaconMclParticles read_particles(std::size_t radios, LineReader* reader) {
  BeaconMclParticles particles;
  // Kinds of the numbers in a particle's line, and how many are in a radio's.
  std::vector<ColumnKind> kinds;
  std::size_t per_radio = 0;
  BeaconMclParticles::for_each_column(particles,
                                      [&](const char*, ColumnKind kind, const auto& column) {
                                        if (has_one_number<decltype(column)>) {
                                          kinds.push_back(kind);
                                        } else {
                                          ++per_radio;
                                        }
                                      });
  const Eigen::Index count = take_count("particles", kMost, reader);
  std::vector<double> numbers;
  std::vector<double> of_radios;
  for (Eigen::Index i = 0; i < count; ++i) {
    reader->take("particle", kinds.size());
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const bool is_slot = kinds[k] == ColumnKind::ancestor;
      numbers.push_back(is_slot ? static_cast<double>(reader->integer(k + 1, kLargestInt))
                                : reader->real(k + 1));
    }
    for (std::size_t radio = 0; radio < radios; ++radio) {
      reader->take("radio", per_radio);
      for (std::size_t k = 0; k < per_radio; ++k) of_radios.push_back(reader->finite(k + 1));
    }
  }
  const Rows rows = rows_of(numbers, count, static_cast<Eigen::Index>(kinds.size()));
  // A row per particle and radio.
  const auto lines = static_cast<Eigen::Index>(radios) * count;
  const Rows rows_of_radios = rows_of(of_radios, lines, static_cast<Eigen::Index>(per_radio));
  Eigen::Index number = 0;
  Eigen::Index number_of_radio = 0;
  BeaconMclParticles::for_each_column(particles, [&](const char*, ColumnKind, auto& column) {
    using Column = std::decay_t<decltype(column)>;
    if constexpr (has_one_number<Column>) {
      column = rows.col(number++).template cast<typename Column::Scalar>();
    } else {
      const Eigen::ArrayXd of_all = rows_of_radios.col(number_of_radio++);
      column = rows_of({of_all.data(), of_all.data() + of_all.size()}, count,
                       static_cast<Eigen::Index>(radios));
    }
  });
  return particles;
}

void read_filter(LineReader* reader, BeaconMclCheckpoint* checkpoint) {
  SavedBeaconMcl& filter = checkpoint->filter;
  const std::int64_t beacons = take_count("beacons", kMost, reader);
  for (std::int64_t i = 0; i < beacons; ++i) {
    reader->take("beacon", 5);
    Beacon beacon;
    beacon.id = id_of(*reader, 1);
    beacon.is_planar = reader->integer(2, 1) == 1;
    beacon.position = {reader->finite(3), reader->finite(4), reader->finite(5)};
    filter.beacons.push_back(beacon);
  }
  filter.step = static_cast<std::uint32_t>(
      take_count("step", std::numeric_limits<std::uint32_t>::max(), reader));
  filter.time = take_number("time", reader);
  filter.updates_since_renewal = take_count("updates_since_renewal", kLargest, reader);
  filter.requested_particles = static_cast<int>(take_count("requested_particles", kMost, reader));
  reader->take("dead_reckoning", 3);
  filter.dead_reckoning = pose_of(*reader, 1);
  reader->take("range_noise", 2);
  filter.range_squares = reader->finite(1);
  filter.range_count = reader->finite(2);
  reader->take("likelihood", 3);
  filter.slow_likelihood = reader->finite(1);
  filter.fast_likelihood = reader->finite(2);
  filter.likelihoods = reader->integer(3, kLargest);
  const std::int64_t radios = take_count("radios", kMost, reader);
  for (std::int64_t i = 0; i < radios; ++i) {
    filter.calibration_times.push_back(take_number("radio_time", reader));
  }
  filter.first_range_time = take_number("first_range_time", reader);
  const std::int64_t ranges = take_count("ranges", kMost, reader);
  for (std::int64_t i = 0; i < ranges; ++i) {
    reader->take("range", 10);
    SavedBeaconMcl::Range range;
    range.observation = {id_of(*reader, 1), reader->finite(2), reader->finite(3),
                         Eigen::Vector3d(reader->finite(4), reader->finite(5), reader->finite(6))};
    range.pose = pose_of(*reader, 7);
    range.time = reader->finite(10);
    filter.ranges.push_back(range);
  }
  filter.particles = read_particles(filter.calibration_times.size(), reader);
  reader->refuse_if(fault_of(filter));
}

void read_scene_and_map(LineReader* reader, FastSlamCheckpoint* checkpoint) {
  reader->take("scene", 4);
  checkpoint->scene = Eigen::AlignedBox2d(Eigen::Vector2d(reader->finite(1), reader->finite(2)),
                                          Eigen::Vector2d(reader->finite(3), reader->finite(4)));
  reader->refuse_if(fault_of(checkpoint->scene));
  checkpoint->filter = read_map_lines(reader);
}

template <typename Checkpoint, typename ReadFilter>
Checkpoint read(const std::string& path, const char* filter, const ReadFilter& read_filter_lines) {
  const text_file::ClassicLocale locale;
  LineReader reader(text_file::kCheckpoint, path);
  reader.take("filter", 1);
  const std::string& found = reader.word(1);
  const bool is_other =
      found == checkpoint_lines::kBeaconMcl || found == checkpoint_lines::kFastSlam;
  if (found != filter && is_other) {
    throw Error("checkpoint " + path + " is one of " + found + ", not of " + filter +
                "; name one of that filter");
  }
  if (found != filter) reader.refuse(text_file::printable(found) + " is no filter");
  Checkpoint checkpoint;
  checkpoint.progress = read_progress(&reader);
  read_filter_lines(&reader, &checkpoint);
  reader.take_end();
  return checkpoint;
}

}  // namespace

BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path) {
  return read<BeaconMclCheckpoint>(path, checkpoint_lines::kBeaconMcl, read_filter);
}

FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path) {
  return read<FastSlamCheckpoint>(path, checkpoint_lines::kFastSlam, read_scene_and_map);
}

}  // namespace pf_resampling
