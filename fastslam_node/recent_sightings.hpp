#pragma once

#include <ros/time.h>

#include <deque>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/relocalization.hpp"

namespace pf_resampling {

/// The landmarks with ids that were seen in the last seconds and are in the map, for
/// relocalize().
class RecentSightings {
 public:
  /// Takes a scan from a sensor that the belief puts at `eye` (map frame).
  void add(ros::Time stamp, const Pose2& eye,
           const std::vector<RangeBearingObservation>& observations,
           const LandmarkSensorOptions& sensor, FastSlam* filter);
  void clear() { sightings_.clear(); }

  /// Whether they could tell where the robot is: several scans, of different landmarks.
  bool suffice() const;
  std::vector<LandmarkSighting> all() const;

 private:
  struct Stamped {
    ros::Time stamp;
    LandmarkSighting sighting;
  };
  std::deque<Stamped> sightings_;  // in order of time
};

/// Whether most of a scan's observations of landmarks that were known before were believed.
bool fits(const std::vector<ObservationOutcome>& outcomes);

}  // namespace pf_resampling
