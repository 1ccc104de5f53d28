#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

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

/// The scales under which the mean squares of the prediction errors of passages and of windows are
/// at most a standard error larger than they should be: no more than the data show. Sightings are
/// no better than `scatter`, by which they differ from scan to scan, nor, before there are 20
/// passages, than stated. Odometry that is not worse than stated may be better, from six windows
/// on: its scale is then the likeliest under a log-normal prior (0.7), larger by a standard error.
NoiseScales noise_scales(const std::vector<PredictedBlock>& passages,
                         const std::vector<PredictedBlock>& windows,
                         const NoiseScales& scatter = {});

/// By what factor standard deviations may still be larger than noise_scales() found from so many
/// blocks: by three standard errors of what is found from two numbers a block, e^(1.5/sqrt(n)). The
/// rule itself stops one of them short. At most 6, as before the first block: twice as much as the
/// recordings that are known to us have shown of what data sheets leave out.
double noise_doubt(std::size_t blocks);

}  // namespace pf_resampling
