#include "tools/datasets/plaza.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "tools/common/table.hpp"
#include "tools/datasets/dataset_format.hpp"
#include "tools/datasets/mat_file.hpp"

namespace pf_resampling {

namespace {

constexpr double kLeastStep = 0.02;  // m, in which the direction of travel can be seen
constexpr std::size_t kLeastSteps = 10;
/// Truth may begin this many intervals of the odometry before its first step ends.
constexpr double kStartWithin = 5.0;

/// Rows whose first `columns` are finite, in order of time.
Eigen::MatrixXd usable_rows(const Eigen::MatrixXd& matrix, Eigen::Index columns,
                            const std::string& name, std::vector<std::string>* notes) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    if (matrix.row(row).head(columns).allFinite()) rows.push_back(row);
  }
  const auto dropped = matrix.rows() - static_cast<Eigen::Index>(rows.size());
  if (dropped > 0) {
    notes->push_back(name + ": " + std::to_string(dropped) + " rows that are not finite dropped");
  }
  const auto earlier = [&](Eigen::Index a, Eigen::Index b) { return matrix(a, 0) < matrix(b, 0); };
  if (!std::is_sorted(rows.begin(), rows.end(), earlier)) {
    std::stable_sort(rows.begin(), rows.end(), earlier);
    notes->push_back(name + ": rows were not in order of time, sorted");
  }
  Eigen::MatrixXd usable(static_cast<Eigen::Index>(rows.size()), matrix.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    usable.row(static_cast<Eigen::Index>(i)) = matrix.row(rows[i]);
  }
  return usable;
}

std::int32_t id_of(double value, const std::string& place) {
  if (std::abs(value - std::nearbyint(value)) > 0.0 || std::abs(value) > 1e9) {
    throw Error(place + ": " + fixed(value, 3) + " is not the number of a beacon or antenna");
  }
  return static_cast<std::int32_t>(value);
}

void read_truth(const MatFile& file, Recording* recording) {
  const auto matrix = file.matrix("GT", 3);
  if (!matrix) return;
  recording->truth_has_heading = matrix->cols() >= 4;
  const Eigen::Index columns = recording->truth_has_heading ? 4 : 3;
  const Eigen::MatrixXd rows = usable_rows(*matrix, columns, "GT", &recording->notes);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    Recording::Truth truth{rows(i, 0), {rows(i, 1), rows(i, 2), 0.0}};
    if (recording->truth_has_heading) truth.pose.heading = wrap_angle(rows(i, 3));
    recording->truth.push_back(truth);
  }
  if (!recording->truth_has_heading) return;

  const auto offset = mean_travel_minus_heading(recording->truth);
  if (!offset) return;
  const std::string seen = "GT: the direction of travel differs by " + fixed(*offset, 3) +
                           " rad from the heading on average";
  if (std::abs(*offset) > 0.5 * kPi) {
    for (auto& truth : recording->truth) truth.pose.heading = wrap_angle(truth.pose.heading + kPi);
    recording->notes.push_back(seen + "; heading turned by pi");
  } else if (std::abs(*offset) > 0.1) {
    recording->notes.push_back(seen + "; heading left as it is");
  }
}

void integrate_steps(const Eigen::MatrixXd& steps, Recording* recording) {
  if (steps.rows() == 0) return;
  std::vector<double> times(static_cast<std::size_t>(steps.rows()));
  for (Eigen::Index i = 0; i < steps.rows(); ++i) times[static_cast<std::size_t>(i)] = steps(i, 0);
  // The truth knows when the drive began, if it began just before the first step ended.
  double start = start_of_steps(times);
  const double earliest = times.front() - kStartWithin * (times.front() - start);
  if (!recording->truth.empty() && recording->truth.front().time < times.front() &&
      recording->truth.front().time >= earliest) {
    start = recording->truth.front().time;
  }
  Pose2 pose;
  recording->odometry.push_back({start, pose});
  for (Eigen::Index i = 0; i < steps.rows(); ++i) {
    pose = compose(pose, midpoint_motion(steps(i, 1), steps(i, 2)));
    if (steps(i, 0) <= recording->odometry.back().time) recording->odometry.pop_back();
    recording->odometry.push_back({steps(i, 0), pose});
  }
}

