#include "tools/datasets/csv.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/given_particles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/table.hpp"
#include "tools/datasets/csv_table.hpp"
#include "tools/datasets/dataset_format.hpp"

namespace pf_resampling {

namespace {

/// An angle beyond a full turn is one in degrees.
constexpr double kFullTurn = 2.0 * kPi;

void note_ignored(const CsvTable& table, const std::string& file, Recording* recording) {
  for (const std::string& column : table.ignored()) {
    recording->notes.push_back(file + ": column '" + column + "' is not used");
  }
}

/// A table with times, in order of them.
CsvTable timed_table(const std::string& path, const std::vector<CsvColumn>& columns,
                     const std::string& file, Recording* recording) {
  CsvTable table(path, columns);
  if (table.sort_by_time()) recording->notes.push_back(file + ": rows put in order of time");
  return table;
}

/// Radians that go far from zero come in small steps; degrees begin anywhere, or jump by a turn.
void note_degrees(const CsvTable& table, const std::string& column, const std::string& file,
                  Recording* recording) {
  double largest = 0.0;
  double largest_step = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double angle = table.number(row, column);
    largest = std::max(largest, std::abs(angle));
    const double step = row == 0 ? angle : angle - table.number(row - 1, column);
    largest_step = std::max(largest_step, std::abs(step));
  }
  if (largest <= kFullTurn || largest_step <= kFullTurn) return;
  recording->notes.push_back(file + ": column '" + column + "' looks like degrees (it goes to " +
                             fixed(largest, 1) + "); angles have to be in radians");
}

/// Likewise turns, each for itself.
void note_turns_in_degrees(const CsvTable& table, const std::string& column,
                           const std::string& file, Recording* recording) {
  double largest = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    largest = std::max(largest, std::abs(table.number(row, column)));
  }
  if (largest <= kFullTurn) return;
  recording->notes.push_back(file + ": column '" + column + "' looks like degrees (it goes to " +
                             fixed(largest, 1) + "); angles have to be in radians");
}

/// The pose that the odometry comes to in a row.
void require_possible(const CsvTable& table, std::size_t row, const std::string& column,
                      const Pose2& pose) {
  if (std::abs(pose.x) <= kFarthestPosition && std::abs(pose.y) <= kFarthestPosition &&
      std::isfinite(pose.heading)) {
    return;
  }
  table.fail(row, column, "takes the robot beyond 1e9 m");
}

/// Appends a pose of the odometry; one at the same time replaces the last.
void append_odometry(double time, const Pose2& pose, std::vector<Recording::Odometry>* odometry) {
  if (!odometry->empty() && time <= odometry->back().time) odometry->pop_back();
  odometry->push_back({time, pose});
}

/// t,x,y,heading: poses in a frame of their own, taken to begin at the origin.
void read_odometry_poses(const CsvTable& table, Recording* recording) {
  Pose2 first;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Pose2 pose{table.number(row, "x"), table.number(row, "y"), table.number(row, "heading")};
    if (row == 0) first = pose;
    require_possible(table, row, "x", pose);
    append_odometry(table.time(row), relative(first, pose), &recording->odometry);
  }
}

/// t,distance,dheading: what was driven since the row above.
void read_odometry_steps(const CsvTable& table, Recording* recording) {
  std::vector<double> times;
  for (std::size_t row = 0; row < table.rows(); ++row) times.push_back(table.time(row));
  if (times.empty()) return;
  Pose2 pose;
  append_odometry(start_of_steps(times), pose, &recording->odometry);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    pose = compose(pose,
                   midpoint_motion(table.number(row, "distance"), table.number(row, "dheading")));
    require_possible(table, row, "distance", pose);
    append_odometry(times[row], pose, &recording->odometry);
  }
}

/// t,v,omega: velocities that hold until the next row.
void read_odometry_velocities(const CsvTable& table, Recording* recording) {
  Pose2 pose;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double time = table.time(row);
    table.number(row, "v");
    table.number(row, "omega");
    if (row > 0) {
      const double duration = time - table.time(row - 1);
      pose = compose(pose, midpoint_motion(table.number(row - 1, "v") * duration,
                                           table.number(row - 1, "omega") * duration));
      require_possible(table, row - 1, "v", pose);
    }
    append_odometry(time, pose, &recording->odometry);
  }
}

