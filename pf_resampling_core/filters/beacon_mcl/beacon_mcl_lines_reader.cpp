#include <limits>
#include <type_traits>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl_lines.hpp"

namespace pf_resampling {
namespace {

using text_file::LineReader;

// Memory grows with what is in the file, never with what it says is to come.
constexpr std::int64_t kMost = 10000000;  // of anything that is listed
constexpr std::int64_t kSmallestInt = std::numeric_limits<int>::min();
constexpr std::int64_t kLargestInt = std::numeric_limits<int>::max();
constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();

int id_of(const LineReader& reader, std::size_t i) {
  return static_cast<int>(reader.integer(i, kSmallestInt, kLargestInt));
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
  const Eigen::Index count = reader->take_count("particles", kMost);
  if (count == 0) return particles;
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
    } else if (radios == 0) {
      column.resize(count, 0);  // an array without rows has no columns to take
    } else {
      const Eigen::ArrayXd of_all = rows_of_radios.col(number_of_radio++);
      column = rows_of({of_all.data(), of_all.data() + of_all.size()}, count,
                       static_cast<Eigen::Index>(radios));
    }
  });
  return particles;
}

}  // namespace

SavedBeaconMcl read_beacon_mcl_lines(LineReader* reader) {
  SavedBeaconMcl filter;
  const std::int64_t beacons = reader->take_count("beacons", kMost);
  for (std::int64_t i = 0; i < beacons; ++i) {
    reader->take("beacon", 5);
    Beacon beacon;
    beacon.id = id_of(*reader, 1);
    beacon.is_planar = reader->integer(2, 1) == 1;
    beacon.position = {reader->finite(3), reader->finite(4), reader->finite(5)};
    filter.beacons.push_back(beacon);
  }
  filter.step = static_cast<std::uint32_t>(
      reader->take_count("step", std::numeric_limits<std::uint32_t>::max()));
  filter.time = reader->take_number("time");
  filter.updates_since_renewal = reader->take_count("updates_since_renewal", kLargest);
  filter.requested_particles = static_cast<int>(reader->take_count("requested_particles", kMost));
  reader->take("dead_reckoning", 3);
  filter.dead_reckoning = reader->pose(1);
  reader->take("range_noise", 2);
  filter.range_squares = reader->finite(1);
  filter.range_count = reader->finite(2);
  reader->take("likelihood", 3);
  filter.slow_likelihood = reader->finite(1);
  filter.fast_likelihood = reader->finite(2);
  filter.likelihoods = reader->integer(3, kLargest);
  const std::int64_t radios = reader->take_count("radios", kMost);
  for (std::int64_t i = 0; i < radios; ++i) {
    filter.calibration_times.push_back(reader->take_number("radio_time"));
  }
  filter.first_range_time = reader->take_number("first_range_time");
  const std::int64_t ranges = reader->take_count("ranges", kMost);
  for (std::int64_t i = 0; i < ranges; ++i) {
    reader->take("range", 10);
    SavedBeaconMcl::Range range;
    range.observation = {id_of(*reader, 1), reader->finite(2), reader->finite(3),
                         Eigen::Vector3d(reader->finite(4), reader->finite(5), reader->finite(6))};
    range.pose = reader->pose(7);
    range.time = reader->finite(10);
    filter.ranges.push_back(range);
  }
  filter.particles = read_particles(filter.calibration_times.size(), reader);
  reader->refuse_if(fault_of(filter));
  return filter;
}

}  // namespace pf_resampling
