#include "tools/datasets/mrclam.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"
#include "tools/datasets/dataset_format.hpp"
#include "tools/datasets/number_table.hpp"

namespace pf_resampling {

namespace {

constexpr int kFirstLandmark = 6;  // subjects before it are robots
constexpr int kMostRobots = 5;

/// A table in order of its first column, the time, however the file has it.
NumberTable read_timed(const std::string& path, std::size_t columns, Recording* recording) {
  NumberTable table = read_number_table(path, columns);
  const auto is_before = [](const NumberTable::Row& a, const NumberTable::Row& b) {
    return a.numbers[0] < b.numbers[0];
  };
  if (!std::is_sorted(table.rows.begin(), table.rows.end(), is_before)) {
    std::stable_sort(table.rows.begin(), table.rows.end(), is_before);
    recording->notes.push_back(std::filesystem::path(path).filename().string() +
                               ": rows put in order of time");
  }
  return table;
}

class Reader {
 public:
  Reader(std::filesystem::path directory, const MrclamOptions& options)
      : directory_(std::move(directory)), options_(options) {}

  Recording read() {
    const std::string robot = "Robot" + std::to_string(options_.robot) + "_";
    const auto path = [&](const std::string& name) { return (directory_ / name).string(); };
    const auto exists = [&](const std::string& name) {
      return std::filesystem::exists(directory_ / name);
    };
    if (!exists(robot + "Odometry.dat")) {
      throw Error(path(robot + "Odometry.dat") + ": no such file; " + robots_there());
    }
    read_odometry(path(robot + "Odometry.dat"));
    read_measurements(path(robot + "Measurement.dat"), subjects_by_barcode(path("Barcodes.dat")));
    if (exists(robot + "Groundtruth.dat")) read_truth(path(robot + "Groundtruth.dat"));
    if (exists("Landmark_Groundtruth.dat")) read_landmarks(path("Landmark_Groundtruth.dat"));
    return std::move(recording_);
  }

 private:
  std::string robots_there() const {
    std::string there;
    for (int robot = 1; robot <= kMostRobots; ++robot) {
      const std::string number = std::to_string(robot);
      if (!std::filesystem::exists(directory_ / ("Robot" + number + "_Odometry.dat"))) continue;
      there += (there.empty() ? "" : ", ") + number;
    }
    if (there.empty()) return "give the directory with Robot1_Odometry.dat and the like";
    return "--robot has to be one of " + there;
  }

  std::map<int, int> subjects_by_barcode(const std::string& path) const {
    const NumberTable table = read_number_table(path, 2);
    std::map<int, int> subjects;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const int subject = table.whole_number(row, 0);
      const int barcode = table.whole_number(row, 1);
      if (subject < 1) table.fail(row, "subject " + std::to_string(subject) + " is not above 0");
      if (!subjects.emplace(barcode, subject).second) {
        table.fail(row, "barcode " + std::to_string(barcode) + " is there twice");
      }
    }
    return subjects;
  }

  void read_odometry(const std::string& path) {
    const NumberTable table = read_timed(path, 3, &recording_);
    std::size_t merged = 0;
    Pose2 pose;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::vector<double>& now = table.rows[row].numbers;
      if (row > 0) {
        const std::vector<double>& before = table.rows[row - 1].numbers;
        const double duration = now[0] - before[0];
        pose = compose(pose, midpoint_motion(before[1] * duration, before[2] * duration));
        if (duration <= 0.0) {
          ++merged;
          continue;  // the pose at this time is there; the velocities from here on are this row's
        }
      }
      recording_.odometry.push_back({now[0] + options_.odometry_delay, pose});
    }
    if (merged > 0) {
      recording_.notes.push_back("odometry: " + std::to_string(merged) +
                                 " rows merged with the row before, which has the same time");
    }
    if (std::abs(options_.odometry_delay) > 0.0) {
      recording_.notes.push_back("odometry delayed by " + std::to_string(options_.odometry_delay) +
                                 " s");
    }
  }

  void read_measurements(const std::string& path, const std::map<int, int>& subjects) {
    const NumberTable table = read_timed(path, 4, &recording_);
    std::size_t robots = 0;
    std::size_t misread = 0;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::vector<double>& numbers = table.rows[row].numbers;
      const auto subject = subjects.find(table.whole_number(row, 1));
      if (subject == subjects.end()) {
        ++misread;
      } else if (subject->second < kFirstLandmark) {
        ++robots;
      } else if (!(numbers[2] > 0.0)) {
        table.fail(row, "range " + std::to_string(numbers[2]) + " is not above 0");
      } else {
        recording_.landmark_observations.push_back(
            {numbers[0], subject->second, numbers[2], wrap_angle(numbers[3]), 0.0, 0.0});
      }
    }
    if (robots > 0) {
      recording_.notes.push_back(std::to_string(robots) + " observations of robots left out");
    }
    if (misread > 0) {
      recording_.notes.push_back(
          std::to_string(misread) +
          " observations left out because no subject carries their barcode (misread)");
    }
    recording_.frames.push_back({"sensor", 0.0, 0.0, 0.0, 0.0});
  }

  void read_truth(const std::string& path) {
    const NumberTable table = read_timed(path, 4, &recording_);
    for (const NumberTable::Row& row : table.rows) {
      const std::vector<double>& n = row.numbers;
      recording_.truth.push_back({n[0], {n[1], n[2], wrap_angle(n[3])}});
    }
    recording_.truth_has_heading = true;
  }

  void read_landmarks(const std::string& path) {
    const NumberTable table = read_number_table(path, 5);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::vector<double>& n = table.rows[row].numbers;
      Recording::Landmark landmark;
      landmark.id = table.whole_number(row, 0);
      landmark.x = n[1];
      landmark.y = n[2];
      landmark.covariance = {n[3] * n[3], 0.0, 0.0, n[4] * n[4]};
      recording_.landmarks.push_back(landmark);
    }
  }

  std::filesystem::path directory_;
  MrclamOptions options_;
  Recording recording_;
};

}  // namespace

Recording read_mrclam(const std::string& directory, const MrclamOptions& options) {
  require_directory(directory, "Robot1_Odometry.dat and the like");
  return Reader(directory, options).read();
}

DatasetFormat mrclam_format() {
  DatasetFormat format;
  format.name = "mrclam";
  format.line = "text files of UTIAS (multi-robot data sets 1 to 9), one robot";
  format.help =
      "Makes a bag of what one robot of a directory with Robot<n>_Odometry.dat,\n"
      "Robot<n>_Measurement.dat, Barcodes.dat and, if there is truth,\n"
      "Robot<n>_Groundtruth.dat and Landmark_Groundtruth.dat recorded. Landmark ids\n"
      "are subject numbers, from 6; observations of robots are left out.";
  format.input = "DIRECTORY";
  format.examples = {"dataset_to_bag mrclam MRCLAM_Dataset6 robot1.bag --robot 1"};
  format.add_options = [](CommandLine* line) {
    line->option<int>("robot", "N", 1, "number of the robot");
    line->option<double>(
        "odometry-delay", "SECONDS", 0.0,
        "added to the times of the odometry; in data set 6 the truth is 0.2 s behind it");
  };
  format.read = [](const std::string& path, const CommandLine& line) {
    MrclamOptions options;
    options.robot = line.get<int>("robot");
    options.odometry_delay = line.get<double>("odometry-delay");
    if (!(std::abs(options.odometry_delay) <= 10.0)) {
      throw UsageError("--odometry-delay has to be between -10 and 10 s");
    }
    return read_mrclam(path, options);
  };
  return format;
}

}  // namespace pf_resampling
