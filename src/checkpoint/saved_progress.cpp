#include "src/checkpoint/saved_progress.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "pf_resampling_core/population/given_particles.hpp"

namespace pf_resampling {
namespace {

using text_file::line_of;
using text_file::LineReader;
using text_file::LineWriter;

constexpr std::int64_t kNanoseconds = 1000000000;  // in a second
constexpr std::int64_t kLatest = 0x7fffffff;       // s, that ROS 1 can reckon with
constexpr std::int64_t kMost = 10000000;           // of anything that is listed

std::int64_t stamp_of(const LineReader& reader, std::size_t first) {
  return reader.integer(first, kLatest) * kNanoseconds +
         reader.integer(first + 1, kNanoseconds - 1);
}

bool is_in_reach(const std::optional<Eigen::Matrix3d>& covariance) {
  return !covariance || (covariance->array().abs() <= kFarthestPosition * kFarthestPosition).all();
}

}  // namespace

std::string stamp_line(const std::string& keyword, std::int64_t stamp) {
  return line_of(keyword, stamp / kNanoseconds, stamp % kNanoseconds);
}

std::int64_t take_stamp(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 2);
  return stamp_of(*reader, 1);
}

std::string covariance_line(const std::string& keyword, const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d& c = covariance;
  return line_of(keyword, c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2));
}

Eigen::Matrix3d take_covariance(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 6);
  // Eigen does not stand an exception while a matrix is filled in.
  std::array<double, 7> c{};
  for (std::size_t i = 1; i < c.size(); ++i) c[i] = reader->finite(i);
  Eigen::Matrix3d covariance;
  covariance << c[1], c[2], c[3], c[2], c[4], c[5], c[3], c[5], c[6];
  return covariance;
}

std::string fault_of(const SavedProgress& progress) {
  if (progress.odometry.empty()) return "there is no odometry";
  std::int64_t previous = -1;
  if (!is_in_reach(progress.odometry_offset)) return "the offset of the odometry is beyond 1e9 m";
  for (const SavedOdometry& odometry : progress.odometry) {
    if (!is_in_reach(odometry.received) || !is_in_reach(odometry.pose)) {
      return "a pose of the odometry is beyond 1e9 m";
    }
    if (!is_in_reach(odometry.covariance) || !is_in_reach(odometry.step_covariance)) {
      return "a covariance of the odometry is beyond 1e18";
    }
    if (odometry.stamp <= previous) return "the stamps of the odometry do not ascend";
    previous = odometry.stamp;
  }
  const std::int64_t latest =
      std::max({previous, progress.first_odometry, progress.last_observation});
  if (latest / kNanoseconds > kLatest) return "a stamp is too large for ROS 1";
  if (progress.used < progress.odometry.front().stamp || progress.used > previous) {
    return "the odometry does not reach back to what the filter has used";
  }
  if (progress.first_odometry < 0 || progress.last_observation < 0) return "a stamp is negative";
  if (!(progress.lost_probability >= 0.0 && progress.lost_probability <= 1.0)) {
    return "the probability of being lost is not in [0, 1]";
  }
  if (!(progress.normalized_innovation >= 0.0 && std::isfinite(progress.normalized_innovation))) {
    return "the mean innovation is negative or not finite";
  }
  return {};
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
  writer->line(line_of("odometry_offset", progress.odometry_offset));
  writer->line("odometry " + std::to_string(progress.odometry.size()));
  for (const SavedOdometry& odometry : progress.odometry) {
    const std::string text =
        line_of(stamp_line("sample", odometry.stamp), odometry.received, odometry.pose);
    writer->line(text + (odometry.covariance ? " 1" : " 0") +
                 (odometry.step_covariance ? " 1" : " 0"));
    const auto& [as_received, of_step] = std::tie(odometry.covariance, odometry.step_covariance);
    if (as_received) writer->line(covariance_line("covariance", *as_received));
    if (of_step) writer->line(covariance_line("step_covariance", *of_step));
  }
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
  progress.odometry_offset = reader->pose(1);
  const std::int64_t samples = reader->take_count("odometry", kMost);
  for (std::int64_t i = 0; i < samples; ++i) {
    reader->take("sample", 10);
    SavedOdometry odometry;
    odometry.stamp = stamp_of(*reader, 1);
    odometry.received = reader->pose(3);
    odometry.pose = reader->pose(6);
    const bool has_covariance = reader->integer(9, 1) == 1;
    const bool has_step = reader->integer(10, 1) == 1;
    if (has_covariance) odometry.covariance = take_covariance("covariance", reader);
    if (has_step) odometry.step_covariance = take_covariance("step_covariance", reader);
    progress.odometry.push_back(odometry);
  }
  reader->refuse_if(fault_of(progress));
  return progress;
}

}  // namespace pf_resampling
