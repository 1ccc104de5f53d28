#include "tools/datasets/labyrinth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"
#include "tools/datasets/dataset_format.hpp"

namespace pf_resampling {

namespace {

namespace fs = std::filesystem;

/// One measurement: its kind and the numbers behind it.
struct Line {
  std::string place;  // "FILE:LINE: "
  std::string kind;
  std::vector<double> numbers;

  void require(std::size_t count) const {
    if (numbers.size() >= count) return;
    throw Error(place + kind + " with " + std::to_string(numbers.size()) + " numbers, " +
                std::to_string(count) + " are needed");
  }

  std::int32_t id(std::size_t index) const {
    using Limits = std::numeric_limits<std::int32_t>;
    const double value = numbers[index];
    if (value < Limits::min() || value > Limits::max() || std::floor(value) < value) {
      std::ostringstream text;
      text << value;
      throw Error(place + kind + ": the id " + text.str() + " is not a whole number of 32 bits");
    }
    return static_cast<std::int32_t>(value);
  }
};

std::vector<Line> lines_of(const std::string& path) {
  std::vector<Line> lines;
  std::istringstream stream(read_file(path));
  std::string text;
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    std::istringstream words(text);
    Line line;
    line.place = path + ":" + std::to_string(number) + ": ";
    if (!(words >> line.kind)) continue;
    const bool known = line.kind == "range2" || line.kind == "odom2diff" || line.kind == "point2";
    for (std::string word; known && words >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (end != word.c_str() + word.size() || !std::isfinite(value)) {
        throw Error(line.place + line.kind + ": '" + word + "' is not a finite number");
      }
      line.numbers.push_back(value);
    }
    lines.push_back(line);
  }
  return lines;
}

/// The one file of the directory whose name ends in `ending`; "" if there is none.
std::string file_ending_with(const std::string& directory, const std::string& ending) {
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (name.size() >= ending.size() &&
        name.compare(name.size() - ending.size(), ending.size(), ending) == 0) {
      found.push_back(entry.path().string());
    }
  }
  std::sort(found.begin(), found.end());
  if (found.size() > 1) {
    throw Error(directory + ": has several files *" + ending + "; give a directory with one");
  }
  return found.empty() ? "" : found.front();
}

double time_after(const Line& line, double last) {
  const double time = line.numbers[0];
  if (time < last) {
    throw Error(line.place + line.kind + ": time " + std::to_string(time) +
                " is before that of the line above of this kind");
  }
  return time;
}

class Reader {
 public:
  void read_input(const std::string& path) {
    for (const Line& line : lines_of(path)) {
      if (line.kind == "range2") {
        add_range(line);
      } else if (line.kind == "odom2diff") {
        add_odometry(line);
      } else {
        ++ignored_[line.kind];
      }
    }
    if (recording_.odometry.empty() && recording_.ranges.empty()) {
      throw Error(path + ": has no line range2 or odom2diff; is it a recording of this format?");
    }
  }

  void read_truth(const std::string& path) {
    double last = -std::numeric_limits<double>::infinity();
    for (const Line& line : lines_of(path)) {
      if (line.kind != "point2") {
        ++ignored_[line.kind];
        continue;
      }
      line.require(3);
      last = time_after(line, last);
      recording_.truth.push_back({last, {line.numbers[1], line.numbers[2], 0.0}});
    }
  }

  Recording take() {
    for (const auto& [kind, count] : ignored_) {
      recording_.notes.push_back(std::to_string(count) + " lines " + kind + " are not used");
    }
    return std::move(recording_);
  }

 private:
  /// t, range, variance, beacon's x and y, id.
  void add_range(const Line& line) {
    line.require(6);
    Recording::Range range;
    range.time =
        time_after(line, recording_.ranges.empty() ? -std::numeric_limits<double>::infinity()
                                                   : recording_.ranges.back().time);
    range.range = line.numbers[1];
    range.variance = line.numbers[2];
    range.beacon = line.id(5);
    if (range.range < 0.0) throw Error(line.place + "negative range");
    if (range.variance < 0.0) throw Error(line.place + "negative variance");
    recording_.ranges.push_back(range);

    const double x = line.numbers[3];
    const double y = line.numbers[4];
    const auto known =
        std::find_if(recording_.beacons.begin(), recording_.beacons.end(),
                     [&](const Recording::Beacon& beacon) { return beacon.id == range.beacon; });
    if (known == recording_.beacons.end()) {
      recording_.beacons.push_back({range.beacon, x, y, std::nullopt});
    } else if (std::hypot(known->x - x, known->y - y) > 1e-6) {
      throw Error(line.place + "beacon " + std::to_string(range.beacon) +
                  " is not where it was in the lines above");
    }
  }

  /// t, velocity of the left wheel, of the right, to the side, half the distance of the wheels.
  void add_odometry(const Line& line) {
    line.require(5);
    auto& odometry = recording_.odometry;
    const double time = time_after(
        line, odometry.empty() ? -std::numeric_limits<double>::infinity() : odometry.back().time);
    if (!(line.numbers[4] > 0.0)) throw Error(line.place + "distance of wheels is not positive");
    Pose2 pose;
    if (!odometry.empty()) {
      const double duration = time - odometry.back().time;
      const double turn = yaw_rate_ * duration;
      Pose2 motion = midpoint_motion(forward_ * duration, turn);
      motion.x -= sideways_ * duration * std::sin(0.5 * turn);
      motion.y += sideways_ * duration * std::cos(0.5 * turn);
      pose = compose(odometry.back().pose, motion);
    }
    if (odometry.empty() || time > odometry.back().time) odometry.push_back({time, pose});
    forward_ = 0.5 * (line.numbers[1] + line.numbers[2]);
    sideways_ = line.numbers[3];
    yaw_rate_ = (line.numbers[2] - line.numbers[1]) / (2.0 * line.numbers[4]);
  }

  Recording recording_;
  std::map<std::string, std::size_t> ignored_;
  double forward_ = 0.0;   // m/s, until the next line
  double sideways_ = 0.0;  // m/s, to the left
  double yaw_rate_ = 0.0;  // rad/s
};

}  // namespace

Recording read_labyrinth(const std::string& directory) {
  require_directory(directory, "*Input.txt and *GT.txt");
  const std::string input = file_ending_with(directory, "Input.txt");
  if (input.empty()) throw Error(directory + ": has no file *Input.txt");
  const std::string truth = file_ending_with(directory, "GT.txt");
  Reader reader;
  reader.read_input(input);
  if (!truth.empty()) reader.read_truth(truth);
  return reader.take();
}

DatasetFormat labyrinth_format() {
  DatasetFormat format;
  format.name = "labyrinth";
  format.line = "text files of TU Chemnitz (Labyrinth, UWB)";
  format.help =
      "Makes a bag of a directory with one file *Input.txt (lines range2 and\n"
      "odom2diff) and, if there is truth, one *GT.txt (lines point2).";
  format.input = "DIRECTORY";
  format.examples = {"dataset_to_bag labyrinth labyrinth_uwb labyrinth.bag"};
  format.read = [](const std::string& path, const CommandLine&) { return read_labyrinth(path); };
  return format;
}

}  // namespace pf_resampling
