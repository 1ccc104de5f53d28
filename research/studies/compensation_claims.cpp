#include "research/studies/compensation_claims.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

using Figures = CompensationFigures;
using Figure = double Figures::*;

constexpr double kClear = 3.0;  // standard errors: by chance once in 370

/// Collects the differences of one claim. A filter that the study lacks makes it unknown.
class ClaimBuilder {
 public:
  ClaimBuilder(const CompensationStudy& study, const std::string& text) : study_(study) {
    claim_.text = text;
  }

  /// Claimed: `figure` of `first` is below that of `second`.
  ClaimBuilder& below(Figure figure, const std::string& first, const std::string& second,
                      double least_standard_errors = 0.0) {
    return add(figure, first, second, 1.0, true, least_standard_errors);
  }
  /// Claimed: it is above `times` that of `second`.
  ClaimBuilder& above(Figure figure, const std::string& first, const std::string& second,
                      double times = 1.0) {
    return add(figure, first, second, times, false, 0.0);
  }

  Claim claim() const { return complete_ ? claim_ : Claim{claim_.text, {}}; }

 private:
  ClaimBuilder& add(Figure figure, const std::string& first, const std::string& second,
                    double times, bool is_below, double least_standard_errors) {
    const CompensationCell* a = study_.find(first);
    const CompensationCell* b = study_.find(second);
    if (a == nullptr || b == nullptr) {
      complete_ = false;
      return *this;
    }
    std::vector<double> subtracted = b->values(figure);
    for (double& value : subtracted) value *= times;
    ClaimedDifference difference;
    const auto described =
        std::find_if(figure_descriptions().begin(), figure_descriptions().end(),
                     [&](const FigureDescription& each) { return each.value == figure; });
    difference.text = std::string(described->heading) + ": " + first + " minus " +
                      (times == 2.0 ? "twice " : "") + second;
    difference.decimals = std::max(described->decimals, 2);
    difference.difference = paired_difference(a->values(figure), subtracted);
    difference.is_below = is_below;
    difference.least_standard_errors = least_standard_errors;
    claim_.differences.push_back(difference);
    return *this;
  }

  const CompensationStudy& study_;
  Claim claim_;
  bool complete_ = true;
};

}  // namespace

double ClaimedDifference::standard_errors() const {
  const double distance = is_below ? -difference.mean : difference.mean;
  if (difference.standard_error > 0.0) return distance / difference.standard_error;
  if (distance == 0.0) return 0.0;
  return std::copysign(std::numeric_limits<double>::infinity(), distance);
}

bool ClaimedDifference::is_clear() const {
  return std::abs(standard_errors()) >= kClear;
}

bool Claim::holds() const {
  return is_known() && std::all_of(differences.begin(), differences.end(),
                                   [](const auto& difference) { return difference.holds(); });
}

std::string Claim::verdict() const {
  if (!is_known()) return "not in this study";
  if (holds()) {
    const bool is_clear = std::all_of(differences.begin(), differences.end(),
                                      [](const auto& difference) { return difference.is_clear(); });
    return is_clear ? "holds" : "holds, but chance is not ruled out";
  }
  const bool is_clear = std::any_of(differences.begin(), differences.end(), [](const auto& each) {
    return !each.holds() && each.standard_errors() <= -kClear;
  });
  return is_clear ? "does not hold" : "does not hold, but chance is not ruled out";
}

std::vector<Claim> five_points(const CompensationStudy& study) {
  const auto claim = [&](const std::string& text) { return ClaimBuilder(study, text); };
  return {claim("1. Distinct particles at the end: RSR < PR < RBR")
              .below(&Figures::distinct_end, "RSR", "PR")
              .below(&Figures::distinct_end, "PR", "RBR")
              .claim(),
          claim("2. Compensation beats RSR on eq. 5 by more than three standard errors")
              .below(&Figures::feature_error, "compensation", "RSR", kClear)
              .claim(),
          claim("3. Eq. 5 falls as the ratio rises over 10, 20, 50, 100 %")
              .below(&Figures::feature_error, "compensation 20 %", "compensation 10 %")
              .below(&Figures::feature_error, "compensation 50 %", "compensation 20 %")
              .below(&Figures::feature_error, "compensation", "compensation 50 %")
              .claim(),
          claim("4. T_N = 1 costs more than twice the calls of 0.75 and does not lower the error "
                "after C")
              .above(&Figures::calls, "compensation T_N=1", "compensation", 2.0)
              .above(&Figures::feature_error_end, "compensation T_N=1", "compensation")
              .claim(),
          claim("5. Compensation with 50 particles beats RSR with 100 on eq. 5")
              .below(&Figures::feature_error, "compensation M=50", "RSR")
              .claim()};
}

std::vector<Claim> other_claims_of_paper_k(const CompensationStudy& study) {
  const auto claim = [&](const std::string& text) { return ClaimBuilder(study, text); };
  return {
      claim("Resampling lowers eq. 5 (Fig. 8)").below(&Figures::feature_error, "RSR", "NR").claim(),
      claim("Eq. 5: RSR < PR < RBR (Table IV)")
          .below(&Figures::feature_error, "RSR", "PR")
          .below(&Figures::feature_error, "PR", "RBR")
          .claim(),
      claim("Compensation beats RSR on eq. 6 (Fig. 12)")
          .below(&Figures::position_error, "compensation", "RSR")
          .claim(),
      claim("Compensation has the larger N_eff (Fig. 11)")
          .above(&Figures::effective_sample_size, "compensation", "RSR")
          .claim(),
      claim("Pairing by rank is best on eq. 5 (Table V)")
          .below(&Figures::feature_error, "compensation", "compensation random")
          .below(&Figures::feature_error, "compensation", "compensation roulette")
          .claim(),
      claim("N_eff rises with the ratio (Table VI)")
          .above(&Figures::effective_sample_size, "compensation 20 %", "compensation 10 %")
          .above(&Figures::effective_sample_size, "compensation 50 %", "compensation 20 %")
          .above(&Figures::effective_sample_size, "compensation", "compensation 50 %")
          .claim(),
      claim("T_N = 1 is best on the average of eq. 5 (Fig. 14)")
          .below(&Figures::feature_error, "compensation T_N=1", "compensation")
          .below(&Figures::feature_error, "compensation T_N=1", "compensation T_N=0.5")
          .claim()};
}

std::vector<Claim> claims_of_confidence(const CompensationStudy& study) {
  const auto claim = [&](const std::string& text) { return ClaimBuilder(study, text); };
  return {claim("Compensation gives the better weighted-mean map, on average")
              .below(&Figures::map_error, "compensation", "RSR")
              .claim(),
          claim("… and at the end, with both loops closed")
              .below(&Figures::map_error_end, "compensation", "RSR")
              .claim(),
          claim("… but believes too much in it: fewer truths inside its 95 % ellipses")
              .below(&Figures::map_inside, "compensation", "RSR")
              .below(&Figures::pose_inside, "compensation", "RSR")
              .claim(),
          claim("A ratio of 20 % gives the better map, too")
              .below(&Figures::map_error, "compensation 20 %", "RSR")
              .below(&Figures::map_error_end, "compensation 20 %", "RSR")
              .claim(),
          claim("… and is less over-confident than RSR")
              .above(&Figures::map_inside, "compensation 20 %", "RSR")
              .above(&Figures::pose_inside, "compensation 20 %", "RSR")
              .claim()};
}

}  // namespace pf_resampling
