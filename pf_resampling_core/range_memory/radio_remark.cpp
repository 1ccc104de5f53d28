#include "pf_resampling_core/range_memory/radio_remark.hpp"

#include <cmath>
#include <cstdio>

namespace pf_resampling {

std::string remark_on(const RadioKnowledge& radio, const std::vector<Beacon>& listed) {
  const std::string name = "beacon " + std::to_string(radio.id);
  if (radio.repeats) {
    return name + " repeats the ranges of beacon " + std::to_string(radio.in_place_of) +
           ": it takes no part";
  }
  char text[160];
  if (radio.account == RadioAccount::biased) {
    std::snprintf(text, sizeof(text), " measures %.2f ± %.2f m too %s: give it a calibration",
                  std::abs(radio.calibration.bias), radio.bias_sigma,
                  radio.calibration.bias > 0.0 ? "long" : "short");
    return name + text + "; until then, this is used";
  }
  if (radio.account != RadioAccount::elsewhere || radio.places.empty()) return "";
  if (radio.in_place_of >= 0) {
    std::snprintf(text, sizeof(text),
                  " seems to be at the place of beacon %d: swapped in the list, or repeated?",
                  radio.in_place_of);
    return name + text + " Until it is settled, that place is used";
  }
  for (const Beacon& beacon : listed) {
    if (beacon.id != radio.id) continue;
    const RadioPlace& place = radio.places.front();
    std::snprintf(
        text, sizeof(text),
        " is listed %.1f m from where its ranges put it (%.2f, %.2f -> %.2f, %.2f ± %.2f): "
        "is the list right?",
        (place.position - beacon.position.head<2>()).norm(), beacon.position.x(),
        beacon.position.y(), place.position.x(), place.position.y(),
        std::sqrt(0.5 * place.covariance.trace()));
    return name + text + " Until it is settled, that place is used";
  }
  return "";
}

std::string place_in_words(const RadioKnowledge& radio) {
  const std::string name = "beacon " + std::to_string(radio.id);
  const std::string ranges = "; " + std::to_string(radio.ranges) + " ranges";
  if (radio.repeats) return remark_on(radio, {});
  if (radio.account == RadioAccount::as_listed) return name + " is as listed" + ranges;
  if (radio.places.empty()) return name + " is not found: drive about it" + ranges;
  const RadioPlace& best = radio.places.front();
  char text[160];
  if (radio.places.size() > 1) {
    const RadioPlace& other = radio.places[1];
    std::snprintf(text, sizeof(text),
                  ": more than one place fits, (%.2f, %.2f) and (%.2f, %.2f), %.0f to %.0f %%: "
                  "drive a turn near it",
                  best.position.x(), best.position.y(), other.position.x(), other.position.y(),
                  100.0 * best.probability, 100.0 * other.probability);
  } else {
    std::snprintf(text, sizeof(text), " is at (%.2f, %.2f), known to %.2f m", best.position.x(),
                  best.position.y(), std::sqrt(0.5 * best.covariance.trace()));
  }
  return name + text + ranges;
}

}  // namespace pf_resampling
