#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/pose_estimate.hpp"

namespace pf_resampling {

/// A landmark of the weighted-mean map, as it is saved.
struct SavedLandmark {
  LandmarkEstimate estimate;
  /// m; where the heaviest particle had it when it was last seen: what data association looks for.
  Eigen::Vector2d last_seen = Eigen::Vector2d::Zero();
};

/// A landmark in the map of one particle.
struct ParticleLandmark {
  std::int64_t id = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();        ///< m
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< m^2
  double log_odds = 0.0;
};

/// What a FastSLAM filter knows at a moment: the map for people and for localization, and the
/// population for going on. Options and seed are not part of it. With the same of these, a filter
/// that loads the whole population goes on to the bit as the one that was saved would have.
struct SavedMap {
  std::string frame = "map";  ///< name of the frame that everything is given in
  /// What the landmarks' ids mean: with `known` they are the observations' own, else numbers in
  /// order of discovery.
  DataAssociation association = DataAssociation::automatic;
  PoseEstimate pose;
  double view_range = 0.0;    ///< m, how far the sensor sees
  double view_bearing = 0.0;  ///< rad, how wide to both sides
  std::uint32_t step = 0;     ///< of the random streams
  std::int64_t next_id = 0;   ///< of the next landmark that is discovered
  std::int64_t observations_since_renewal = 0;
  std::vector<SavedLandmark> landmarks;                      ///< ids ascending
  FastSlamParticles particles;                               ///< none: there is only the map
  std::vector<std::vector<ParticleLandmark>> particle_maps;  ///< of each particle; ids ascending
  OdometryErrorState odometry_errors;                        ///< a row of means per particle
  MemoryState memory;  ///< what a redraw draws from; nothing without particles
  bool is_lost = false;
  double unplaced_since = -1.0;
  std::int64_t observations_since_redraw = 0;
};

/// The filter as it is now; it is not changed. All particles if there are no more than `particles`,
/// else so many drawn by systematic resampling (their weights are equal then); 0: the map alone.
SavedMap saved_map(FastSlam* filter, int particles);

/// A place of a landmark that was measured otherwise.
struct SurveyedLandmark {
  std::int64_t id = 0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m
  double sigma = 0.0;  ///< m, along both axes; 0: good to a millimetre
};

/// A map without particles from a list of landmarks in any order; their ids are the observations'.
/// The robot is at the origin until it is told otherwise. Throws Error for a list that makes no
/// sense.
SavedMap surveyed_map(const std::vector<SurveyedLandmark>& landmarks, const std::string& frame);

/// Such a map from a text file: a header line `id,x,y` (m), or `id,x,y,sigma` if the accuracy is
/// known, then a landmark per line; `#` starts a comment. Throws Error, in one line that names
/// file, line, fault and remedy, for anything else.
SavedMap read_landmark_list(const std::string& path, const std::string& frame);

/// What is wrong with it, in words; nothing if all is well: not finite, not a covariance, an id
/// twice, weights that are not positive or do not add up to 1.
std::string fault_of(const SavedMap& map);
/// Throws Error for a map with a fault.
void check_saved_map(const SavedMap& map);

/// As it is saved: see doc/saved_files.md.
void describe(Archive& archive, SavedMap& map);

/// Writes a map as JSON; see write_saved().
void write_map_file(const std::string& path, const SavedMap& map);
/// Reads it; see read_saved().
SavedMap read_map_file(const std::string& path);

/// Reads either: a map file, which begins with a brace, or a landmark list, in `frame`.
SavedMap read_map(const std::string& path, const std::string& frame);

}  // namespace pf_resampling
