#include "src/checkpoint/saved_pose.hpp"

#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/health/lost_detector.hpp"
#include "pf_resampling_core/population/given_particles.hpp"
#include "src/checkpoint/saved_progress.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

using text_file::line_of;
using text_file::LineReader;
using text_file::LineWriter;

// What two readings of the odometry of a robot that was not moved may differ by.
constexpr double kSamePosition = 0.1;  // m
constexpr double kSameHeading = 0.1;   // rad

bool reads_the_same(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y) <= kSamePosition &&
         std::abs(wrap_angle(a.heading - b.heading)) <= kSameHeading;
}

std::string text_of(const Pose2& pose) {
  return "(" + number_text(pose.x) + ", " + number_text(pose.y) + ") m, " +
         number_text(pose.heading) + " rad";
}

std::string fault_of(const SavedPose& saved) {
  const Eigen::Matrix3d& covariance = saved.pose.covariance;
  if (!is_in_reach(saved.pose.mean) || !is_in_reach(saved.odometry)) {
    return "a pose is not finite or beyond 1e9 m";
  }
  if (!(covariance.array().abs() <= kFarthestPosition * kFarthestPosition).all()) {
    return "the covariance is not finite or beyond 1e18";
  }
  if (covariance.diagonal().minCoeff() < 0.0) return "a variance is negative";
  if (saved.stamp < 0) return "the stamp is negative";
  if (!(saved.lost >= 0.0 && saved.lost <= 1.0)) {
    return "the probability of being lost is not in [0, 1]";
  }
  return {};
}

// Words end at spaces; names of files may have some.
std::string as_word(const std::string& text) {
  static const char* const kDigits = "0123456789abcdef";
  std::string word;
  for (const char letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (code > ' ' && code != '%' && code < 127) {
      word += letter;
    } else {
      word += {'%', kDigits[code / 16], kDigits[code % 16]};
    }
  }
  return word;
}

std::string of_word(const std::string& word) {
  const auto digit = [](char letter) {
    if (letter >= '0' && letter <= '9') return letter - '0';
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : 0;
  };
  std::string text;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '%' && i + 2 < word.size()) {
      text += static_cast<char>(16 * digit(word[i + 1]) + digit(word[i + 2]));
      i += 2;
    } else {
      text += word[i];
    }
  }
  return text;
}

std::string take_name(const std::string& keyword, LineReader* reader) {
  reader->take(keyword, 1);
  const std::string name = of_word(reader->word(1));
  if (as_word(name) != reader->word(1)) {
    reader->refuse(text_file::printable(reader->word(1)) + " is not how a name is written");
  }
  return name;
}

}  // namespace

std::optional<std::string> reason_against(const SavedPose& saved, const PoseAtStart& now) {
  if (saved.frame != now.frame) {
    return "it is in the frame " + text_file::printable(saved.frame) + ", and frames/map is " +
           now.frame;
  }
  if (now.map.empty()) {
    return "it was saved in " + text_file::printable(saved.map) +
           ", and no map is loaded now that it could be in";
  }
  if (saved.map != now.map) {
    return "it was saved in " + text_file::printable(saved.map) + ", and this is " +
           text_file::printable(now.map);
  }
  const double age = 1e-9 * static_cast<double>(now.stamp - saved.stamp);
  if (age < 0.0) {
    return "it is from " + number_text(-age) +
           " s after the first odometry: the clock was set back, or a bag is played again";
  }
  if (age > now.oldest) {
    return "it is " + number_text(age) + " s old, more than pose/oldest, which is " +
           number_text(now.oldest) + " s";
  }
  if (saved.lost > kLikelyLost) {
    return "the filter did not know where it was when it was saved (lost: " +
           number_text(saved.lost) + ")";
  }
  if (reads_the_same(saved.odometry, now.odometry)) return std::nullopt;
  const bool began_anew = reads_the_same(now.odometry, Pose2{});
  if (began_anew && saved.stood_still) return std::nullopt;
  const std::string readings = "the odometry read " + text_of(saved.odometry) +
                               " when it was saved and reads " + text_of(now.odometry) + " now";
  return readings + (began_anew ? ": it began anew, and the robot was driving"
                                : ": the robot was moved meanwhile");
}

PoseEstimate pose_at_start(const SavedPose& saved, const Pose2& odometry) {
  PoseEstimate there = saved.pose;
  if (reads_the_same(saved.odometry, odometry)) {
    there.mean = compose(saved.pose.mean, relative(saved.odometry, odometry));
  }
  return there;
}

void write_saved_pose(const std::string& path, const SavedPose& pose) {
  const std::string fault = fault_of(pose);
  if (!fault.empty()) throw Error("pose to write: " + fault + "; reset the filter");
  const text_file::ClassicLocale locale;
  LineWriter writer(text_file::kPose, path);
  writer.line("# Where the robot was; metres, radians; x forward, y left. Do not edit.");
  writer.line("frame " + as_word(pose.frame));
  writer.line("map " + as_word(pose.map));
  writer.line("# of the odometry, in seconds and nanoseconds");
  writer.line(stamp_line("stamp", pose.stamp));
  writer.line(line_of("pose", pose.pose.mean));
  writer.line(covariance_line("covariance", pose.pose.covariance));
  writer.line("# what the odometry read, and whether the robot stood still");
  writer.line(line_of("odometry", pose.odometry));
  writer.line(pose.stood_still ? "stood_still 1" : "stood_still 0");
  writer.line(line_of("lost", pose.lost));
  writer.finish();
}

SavedPose read_saved_pose(const std::string& path) {
  const text_file::ClassicLocale locale;
  LineReader reader(text_file::kPose, path);
  SavedPose pose;
  pose.frame = take_name("frame", &reader);
  pose.map = take_name("map", &reader);
  pose.stamp = take_stamp("stamp", &reader);
  reader.take("pose", 3);
  pose.pose.mean = reader.pose(1);
  pose.pose.covariance = take_covariance("covariance", &reader);
  reader.take("odometry", 3);
  pose.odometry = reader.pose(1);
  pose.stood_still = reader.take_count("stood_still", 1) == 1;
  pose.lost = reader.take_number("lost");
  reader.refuse_if(fault_of(pose));
  reader.take_end();
  return pose;
}

}  // namespace pf_resampling
