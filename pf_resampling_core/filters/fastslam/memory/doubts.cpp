// What does not fit: the belief may be wrong, or the id.
#include <algorithm>
#include <cmath>
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
// few updates ago: nothing is moved before the eyes of the robot. Or the id is wrong, see solve().
constexpr std::size_t kManyInARow = 3;
constexpr int kFewestInView = 3;
constexpr int kInView = 8;
constexpr double kDistrusted = 4.0;  // s that odometry is distrusted for then
// What wrong ids add to the negative log evidence: that two landmarks have one id, 7, and where the
// other stands, 13; more if the first was in view; and each sighting that fits the other.
constexpr double kWrongId = 20.0;
constexpr double kWrongIdInView = 26.0;
constexpr double kFit = 1.0;
constexpr int kTwice = 3;           // scans that have seen an id twice: it is that of two landmarks
constexpr double kLatest = 10.0;    // s, and
constexpr int kLatestUpdates = 50;  // updates, in which one may have misled the belief, ...
constexpr std::size_t kMostSuspects = 12;  // ... unless so many were seen: others would hold it

}  // namespace

void Memory::append_doubtful_sighting(std::int64_t landmark_id, const SightingFactor& sighting,
                                      bool may_be_another) {
  const auto found = numbers_.find(landmark_id);
  if (found == numbers_.end()) return append_sighting(landmark_id, sighting);
  RememberedLandmark& landmark = state_.landmarks[static_cast<std::size_t>(found->second)];
  if (landmark.twice >= kTwice) return;
  if (++landmark.doubted > std::max(kFewFitted, landmark.fitted) && may_be_another) {
    landmark.last_seen = state_.updates;
    forget_landmark(landmark_id);  // misread when it was first seen, or moved long ago
    return append_sighting(landmark_id, sighting);
  }
  state_.open_doubts.push_back(state_.open.sightings.size());
  SightingFactor seen = sighting;
  seen.pose = static_cast<int>(state_.open.motions.size()) - 1;
  add_sighting(found->second, seen, &state_.open);
  const auto& newest = state_.newest;
  const bool says_something_new =
      std::find(newest.begin(), newest.end(), landmark_id) == newest.end();
  if (says_something_new) state_.is_refused = false;
  note_newest(landmark_id);
  if (belief_is_wrong()) state_.distrusted = state_.time + kDistrusted;
}

void Memory::note_twice(std::int64_t landmark_id) {
  const auto found = numbers_.find(landmark_id);
  if (found == numbers_.end()) return;
  ++state_.landmarks[static_cast<std::size_t>(found->second)].twice;
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
  state_.open = without(state_.open_doubts, state_.open);
  state_.open_doubts.clear();
}

// Landmarks of which one may have misled the belief: those that fitted lately, and of several that
// did not fit each.
std::vector<int> Memory::suspects() const {
  std::set<std::int64_t> doubted(state_.newest.begin(), state_.newest.end());
  doubted.erase(-1);
  std::vector<int> suspects;
  for (std::size_t l = 0; l < state_.landmarks.size(); ++l) {
    const RememberedLandmark& landmark = state_.landmarks[l];
    const bool is_suspect = doubted.count(landmark.id) > 0
                                ? doubted.size() > 1
                                : state_.updates - landmark.last_seen <= kLatestUpdates;
    if (landmark.id >= 0 && is_suspect) suspects.push_back(static_cast<int>(l));
  }
  if (suspects.size() > kMostSuspects) suspects.clear();
  return suspects;
}

// What did not fit is of other landmarks with those ids, and fits those.
double Memory::cost_of_wrong_ids() const {
  double cost = kFit * static_cast<double>(state_.open_doubts.size());
  std::set<std::size_t> landmarks;
  for (const std::size_t i : state_.open_doubts) {
    const int track = state_.open.sightings[i].landmark;
    landmarks.insert(
        static_cast<std::size_t>(state_.open.landmarks[static_cast<std::size_t>(track)]));
  }
  for (const std::size_t l : landmarks) {
    const RememberedLandmark& landmark = state_.landmarks[l];
    const bool was_in_view =
        landmark.fitted >= kFewestInView &&
        state_.updates - landmark.last_seen <= kInView + static_cast<int>(kNewest);
    cost += was_in_view ? kWrongIdInView : kWrongId;
  }
  return cost;
}

// Without what the last seconds have seen of a landmark that was known before; how often that is.
std::size_t Memory::leave_out_newest(int landmark) {
  const double from = state_.time - kLatest;
  SegmentGraph& graph = state_.graph;
  std::size_t left_out = 0;
  const auto strip = [&](Segment* segment) {
    std::vector<std::size_t> of_it;
    for (std::size_t i = 0; i < segment->sightings.size(); ++i) {
      const auto track = static_cast<std::size_t>(segment->sightings[i].landmark);
      if (segment->landmarks[track] == landmark) of_it.push_back(i);
    }
    if (of_it.empty()) return false;
    left_out += of_it.size();
    *segment = without(of_it, *segment);
    return true;
  };
  strip(&state_.open);
  for (std::size_t s = graph.segments.size(); s-- > 0 && state_.begins[s] >= from;) {
    Segment segment = at_estimate(graph, s);
    if (!segment.has_data() || !strip(&segment)) continue;
    if (!condense(segment.robust_width, &segment)) return 0;
    graph.segments[s] = std::make_shared<const Segment>(std::move(segment));
  }
  const bool was_known = static_cast<std::size_t>(landmark) < graph.landmarks.size() &&
                         seen_landmarks(graph)[static_cast<std::size_t>(landmark)];
  return was_known ? left_out : 0;
}

// Where the belief is wrong, the wheels slipped. Unless one landmark has the id of another, and has
// misled the belief. Or each of those that did not fit: then the next sightings will tell, there is
// no solution, and the doubts stay.
bool Memory::solve(double robust_width) {
  const bool has_waited = has_doubts() && distrusts_odometry();
  if (!belief_is_wrong() && !has_waited) return solve_for_all(robust_width).is_solved;
  const Memory before = *this;
  believe_doubts();
  const Memory doubtless = *this;
  double least = solve_for_all(robust_width).negative_log_evidence();
  look_for_slips(robust_width, &least);
  for (const int landmark : before.suspects()) {
    Memory other = doubtless;
    const std::size_t sightings = other.leave_out_newest(landmark);
    if (sightings == 0) continue;
    const double evidence = other.solve_for_all(robust_width).negative_log_evidence() + kWrongId +
                            kFit * static_cast<double>(sightings);
    if (!(evidence < least)) continue;
    least = evidence;
    *this = std::move(other);
  }
  Memory with_wrong_ids = before;
  const double evidence = with_wrong_ids.solve_for_all(robust_width).negative_log_evidence() +
                          before.cost_of_wrong_ids();
  if (!(evidence < least)) return std::isfinite(least);
  *this = before.belief_is_wrong() ? before : std::move(with_wrong_ids);
  return !belief_is_wrong();
}

}  // namespace pf_resampling
