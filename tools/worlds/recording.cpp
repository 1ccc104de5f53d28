#include "tools/worlds/recording.hpp"

#include <cmath>
#include <set>

#include "tools/common/table.hpp"

namespace pf_resampling {

namespace {

/// Count, first and last time, rate of one list, as words.
template <typename Stamped>
std::string describe(const std::vector<Stamped>& list) {
  if (list.empty()) return "none";
  const double duration = list.back().time - list.front().time;
  std::string text = std::to_string(list.size());
  if (duration > 0.0) {
    text += " in " + fixed(duration, 1) + " s (" +
            fixed(static_cast<double>(list.size() - 1) / duration, 2) + " Hz)";
  }
  return text;
}

double path_length(const std::vector<Recording::Odometry>& odometry) {
  double length = 0.0;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    length += std::hypot(odometry[i].pose.x - odometry[i - 1].pose.x,
                         odometry[i].pose.y - odometry[i - 1].pose.y);
  }
  return length;
}

}  // namespace

std::string report(const Recording& recording) {
  std::string text;
  const auto line = [&text](const std::string& name, const std::string& what) {
    text += "  " + name + std::string(23 - name.size(), ' ') + what + "\n";
  };
  std::set<std::int32_t> heard;
  for (const auto& range : recording.ranges) heard.insert(range.beacon);
  std::set<double> scans;
  for (const auto& observation : recording.landmark_observations) scans.insert(observation.time);

  line("odometry",
       describe(recording.odometry) +
           (recording.odometry.empty() ? ""
                                       : ", " + fixed(path_length(recording.odometry), 1) + " m"));
  line("ranges", describe(recording.ranges) +
                     (heard.empty() ? "" : ", to " + std::to_string(heard.size()) + " beacons"));
  line("beacons", recording.beacons.empty() ? "none" : std::to_string(recording.beacons.size()));
  if (!recording.landmark_observations.empty()) {
    line("landmark observations", describe(recording.landmark_observations) + ", in " +
                                      std::to_string(scans.size()) + " scans");
  }
  if (!recording.landmarks.empty()) {
    line("landmarks", std::to_string(recording.landmarks.size()));
  }
  line("ground truth",
       describe(recording.truth) + (recording.truth.empty() ? "" : ", with heading"));
  for (const std::string& note : recording.notes) text += "  note: " + note + "\n";
  return text;
}

}  // namespace pf_resampling
