#pragma once

#include <string>
#include <vector>

#include "research/studies/compensation_study.hpp"

namespace pf_resampling {

/// What a claim comes down to: a difference between two filters, paired by drive, and on which side
/// of zero it is said to be.
struct ClaimedDifference {
  std::string text;
  MeanEstimate difference;
  int decimals = 3;
  bool is_below = true;                ///< claimed: below zero; else above
  double least_standard_errors = 0.0;  ///< and so many of its standard errors away from it

  /// How many standard errors it is away from zero; positive on the claimed side.
  double standard_errors() const;
  bool holds() const { return standard_errors() > least_standard_errors; }
  /// Three or more standard errors away from zero, on either side.
  bool is_clear() const;
};

struct Claim {
  std::string text;
  std::vector<ClaimedDifference> differences;  ///< empty: the study lacks a filter it is about

  bool is_known() const { return !differences.empty(); }
  bool holds() const;
  /// In words: whether it holds, and whether chance is ruled out.
  std::string verdict() const;
};

/// The five points that the method has to show on the reference world.
std::vector<Claim> five_points(const CompensationStudy& study);
/// What else K says of resampling and compensation.
std::vector<Claim> other_claims_of_paper_k(const CompensationStudy& study);
/// What K does not look at: the error of the map that a user gets, and how well it is known.
std::vector<Claim> claims_of_confidence(const CompensationStudy& study);

}  // namespace pf_resampling
