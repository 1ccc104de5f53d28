#pragma once

#include <string>

#include "pf_resampling_core/parameters/enum_names.hpp"

namespace pf_resampling {

/// Whether a filter can be believed, and if not, why not: one word for the node's status, its
/// diagnostics, the panel and the evaluation of a bag.
enum class Health {
  starting,    ///< there is no belief yet
  lost,        ///< what is seen does not fit the belief
  converging,  ///< position or heading is not known yet, or no longer
  doubtful,    ///< what is seen, or what a beacon says, has not fitted the rest for a while
  degenerate,  ///< few particles carry the weight: the belief is a picture of these few
  depleted,    ///< few are left of those that there were: the belief is less sure than it looks
  too_slow,    ///< updates take longer than the time between observations
  healthy,
};
const EnumNames<Health>& names_of(Health);

/// Share of the particles below which they are few.
inline constexpr double kFewParticles = 0.1;

/// What a judgement needs. The defaults are those of a filter that is well.
struct HealthInputs {
  bool has_belief = true;
  double lost = 0.0;              ///< LostDetector::probability()
  double position_unknown = 0.0;  ///< probability that the position is; farther_probability()
  double heading_unknown = 0.0;   ///< and the heading; unknown_heading_probability()
  bool is_placed = true;         ///< in a map that was given: what is seen shows where the robot is
  bool is_contradicted = false;  ///< by what was seen last, which is to be explained anew
  bool misses_landmarks = false;  ///< those that should be in view are not seen, too many
  std::string misfit;  ///< what does not fit the rest, as "the ranges of a beacon"; empty: all does
  bool map_is_wrong = false;       ///< a finding is open: a landmark that is seen was moved
  bool odometry_is_wrong = false;  ///< likewise: its scale, by far
  /// Shares of the particles: N_eff, and those before the last renewal that have descendants, both
  /// as RecentMean, since one update says nothing; and those at the start.
  double sample_size = 1.0;
  double descendants = 1.0;
  double histories = 1.0;
  /// Whether what particles know of the past still matters: FastSLAM that maps hangs its landmarks
  /// on it. A filter that knows the places of what it sees can forget.
  bool needs_past = false;
  bool renews_past = false;                   ///< whether redraws bring it back
  bool keeps_up = true;                       ///< with the observations
  std::string observations = "observations";  ///< what they are called, in the plural
  std::string waits_for, remedy;              ///< without a belief: what stands in its way
};

struct HealthJudgement {
  Health health = Health::healthy;
  std::string reason;  ///< why, in a few words that begin small and hold no figures; empty: healthy
  std::string remedy;  ///< what to do about it, a sentence; empty: nothing
};

/// The first of Health's values that applies.
HealthJudgement judge_health(const HealthInputs& inputs);

/// In one line, for people: "Depleted: few particles ... Take ...", "Healthy".
std::string sentence_of(const HealthJudgement& judgement);

/// Mean of a value over about the last three seconds; newer ones count more.
class RecentMean {
 public:
  /// `duration`: s since the value before.
  void add(double value, double duration);
  /// 1 before the first.
  double value() const { return value_; }
  void reset() { *this = RecentMean(); }

 private:
  bool is_empty_ = true;
  double value_ = 1.0;
};

}  // namespace pf_resampling
