#include "src/checkpoint/checkpoint.hpp"

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl_lines.hpp"
#include "pf_resampling_core/filters/fastslam/map_lines.hpp"
#include "pf_resampling_core/population/given_particles.hpp"

namespace pf_resampling {
namespace {

using text_file::line_of;
using text_file::LineReader;
using text_file::LineWriter;

constexpr const char* kBeaconMcl = "beacon_mcl";
constexpr const char* kFastSlam = "fastslam";

std::string fault_of(const Eigen::AlignedBox2d& scene) {
  if (!scene.min().allFinite() || !scene.max().allFinite()) return "the scene is not finite";
  if (!((scene.min().array().abs() <= kFarthestPosition).all() &&
        (scene.max().array().abs() <= kFarthestPosition).all())) {
    return "the scene is beyond 1e9 m";
  }
  if (scene.isEmpty()) return "the scene is empty";
  return {};
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
  const bool is_other = found == kBeaconMcl || found == kFastSlam;
  if (found != filter && is_other) {
    throw Error("checkpoint " + path + " is one of " + found + ", not of " + filter +
                "; give a checkpoint of that filter");
  }
  if (found != filter) reader.refuse(text_file::printable(found) + " is not a filter");
  Checkpoint checkpoint;
  checkpoint.progress = read_progress(&reader);
  read_filter_lines(&reader, &checkpoint);
  reader.take_end();
  return checkpoint;
}

}  // namespace

void write_checkpoint(const std::string& path, const BeaconMclCheckpoint& checkpoint) {
  refuse_if(fault_of(checkpoint.progress));
  refuse_if(fault_of(checkpoint.filter));
  write(path, kBeaconMcl, checkpoint.progress,
        [&](LineWriter* writer) { write_beacon_mcl_lines(checkpoint.filter, writer); });
}

void write_checkpoint(const std::string& path, const FastSlamCheckpoint& checkpoint) {
  refuse_if(fault_of(checkpoint.progress));
  refuse_if(fault_of(checkpoint.scene));
  check_saved_map(checkpoint.filter);
  write(path, kFastSlam, checkpoint.progress, [&](LineWriter* writer) {
    const Eigen::AlignedBox2d& scene = checkpoint.scene;
    writer->line("# smallest x and y, largest x and y, of robot and landmarks so far");
    writer->line(
        line_of("scene", scene.min().x(), scene.min().y(), scene.max().x(), scene.max().y()));
    write_map_lines(checkpoint.filter, writer);
  });
}

BeaconMclCheckpoint read_beacon_mcl_checkpoint(const std::string& path) {
  return read<BeaconMclCheckpoint>(path, kBeaconMcl,
                                   [](LineReader* reader, BeaconMclCheckpoint* checkpoint) {
                                     checkpoint->filter = read_beacon_mcl_lines(reader);
                                   });
}

FastSlamCheckpoint read_fastslam_checkpoint(const std::string& path) {
  return read<FastSlamCheckpoint>(path, kFastSlam, read_scene_and_map);
}

}  // namespace pf_resampling
