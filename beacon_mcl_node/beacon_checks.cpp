#include "beacon_mcl_node/beacon_checks.hpp"

#include <cmath>
#include <limits>
#include <set>

#include "src/odometry/input_checks.hpp"

namespace pf_resampling {

std::optional<Rejection> check(const BeaconRange& range) {
  if (auto wrong = check(range.header.stamp)) return wrong;
  if (!std::isfinite(range.range)) {
    return rejection(RejectReason::not_finite, "the range to beacon ", range.beacon, " is ",
                     range.range);
  }
  if (range.range <= 0.0) {
    return rejection(RejectReason::not_positive, "the range to beacon ", range.beacon, " is ",
                     range.range, " m");
  }
  if (!std::isfinite(range.variance)) {
    return rejection(RejectReason::not_finite, "the variance of the range to beacon ", range.beacon,
                     " is ", range.variance);
  }
  if (range.variance < 0.0) {
    return rejection(RejectReason::impossible_variance, "the variance of the range to beacon ",
                     range.beacon, " is ", range.variance, " m^2");
  }
  return std::nullopt;
}

std::optional<Rejection> check(const BeaconArray& array, const FrameNames& frames, int most) {
  if (auto wrong =
          check_frame("header.frame_id", array.header.frame_id, frames.map, "frames/map")) {
    return wrong;
  }
  if (array.beacons.empty()) return rejection(RejectReason::empty, "it contains no beacon");
  if (array.beacons.size() > static_cast<std::size_t>(most)) {
    return rejection(RejectReason::too_many, "it contains ", array.beacons.size(),
                     " beacons, more than the limit of ", most);
  }
  std::set<int> ids;
  for (const auto& beacon : array.beacons) {
    if (!std::isfinite(beacon.position.x) || !std::isfinite(beacon.position.y) ||
        std::isinf(beacon.position.z)) {
      return rejection(RejectReason::not_finite, "the position of beacon ", beacon.id,
                       " has a NaN or infinity");
    }
    if (!ids.insert(beacon.id).second) {
      return rejection(RejectReason::duplicate_beacon, "beacon ", beacon.id, " is there twice");
    }
  }
  return std::nullopt;
}

std::vector<Beacon> to_beacons(const BeaconArray& array) {
  std::vector<Beacon> beacons;
  for (const auto& message : array.beacons) {
    Beacon beacon;
    beacon.id = message.id;
    beacon.is_planar = std::isnan(message.position.z);
    beacon.position = {message.position.x, message.position.y,
                       beacon.is_planar ? 0.0 : message.position.z};
    beacons.push_back(beacon);
  }
  return beacons;
}

BeaconArray to_message(const std::vector<Beacon>& beacons, const std::string& frame) {
  BeaconArray array;
  array.header.frame_id = frame;
  for (const Beacon& beacon : beacons) {
    array.beacons.emplace_back();
    array.beacons.back().id = beacon.id;
    array.beacons.back().position.x = beacon.position.x();
    array.beacons.back().position.y = beacon.position.y();
    array.beacons.back().position.z =
        beacon.is_planar ? std::numeric_limits<double>::quiet_NaN() : beacon.position.z();
  }
  return array;
}

}  // namespace pf_resampling
