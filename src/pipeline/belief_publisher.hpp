#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"
#include "src/pictures/path_recorder.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

namespace pf_resampling {

/// How much of what is for looking at is given out.
struct OutputOptions {
  double cloud_period = 0.5;   ///< s between particle clouds; 0: with all odometry messages
  double marker_period = 0.5;  ///< s between markers
  double path_period = 2.0;    ///< s between paths
  double path_spacing = 0.5;   ///< m between poses of the path
  static constexpr double path_max_sigma =
      3.0;                          ///< m; less certain positions are not put on the path
  int path_length = 10000;          ///< poses; a path that gets longer is thinned
  double diagnostics_period = 1.0;  ///< s between diagnostics
};

/// Adds them as parameters, in the group "output".
void add_parameters(OutputOptions* output, ParameterList* list);

/// Whether a multiple of the period (s) has gone by since *last, which is then set to `stamp`. So
/// what has the same period is given out at the same times: particles, and the arrow of their pose.
bool is_due(double period, ros::Time stamp, ros::Time* last);

/// Standard deviation of the position, m.
double position_sigma(const PoseEstimate& estimate);

/// And of the heading, rad.
double heading_sigma(const PoseEstimate& estimate);

/// Gives out a filter's belief: pose, map -> odom, path and particle clouds. A pose that is not
/// finite, by which somebody would drive, is held back and counted.
class BeliefPublisher {
 public:
  /// The sinks have to outlive it.
  BeliefPublisher(const FrameNames& frames, const OutputOptions& options,
                  const PipelineSinks* sinks)
      : frames_(frames),
        options_(options),
        sinks_(sinks),
        path_(options.path_spacing, options.path_length) {}

  /// `base`: the robot in the odometry frame at `stamp`.
  void publish_pose(ros::Time stamp, const PoseEstimate& belief, const Pose2& base);
  /// The particles, each moved by `motion`, in its own frame; when they are due.
  void publish_clouds(ros::Time stamp, const ParticleView& particles, const Pose2& motion);
  bool wants_clouds() const { return sinks_->particlecloud || sinks_->particles; }
  /// The path driven as it was believed at the time, when it is due: every path_period, and less
  /// often when it has become long, since all of it is given out each time.
  void publish_path(ros::Time stamp);
  /// Likewise a path that is known otherwise: `poses` at `stamps`, as many. Poses nearer to the one
  /// before than path_spacing are left out.
  void publish_path(ros::Time stamp, const std::vector<ros::Time>& stamps,
                    const std::function<std::vector<Pose2>()>& poses);
  /// The next path is due, whenever the last one was.
  void hurry_path() { last_path_ = ros::Time(); }

  void clear_path() { path_.clear(); }
  std::uint64_t held_back() const { return held_back_; }

 private:
  bool is_path_due(ros::Time stamp);
  void give_out(const nav_msgs::Path& path);

  FrameNames frames_;
  OutputOptions options_;
  const PipelineSinks* sinks_;
  PathRecorder path_;
  std::uint64_t held_back_ = 0;
  std::size_t path_size_ = 0;  // of the last path that was given out
  ros::Time last_cloud_, last_path_;
};

}  // namespace pf_resampling