void read_odometry(const std::string& path, Recording* recording) {
  const std::vector<std::string> names = CsvTable::names_in(path);
  const auto names_all = [&names](const std::vector<std::string>& wanted) {
    return std::all_of(wanted.begin(), wanted.end(), [&](const std::string& name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    });
  };
  std::size_t rows = 0;
  if (names_all({"x", "y", "heading"})) {
    const CsvTable table =
        timed_table(path, {{"t"}, {"x"}, {"y"}, {"heading"}}, "odometry.csv", recording);
    read_odometry_poses(table, recording);
    note_degrees(table, "heading", "odometry.csv", recording);
    note_ignored(table, "odometry.csv", recording);
    rows = table.rows();
  } else if (names_all({"distance", "dheading"})) {
    const CsvTable table =
        timed_table(path, {{"t"}, {"distance"}, {"dheading"}}, "odometry.csv", recording);
    read_odometry_steps(table, recording);
    note_turns_in_degrees(table, "dheading", "odometry.csv", recording);
    note_ignored(table, "odometry.csv", recording);
    rows = table.rows() + (table.rows() > 0 ? 1 : 0);
  } else if (names_all({"v", "omega"})) {
    const CsvTable table = timed_table(path, {{"t"}, {"v"}, {"omega"}}, "odometry.csv", recording);
    read_odometry_velocities(table, recording);
    note_turns_in_degrees(table, "omega", "odometry.csv", recording);
    note_ignored(table, "odometry.csv", recording);
    rows = table.rows();
  } else {
    throw Error(path + ": columns " + joined(names, ",") +
                "; odometry has t,x,y,heading or t,distance,dheading or t,v,omega");
  }
  if (rows > recording->odometry.size()) {
    recording->notes.push_back(
        "odometry.csv: " + std::to_string(rows - recording->odometry.size()) +
        " rows merged with the row before, which has the same time");
  }
}

void read_ranges(const std::string& path, double metres_per_unit, Recording* recording) {
  const CsvTable table = timed_table(path, {{"t"}, {"beacon"}, {"range"}, {"variance", false}},
                                     "ranges.csv", recording);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Recording::Range range;
    range.time = table.time(row);
    range.beacon = table.id(row, "beacon", -1);
    range.range = metres_per_unit * table.non_negative(row, "range");
    if (table.has("variance")) {
      range.variance = metres_per_unit * metres_per_unit * table.non_negative(row, "variance");
    }
    recording->ranges.push_back(range);
  }
  note_ignored(table, "ranges.csv", recording);
}

void read_beacons(const std::string& path, Recording* recording) {
  const CsvTable table(path, {{"beacon"}, {"x"}, {"y"}, {"z", false}});
  std::set<std::int32_t> known;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Recording::Beacon beacon;
    beacon.id = table.id(row, "beacon", 0);
    beacon.x = table.number(row, "x");
    beacon.y = table.number(row, "y");
    if (table.has("z")) beacon.z = table.number(row, "z");
    if (!known.insert(beacon.id).second) table.fail(row, "beacon", "is there twice");
    recording->beacons.push_back(beacon);
  }
  note_ignored(table, "beacons.csv", recording);
}

void read_landmark_observations(const std::string& path, double metres_per_unit,
                                Recording* recording) {
  const CsvTable table = timed_table(path,
                                     {{"t"},
                                      {"id"},
                                      {"range"},
                                      {"bearing"},
                                      {"range_variance", false},
                                      {"bearing_variance", false}},
                                     "landmark_observations.csv", recording);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Recording::LandmarkObservation observation;
    observation.time = table.time(row);
    observation.id = table.id(row, "id", -1);
    observation.range = metres_per_unit * table.non_negative(row, "range");
    observation.bearing = table.number(row, "bearing");
    if (std::abs(observation.bearing) > kFullTurn) {
      table.fail(row, "bearing", "is more than a full turn; bearings are in radians");
    }
    if (table.has("range_variance")) {
      observation.range_variance =
          metres_per_unit * metres_per_unit * table.non_negative(row, "range_variance");
    }
    if (table.has("bearing_variance")) {
      observation.bearing_variance = table.non_negative(row, "bearing_variance");
    }
    recording->landmark_observations.push_back(observation);
  }
  note_ignored(table, "landmark_observations.csv", recording);
}

void read_landmarks(const std::string& path, Recording* recording) {
  const CsvTable table(path, {{"id"}, {"x"}, {"y"}});
  std::set<std::int32_t> known;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::int32_t id = table.id(row, "id", 0);
    if (!known.insert(id).second) table.fail(row, "id", "is there twice");
    recording->landmarks.push_back({id, table.number(row, "x"), table.number(row, "y")});
  }
  note_ignored(table, "landmarks.csv", recording);
}

