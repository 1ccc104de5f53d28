#include "beacon_mcl_node/range_sensor.hpp"

#include <cmath>

#include "src/frames/frame_names.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"

namespace pf_resampling {
namespace {

RangeReading rejected(const Rejection& reason) {
  return {std::nullopt, reason};
}

}  // namespace

std::optional<int> BeaconNames::id_of(const std::string& frame) const {
  const auto named = frames.find(without_slash(frame));
  if (named != frames.end()) return named->second;
  return pattern.id_of(frame);
}

BeaconNames names_of(const BeaconMclPipelineOptions& options) {
  return {options.beacon_frames, FramePattern(options.frame_pattern),
          options.antenna.empty() ? options.frames.base : options.antenna};
}

RangeReading read_range(const sensor_msgs::Range& message, const BeaconNames& names) {
  const std::string& frame = message.header.frame_id;
  const std::optional<int> beacon = names.id_of(frame);
  if (!beacon) {
    return rejected(rejection(RejectReason::unknown_beacon, "frame '", frame,
                              "' does not name a beacon: change range_input/frame_pattern to match "
                              "it, or name it as `frame` in the list `beacons`"));
  }
  const float least = message.min_range;
  const float most = message.max_range;
  if (std::isnan(message.range) || std::isnan(least) || std::isnan(most)) {
    return rejected(rejection(RejectReason::not_finite, "the range to '", frame, "' is ",
                              message.range, " m, of ", least, " to ", most, " m"));
  }
  const bool has_limits = least != 0.0F || most != 0.0F;
  if (has_limits && least > most) {
    return rejected(rejection(RejectReason::impossible_range, "the sensor of '", frame,
                              "' measures from ", least, " m to ", most, " m"));
  }
  const bool is_outside = has_limits && (message.range < least || message.range > most);
  if (is_outside || std::isinf(message.range)) return {};
  BeaconRange range;
  range.header = message.header;
  range.header.frame_id = names.antenna;
  range.beacon = *beacon;
  range.range = message.range;
  return {range, std::nullopt};
}

}  // namespace pf_resampling
