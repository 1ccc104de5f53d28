#include "tools/datasets/victoria_park.hpp"

#include <cmath>
#include <filesystem>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"
#include "tools/datasets/dataset_format.hpp"
#include "tools/datasets/mat_file.hpp"
#include "tools/datasets/number_table.hpp"

namespace pf_resampling {

namespace {

namespace fs = std::filesystem;

constexpr double kSecondsPerUnit = 1e-3;  // all times are in ms

// The vehicle, m; see the header.
constexpr double kWheelBase = 2.83;            // L
constexpr double kLaserBeforeFront = 0.95;     // a
constexpr double kLaserLeftOfMiddle = 0.5;     // b
constexpr double kEncoderLeftOfMiddle = 0.76;  // H

// rad: wheels do not turn further, and near pi/2 the model has no meaning.
constexpr double kMostSteering = 1.0;

struct Control {
  double time;      // s
  double speed;     // m/s, of the left rear wheel
  double steering;  // rad
};

/// Columns of equal length from a MATLAB file, as rows.
Eigen::MatrixXd columns_of(const std::string& path, const std::vector<std::string>& names) {
  const MatFile file(path);
  Eigen::MatrixXd all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto column = file.matrix(names[i], 1);
    if (!column) throw Error(path + ": has no variable " + names[i] + ", only " + file.names());
    if (i == 0) all.resize(column->rows(), static_cast<Eigen::Index>(names.size()));
    if (column->rows() != all.rows()) {
      throw Error(path + ": variable " + names[i] + " has " + std::to_string(column->rows()) +
                  " rows and " + names[0] + " " + std::to_string(all.rows()));
    }
    all.col(static_cast<Eigen::Index>(i)) = column->col(0);
  }
  if (!all.allFinite()) throw Error(path + ": has numbers that are not finite");
  return all;
}

/// The same from text files of one column each.
Eigen::MatrixXd columns_of(const fs::path& directory, const std::vector<std::string>& files) {
  Eigen::MatrixXd all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const NumberTable table = read_number_table((directory / files[i]).string(), 1);
    const auto rows = static_cast<Eigen::Index>(table.rows.size());
    if (i == 0) all.resize(rows, static_cast<Eigen::Index>(files.size()));
    if (rows != all.rows()) {
      throw Error(table.path + ": has " + std::to_string(rows) + " rows and " + files[0] + " " +
                  std::to_string(all.rows()));
    }
    for (Eigen::Index row = 0; row < rows; ++row) {
      all(row, static_cast<Eigen::Index>(i)) = table.rows[static_cast<std::size_t>(row)].numbers[0];
    }
  }
  return all;
}

void check_times(const Eigen::MatrixXd& table, const std::string& name) {
  for (Eigen::Index row = 1; row < table.rows(); ++row) {
    if (table(row, 0) >= table(row - 1, 0)) continue;
    throw Error(name + ": the time of row " + std::to_string(row + 1) +
                " is before that of the row above");
  }
}

std::vector<Control> read_controls(const fs::path& directory) {
  const bool has_text = fs::exists(directory / "time.txt");
  const fs::path mat = directory / "aa3_dr.mat";
  if (!has_text && !fs::exists(mat)) {
    throw Error(directory.string() +
                ": has neither time.txt, speed.txt, steering.txt nor aa3_dr.mat");
  }
  const Eigen::MatrixXd table =
      has_text ? columns_of(directory, {"time.txt", "speed.txt", "steering.txt"})
               : columns_of(mat.string(), {"time", "speed", "steering"});
  const std::string name = has_text ? (directory / "time.txt").string() : mat.string();
  check_times(table, name);
  std::vector<Control> controls;
  for (Eigen::Index row = 0; row < table.rows(); ++row) {
    if (std::abs(table(row, 2)) > kMostSteering) {
      throw Error(name + ": steering " + std::to_string(table(row, 2)) + " in row " +
                  std::to_string(row + 1) + " is not a steering angle in radians");
    }
    controls.push_back({kSecondsPerUnit * table(row, 0), table(row, 1), table(row, 2)});
  }
  return controls;
}