void read_odometry(const MatFile& file, const std::string& path, Recording* recording) {
  if (const auto steps = file.matrix("DR", 3)) {
    integrate_steps(usable_rows(*steps, 3, "DR", &recording->notes), recording);
    return;
  }
  const auto poses = file.matrix("DRp", 4);
  if (!poses) {
    throw Error(path + ": has no variable DR [t distance dheading] nor DRp; it has " +
                file.names());
  }
  const Eigen::MatrixXd rows = usable_rows(*poses, 4, "DRp", &recording->notes);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Pose2 first{rows(0, 1), rows(0, 2), rows(0, 3)};
    const Pose2 pose = relative(first, {rows(i, 1), rows(i, 2), rows(i, 3)});
    if (i > 0 && rows(i, 0) <= rows(i - 1, 0)) recording->odometry.pop_back();
    recording->odometry.push_back({rows(i, 0), pose});
  }
  recording->notes.push_back("no variable DR: odometry is DRp");
}

void read_beacons(const MatFile& file, const std::string& path, Recording* recording) {
  const auto beacons = file.matrix("TL", 3);
  if (!beacons) {
    recording->notes.push_back("no variable TL: the places of the beacons are not known");
    return;
  }
  const Eigen::Index columns = beacons->cols() >= 4 ? 4 : 3;
  for (Eigen::Index i = 0; i < beacons->rows(); ++i) {
    if (!beacons->row(i).head(columns).allFinite()) {
      throw Error(path + ": variable TL: row " + std::to_string(i + 1) + " is not finite");
    }
    Recording::Beacon beacon;
    beacon.id = id_of((*beacons)(i, 0), path + ": variable TL");
    beacon.x = (*beacons)(i, 1);
    beacon.y = (*beacons)(i, 2);
    if (columns == 4) beacon.z = (*beacons)(i, 3);
    recording->beacons.push_back(beacon);
  }
}

void read_ranges(const MatFile& file, const std::string& path, Recording* recording) {
  const auto matrix = file.matrix("TD", 4);
  if (!matrix) {
    throw Error(path + ": has no variable TD [t antenna beacon range]; it has " + file.names());
  }
  const Eigen::MatrixXd rows = usable_rows(*matrix, 4, "TD", &recording->notes);
  std::set<std::int32_t> antennas;
  std::size_t negative = 0;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (rows(i, 3) < 0.0) {
      ++negative;
      continue;
    }
    const std::int32_t antenna = id_of(rows(i, 1), path + ": variable TD");
    antennas.insert(antenna);
    recording->ranges.push_back({rows(i, 0), id_of(rows(i, 2), path + ": variable TD"), rows(i, 3),
                                 0.0, "antenna_" + std::to_string(antenna)});
  }
  if (negative > 0) {
    recording->notes.push_back("TD: " + std::to_string(negative) + " negative ranges dropped");
  }
  if (antennas.size() == 1) {
    for (auto& range : recording->ranges) range.frame = "antenna";
  }
}

/// Brings the ranges to metres; which unit they are in is seen from the true distances unless
/// given.
void scale_ranges(const std::optional<double>& metres_per_unit, Recording* recording) {
  const auto ratio = median_range_ratio(*recording);
  double scale = 1.0;
  if (metres_per_unit) {
    scale = *metres_per_unit;
    if (ratio && looks_like_feet(*ratio * scale)) {
      recording->notes.push_back("ranges are " + fixed(*ratio * scale, 2) +
                                 " times the true distances: are they in feet?");
    }
  } else if (ratio && looks_like_feet(*ratio)) {
    scale = kMetresPerFoot;
    recording->notes.push_back("TD: ranges are " + fixed(*ratio, 2) +
                               " times the true distances: taken as feet");
  } else if (!ratio) {
    recording->notes.push_back(
        "TD: the unit of the ranges is not known: metres are assumed (--range-unit ft for feet)");
  }
  for (auto& range : recording->ranges) range.range *= scale;
}

