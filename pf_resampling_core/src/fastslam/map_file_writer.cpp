#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "map_file.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

using map_file::Checksum;
using map_file::ClassicLocale;

// The file under another name beside it, until all of it is there.
class NewFile {
 public:
  explicit NewFile(const std::string& path) : path_(path) {
    std::error_code ignored;
    // A link stays a link.
    if (std::filesystem::is_symlink(path_, ignored)) {
      const auto target = std::filesystem::canonical(path_, ignored);
      if (!ignored) path_ = target.string();
    }
    static std::atomic<int> count{0};
    temporary_ = path_ + ".part-" + std::to_string(getpid()) + "-" + std::to_string(++count);
    descriptor_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0) refuse();
  }
  ~NewFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!is_done_ && !temporary_.empty()) unlink(temporary_.c_str());
  }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void write(const std::string& bytes) {
    std::size_t written = 0;
    while (written < bytes.size()) {
      const ssize_t now = ::write(descriptor_, bytes.data() + written, bytes.size() - written);
      if (now < 0 && errno == EINTR) continue;
      if (now < 0) refuse();
      written += static_cast<std::size_t>(now);
    }
  }

  void finish() {
    if (fsync(descriptor_) != 0) refuse();
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (close(descriptor) != 0) refuse();
    if (std::rename(temporary_.c_str(), path_.c_str()) != 0) refuse();
    is_done_ = true;
    // The new name has to last, too; a file system that cannot say so is no reason to fail.
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    const int directory = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
    if (directory < 0) return;
    fsync(directory);
    close(directory);
  }

 private:
  [[noreturn]] void refuse() {
    const std::string reason = std::strerror(errno);
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
    throw Error("map file " + path_ + " cannot be written: " + reason +
                "; name a file in a folder that exists, has space and may be written to");
  }

  std::string path_;
  std::string temporary_;
  int descriptor_ = -1;
  bool is_done_ = false;
};

class MapWriter {
 public:
  explicit MapWriter(const std::string& path) : file_(path) {}

  void line(const std::string& text) {
    pending_ += text;
    pending_ += '\n';
    ++lines_;
    if (pending_.size() > kBlock) flush();
  }
  void finish() {
    flush();
    file_.write(checksum_.end_line(lines_) + "\n");
    file_.finish();
  }

 private:
  static constexpr std::size_t kBlock = std::size_t{1} << 20;

  void flush() {
    checksum_.add(pending_);
    file_.write(pending_);
    pending_.clear();
  }

  NewFile file_;
  Checksum checksum_;
  std::string pending_;
  std::int64_t lines_ = 0;
};

// A number after a space, so that it comes back to the bit.
void append(double value, std::string* text) {
  std::array<char, 40> digits{};
  std::snprintf(digits.data(), digits.size(), " %.15g", value);
  if (std::strtod(digits.data(), nullptr) != value) {
    std::snprintf(digits.data(), digits.size(), " %.17g", value);
  }
  *text += digits.data();
}

template <typename... Values>
std::string line_of(std::string text, Values... values) {
  (append(values, &text), ...);
  return text;
}

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

void write_odometry_errors(const SavedMap& map, MapWriter* writer) {
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

void write_map_file(const std::string& path, const SavedMap& map) {
  check_saved_map(map);
  const ClassicLocale locale;
  MapWriter writer(path);
  writer.line(map_file::kFirstLine);
  writer.line(
      "# Landmarks, and the particles that go on from here; metres and radians, x forward,");
  writer.line("# y left, in the frame named below. The last line covers every byte: do not edit.");
  writer.line("frame " + map.frame);
  writer.line("association " + to_string(map.association));
  writer.line("next_id " + std::to_string(map.next_id));
  writer.line("step " + std::to_string(map.step));
  writer.line("scans_since_renewal " + std::to_string(map.observations_since_renewal));
  writer.line("# farthest range and widest bearing of any observation");
  writer.line(line_of("view", map.view_range, map.view_bearing));
  writer.line("# x, y, heading; covariance: xx xy xh yy yh hh");
  writer.line(line_of("pose", map.pose.mean.x, map.pose.mean.y, map.pose.mean.heading));
  const Eigen::Matrix3d& c = map.pose.covariance;
  writer.line(line_of("pose_covariance", c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)));
  writer.line(
      "# id, x, y, covariance xx xy yy, share of the weight that holds it, log-odds of its");
  writer.line("# existence, x and y where it was last seen");
  writer.line("landmarks " + std::to_string(map.landmarks.size()));
  for (const SavedLandmark& landmark : map.landmarks) writer.line(line_of(landmark));
  writer.line("# x, y, heading, log-weight, weight, number of its landmarks, which follow:");
  writer.line("# id, x, y, covariance xx xy yy, log-odds");
  writer.line("particles " + std::to_string(map.particles.size()));
  for (const SavedParticle& particle : map.particles) {
    writer.line(line_of("particle", particle.pose.x, particle.pose.y, particle.pose.heading,
                        particle.log_weight, particle.weight) +
                " " + std::to_string(particle.landmarks.size()));
    for (const ParticleLandmark& landmark : particle.landmarks) writer.line(line_of(landmark));
  }
  write_odometry_errors(map, &writer);
  writer.finish();
}

}  // namespace pf_resampling
