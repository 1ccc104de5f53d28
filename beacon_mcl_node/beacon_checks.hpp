#pragma once

#include <pf_resampling/BeaconArray.h>
#include <pf_resampling/BeaconRange.h>

#include <optional>
#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"
#include "src/frames/frame_names.hpp"
#include "src/messages/rejects.hpp"

namespace pf_resampling {

/// What can be told of a message by itself, `most`: the beacons that it may have. Nothing: it can
/// be used.
std::optional<Rejection> check(const BeaconRange& range);
std::optional<Rejection> check(const BeaconArray& beacons, const FrameNames& frames, int most);

/// A checked array. A height of NaN means that the beacon is as high as the antenna.
std::vector<Beacon> to_beacons(const BeaconArray& beacons);

/// And back, as of `frame`.
BeaconArray to_message(const std::vector<Beacon>& beacons, const std::string& frame);

}  // namespace pf_resampling
