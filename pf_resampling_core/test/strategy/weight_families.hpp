#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {

/// Weights that resampling has to cope with. All sum to one to within rounding.
enum class Weights { uniform, random, skewed, one_hot, denormal, tied, with_zeros };

inline const std::vector<Weights>& all_weights() {
  static const std::vector<Weights> all = {Weights::uniform,   Weights::random,   Weights::skewed,
                                           Weights::one_hot,   Weights::denormal, Weights::tied,
                                           Weights::with_zeros};
  return all;
}

inline std::string to_string(Weights family) {
  switch (family) {
    case Weights::uniform:
      return "uniform";
    case Weights::random:
      return "random";
    case Weights::skewed:
      return "skewed";
    case Weights::one_hot:
      return "one_hot";
    case Weights::denormal:
      return "denormal";
    case Weights::tied:
      return "tied";
    case Weights::with_zeros:
      return "with_zeros";
  }
  return "unknown";
}

inline Eigen::ArrayXd make_weights(Weights family, int size) {
  Eigen::ArrayXd uniforms(size);
  RandomStream(20, RandomPurpose::test, static_cast<std::uint32_t>(size))
      .fill_uniform(0, size, uniforms.data());
  Eigen::ArrayXd weights(size);
  for (int i = 0; i < size; ++i) {
    const double u = uniforms[i];
    switch (family) {
      case Weights::uniform:
        weights[i] = 1.0;
        break;
      case Weights::random:
        weights[i] = u;
        break;
      case Weights::skewed:  // as the likelihood of a range that is known to 1 % makes them
        weights[i] = std::exp(-20.0 * u * u) + 1e-9;
        break;
      case Weights::one_hot:
        weights[i] = i == size / 3 ? 1.0 : 0.0;
        break;
      case Weights::denormal:  // most are the smallest numbers there are
        weights[i] = i % 5 == 0 ? u : (1.0 + i % 3) * std::numeric_limits<double>::denorm_min();
        break;
      case Weights::tied:
        weights[i] = 1.0 + std::floor(3.0 * u);
        break;
      case Weights::with_zeros:  // first and last among them
        weights[i] = i % 3 == 0 || i == size - 1 ? 0.0 : u;
        break;
    }
  }
  if (weights.sum() == 0.0) weights.setOnes();
  return weights / weights.sum();
}

/// Everything that must hold of a result whatever was drawn.
inline void expect_sound(const Eigen::ArrayXd& weights, int size, const ResamplingResult& result) {
  ASSERT_EQ(result.counts.size(), weights.size());
  ASSERT_EQ(result.ancestors.size(), size);
  ASSERT_EQ(result.log_weights.size(), size);
  ASSERT_EQ(result.counts.cast<std::int64_t>().sum(), size);
  ASSERT_GE(result.counts.minCoeff(), 0);
  ASSERT_GE(result.ancestors.minCoeff(), 0);
  ASSERT_LT(result.ancestors.maxCoeff(), weights.size());
  Eigen::ArrayXi counted = Eigen::ArrayXi::Zero(weights.size());
  for (int slot = 0; slot < size; ++slot) ++counted[result.ancestors[slot]];
  ASSERT_TRUE((counted == result.counts).all());
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    ASSERT_FALSE(weights[i] == 0.0 && result.counts[i] > 0) << "particle " << i << " has weight 0";
  }
  ASSERT_NEAR(result.log_weights.exp().sum(), 1.0, 1e-9);
}

}  // namespace pf_resampling
