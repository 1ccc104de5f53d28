// What does not fit: the belief may be wrong, or the id.
#include <algorithm>
#include <set>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

namespace pf_resampling {
namespace {

// The belief is wrong if of so many sightings so many did not fit (with one id in a hundred
// misread, by chance once in 10⁵ times), of several landmarks: one or two may have been moved.
constexpr std::size_t kNewest = 12;
constexpr std::size_t kManyDoubts = 4;
constexpr std::size_t kManyDoubted = 3;
// Or if so many in a row did not, of two landmarks or of one that was seen so often and until so
// few updates ago: nothing is moved before the eyes of the robot.
constexpr std::size_t kManyInARow = 3;
constexpr int kFewestInView = 3;
constexpr int kInView = 8;
constexpr double kDistrusted = 4.0;  // s that odometry is distrusted for then
constexpr double kWrongId = 30.0;    // cost of an id that two landmarks have; slips cost 30 to 50

}  // namespace

void Memory::append_doubtful_sighting(std::int64_t landmark_id, const SightingFactor& sighting,
                                      bool may_be_another) {
  const auto found = numbers_.find(landmark_id);
  if (found == numbers_.end()) return append_sighting(landmark_id, sighting);
  RememberedLandmark& landmark = state_.landmarks[static_cast<std::size_t>(found->second)];
  if (++landmark.doubted > std::max(kFewFitted, landmark.fitted) && may_be_another) {
    forget_landmark(landmark_id);  // misread when it was first seen, or moved long ago
    return append_sighting(landmark_id, sighting);
  }
  state_.open_doubts.push_back(state_.open.sightings.size());
  SightingFactor seen = sighting;
  seen.pose = static_cast<int>(state_.open.motions.size()) - 1;
  add_sighting(found->second, seen, &state_.open);
  note_newest(landmark_id);
  if (belief_is_wrong()) state_.distrusted = state_.time + kDistrusted;
}

void Memory::note_newest(std::int64_t doubted) {
  if (state_.newest.size() == kNewest) state_.newest.erase(state_.newest.begin());
  state_.newest.push_back(doubted);
}

bool Memory::belief_is_wrong() const {
  std::set<std::int64_t> doubted, in_a_row;
  std::size_t doubts = 0;
  std::size_t row = 0;
  bool was_in_view = false;
  for (const std::int64_t id : state_.newest) {
    const auto found = numbers_.find(id);
    if (found == numbers_.end()) {
      in_a_row.clear();
      row = 0;
      was_in_view = false;
      continue;
    }
    const RememberedLandmark& landmark = state_.landmarks[static_cast<std::size_t>(found->second)];
    ++row;
    was_in_view |=
        landmark.fitted >= kFewestInView && state_.updates - landmark.last_seen <= kInView;
    ++doubts;
    doubted.insert(id);
    in_a_row.insert(id);
  }
  return (doubts >= kManyDoubts && doubted.size() >= kManyDoubted) ||
         (row >= kManyInARow && (in_a_row.size() > 1 || was_in_view));
}

// The sightings that did not fit are of their landmarks: it is the belief that is wrong.
void Memory::believe_doubts() {
  for (const std::size_t i : state_.open_doubts) {
    const SightingFactor& sighting = state_.open.sightings[i];
    const int landmark = state_.open.landmarks[static_cast<std::size_t>(sighting.landmark)];
    --state_.landmarks[static_cast<std::size_t>(landmark)].doubted;
  }
  state_.newest.clear();
  state_.open_doubts.clear();
}

// They are not: misread ids, or landmarks that were moved.
void Memory::leave_out_doubts() {
  if (state_.open_doubts.empty()) return;
  Segment believed;
  believed.motions = state_.open.motions;
  believed.unassigned = state_.open.unassigned;
  for (std::size_t i = 0; i < state_.open.sightings.size(); ++i) {
    const SightingFactor& sighting = state_.open.sightings[i];
    if (std::binary_search(state_.open_doubts.begin(), state_.open_doubts.end(), i)) continue;
    add_sighting(state_.open.landmarks[static_cast<std::size_t>(sighting.landmark)], sighting,
                 &believed);
  }
  state_.open = std::move(believed);
  state_.open_doubts.clear();
}

// Of landmarks that were not in view just before: those may have the ids of others.
std::set<std::int64_t> Memory::doubted_ids() const {
  std::set<std::int64_t> doubted;
  for (const std::int64_t id : state_.newest) {
    const auto found = numbers_.find(id);
    if (found == numbers_.end()) continue;
    const RememberedLandmark& landmark = state_.landmarks[static_cast<std::size_t>(found->second)];
    const bool was_in_view =
        landmark.fitted >= kFewestInView &&
        state_.updates - landmark.last_seen <= kInView + static_cast<int>(kNewest);
    if (was_in_view) return {};
    doubted.insert(id);
  }
  return doubted;
}

// Where the belief is wrong, the wheels slipped; unless that takes more than that each landmark
// that did not fit has the id of another. Then the next sightings will tell: there is no solution,
// and the doubts stay.
bool Memory::solve(double robust_width) {
  if (!belief_is_wrong()) return solve_for_all(robust_width).is_solved;
  const std::set<std::int64_t> doubted = doubted_ids();
  Memory before = *this;
  believe_doubts();
  const SegmentSolution believed = solve_for_all(robust_width);
  if (doubted.empty()) return believed.is_solved;
  Memory with_wrong_ids = before;
  with_wrong_ids.state_.newest.clear();
  const SegmentSolution other = with_wrong_ids.solve_for_all(robust_width);
  const double cost = other.cost + kWrongId * static_cast<double>(doubted.size());
  if (!other.is_solved || (believed.is_solved && believed.cost <= cost)) return believed.is_solved;
  *this = std::move(before);
  return false;
}

}  // namespace pf_resampling
