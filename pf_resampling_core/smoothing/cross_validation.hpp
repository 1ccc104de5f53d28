#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// Sightings that are left out of a graph and predicted from the rest. Errors that last stay hidden
/// in the residuals of what was used, and show in those of what was not.
struct LeftOutBlock {
  std::vector<int> sightings;
  /// Of these, groups of sightings of one landmark each, whose means are predicted.
  std::vector<std::vector<int>> groups;
};

/// How far the mean of a group of sightings, in range and bearing, is from where the rest of the
/// data predict it, in standard deviations of such a mean as stated; and the covariance that this
/// error should have, to first order, if the standard deviations of sightings and motions were so
/// many times those stated:
///   range²·by_ranges + bearing²·by_bearings + motion²·by_motions + by_prior.
struct PredictionError {
  Eigen::Vector2d error = Eigen::Vector2d::Zero();
  Eigen::Matrix2d by_ranges = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d by_bearings = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d by_motions = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d by_prior = Eigen::Matrix2d::Zero();
};

/// As it is saved.
void describe(Archive& archive, PredictionError& error);

/// Of the groups of a block.
using PredictedBlock = std::vector<PredictionError>;

/// Leaves each block out in turn and predicts its groups, at a graph's estimate, which should be a
/// solution (smooth()). Groups and blocks that the rest of the data say nothing of are missing from
/// the result. A factorisation per block.
std::vector<PredictedBlock> cross_validate(const SmoothingGraph& graph, double robust_width,
                                           const std::vector<LeftOutBlock>& blocks);

/// Passages of landmarks, a block each: one ends when its landmark was not seen for 10 s, or after
/// 30 s. Those that ended after `since` and no later than `until`, by `times` of the poses (s).
std::vector<LeftOutBlock> passages(const SmoothingGraph& graph, const std::vector<double>& times,
                                   double since, double until);

/// Windows of 25 s, one every 12.5 s, in which nothing is seen; a group per landmark seen in the
/// middle half. Those that ended, with 12.5 s of data behind them, after `since` and no later than
/// `until`.
std::vector<LeftOutBlock> windows(const SmoothingGraph& graph, const std::vector<double>& times,
                                  double since, double until);

/// Whether odometry may be found to be better than stated, too.
enum class NoiseDirection { worse, both };

/// The scales under which the mean squares of the prediction errors of passages and of windows are
/// at most a standard error larger than they should be, none below 1: no more than the data show.
/// With both directions, odometry that is not worse than stated may be better: its scale is then
/// the likeliest under a log-normal prior (0.7), larger by a standard error.
NoiseScales noise_scales(const std::vector<PredictedBlock>& passages,
                         const std::vector<PredictedBlock>& windows,
                         NoiseDirection direction = NoiseDirection::worse);

/// By what factor standard deviations may still be larger than noise_scales() found from so many
/// blocks: by three standard errors of what is found from two numbers a block, e^(1.5/sqrt(n)). The
/// rule itself stops one of them short. At most 6, as before the first block: twice as much as the
/// recordings that are known to us have shown of what data sheets leave out.
double noise_doubt(std::size_t blocks);

}  // namespace pf_resampling
