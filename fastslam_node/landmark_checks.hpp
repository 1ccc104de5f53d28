#pragma once

#include <pf_resampling/LandmarkObservation.h>
#include <pf_resampling/LandmarkObservationArray.h>

#include <optional>

#include "src/messages/rejects.hpp"

namespace pf_resampling {

/// What can be told of a scan by itself, `most`: the observations that it may have. Nothing: it can
/// be used.
std::optional<Rejection> check(const LandmarkObservationArray& scan, int most);

/// The same of one of its observations.
std::optional<Rejection> check(const LandmarkObservation& observation);

}  // namespace pf_resampling
