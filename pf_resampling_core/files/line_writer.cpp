#include "pf_resampling_core/files/line_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::text_file {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;

}  // namespace

// The file under another name beside it, until all of it is there.
class LineWriter::NewFile {
 public:
  NewFile(const Kind& kind, const std::string& path) : kind_(kind), path_(path) {
    std::error_code ignored;
    // A link stays a link.
    if (std::filesystem::is_symlink(path_, ignored)) {
      const auto target = std::filesystem::canonical(path_, ignored);
      if (!ignored) path_ = target.string();
    }
    static std::atomic<int> count{0};
    temporary_ = path_ + ".part-" + std::to_string(getpid()) + "-" + std::to_string(++count);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
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
    const int directory = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
    if (directory < 0) return;
    fsync(directory);
    close(directory);
  }

 private:
  [[noreturn]] void refuse() {
    const std::string reason = std::strerror(errno);
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
    throw Error(std::string(kind_.name) + " " + path_ + " cannot be written: " + reason +
                "; give a file in a folder that exists, has space and is writable");
  }

  Kind kind_;
  std::string path_;
  std::string temporary_;
  int descriptor_ = -1;
  bool is_done_ = false;
};

LineWriter::LineWriter(const Kind& kind, const std::string& path)
    : file_(std::make_unique<NewFile>(kind, path)) {
  line(kind.first_line());
}

LineWriter::~LineWriter() = default;

void LineWriter::line(const std::string& text) {
  pending_ += text;
  pending_ += '\n';
  ++lines_;
  if (pending_.size() > kBlock) flush();
}

void LineWriter::finish() {
  flush();
  file_->write(checksum_.end_line(lines_) + "\n");
  file_->finish();
}

void LineWriter::flush() {
  checksum_.add(pending_);
  file_->write(pending_);
  pending_.clear();
}

void append(double value, std::string* text) {
  std::array<char, 40> digits{};
  std::snprintf(digits.data(), digits.size(), " %.15g", value);
  if (std::strtod(digits.data(), nullptr) != value) {
    std::snprintf(digits.data(), digits.size(), " %.17g", value);
  }
  *text += digits.data();
}

void append(std::int64_t value, std::string* text) {
  *text += " " + std::to_string(value);
}

void append(const Pose2& pose, std::string* text) {
  for (const double value : {pose.x, pose.y, pose.heading}) append(value, text);
}

}  // namespace pf_resampling::text_file