void read_truth(const std::string& path, Recording* recording) {
  const CsvTable table =
      timed_table(path, {{"t"}, {"x"}, {"y"}, {"heading", false}}, "ground_truth.csv", recording);
  recording->truth_has_heading = table.has("heading");
  if (recording->truth_has_heading) note_degrees(table, "heading", "ground_truth.csv", recording);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Recording::Truth truth{table.time(row), {table.number(row, "x"), table.number(row, "y"), 0.0}};
    if (recording->truth_has_heading) truth.pose.heading = wrap_angle(table.number(row, "heading"));
    recording->truth.push_back(truth);
  }
  note_ignored(table, "ground_truth.csv", recording);
}

void read_frames(const std::string& path, Recording* recording) {
  const CsvTable table(path, {{"frame"}, {"x"}, {"y"}, {"z", false}, {"yaw", false}});
  std::set<std::string> known;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Recording::Frame frame;
    frame.name = table.text(row, "frame");
    if (frame.name != "antenna" && frame.name != "sensor") {
      table.fail(row, "frame", "is not known; frames are antenna and sensor");
    }
    if (!known.insert(frame.name).second) table.fail(row, "frame", "is there twice");
    frame.x = table.number(row, "x");
    frame.y = table.number(row, "y");
    if (table.has("z")) frame.z = table.number(row, "z");
    if (table.has("yaw")) frame.yaw = wrap_angle(table.number(row, "yaw"));
    recording->frames.push_back(frame);
  }
  note_ignored(table, "frames.csv", recording);
}

}  // namespace

Recording read_csv(const std::string& directory, double metres_per_unit) {
  require_directory(directory, "the CSV files");
  Recording recording;
  bool any = false;
  const auto if_there = [&](const std::string& file, const auto& read) {
    const std::string path = (std::filesystem::path(directory) / file).string();
    if (!std::filesystem::exists(path)) return;
    read(path);
    any = true;
  };
  if_there("odometry.csv", [&](const auto& path) { read_odometry(path, &recording); });
  if_there("ranges.csv", [&](const auto& path) { read_ranges(path, metres_per_unit, &recording); });
  if_there("beacons.csv", [&](const auto& path) { read_beacons(path, &recording); });
  if_there("landmark_observations.csv", [&](const auto& path) {
    read_landmark_observations(path, metres_per_unit, &recording);
  });
  if_there("landmarks.csv", [&](const auto& path) { read_landmarks(path, &recording); });
  if_there("ground_truth.csv", [&](const auto& path) { read_truth(path, &recording); });
  if_there("frames.csv", [&](const auto& path) { read_frames(path, &recording); });
  if (!any) {
    throw Error(directory +
                ": has none of odometry.csv, ranges.csv, beacons.csv, landmark_observations.csv, "
                "landmarks.csv, ground_truth.csv, frames.csv");
  }
  const auto ratio = median_range_ratio(recording);
  if (ratio && looks_like_feet(*ratio)) {
    recording.notes.push_back("ranges are " + fixed(*ratio, 2) +
                              " times the true distances: if they are in feet, give "
                              "--range-unit ft");
  }
  return recording;
}

DatasetFormat csv_format() {
  DatasetFormat format;
  format.name = "csv";
  format.line = "a directory with CSV files of your own";
  format.help =
      "Makes a bag of a directory with any of\n"
      "  odometry.csv               t,x,y,heading or t,distance,dheading or t,v,omega\n"
      "  ranges.csv                 t,beacon,range[,variance]\n"
      "  beacons.csv                beacon,x,y[,z]\n"
      "  landmark_observations.csv  t,id,range,bearing[,range_variance,bearing_variance]\n"
      "  landmarks.csv              id,x,y\n"
      "  ground_truth.csv           t,x,y[,heading]\n"
      "  frames.csv                 frame,x,y[,z][,yaw]: where antenna or sensor sits on the "
      "robot\n"
      "The first line names the columns, in any order; # begins a comment. Seconds, metres and\n"
      "radians; id -1: unknown; variance 0: unknown. distance and dheading are since the row\n"
      "before; v and omega hold until the next row.";
  format.input = "DIRECTORY";
  format.examples = {"dataset_to_bag csv my_recording my_recording.bag"};
  format.add_options = [](CommandLine* line) {
    line->option<std::string>("range-unit", "m|ft", "m", "unit of the measured ranges");
  };
  format.read = [](const std::string& path, const CommandLine& line) {
    return read_csv(path, metres_per(line.text("range-unit")));
  };
  return format;
}

}  // namespace pf_resampling
