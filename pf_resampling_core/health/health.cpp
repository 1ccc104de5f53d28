#include "pf_resampling_core/health/health.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "pf_resampling_core/health/lost_detector.hpp"
#include "pf_resampling_core/health/unknown_place.hpp"

namespace pf_resampling {
namespace {

constexpr double kMemory = 3.0;  // s

const EnumNames<Health> kNames{"health",
                               {{Health::starting, "starting"},
                                {Health::lost, "lost"},
                                {Health::converging, "converging"},
                                {Health::doubtful, "doubtful"},
                                {Health::degenerate, "degenerate"},
                                {Health::depleted, "depleted"},
                                {Health::too_slow, "too_slow"},
                                {Health::healthy, "healthy"}}};

}  // namespace

const EnumNames<Health>& names_of(Health) {
  return kNames;
}

HealthJudgement judge_health(const HealthInputs& inputs) {
  if (!inputs.has_belief) {
    return {Health::starting, "waiting for " + inputs.waits_for, inputs.remedy};
  }
  if (inputs.lost > kLikelyLost) {
    return {Health::lost, "the " + inputs.observations + " contradict the belief: lost?",
            "Wait for recovery (recovery/enabled), or give the pose (initialpose)."};
  }
  const double unknown = either_probability(inputs.position_unknown, inputs.heading_unknown);
  if (either_probability(inputs.lost, unknown) > kLikelyLost) {
    const bool is_position =
        inputs.position_unknown > kLikelyLost || inputs.position_unknown >= inputs.heading_unknown;
    return {Health::converging,
            is_position ? "the position is uncertain by a large part of the scene"
                        : "the heading is uncertain by a large part of a turn",
            "Drive on until it is known, and do not rely on it until then."};
  }
  if (!inputs.is_placed) {
    return {Health::converging, "nothing that was seen shows yet where in the map the robot is",
            "Drive to where landmarks of the map are, or give the pose (initialpose)."};
  }
  if (inputs.is_contradicted) {
    return {Health::doubtful,
            "odometry and " + inputs.observations + " contradict each other: slipping, or carried?",
            "Drive on where there is something to see, and do not rely on the pose before."};
  }
  if (inputs.misses_landmarks) {
    return {Health::doubtful, "landmarks that should be in view are not seen",
            "Do not rely on the pose or the map: a place was taken for one that looks alike."};
  }
  if (!inputs.misfit.empty()) {
    return {
        Health::doubtful, inputs.misfit + " contradict the others: moved, reflected, or faulty?",
        "If /diagnostics names one, remove it until it is repaired; if not, drive on, with turns."};
  }
  if (inputs.map_is_wrong) {
    return {Health::doubtful, "a landmark is not where the map has it",
            "Findings name it; correct the map, or put it back."};
  }
  if (inputs.odometry_is_wrong) {
    return {Health::doubtful, "the odometry has a wrong scale or sign, which is taken out",
            "Findings name it; mend the odometry."};
  }
  if (inputs.sample_size < kFewParticles) {
    return {Health::degenerate, "few particles carry the weight",
            "Use more particles, or a realistic sensor noise."};
  }
  if (inputs.descendants < kFewParticles) {
    return {
        Health::depleted, "few particles have descendants",
        "Renew earlier (population/threshold), or add noise to the copies (excitation/method)."};
  }
  if (inputs.needs_past && !inputs.renews_past && inputs.histories < kFewParticles) {
    return {Health::depleted,
            "particle diversity is nearly gone; the map is less certain than its covariances say",
            "Use population/renewal redraw, or freeze a finished map (map/frozen)."};
  }
  if (!inputs.keeps_up) {
    return {Health::too_slow, "updates take longer than the time between observations",
            "Use fewer particles, or send fewer " + inputs.observations + "."};
  }
  return {};
}

std::string sentence_of(const HealthJudgement& judgement) {
  std::string sentence = to_string(judgement.health);
  std::replace(sentence.begin(), sentence.end(), '_', ' ');
  sentence[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence[0])));
  if (judgement.reason.empty()) return sentence;
  const bool is_question = judgement.reason.back() == '?';
  return sentence + ": " + judgement.reason + (is_question ? " " : ". ") + judgement.remedy;
}

void RecentMean::add(double value, double duration) {
  if (!std::isfinite(value)) return;
  const double weight = is_empty_ ? 1.0 : 1.0 - std::exp(-std::max(0.0, duration) / kMemory);
  is_empty_ = false;
  value_ += weight * (value - value_);
}

}  // namespace pf_resampling
