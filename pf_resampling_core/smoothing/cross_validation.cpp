#include "pf_resampling_core/smoothing/cross_validation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "pf_resampling_core/smoothing/normal_equations.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr double kPassageGap = 10.0;      // s
constexpr double kLongestPassage = 30.0;  // s
constexpr double kWindow = 25.0;          // s
// A prediction so many times less certain than the observations tells nothing.
constexpr double kNoPrediction = 1e7;
// Squared errors of one and two degrees of freedom are cut off where 99.9 % lie below; the mean of
// the latter is then 2·(1 - exp(-13.8 / 2)).
constexpr double kLargestSquareOfOne = 10.8;
constexpr double kLargestSquareOfTwo = 13.8;
constexpr double kMeanSquareOfTwo = 1.998;
// Windows whose errors are for less than a quarter the odometry's say the less about it.
constexpr double kFullShare = 4.0;
// Without so many, odometry is not taken to be better than stated.
constexpr std::size_t kFewestWindows = 6;
// Standard deviation of the logarithm of a scale before there is any block.
constexpr double kPriorSigma = 0.7;

// Sum of a group's sightings, weighted by information and scaled to unit variance: value, and the
// derivatives by all unknowns.
struct GroupMean {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  Directions by_unknowns;
};

GroupMean mean_of(const SmoothingGraph& graph, double robust_width, const std::vector<int>& group,
                  const NormalEquations& equations) {
  GroupMean mean;
  mean.by_unknowns.setZero(equations.size(), 2);
  Eigen::Array2d information = Eigen::Array2d::Zero();
  for (const int index : group) {
    const SightingFactor& sighting = graph.sightings[static_cast<std::size_t>(index)];
    const SightingResidual r = sighting_residual(
        sighting, graph.noise, graph.poses[static_cast<std::size_t>(sighting.pose)],
        graph.landmarks[static_cast<std::size_t>(sighting.landmark)], graph.constants);
    const double root = std::sqrt(robust_weight(r.value.squaredNorm(), robust_width));
    const Eigen::Array2d share(root / std::sqrt(sighting.range_variance),
                               root / std::sqrt(sighting.bearing_variance));
    information += share.square();
    const Eigen::Matrix2d factor = (root * share).matrix().asDiagonal();
    mean.value += factor * r.value;
    const int pose = equations.pose_at(sighting.pose);
    const int landmark = equations.landmark_at(sighting.landmark);
    const int sensor = equations.constants_at() + SensorConstant::range_scale;
    mean.by_unknowns.middleRows<3>(pose) += (factor * r.by_pose).transpose();
    mean.by_unknowns.middleRows<2>(landmark) += (factor * r.by_landmark).transpose();
    mean.by_unknowns.middleRows<2>(sensor) += (factor * r.by_constants).transpose();
  }
  const Eigen::Matrix2d scale = information.rsqrt().matrix().asDiagonal();
  mean.value = scale * mean.value;
  mean.by_unknowns = mean.by_unknowns * scale;
  return mean;
}

// Of a group, from what was factorised and solved without its block.
PredictionError prediction_error(const SmoothingGraph& graph, double robust_width,
                                 const LeftOutBlock& block, const GroupMean& mean,
                                 const Eigen::VectorXd& step, const Directions& spread,
                                 const NormalEquations& equations) {
  const NoiseScales& noise = graph.noise;
  InformationParts parts =
      equations.information_along(graph, robust_width, block.sightings, spread);
  parts.ranges(0, 0) += 1.0;
  parts.bearings(1, 1) += 1.0;
  // From standard deviations as they are taken to be back to those stated.
  const Eigen::Vector2d unit(noise.range, noise.bearing);
  const auto stated = [&](const Eigen::Matrix2d& covariance, double scale) -> Eigen::Matrix2d {
    return unit.asDiagonal() * covariance * unit.asDiagonal() / (scale * scale);
  };
  PredictionError error;
  error.error = unit.cwiseProduct(mean.value + mean.by_unknowns.transpose() * step);
  error.by_ranges = stated(parts.ranges, noise.range);
  error.by_bearings = stated(parts.bearings, noise.bearing);
  error.by_motions = stated(parts.motions, noise.motion);
  error.by_prior = stated(parts.prior, 1.0);
  return error;
}

Eigen::Matrix2d covariance_of(const PredictionError& e, const NoiseScales& scales) {
  return scales.range * scales.range * e.by_ranges +
         scales.bearing * scales.bearing * e.by_bearings +
         scales.motion * scales.motion * e.by_motions + e.by_prior;
}

// Means over prediction errors: their squares, in range, in bearing, and of both together; and the
// share of the odometry in their variances.
struct MeanSquares {
  double range = 0.0, bearing = 0.0, both = 0.0;
  double by_motions = 0.0;
};