/// Places the antennas that the ranges name, as far as the options know them.
void place_antennas(const std::map<int, Recording::Frame>& antennas, Recording* recording) {
  std::set<std::string> frames;
  for (const auto& range : recording->ranges) frames.insert(range.frame);
  const auto all = antennas.find(-1);
  for (const std::string& name : frames) {
    auto found = all;
    for (auto antenna = antennas.begin(); antenna != antennas.end(); ++antenna) {
      if (name == "antenna_" + std::to_string(antenna->first)) found = antenna;
    }
    if (found == antennas.end() && name == "antenna" && antennas.size() == 1) {
      found = antennas.begin();
    }
    if (found == antennas.end()) continue;
    Recording::Frame frame = found->second;
    frame.name = name;
    recording->frames.push_back(frame);
  }
}

/// "x,y,z" is for all antennas, "N:x,y,z" for the one of that number in the file.
std::map<int, Recording::Frame> antennas_from(const std::vector<std::string>& places) {
  std::map<int, Recording::Frame> antennas;
  for (const std::string& place : places) {
    const std::size_t colon = place.find(':');
    int number = -1;
    if (colon != std::string::npos) {
      number = static_cast<int>(parse_numbers("antenna", place.substr(0, colon), 1)[0]);
    }
    const std::string where = colon == std::string::npos ? place : place.substr(colon + 1);
    const std::vector<double> xyz = parse_numbers("antenna", where, 3);
    antennas[number] = {"antenna", xyz[0], xyz[1], xyz[2], 0.0};
  }
  return antennas;
}

}  // namespace

std::optional<double> mean_travel_minus_heading(const std::vector<Recording::Truth>& truth) {
  double cosine = 0.0;
  double sine = 0.0;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double dx = truth[i].pose.x - truth[i - 1].pose.x;
    const double dy = truth[i].pose.y - truth[i - 1].pose.y;
    if (std::hypot(dx, dy) < kLeastStep) continue;
    const double turn = wrap_angle(truth[i].pose.heading - truth[i - 1].pose.heading);
    const double angle = std::atan2(dy, dx) - (truth[i - 1].pose.heading + 0.5 * turn);
    cosine += std::cos(angle);
    sine += std::sin(angle);
    ++steps;
  }
  if (steps < kLeastSteps) return std::nullopt;
  return std::atan2(sine, cosine);
}

Recording read_plaza(const std::string& path, const PlazaOptions& options) {
  const MatFile file(path);
  Recording recording;
  read_truth(file, &recording);
  read_odometry(file, path, &recording);
  read_beacons(file, path, &recording);
  read_ranges(file, path, &recording);
  scale_ranges(options.metres_per_unit, &recording);
  place_antennas(options.antennas, &recording);
  return recording;
}

DatasetFormat plaza_format() {
  DatasetFormat format;
  format.name = "plaza";
  format.line = "MATLAB files of the CMU range-only data sets (Plaza, Gesling, Kurth)";
  format.help =
      "Makes a bag of a MATLAB file with the variables DR [t distance dheading], TD\n"
      "[t antenna beacon range], TL [beacon x y] and GT [t x y heading].";
  format.input = "FILE.mat";
  format.examples = {
      "dataset_to_bag plaza Plaza2.mat plaza2.bag",
      "dataset_to_bag plaza kurth.mat kurth.bag --range-unit ft --antenna 0.2,0,0.5"};
  format.add_options = [](CommandLine* line) {
    line->option<std::string>("range-unit", "m|ft",
                              "unit of the ranges; by default found from the true distances");
    line->repeatable_option(
        "antenna", "[N:]x,y,z",
        "where the antenna (with number N) sits on the robot, in m; may be repeated");
  };
  format.read = [](const std::string& path, const CommandLine& line) {
    PlazaOptions options;
    if (line.has("range-unit")) options.metres_per_unit = metres_per(line.text("range-unit"));
    if (line.has("antenna")) {
      options.antennas = antennas_from(line.get<std::vector<std::string>>("antenna"));
    }
    return read_plaza(path, options);
  };
  return format;
}

}  // namespace pf_resampling
