#pragma once

#include <pf_resampling/LandmarkObservation.h>
#include <pf_resampling/LandmarkObservationArray.h>

#include <optional>
#include <string>

#include "src/messages/rejects.hpp"

namespace pf_resampling {

/// What can be told of a scan by itself, `most`: the observations that it may have. Nothing: it can
/// be used.
std::optional<Rejection> check(const LandmarkObservationArray& scan, int most);

/// The same of one of its observations.
std::optional<Rejection> check(const LandmarkObservation& observation);

/// One of the observations of a scan that says the same as an earlier one.
std::optional<Rejection> check_repeated(const LandmarkObservation& observation,
                                        const LandmarkObservationArray& scan);

/// Which id a scan has at two places, in words; empty: none.
std::string id_at_two_places(const LandmarkObservationArray& scan);

}  // namespace pf_resampling
