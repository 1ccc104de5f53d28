#include "pf_resampling_core/smoothing/cross_validation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Errors of range and bearing with these standard deviations where 1 was stated.
std::vector<PredictedBlock> errors(int count, double range, double bearing, std::uint64_t seed) {
  const RandomStream random(seed, RandomPurpose::test, 0);
  std::vector<PredictedBlock> blocks;
  for (int i = 0; i < count; ++i) {
    PredictionError error;
    const std::uint64_t at = 2 * static_cast<std::uint64_t>(i);
    error.error = {range * random.normal(at), bearing * random.normal(at + 1)};
    error.by_ranges(0, 0) = 1.0;
    error.by_bearings(1, 1) = 1.0;
    blocks.push_back({error});
  }
  return blocks;
}

// 2000 blocks: a scale has a standard error of 1.1 to 1.6 %, and stays below by as much on purpose.
// The last, of range and bearing apart, keeps the product that a common scale would have.
TEST(CrossValidation, FindsTheScales) {
  const NoiseScales alike = noise_scales(errors(2000, 2.0, 2.0, 1), errors(2000, 2.0, 2.0, 2));
  EXPECT_NEAR(alike.range, 2.0, 0.15);
  EXPECT_NEAR(alike.bearing, 2.0, 0.15);
  EXPECT_EQ(alike.motion, 1.0);
  const NoiseScales apart = noise_scales(errors(2000, 3.0, 1.5, 3), errors(2000, 3.0, 1.5, 4));
  EXPECT_NEAR(apart.range / apart.bearing, 2.0, 0.15);
  EXPECT_GT(apart.range, 2.5);
  EXPECT_LT(apart.bearing, 2.0);
}

TEST(CrossValidation, FindsTheNoiseOfMotions) {
  std::vector<PredictedBlock> of_windows = errors(2000, 3.0, 3.0, 5);
  for (PredictedBlock& block : of_windows) block[0].by_motions = 2.0 * Eigen::Matrix2d::Identity();
  const NoiseScales scales = noise_scales(errors(2000, 1.0, 1.0, 6), of_windows);
  // 9 = 1 + 2·scale².
  EXPECT_NEAR(scales.motion, 2.0, 0.15);
}

// Of a hundred blocks the mean square has a relative standard error of a tenth: what is a twentieth
// too large may be chance, what is a third too large is not.
TEST(CrossValidation, WhatMayBeChanceIsNoNoise) {
  const auto scale_of = [](double square) {
    std::vector<PredictedBlock> blocks = errors(100, 1.0, 1.0, 1);
    for (PredictedBlock& block : blocks) block[0].error.setConstant(std::sqrt(square));
    return noise_scales(blocks, {}).range;
  };
  EXPECT_EQ(scale_of(1.05), 1.0);
  EXPECT_GT(scale_of(1.33), 1.05);
}

TEST(CrossValidation, NothingIsLearntFromNothing) {
  const NoiseScales none = noise_scales({}, {});
  EXPECT_EQ(none.range, 1.0);
  EXPECT_EQ(none.bearing, 1.0);
  EXPECT_EQ(none.motion, 1.0);
  // Too small errors do not make the noise smaller than stated.
  const NoiseScales small = noise_scales(errors(500, 0.3, 0.3, 7), errors(500, 0.3, 0.3, 8));
  EXPECT_EQ(small.range, 1.0);
  EXPECT_EQ(small.bearing, 1.0);
}

// A single bearing that is predicted to a hair says nothing of the ranges.
TEST(CrossValidation, ASinglePassageDoesNotTellRangesFromBearings) {
  const NoiseScales scales = noise_scales(errors(1, 1.0, 1e-4, 9), {});
  EXPECT_NEAR(scales.range, 1.0, 0.2);
  EXPECT_NEAR(scales.bearing, 1.0, 0.2);
}

// But where they scatter less from scan to scan, too; not below that, nor by a few passages.
TEST(CrossValidation, FindsSightingsThatAreBetterThanStated) {
  const std::vector<PredictedBlock> passages = errors(500, 0.3, 0.3, 7);
  const std::vector<PredictedBlock> windows = errors(500, 0.3, 0.3, 8);
  const NoiseScales found = noise_scales(passages, windows, {0.2, 0.2, 1.0});
  EXPECT_NEAR(found.range, 0.3, 0.03);
  EXPECT_NEAR(found.bearing, 0.3, 0.03);
  const NoiseScales least = noise_scales(passages, windows, {0.5, 0.5, 1.0});
  EXPECT_EQ(least.range, 0.5);
  EXPECT_EQ(least.bearing, 0.5);
  EXPECT_EQ(noise_scales(errors(19, 0.3, 0.3, 7), {}, {0.2, 0.2, 1.0}).range, 1.0);
}

TEST(CrossValidation, ErrorsWithoutACovarianceSayNothing) {
  std::vector<PredictedBlock> of_passages = errors(100, 2.0, 2.0, 1);
  const NoiseScales scales = noise_scales(of_passages, {});
  for (PredictedBlock& block : of_passages) block.push_back(PredictionError());
  EXPECT_EQ(noise_scales(of_passages, {}).range, scales.range);
}

TEST(CrossValidation, ErrorsWithoutMeasureLeaveFiniteScales) {
  std::vector<PredictedBlock> of_passages = errors(10, 1.0, 1.0, 1);
  for (PredictedBlock& block : of_passages) {
    block[0].error = {1e300, 1e300};
    block[0].by_motions << 0.0, 5.0, 5.0, 99.0;  // the square would be infinity less infinity
  }
  const NoiseScales scales = noise_scales(of_passages, of_passages);
  for (const double scale : {scales.range, scales.bearing, scales.motion}) {
    EXPECT_GE(scale, 1.0);
    EXPECT_LE(scale, kLargestNoiseScale);
  }
}

// Of n blocks of two numbers, a deviation has a standard error of 1/(2 sqrt(n)): three of them.
TEST(CrossValidation, NoiseIsDoubtedLessTheMoreWasPredicted) {
  EXPECT_EQ(noise_doubt(0), 6.0);
  EXPECT_NEAR(noise_doubt(1), std::exp(1.5), 1e-12);
  EXPECT_NEAR(noise_doubt(9), std::exp(0.5), 1e-12);
  EXPECT_LT(noise_doubt(10000), 1.02);
}

}  // namespace
}  // namespace pf_resampling
