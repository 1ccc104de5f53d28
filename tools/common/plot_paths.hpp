#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// What a picture of paths shows; what is empty is left out. All in the map frame.
struct PathPlot {
  std::string title;
  std::vector<TruePose> truth;
  std::vector<EstimatedPose> estimate;
  std::vector<EstimatedPose> dead_reckoning;
  std::vector<Beacon> beacons;
  std::vector<PointLandmark> landmarks;  ///< estimated, with the ellipses of their covariances
  std::vector<PointLandmark> true_landmarks;
  bool is_slam = false;  ///< marks loop closures; `landmarks` is the map that belongs to the path
  /// The estimate is drawn where this brings it, and the map too unless `map` has an alignment of
  /// its own (errors are those of where they were).
  std::optional<Pose2> alignment;
  std::optional<MapErrors> map;              ///< which landmark is which, and how far it is off
  std::optional<PathErrors> errors;          ///< of the estimate, over time, with 3-sigma bands
  std::optional<PathErrors> aligned_errors;  ///< of the path after `alignment`, if that is the best
  std::optional<PathErrors> dead_reckoning_errors;  ///< its Cartesian error, beside the estimate's
};

/// Throws Error unless the name ends in .png, .pdf or .svg.
void check_plot_file(const std::string& path);

/// Draws the picture with scripts/plot_paths.py (Python and matplotlib). Throws Error with the
/// script's own line if that fails, for instance because matplotlib is missing.
void plot_paths(const PathPlot& plot, const std::string& path);

}  // namespace pf_resampling
