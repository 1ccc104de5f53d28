#pragma once

namespace pf_resampling {

/// Above this probability a filter counts as lost: it warns, and recovery may begin.
inline constexpr double kLikelyLost = 0.5;

/// Share of the observations that say nothing although the filter is right.
inline constexpr double kOutlierShare = 0.05;

/// Am I lost? A hidden Markov model with two states, right and lost, whose observations are the
/// filter's innovations: normalised ones of a filter that is right are standard normal but for
/// outliers, those of a lost one are ten times as wide (forward algorithm; Rabiner 1989). A right
/// filter is lost after an hour, a lost one right after a minute, on average.
class LostDetector {
 public:
  LostDetector() { reset(); }

  /// Takes an innovation: its squared Mahalanobis distance, of `dimensions` numbers (1 a range, 2
  /// range and bearing), `duration` s after the one before; of a sensor with such a share of
  /// outliers, in (0, 1). What is not finite is passed over.
  void observe(double squared_distance, int dimensions, double duration,
               double outlier_share = kOutlierShare);

  /// Probability that the filter is lost, given all innovations so far.
  double probability() const { return probability_; }

  /// Running mean of the squared distances per dimension, over about the last 40 innovations: 1
  /// is expected.
  double normalized_innovation() const { return normalized_innovation_; }

  /// As after construction: the filter started anew.
  void reset();

  /// Goes on from what probability() and normalized_innovation() gave.
  void resume(double probability, double normalized_innovation) {
    probability_ = probability;
    normalized_innovation_ = normalized_innovation;
  }

 private:
  double probability_ = 0.0;
  double normalized_innovation_ = 1.0;
};

}  // namespace pf_resampling
