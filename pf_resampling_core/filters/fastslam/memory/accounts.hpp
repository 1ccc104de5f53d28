#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"

namespace pf_resampling {

/// A landmark of a drive.
struct RememberedLandmark {
  std::int64_t id = -1;         ///< -1: it is none any more
  int last_seen = 0;            ///< update in which it was seen last
  int fitted = 0, doubted = 0;  ///< sightings, where landmarks have ids
  /// The particles have given it up, but it may be another seen elsewhere, of which the odometry
  /// is too uncertain to tell.
  bool is_dormant = false;
  int twice = 0;  ///< scans that have seen its id at two places
};

/// Of what all sightings of a drive are, where landmarks have no ids, and the solution under that.
struct Account {
  SegmentGraph graph;
  std::vector<RememberedLandmark> landmarks;
  SegmentSolution solution;
  std::shared_ptr<const SegmentEquations> equations;  ///< factorised at the solution
};

/// When things were seen.
struct DriveTimes {
  std::vector<double> begins;  ///< of the segments, s since the start
  int before = 0;              ///< updates before these segments
  int updates = 0;
  int decided = 0;  ///< updates whose sightings have been decided before
};

/// Solves, and decides what was seen: what came back into view since the last time counts as
/// another landmark, with an id from `next_id` on, until it is clear that it is not; landmarks that
/// are one become one, under the number of the older; and sightings may change their landmarks, as
/// long as that makes all of it more likely. What is new and what was seen since arrivals are
/// decided anew. All this is tried on all of a small map (fewer than 60 landmarks), of which
/// landmarks that can be done without go, too; of a larger one on what is new, with a Gaussian of
/// what the rest of the drive says. False, with the account as it was, if there is no solution.
bool decide_associations(const ReassociationOptions& options, const DriveTimes& times,
                         std::int64_t* next_id, Account* account);

}  // namespace pf_resampling