MeanSquares mean_squares(const std::vector<PredictedBlock>& blocks, const NoiseScales& scales) {
  MeanSquares sum;
  double count = 0.0;
  for (const PredictedBlock& block : blocks) {
    for (const PredictionError& e : block) {
      const Eigen::Matrix2d covariance = covariance_of(e, scales);
      // What comes from a file may be anything.
      const double square_of_both = e.error.dot(covariance.inverse() * e.error);
      if (!covariance.allFinite() || covariance.diagonal().minCoeff() <= 0.0 ||
          covariance.determinant() <= 0.0 || !std::isfinite(square_of_both)) {
        continue;
      }
      const auto square = [&](int i) {
        return std::clamp(e.error[i] * e.error[i] / covariance(i, i), 0.0, kLargestSquareOfOne);
      };
      sum.range += square(0);
      sum.bearing += square(1);
      sum.both += std::clamp(square_of_both, 0.0, kLargestSquareOfTwo);
      const Eigen::Matrix2d by_motions = scales.motion * scales.motion * e.by_motions;
      sum.by_motions += by_motions.trace() / covariance.trace();
      ++count;
    }
  }
  if (count == 0.0) return {};
  return {sum.range / count, sum.bearing / count, sum.both / count, sum.by_motions / count};
}

// Relative standard error of the mean square of two errors; those of a block have much in common
// and are as good as one.
double standard_error(const std::vector<PredictedBlock>& blocks) {
  return 1.0 / std::sqrt(static_cast<double>(std::max<std::size_t>(1, blocks.size())));
}

// By how much a mean square exceeds a standard error more than it should be.
double excess(const MeanSquares& squares, const std::vector<PredictedBlock>& blocks) {
  return squares.both / kMeanSquareOfTwo / (1.0 + standard_error(blocks));
}

// Logarithm of how likely the errors are, up to a constant: those of a block count as one.
double log_likelihood(const std::vector<PredictedBlock>& blocks, const NoiseScales& scales) {
  double sum = 0.0;
  for (const PredictedBlock& block : blocks) {
    double of_block = 0.0;
    for (const PredictionError& e : block) {
      const Eigen::Matrix2d covariance = covariance_of(e, scales);
      const double square = e.error.dot(covariance.inverse() * e.error);
      const double determinant = covariance.determinant();
      if (!std::isfinite(square) || !(determinant > 0.0)) continue;
      of_block -= 0.5 * (std::log(determinant) + std::clamp(square, 0.0, kLargestSquareOfTwo));
    }
    sum += of_block / static_cast<double>(block.size());
  }
  return sum;
}

// The likeliest scale of the odometry, at most 1, under a log-normal prior, where sightings are as
// stated; larger by a standard error.
double better_motion(const std::vector<PredictedBlock>& windows) {
  constexpr int kSteps = 46;  // of 5 %, down to kSmallestNoiseScale
  double best = -std::numeric_limits<double>::infinity();
  double found = 1.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double log_scale = std::log(kSmallestNoiseScale) * i / kSteps;
    const double of_prior = log_scale / kPriorSigma;
    const double scale = std::exp(log_scale);
    const double likelihood =
        log_likelihood(windows, {1.0, 1.0, scale}) - 0.5 * of_prior * of_prior;
    if (likelihood <= best) continue;
    best = likelihood;
    found = scale;
  }
  return std::min(1.0, found * std::sqrt(1.0 + standard_error(windows)));
}

// How much larger, in standard deviations, the errors of ranges are than those of bearings, nearer
// to 1 by a standard error.
double ratio_of_range(const std::vector<PredictedBlock>& passages, const NoiseScales& scales) {
  const MeanSquares squares = mean_squares(passages, scales);
  if (squares.range <= 0.0 || squares.bearing <= 0.0) return 1.0;
  const double ratio = 0.5 * std::log(squares.range / squares.bearing);
  const double error = standard_error(passages);
  return std::exp(ratio - std::clamp(ratio, -error, error));
}

double worse(double scale, double excess) {
  return std::clamp(scale * std::sqrt(excess), 1.0, kLargestNoiseScale);
}

}  // namespace

std::vector<PredictedBlock> cross_validate(const SmoothingGraph& graph, double robust_width,
                                           const std::vector<LeftOutBlock>& blocks) {
  std::vector<PredictedBlock> predicted_blocks;
  if (blocks.empty()) return predicted_blocks;
  NormalEquations equations(graph);
  for (const LeftOutBlock& block : blocks) {
    equations.linearize(graph, robust_width, block.sightings);
    if (!equations.factorize(0.0)) continue;
    const Eigen::VectorXd step = equations.step();
    PredictedBlock errors;
    for (const std::vector<int>& group : block.groups) {
      const GroupMean mean = mean_of(graph, robust_width, group, equations);
      const Directions spread = equations.solve(mean.by_unknowns);
      const Eigen::Matrix2d predicted = mean.by_unknowns.transpose() * spread;
      if (!predicted.allFinite() || predicted.maxCoeff() > kNoPrediction) continue;
      errors.push_back(prediction_error(graph, robust_width, block, mean, step, spread, equations));
    }
    if (!errors.empty()) predicted_blocks.push_back(std::move(errors));
  }
  return predicted_blocks;
}

