#include "tools/common/plot_paths.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// The script beside this program, as installed, or in the source tree the program was built from.
std::string script_path() {
  const fs::path beside = fs::read_symlink("/proc/self/exe").parent_path() / "plot_paths.py";
  const fs::path source = fs::path(PF_RESAMPLING_SCRIPTS) / "plot_paths.py";
  for (const fs::path& path : {source, beside}) {
    if (fs::exists(path)) return path.string();
  }
  throw Error("plot_paths.py is neither at " + beside.string() + " nor at " + source.string() +
              ": install pf_resampling again");
}

/// More points than this cannot be told apart in a picture.
template <typename Stamped>
std::size_t stride_of(const std::vector<Stamped>& list) {
  constexpr std::size_t kMostPoints = 20000;
  return 1 + list.size() / kMostPoints;
}

json path_json(const std::vector<TruePose>& path) {
  json x = json::array(), y = json::array();
  const double max_gap = usual_max_gap(path);
  for (std::size_t i = 0; i < path.size(); i += stride_of(path)) {
    // A reference with gaps is a line with gaps.
    if (i > 0 && path[i].time - path[i - 1].time > max_gap) {
      x.push_back(nullptr);
      y.push_back(nullptr);
    }
    x.push_back(path[i].x);
    y.push_back(path[i].y);
  }
  return {{"x", x}, {"y", y}};
}

/// With times from `start`.
json path_json(const std::vector<EstimatedPose>& path, double start) {
  json x = json::array(), y = json::array(), time = json::array();
  for (std::size_t i = 0; i < path.size(); i += stride_of(path)) {
    const EstimatedPose& pose = path[i];
    x.push_back(pose.pose.x);
    y.push_back(pose.pose.y);
    time.push_back(pose.time - start);
  }
  return {{"x", x}, {"y", y}, {"time", time}};
}

json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? json(*value) : json(nullptr);
}

json errors_json(const PathErrors& errors, double start) {
  json result = {{"lost_error", errors.lost_error},
                 {"mean", errors.cartesian.mean},
                 {"coverage95", number_or_null(errors.coverage95)},
                 {"converged_after", number_or_null(errors.converged_after)},
                 {"lost", errors.lost}};
  const std::vector<PathErrorSample>& samples = errors.samples;
  for (std::size_t i = 0; i < samples.size(); i += stride_of(samples)) {
    const PathErrorSample& sample = samples[i];
    result["time"].push_back(sample.time - start);
    result["clipped"].push_back(sample.is_clipped);
    result["cartesian"].push_back(sample.cartesian);
    result["cross_track"].push_back(number_or_null(sample.cross_track));
    result["along_track"].push_back(number_or_null(sample.along_track));
    result["heading"].push_back(number_or_null(sample.heading));
    result["position_sigma"].push_back(sample.position_sigma);
    result["cross_track_sigma"].push_back(sample.cross_track_sigma);
    result["along_track_sigma"].push_back(sample.along_track_sigma);
    result["heading_sigma"].push_back(sample.heading_sigma);
  }
  return result;
}

json map_json(const std::vector<PointLandmark>& map) {
  json result = json::array();
  for (const PointLandmark& landmark : map) {
    const Eigen::Matrix2d& covariance = landmark.covariance;
    result.push_back({{"id", landmark.id},
                      {"x", landmark.position.x()},
                      {"y", landmark.position.y()},
                      {"covariance", {covariance(0, 0), covariance(0, 1), covariance(1, 1)}}});
  }
  return result;
}

json map_errors_json(const MapErrors& map) {
  json matches = json::array();
  for (const LandmarkMatch& match : map.matches) {
    matches.push_back({match.estimated, match.truth});
  }
  return {{"rms", number_or_null(map.rms)},
          {"rms_aligned", number_or_null(map.rms_aligned)},
          {"matches", matches}};
}

double start_of(const PathPlot& plot) {
  if (!plot.truth.empty()) return plot.truth.front().time;
  return plot.estimate.empty() ? 0.0 : plot.estimate.front().time;
}

json plot_json(const PathPlot& plot) {
  const double start = start_of(plot);
  const Pose2 alignment = plot.alignment.value_or(Pose2{});
  // The map by its own alignment, where there is one: a path of poses as they were estimated at the
  // time need not lie where the map has come to lie since.
  const bool has_own = plot.alignment && plot.map && plot.map->rms_aligned;
  const Pose2 map_alignment = has_own ? plot.map->alignment : alignment;
  json beacons = json::array();
  for (const Beacon& beacon : plot.beacons) {
    beacons.push_back({{"id", beacon.id}, {"x", beacon.position.x()}, {"y", beacon.position.y()}});
  }
  json result = {{"title", plot.title},
                 {"truth", path_json(plot.truth)},
                 {"is_slam", plot.is_slam},
                 {"is_aligned", plot.alignment.has_value()},
                 {"estimate", path_json(moved(plot.estimate, alignment), start)},
                 {"dead_reckoning", path_json(plot.dead_reckoning, start)},
                 {"beacons", beacons},
                 {"landmarks", map_json(moved(plot.landmarks, map_alignment))},
                 {"true_landmarks", map_json(plot.true_landmarks)}};
  if (plot.errors) result["errors"] = errors_json(*plot.errors, start);
  if (plot.map) result["map"] = map_errors_json(*plot.map);
  if (plot.aligned_errors) {
    result["aligned_errors"] = errors_json(*plot.aligned_errors, start);
  }
  if (plot.dead_reckoning_errors) {
    result["dead_reckoning_errors"] = errors_json(*plot.dead_reckoning_errors, start);
  }
  return result;
}

/// By which a child can open it.
std::string path_of(int descriptor) {
  return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(descriptor);
}

/// Runs a command; its last line, empty if it went well.
std::string fault_of(const std::string& command) {
  std::FILE* said = popen(command.c_str(), "r");
  if (said == nullptr) return "the system starts no more processes";
  std::string last = "ended without a word";
  char line[1000];
  while (std::fgets(line, sizeof(line), said) != nullptr) last = line;
  const bool went_well = pclose(said) == 0;
  return went_well ? "" : last.substr(0, last.find('\n'));
}

}  // namespace

void check_plot_file(const std::string& path) {
  const std::string ending = fs::path(path).extension().string();
  if (ending != ".png" && ending != ".pdf" && ending != ".svg") {
    throw Error(path + ": a picture ends in .png, .pdf or .svg");
  }
}

void plot_paths(const PathPlot& plot, const std::string& path) {
  check_plot_file(path);
  const std::string script = script_path();
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> data(std::tmpfile(), std::fclose);
  if (!data) throw Error(path + ": not drawn: there is no room for its data");
  NewFile picture(path, path + ":");
  // A title may have letters of any encoding.
  const std::string text = plot_json(plot).dump(-1, ' ', false, json::error_handler_t::replace);
  std::fputs(text.c_str(), data.get());
  std::fflush(data.get());
  const std::string format = fs::path(path).extension().string().substr(1);
  const std::string fault =
      fault_of("exec /usr/bin/python3 '" + script + "' " + path_of(fileno(data.get())) + " " +
               format + " 2>&1 > " + path_of(picture.descriptor()));
  if (!fault.empty()) throw Error(path + ": not drawn: " + fault);
  picture.finish();
}

}  // namespace pf_resampling
