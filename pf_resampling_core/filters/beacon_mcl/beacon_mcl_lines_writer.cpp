#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl_lines.hpp"

namespace pf_resampling {
namespace {

using text_file::append;
using text_file::line_of;
using text_file::LineWriter;

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

}  // namespace

void write_beacon_mcl_lines(const SavedBeaconMcl& filter, LineWriter* writer) {
  writer->line("# id, 1 if its height is unknown, x, y, z");
  writer->line("beacons " + std::to_string(filter.beacons.size()));
  for (const Beacon& beacon : filter.beacons) {
    writer->line(line_of("beacon " + std::to_string(beacon.id) + (beacon.is_planar ? " 1" : " 0"),
                         beacon.position.x(), beacon.position.y(), beacon.position.z()));
  }
  writer->line("step " + std::to_string(filter.step));
  writer->line(line_of("time", filter.time));
  writer->line("updates_since_renewal " + std::to_string(filter.updates_since_renewal));
  writer->line("requested_particles " + std::to_string(filter.requested_particles));
  writer->line(line_of("dead_reckoning", filter.dead_reckoning));
  writer->line("# what was learnt of the ranges' noise: squares, and of how many");
  writer->line(line_of("range_noise", filter.range_squares, filter.range_count));
  writer->line("# likelihood of the ranges: slow and fast mean, and of how many");
  writer->line(
      line_of("likelihood", filter.slow_likelihood, filter.fast_likelihood, filter.likelihoods));
  writer->line("radios " + std::to_string(filter.calibration_times.size()));
  for (const double time : filter.calibration_times) writer->line(line_of("radio_time", time));
  writer->line(line_of("first_range_time", filter.first_range_time));
  writer->line(
      "# beacon, range, variance; x, y, z of the antenna on the robot; dead reckoning and");
  writer->line("# time when it was taken");
  writer->line("ranges " + std::to_string(filter.ranges.size()));
  for (const SavedBeaconMcl::Range& range : filter.ranges) {
    const RangeObservation& seen = range.observation;
    writer->line(line_of("range " + std::to_string(seen.beacon), seen.range, seen.variance,
                         seen.antenna.x(), seen.antenna.y(), seen.antenna.z(), range.pose,
                         range.time));
  }
  write_particles(filter.particles, writer);
}

}  // namespace pf_resampling
