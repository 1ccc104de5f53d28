#include "tools/worlds/map_file.hpp"

#include <cmath>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

using Points = std::vector<Eigen::Vector2d>;

constexpr double kSimulatorRange = 30.0;  // m, MAX_RANGE of its configfile.m

[[noreturn]] void fail_at(const std::string& path, std::size_t line, const std::string& what) {
  throw Error(path + ":" + std::to_string(line) + ": " + what);
}

/// The text form: "lm 2 N" and N lines of "x y"; # begins a comment.
void read_text(const std::string& text, const std::string& path, Points* landmarks,
               Points* waypoints) {
  std::istringstream lines(text);
  std::string line;
  Points* points = nullptr;
  std::size_t missing = 0;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    const auto fail = [&](const std::string& what) { fail_at(path, number, what); };
    std::istringstream words(line.substr(0, line.find('#')));
    std::string first;
    if (!(words >> first)) continue;
    if (missing == 0) {
      if (first != "lm" && first != "wp") {
        fail("'" + first + "' where lm or wp is expected; is this a map of the simulator?");
      }
      points = first == "lm" ? landmarks : waypoints;
      int columns = 0;
      int rows = 0;
      if (!(words >> columns >> rows) || columns != 2 || rows < 1) {
        fail(first + " has to be followed by 2 and the number of points");
      }
      missing = static_cast<std::size_t>(rows);
      continue;
    }
    std::istringstream numbers(line);
    Eigen::Vector2d point;
    if (!(numbers >> point.x() >> point.y()) || !point.allFinite()) fail("not a point: " + line);
    points->push_back(point);
    --missing;
  }
  if (missing > 0) throw Error(path + ": ends " + std::to_string(missing) + " points early");
}

}  // namespace

World load_map(const std::string& path) {
  World world = load_world("indoor_two_loops");
  world.name = path;
  world.landmarks.clear();
  world.waypoints.clear();
  world.closures.clear();
  world.landmark_sensor.range_max = kSimulatorRange;
  const std::string text = read_file(path);
  if (text.compare(0, 6, "MATLAB") == 0) {
    throw Error(
        path +
        ": is a MATLAB file; write it as text: lm 2 N, then N lines x y, and the same for wp");
  }
  read_text(text, path, &world.landmarks, &world.waypoints);
  if (world.waypoints.size() < 2) throw Error(path + ": has fewer than two waypoints (wp)");
  const Eigen::Vector2d start = world.waypoints[0];
  const Eigen::Vector2d ahead = world.waypoints[1] - start;
  world.start = {start.x(), start.y(), std::atan2(ahead.y(), ahead.x())};
  return world;
}

}  // namespace pf_resampling