/// The path of the middle of the rear axle.
std::vector<Recording::Odometry> integrate(const std::vector<Control>& controls) {
  std::vector<Recording::Odometry> odometry;
  Pose2 pose;
  for (std::size_t i = 0; i < controls.size(); ++i) {
    if (i > 0) {
      const Control& control = controls[i - 1];
      const double duration = controls[i].time - control.time;
      if (duration <= 0.0) continue;
      const double tangent = std::tan(control.steering);
      const double speed = control.speed / (1.0 - tangent * kEncoderLeftOfMiddle / kWheelBase);
      pose =
          compose(pose, midpoint_motion(speed * duration, speed * tangent / kWheelBase * duration));
    }
    odometry.push_back({controls[i].time, pose});
  }
  return odometry;
}

std::vector<Recording::LandmarkObservation> read_scans(const fs::path& directory) {
  const Eigen::MatrixXd times = columns_of(directory, {"lasersampling.txt"});
  check_times(times, (directory / "lasersampling.txt").string());
  const NumberTable distances =
      read_number_table((directory / "ObservationDistance.txt").string(), 1);
  const NumberTable angles = read_number_table((directory / "ObservationAngle.txt").string(), 1);
  const auto scans = static_cast<std::size_t>(times.rows());
  for (const NumberTable* table : {&distances, &angles}) {
    if (table->rows.size() == scans) continue;
    throw Error(table->path + ": has " + std::to_string(table->rows.size()) +
                " rows and lasersampling.txt " + std::to_string(scans));
  }
  std::vector<Recording::LandmarkObservation> observations;
  for (std::size_t scan = 0; scan < scans; ++scan) {
    const std::vector<double>& distance = distances.rows[scan].numbers;
    const std::vector<double>& angle = angles.rows[scan].numbers;
    if (angle.size() != distance.size()) {
      angles.fail(scan, std::to_string(angle.size()) + " angles and " +
                            std::to_string(distance.size()) + " distances");
    }
    for (std::size_t i = 0; i < distance.size(); ++i) {
      if (distance[i] < 0.0) distances.fail(scan, "negative distance");
      if (!(distance[i] > 0.0)) continue;  // padding
      Recording::LandmarkObservation observation;
      observation.time = kSecondsPerUnit * times(static_cast<Eigen::Index>(scan), 0);
      observation.range = distance[i];
      observation.bearing = wrap_angle(angle[i] - 0.5 * kPi);
      observations.push_back(observation);
    }
  }
  return observations;
}

std::vector<Recording::Truth> read_gps(const fs::path& path) {
  const Eigen::MatrixXd table = columns_of(path.string(), {"timeGps", "Lo_m", "La_m"});
  check_times(table, path.string());
  std::vector<Recording::Truth> truth;
  for (Eigen::Index row = 0; row < table.rows(); ++row) {
    truth.push_back({kSecondsPerUnit * table(row, 0), {table(row, 1), table(row, 2), 0.0}});
  }
  return truth;
}

}  // namespace

Recording read_victoria_park(const std::string& directory) {
  require_directory(directory, "time.txt and the like");
  Recording recording;
  recording.odometry = integrate(read_controls(directory));
  recording.landmark_observations = read_scans(directory);
  const fs::path gps = fs::path(directory) / "aa3_gpsx.mat";
  if (fs::exists(gps)) recording.truth = read_gps(gps);
  recording.frames.push_back(
      {"sensor", kWheelBase + kLaserBeforeFront, kLaserLeftOfMiddle, 0.0, 0.0});
  // No document says that the GPS gives the path of this point, but in FastSLAM's map it fits best:
  // the distance to the GPS is smallest at (3.80, 0.50).
  recording.frames.push_back(
      {"ground_truth", kWheelBase + kLaserBeforeFront, kLaserLeftOfMiddle, 0.0, 0.0});
  recording.notes.push_back(
      "base_link is the middle of the rear axle; the laser is 3.78 m in front of it and 0.5 m to "
      "its "
      "left, and so is the point whose path the GPS gives (frame ground_truth)");
  return recording;
}

DatasetFormat victoria_park_format() {
  DatasetFormat format;
  format.name = "victoria_park";
  format.line = "text and MATLAB files of Sydney (Victoria Park), trees already found";
  format.help =
      "Makes a bag of a directory with time.txt, speed.txt and steering.txt (or\n"
      "aa3_dr.mat), lasersampling.txt, ObservationDistance.txt, ObservationAngle.txt\n"
      "and, if there is truth, aa3_gpsx.mat. base_link is the middle of the rear axle.";
  format.input = "DIRECTORY";
  format.examples = {"dataset_to_bag victoria_park victoria_park victoria_park.bag"};
  format.read = [](const std::string& path, const CommandLine&) {
    return read_victoria_park(path);
  };
  return format;
}

}  // namespace pf_resampling
