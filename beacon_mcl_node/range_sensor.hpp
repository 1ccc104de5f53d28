#pragma once

#include <pf_resampling/BeaconRange.h>
#include <sensor_msgs/Range.h>

#include <map>
#include <optional>
#include <string>

#include "beacon_mcl_node/pipeline_options.hpp"
#include "src/frames/frame_pattern.hpp"
#include "src/messages/rejects.hpp"

namespace pf_resampling {

/// Which beacon a sensor_msgs/Range is of: its frame_id is the beacon's name.
struct BeaconNames {
  std::map<std::string, int> frames;  ///< names of beacons; they go first
  FramePattern pattern;               ///< for all others
  std::string antenna;                ///< frame on the robot that these ranges are measured from

  std::optional<int> id_of(const std::string& frame) const;
};

/// As the options say.
BeaconNames names_of(const BeaconMclPipelineOptions& options);

/// What a sensor_msgs/Range says: a range, or why it cannot be used; neither: there was no echo.
struct RangeReading {
  std::optional<BeaconRange> range;
  std::optional<Rejection> rejection;
};

/// Reads one. An infinite range (REP 117), or one outside min_range and max_range, is no echo; both
/// limits zero: there are none. The variance is unknown.
RangeReading read_range(const sensor_msgs::Range& message, const BeaconNames& names);

}  // namespace pf_resampling
