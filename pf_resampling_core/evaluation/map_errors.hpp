#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/models/point_alignment.hpp"

namespace pf_resampling {

/// A point landmark, as estimated or as it is.
struct PointLandmark {
  std::int32_t id = -1;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< m, map frame
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< m^2; zero: none is stated
};

/// Throws Error unless every landmark of the map, called `name` in the message, is finite.
void check_map(const std::vector<PointLandmark>& map, const char* name);

/// A path or a map turned and shifted, with its covariances.
std::vector<EstimatedPose> moved(std::vector<EstimatedPose> path, const Pose2& by);
std::vector<PointLandmark> moved(std::vector<PointLandmark> map, const Pose2& by);

/// A path's Cartesian errors after the best alignment of the whole path to the truth: its shape
/// alone, whatever its frame. The clipped part takes no part in either.
struct AlignedPathErrors {
  Pose2 alignment;  ///< brings the estimate to the truth
  AbsoluteErrors cartesian;
};
/// Throws Error as evaluate_path does.
AlignedPathErrors evaluate_aligned_path(const std::vector<TruePose>& truth,
                                        const std::vector<EstimatedPose>& estimate,
                                        const PathErrorOptions& options = {});

/// Which true landmark an estimated one is.
struct LandmarkMatch {
  std::size_t estimated = 0;  ///< position in the estimated map
  std::size_t truth = 0;      ///< position in the true one
};

/// By equal ids, each true landmark once (the first estimate with its id).
std::vector<LandmarkMatch> match_by_id(const std::vector<PointLandmark>& estimated,
                                       const std::vector<PointLandmark>& truth);

/// The nearest first, each landmark at most once, none farther apart than `gate` (m).
std::vector<LandmarkMatch> match_by_nearest(const std::vector<PointLandmark>& estimated,
                                            const std::vector<PointLandmark>& truth, double gate);

/// Half of the median distance from a true landmark to its nearest neighbour, at least 0.5 m: what
/// is farther off than that might as well be its neighbour.
double usual_gate(const std::vector<PointLandmark>& truth);

enum class LandmarkMatching { automatic, id, nearest };

struct MapErrorOptions {
  /// automatic: by id if at least half of the estimated landmarks have the id of a true one and, of
  /// these, at least half are within the gate of it after alignment; else nearest.
  LandmarkMatching matching = LandmarkMatching::automatic;
  /// Where to look for the nearest: brings the estimated map near the true one, as the alignment
  /// of the path does. The matches' own alignment then refines it.
  Pose2 first_alignment;
};

/// How far a map is from the truth.
struct MapErrors {
  LandmarkMatching matching = LandmarkMatching::id;  ///< what was used
  double gate = 0.0;                                 ///< m, for nearest: usual_gate()
  int landmarks = 0;                                 ///< estimated
  int matched = 0;
  int false_landmarks = 0;  ///< estimated, without a true one: invented, or a second of the same
  int missed = 0;           ///< true, without an estimated one
  std::vector<LandmarkMatch> matches;

  /// Of the distances between matched landmarks, m; nothing without matches.
  std::optional<double> rms;
  /// The same after the best alignment of the matched landmarks; nothing below two matches.
  std::optional<double> rms_aligned;
  Pose2 alignment;  ///< that alignment: brings the estimated map to the truth
  /// Of the matched landmarks as they are (not aligned), if covariances are stated: the share of
  /// true landmarks inside the estimate's 95 % ellipse (chi-square, 2 dof, 5.991; the truth's own
  /// covariance is added), and the mean squared Mahalanobis distance (NEES), 2 if consistent.
  std::optional<double> coverage95;
  std::optional<double> normalized_error;
};

/// Throws Error on maps that are not finite, or a true map that is empty.
MapErrors evaluate_map(const std::vector<PointLandmark>& estimated,
                       const std::vector<PointLandmark>& truth,
                       const MapErrorOptions& options = {});

}  // namespace pf_resampling
