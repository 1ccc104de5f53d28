#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "fastslam_node/fastslam_pipeline.hpp"
#include "test/fastslam_drive.hpp"
#include "test/pipeline_rig.hpp"

namespace pf_resampling {

struct FastSlamOutputs : Outputs {
  std::vector<LandmarkMap> maps;
  std::vector<ros::Time> updates;
};

inline FastSlamSinks sinks_into(FastSlamOutputs* out) {
  FastSlamSinks sinks;
  connect(out, &sinks);
  sinks.landmark_map = [out](const auto& message) { out->maps.push_back(message); };
  sinks.updated = [out](ros::Time stamp, FastSlam*) { out->updates.push_back(stamp); };
  return sinks;
}

struct FastSlamRig
    : PipelineRig<FastSlamPipeline, FastSlamDrive, FastSlamOutputs, FastSlamMessage> {
  using PipelineRig::PipelineRig;
  static constexpr const char* kTopic = "landmarks";
  const FastSlamParticles& particles() const { return pipeline.filter().particles(); }
  /// m; of the worst landmark of the last map, which has to be of the drive.
  double map_error() const {
    double worst = 0.0;
    for (const Landmark& landmark : out.maps.back().landmarks) {
      const Eigen::Vector2d truth =
          FastSlamDrive::landmarks().at(static_cast<std::size_t>(landmark.id));
      worst = std::max(worst,
                       (Eigen::Vector2d(landmark.position.x, landmark.position.y) - truth).norm());
    }
    return worst;
  }
};

/// Whether two filters' populations agree to the bit.
inline bool same_particles(const FastSlamParticles& a, const FastSlamParticles& b) {
  return a.size() == b.size() && (a.x == b.x).all() && (a.y == b.y).all() &&
         (a.heading == b.heading).all() && (a.log_weight == b.log_weight).all() &&
         (a.ancestor == b.ancestor).all();
}

inline bool all_finite(const FastSlamOutputs& out) {
  bool finite = all_finite(static_cast<const Outputs&>(out));
  for (const LandmarkMap& map : out.maps) finite = finite && is_finite(map);
  return finite;
}

}  // namespace pf_resampling