std::vector<LeftOutBlock> passages(const SmoothingGraph& graph, const std::vector<double>& times,
                                   double since, double until) {
  struct Passage {
    double begin = 0.0, last = 0.0;
    std::vector<int> sightings;
  };
  std::vector<LeftOutBlock> blocks;
  const auto end = [&](Passage* passage, double at) {
    if (!passage->sightings.empty() && at > since && at <= until) {
      blocks.push_back({passage->sightings, {passage->sightings}});
    }
    passage->sightings.clear();
  };
  std::vector<Passage> open(graph.landmarks.size());
  for (std::size_t s = 0; s < graph.sightings.size(); ++s) {
    const SightingFactor& sighting = graph.sightings[s];
    const double time = times[static_cast<std::size_t>(sighting.pose)];
    Passage& passage = open[static_cast<std::size_t>(sighting.landmark)];
    if (time > passage.last + kPassageGap) {
      end(&passage, passage.last + kPassageGap);
    } else if (time > passage.begin + kLongestPassage) {
      end(&passage, passage.begin + kLongestPassage);
    }
    if (passage.sightings.empty()) passage.begin = time;
    passage.last = time;
    passage.sightings.push_back(static_cast<int>(s));
  }
  for (Passage& passage : open) end(&passage, passage.last + kPassageGap);
  return blocks;
}

std::vector<LeftOutBlock> windows(const SmoothingGraph& graph, const std::vector<double>& times,
                                  double since, double until) {
  const double stride = 0.5 * kWindow;
  const auto time_of = [&](const SightingFactor& sighting) {
    return times[static_cast<std::size_t>(sighting.pose)];
  };
  // Every sighting is in the middle half of one window: times may be far apart.
  std::set<double> begins;
  for (const SightingFactor& sighting : graph.sightings) {
    const double begin = (std::round(time_of(sighting) / stride) - 1.0) * stride;
    const double known = begin + kWindow + stride;
    if (begin >= times.front() && known > since && known <= until) begins.insert(begin);
  }
  std::vector<LeftOutBlock> blocks;
  for (const double begin : begins) {
    LeftOutBlock block;
    std::vector<std::vector<int>> groups(graph.landmarks.size());
    for (std::size_t s = 0; s < graph.sightings.size(); ++s) {
      const SightingFactor& sighting = graph.sightings[s];
      const double time = time_of(sighting);
      if (time < begin || time >= begin + kWindow) continue;
      block.sightings.push_back(static_cast<int>(s));
      if (std::round(time / stride) == std::round(begin / stride) + 1.0) {
        groups[static_cast<std::size_t>(sighting.landmark)].push_back(static_cast<int>(s));
      }
    }
    for (std::vector<int>& group : groups) {
      if (!group.empty()) block.groups.push_back(std::move(group));
    }
    if (!block.groups.empty()) blocks.push_back(std::move(block));
  }
  return blocks;
}

NoiseScales noise_scales(const std::vector<PredictedBlock>& passages,
                         const std::vector<PredictedBlock>& windows, NoiseDirection direction) {
  constexpr int kIterations = 30;
  // Worse than stated: sightings are judged under odometry as stated. Both fitted together would
  // run along a ridge, on which errors that sightings have in common pass for noise of the
  // odometry.
  NoiseScales sightings, all;
  for (int i = 0; i < kIterations; ++i) {
    sightings.range = sightings.bearing =
        worse(sightings.range, std::max(excess(mean_squares(passages, sightings), passages),
                                        excess(mean_squares(windows, sightings), windows)));
    const MeanSquares of_windows = mean_squares(windows, all);
    const double share = std::min(1.0, kFullShare * of_windows.by_motions);
    all.range = all.bearing = worse(all.range, excess(mean_squares(passages, all), passages));
    all.motion = worse(all.motion, std::pow(excess(of_windows, windows), share));
  }
  if (direction == NoiseDirection::both && all.motion == 1.0 && windows.size() >= kFewestWindows)
    all.motion = better_motion(windows);
  // The product stays: what a sighting says of a place.
  const double root = std::sqrt(ratio_of_range(passages, sightings));
  return {worse(sightings.range * root, 1.0), worse(sightings.bearing / root, 1.0), all.motion};
}

double noise_doubt(std::size_t blocks) {
  constexpr double kMost = 6.0;
  return std::min(kMost, std::exp(1.5 / std::sqrt(static_cast<double>(blocks))));
}

}  // namespace pf_resampling
