// How FastSlamPipeline saves its map, and goes on from one.
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// A saved filter is at its last scan; `motion` has brought the robot on since then. Each particle
// draws its own, as it would with the next scan.
void move(const OdometryIncrement& motion, std::uint64_t seed, SavedMap* map) {
  map->pose = moved_by(map->pose, motion);
  map->pose.covariance = 0.5 * (map->pose.covariance + map->pose.covariance.transpose()).eval();
  const Eigen::Matrix3d root = lower_root(motion.covariance);
  const RandomStream normals(seed, RandomPurpose::saving, map->step);
  FastSlamParticles& particles = map->particles;
  for (Eigen::Index i = 0; i < particles.size(); ++i) {
    const std::uint64_t first = 4 * static_cast<std::uint64_t>(i);
    const Eigen::Vector3d offset =
        root * Eigen::Vector3d(normals.normal(first), normals.normal(first + 1),
                               normals.normal(first + 2));
    const Pose2 pose = compose(
        {particles.x[i], particles.y[i], particles.heading[i]},
        {motion.mean.x + offset[0], motion.mean.y + offset[1], motion.mean.heading + offset[2]});
    particles.x[i] = pose.x;
    particles.y[i] = pose.y;
    particles.heading[i] = pose.heading;
  }
}

}  // namespace

std::string FastSlamPipeline::save_map(const std::string& path) {
  SavedMap map = saved_map(filter_.get(), options_.map_file_particles);
  if (!odometry_.empty() && odometry_.used() != odometry_.newest()) {
    move(odometry_.since(), static_cast<std::uint64_t>(options_.seed), &map);
  }
  if (map.landmarks.empty()) {
    throw Error("the map has no landmarks yet; nothing is written to " + path +
                "; save it once landmarks have been seen");
  }
  map.frame = options_.frames.map;
  write_map_file(path, map);
  return std::to_string(map.landmarks.size()) + " landmarks and " +
         std::to_string(map.particles.size()) + " particles written to " + path;
}

std::string FastSlamPipeline::load_map(const std::string& path, bool frozen) {
  const SavedMap map = read_map(path, options_.frames.map);
  FastSlamOptions options = options_.filter;
  options.map.frozen = frozen;
  filter_->set_options(options);
  try {
    filter_->load(map);
    filter_->begin_drive();
  } catch (...) {
    filter_->set_options(options_.filter);
    throw;
  }
  options_.filter = options;
  loaded_map_ = path;
  start_problem_.clear();
  take_new_belief();
  note_given_map();
  odometry_.restart_at(odometry_.empty() ? ros::Time() : odometry_.newest(),
                       options_.filter.odometry);
  publish_map_and_path();
  return std::to_string(map.landmarks.size()) + " landmarks loaded from " + path +
         (frozen ? ", frozen" : "");
}

}  // namespace pf_resampling
