#include "tools/common/recording.hpp"

#include <cmath>
#include <set>

#include "tools/common/text.hpp"

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

double path_length(const std::vector<StampedPose>& odometry) {
  double length = 0.0;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    length += std::hypot(odometry[i].pose.x - odometry[i - 1].pose.x,
                         odometry[i].pose.y - odometry[i - 1].pose.y);
  }
  return length;
}

}  // namespace

Recording read_recording(const rosbag::Bag& bag, const std::string& odometry,
                         const std::string& ranges, const std::string& landmarks,
                         const FrameNames& frames) {
  Recording recording;
  recording.odometry = read_odometry(bag, odometry, frames).poses;
  recording.odometry_noise = read_odometry_noise(bag, odometry);
  recording.ranges = read_ranges(bag, ranges);
  recording.scans = read_landmark_scans(bag, landmarks);
  recording.frames = read_frames_on_robot(bag, frames.base);
  return recording;
}

Pose2 to_pose2(const Eigen::Isometry3d& frame) {
  const Eigen::Matrix3d turn = frame.linear();
  return {frame.translation().x(), frame.translation().y(), std::atan2(turn(1, 0), turn(0, 0))};
}

std::string report(const Recording& recording) {
  std::string text;
  const auto line = [&text](const std::string& name, const std::string& what) {
    text += "  " + name + std::string(23 - name.size(), ' ') + what + "\n";
  };
  std::set<int> heard;
  for (const StampedRange& range : recording.ranges) heard.insert(range.beacon);
  std::size_t seen = 0;
  for (const StampedScan& scan : recording.scans) seen += scan.landmarks.size();

  line("odometry",
       describe(recording.odometry) + ", " + fixed(path_length(recording.odometry), 1) + " m");
  line("ranges", describe(recording.ranges) +
                     (heard.empty() ? "" : ", to " + std::to_string(heard.size()) + " beacons"));
  line("beacons", recording.beacons.empty() ? "none" : std::to_string(recording.beacons.size()));
  if (!recording.scans.empty()) {
    line("landmark observations",
         std::to_string(seen) + ", in scans: " + describe(recording.scans));
  }
  if (!recording.landmarks.empty()) line("landmarks", std::to_string(recording.landmarks.size()));
  line("ground truth", describe(recording.truth));
  return text;
}

}  // namespace pf_resampling
