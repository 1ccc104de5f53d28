#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/smoothing/bordered_chain.hpp"
#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// Where information comes from: the noise of the first three is learnt, each by itself.
struct DataKind {
  enum Index : int {
    range,
    bearing,
    motion,
    given,  ///< a belief at the start
  };
};
inline constexpr int kDataKinds = 4;

/// What a segment says of y = (end pose; tracks; constants), 3 + 2K + 7 unknowns, for each kind of
/// data: the cost
///   cost + gradientᵀ·e + ½ eᵀ·information·e,   e = y − (where it was condensed).
/// The poses between are eliminated.
struct CondensedSegment {
  std::array<double, kDataKinds> cost = {};
  std::array<Eigen::VectorXd, kDataKinds> gradient;
  std::array<Eigen::MatrixXd, kDataKinds> information;  ///< empty: none
  /// How the poses between follow y: 3 (poses − 1) rows; empty where the data are gone.
  Eigen::MatrixXd between;
  double log_determinant = 0.0;  ///< of the information on the poses between
};

/// What a stretch of the drive says, in the frame of the pose that it starts from (its base). A
/// track is a landmark as this segment saw it. The segment turns and moves as one: nothing is
/// linearised in a frame that a loop will turn.
struct Segment {
  std::vector<MotionFactor> motions;      ///< i leads to poses[i], the first from the base
  std::vector<SightingFactor> sightings;  ///< `pose` of poses, `landmark` of tracks
  /// Of no landmark as far as is known: they take no part.
  std::vector<SightingFactor> unassigned;
  std::vector<int> landmarks;  ///< of each track
  /// Tracks that a scan has seen beside each other, where the data are gone.
  std::vector<std::array<int, 2>> beside;

  // Where it was condensed.
  std::vector<Pose2> poses;             ///< the last is the end
  std::vector<Eigen::Vector2d> tracks;  ///< m
  SensorConstants constants = SensorConstants::Zero();
  NoiseScales noise;
  double motion_share = 1.0;  ///< weight of its odometry: less than 1 where the wheels slipped
  double robust_width = 0.0;

  std::shared_ptr<const CondensedSegment> condensed;  ///< shared by copies
  /// Sum over the sightings of the logarithm of their noise: σ of the range times σ of the bearing.
  double log_noise = 0.0;

  Eigen::Index size() const {
    return 3 + 2 * static_cast<Eigen::Index>(tracks.size()) + kSensorConstants;
  }
  Eigen::Index constants_at() const { return size() - kSensorConstants; }
  /// Whether it can be condensed anew.
  bool has_data() const { return !motions.empty(); }
  /// A belief to begin with has one pose, and no update led to it.
  std::size_t updates() const {
    return has_data() ? motions.size() : poses.size() > 1 ? poses.size() : 0;
  }
  /// s
  double duration() const;
};

/// What a segment's motions say of the delay and of the scale of turns. Their own noise is in both
/// their velocity and their error: it would pass for a delay (that is a low-pass filter of the
/// odometry), or for a scale. So they tell of the delay if the squares of the changes of velocity,
/// from one motion to the next but one, are together more than three times their noise; and of the
/// scale if those of the turns of each second are more than thirty times theirs: where the noise is
/// taken for a fifth more or less than it is, the scale is then off by about a hundredth (errors
/// in variables).
void compare_with_noise(std::vector<MotionFactor>* motions);

/// Poses as the odometry has them, tracks where they were first seen.
void initialize(Segment* segment);

/// What fit() may move.
enum class FreePart { between, between_end_and_tracks };

/// Least squares over the segment alone: robust (Cauchy) in sightings and motions. False, with what
/// was reached, where that is not finite.
bool fit(FreePart free, double robust_width, Segment* segment);

/// Of all unknowns of a segment, at where it was condensed: the poses between are the chain; end,
/// tracks and constants the border.
struct SegmentLinearization {
  static constexpr std::size_t kKinds = 3;  // none is given
  std::array<BorderedChain, kKinds> hessian;
  std::array<Eigen::VectorXd, kKinds> gradient;
  std::array<double, kKinds> cost = {};

  BorderedChain whole_hessian() const { return hessian[0] + hessian[1] + hessian[2]; }
  Eigen::VectorXd whole_gradient() const { return gradient[0] + gradient[1] + gradient[2]; }
};

/// Linearises at the poses, tracks and constants that it has, and eliminates the poses between.
/// False if these are not determined. `linearization`, if given, is left there.
bool condense(double robust_width, Segment* segment, SegmentLinearization* linearization = nullptr);

/// Of a segment whose data are gone, or never were: a belief with that information on y.
std::shared_ptr<const CondensedSegment> condensed_belief(const Eigen::MatrixXd& information,
                                                         const Eigen::VectorXd& gradient);

/// To a segment that is not condensed, from one of its poses.
void add_sighting(int landmark, SightingFactor sighting, Segment* segment);

/// The first `motions` of a segment that was not condensed, and the rest.
std::pair<Segment, Segment> cut(std::size_t motions, const Segment& segment);

/// Without some of its sightings, ascending, and without tracks that have no other; not condensed.
Segment without(const std::vector<std::size_t>& sightings, const Segment& segment);

}  // namespace pf_resampling
