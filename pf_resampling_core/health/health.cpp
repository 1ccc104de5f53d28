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
    return {Health::starting, "waiting for " + inputs.waits_for, "Give it what it waits for."};
  }
  if (inputs.lost > kLikelyLost) {
    return {Health::lost, "the " + inputs.observations + " do not fit the belief: lost?",
            "Wait for recovery (recovery/enabled), or say where the robot is (initialpose)."};
  }
  const double unknown = either_probability(inputs.position_unknown, inputs.heading_unknown);
  if (either_probability(inputs.lost, unknown) > kLikelyLost) {
    const bool is_position =
        inputs.position_unknown > kLikelyLost || inputs.position_unknown >= inputs.heading_unknown;
    return {Health::converging,
            is_position ? "the position is uncertain by a good part of the scene"
                        : "the heading is uncertain by a good part of a turn",
            "Drive on until it is known, and do not rely on it before."};
  }
  if (!inputs.misfit.empty()) {
    return {Health::doubtful, inputs.misfit + " do not fit the others: moved, reflected, or lying?",
            "See which in /diagnostics, and do without until it is right again."};
  }
  if (inputs.sample_size < kFewParticles) {
    return {Health::degenerate, "few particles carry the weight",
            "Take more particles, or state the noise of the sensor as large as it is."};
  }
  if (inputs.descendants < kFewParticles) {
    return {Health::depleted, "few particles have descendants",
            "Renew earlier (population/threshold), or spread the copies (excitation/method)."};
  }
  if (inputs.needs_past && !inputs.renews_past && inputs.histories < kFewParticles) {
    return {Health::depleted,
            "few histories of the map's past are left: it is less certain than it looks",
            "Take population/renewal redraw, or freeze the map if it is done (map/frozen)."};
  }
  if (!inputs.keeps_up) {
    return {Health::too_slow, "updates take longer than the time between observations",
            "Take fewer particles, or send fewer " + inputs.observations + "."};
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
