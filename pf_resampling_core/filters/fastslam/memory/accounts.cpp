#include "pf_resampling_core/filters/fastslam/memory/accounts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/arrivals.hpp"
#include "pf_resampling_core/filters/fastslam/memory/local_account.hpp"

namespace pf_resampling {
namespace {

// Updates whose sightings may change their landmarks.
constexpr int kScope = 1000;
// Attempts to find better associations for one solution.
constexpr int kMostReassociations = 3;
constexpr int kMostMergers = 3;
// The better of two associations has to be better by more.
constexpr double kWorthwhile = 0.1;
// Of a landmark that may be done without: what that costs before anything has
// adapted.
constexpr double kMostGrowth = 60.0;
// Logarithm of the odds for it, were the errors of all sightings independent.
// Those of a passage are not, but what speaks louder shows that the robot would
// be elsewhere without it.
constexpr double kMostAgainst = 25.0;
// Landmarks that are done without for one solution; the others wait for the
// next.
constexpr int kMostDropped = 5;
constexpr std::size_t kMostTried = 2;
// Sightings of a landmark that is real, though it was not seen where it should
// be.
constexpr int kOftenSeen = 5;
// One of so many landmarks is none any more: the others close ranks.
constexpr std::size_t kManyGone = 10;
// Landmarks from which on a drive is too large for everything to be tried on all of it.
constexpr std::size_t kLargeMap = 60;
constexpr int kMostCondensed = 5;  // segments
// m: a robot that moves by more is elsewhere.
constexpr double kMostMoved = 0.3;
// Logarithm of the odds for a robot that is elsewhere in a large map, 400 to 1: there are many
// places to be at.
constexpr double kSureElsewhere = 6.0;
constexpr double kNowhere = 1e9;  // m

bool solve(double robust_width, Account* account) {
  std::unique_ptr<SegmentEquations> equations;
  account->solution = solve(robust_width, &account->graph, &equations);
  account->equations = std::move(equations);
  return account->solution.is_solved;
}

// Of which neither a sighting nor a belief at the start says anything.
void forget_unseen(Account* account) {
  const std::vector<bool> are_seen = seen_landmarks(account->graph);
  for (std::size_t l = 0; l < are_seen.size(); ++l) {
    if (!are_seen[l]) account->landmarks[l].id = -1;
  }
}

bool merge(const std::vector<std::pair<int, int>>& pairs, double robust_width, Account* account) {
  std::vector<int> number(account->graph.landmarks.size());
  for (std::size_t l = 0; l < number.size(); ++l) number[l] = static_cast<int>(l);
  for (const auto& [older, newer] : pairs) {
    RememberedLandmark& first = account->landmarks[static_cast<std::size_t>(older)];
    RememberedLandmark& second = account->landmarks[static_cast<std::size_t>(newer)];
    std::replace(number.begin(), number.end(), newer, older);
    first.last_seen = std::max(first.last_seen, second.last_seen);
    first.is_dormant = first.is_dormant && second.is_dormant;
    second.id = -1;
  }
  return renumber(number, robust_width, &account->graph);
}

// By a later sighting than the last.
void wake_seen(const Scans& scans, Account* account) {
  for (const SightingFactor& sighting : scans.sightings) {
    if (sighting.landmark < 0) continue;
    RememberedLandmark& landmark = account->landmarks[static_cast<std::size_t>(sighting.landmark)];
    const int update = scans.first_update + sighting.pose + 1;
    if (update <= landmark.last_seen) continue;
    landmark.last_seen = update;
    landmark.is_dormant = false;
  }
}

// The landmarks that are left get the numbers of those that are none any more, if these are many.
bool close_ranks(double robust_width, Account* account) {
  const std::vector<bool> are_seen = seen_landmarks(account->graph);
  const auto gone = std::count(are_seen.begin(), are_seen.end(), false);
  if (kManyGone * static_cast<std::size_t>(gone) < are_seen.size()) return true;
  account->equations.reset();
  std::vector<int> number;
  std::size_t kept = 0;
  for (std::size_t l = 0; l < are_seen.size(); ++l) {
    number.push_back(static_cast<int>(kept));
    if (!are_seen[l]) continue;
    account->graph.landmarks[kept] = account->graph.landmarks[l];
    account->landmarks[kept] = account->landmarks[l];
    ++kept;
  }
  if (!renumber(number, robust_width, &account->graph)) return false;
  account->graph.landmarks.resize(kept);
  account->landmarks.resize(kept);
  return true;
}

bool complete(double robust_width, Account* account) {
  return close_ranks(robust_width, account) &&
         (account->equations != nullptr || solve(robust_width, account));
}

// Landmarks that the particles have given up and that were not seen often are
// none: their sightings are of nothing known.
bool forget_seldom_seen(double robust_width, Account* account) {
  std::vector<int> sightings(account->graph.landmarks.size(), 0);
  std::vector<int> number(account->graph.landmarks.size());
  for (std::size_t l = 0; l < number.size(); ++l) number[l] = static_cast<int>(l);
  for (const auto& segment : account->graph.segments) {
    for (const SightingFactor& sighting : segment->sightings) {
      const int landmark = segment->landmarks[static_cast<std::size_t>(sighting.landmark)];
      ++sightings[static_cast<std::size_t>(landmark)];
    }
    if (segment->has_data()) continue;
    for (const int landmark : segment->landmarks) {
      sightings[static_cast<std::size_t>(landmark)] = kOftenSeen;
    }
  }
  for (std::size_t l = 0; l < number.size(); ++l) {
    if (!account->landmarks[l].is_dormant || sightings[l] >= kOftenSeen) continue;
    number[l] = -1;
    account->landmarks[l].id = -1;
  }
  return renumber(number, robust_width, &account->graph);
}

// Determinants can be compared where all was condensed under the same noise: of the segments before
// `first`, which take no part in that, a few at a time.
bool condense_under_noise(double robust_width, std::size_t first, SegmentGraph* graph) {
  int left = kMostCondensed;
  for (std::size_t s = 0; s < graph->segments.size(); ++s) {
    const Segment& segment = *graph->segments[s];
    const NoiseScales& noise = graph->noise;
    const bool is_as_found = segment.noise.range == noise.range &&
                             segment.noise.bearing == noise.bearing &&
                             segment.noise.motion == noise.motion;
    if (is_as_found || !segment.has_data() || (s < first && --left < 0)) continue;
    if (!relinearize(robust_width, s, graph)) return false;
  }
  return true;
}

bool is_elsewhere(const SegmentGraph& graph, const SegmentGraph& other) {
  const Pose2 moved = relative(graph.newest(), other.newest());
  return std::hypot(moved.x, moved.y) > kMostMoved;
}

// Tries accounts of a drive.
class Accounts {
 public:
  Accounts(const ReassociationOptions& options, const DriveTimes& times, std::int64_t* next_id,
           const SightingStatistics& statistics, const Account& undecided, const Past& past)
      : options_(options),
        times_(times),
        past_(past),
        next_id_(next_id),
        undecided_(undecided),
        statistics_(statistics) {}

  bool decide(Account* account) {
    const Scans scans = scans_of(undecided_);
    const int since_last = decided_in(scans);
    bool is_solved = part_arrivals(account) && settle(since_last, account);
    if (!is_solved) {
      *account = undecided_;
      is_solved = settle(since_last, account);
    }
    if (!is_solved) return false;
    for (const int arrival : newest_arrivals(scans)) {
      if (decide_anew(arrival, account)) break;
    }
    for (int i = 0; i < kMostDropped && !is_part_of_large(*account); ++i) {
      if (!simplify(account)) break;
    }
    wake_seen(scans_of(*account), account);
    return true;
  }

 private:
  Scans scans_of(const Account& account) const {
    Scans scans = newest_scans(account.graph, times_.begins, kScope);
    scans.first_update += times_.before;
    return scans;
  }
  int decided_in(const Scans& scans) const {
    return std::max(0, times_.decided - scans.first_update);
  }

  // Whether the drive is too large for everything to be compared with everything.
  bool is_part_of_large(const Account& account) const {
    return times_.before > 0 || account.graph.landmarks.size() >= kLargeMap;
  }

  double evidence_of(const Account& account, double redundancy) const {
    SightingStatistics statistics = statistics_;
    statistics.redundancy = redundancy;
    return association_evidence(options_, statistics, account.solution.cost,
                                account.solution.log_determinant, account.graph);
  }
  double evidence_of(const Account& account) const {
    return evidence_of(account, statistics_.redundancy);
  }

  // What comes back into view may be another landmark: until it is clear that
  // it is not, it is one of those seen lately, or a new one.
  bool part_arrivals(Account* account) {
    SegmentGraph& graph = account->graph;
    Scans scans = scans_of(*account);
    const int first = decided_in(scans);
    std::vector<double> last(graph.landmarks.size(), -std::numeric_limits<double>::infinity());
    for_each_sighting(graph, times_.begins,
                      [&](int update, double time, const SightingFactor&, int landmark) {
                        if (times_.before + update < times_.decided)
                          last[static_cast<std::size_t>(landmark)] = time;
                      });
    // What a belief at the start has was seen before that.
    for (const auto& segment : graph.segments) {
      if (segment->has_data()) continue;
      for (const int landmark : segment->landmarks) {
        double& before = last[static_cast<std::size_t>(landmark)];
        before = std::max(before, -2.0 * kPassageGap);
      }
    }
    std::vector<int> taken(graph.landmarks.size(), -1);  // pose
    for (SightingFactor& sighting : scans.sightings) {
      if (sighting.pose < first || sighting.landmark < 0) continue;
      const std::size_t pose = static_cast<std::size_t>(sighting.pose);
      const double now = scans.times[pose];
      std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
      if (std::isfinite(last[landmark]) && now - last[landmark] > kPassageGap) {
        double least = -options_.log_density_of_new;
        landmark = graph.landmarks.size();
        for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
          if (now - last[l] > kPassageGap || taken[l] == sighting.pose) continue;
          const double cost =
              sighting_cost(options_, graph, scans.poses[pose], sighting, static_cast<int>(l));
          if (cost >= least) continue;
          least = cost;
          landmark = l;
        }
        if (landmark == graph.landmarks.size()) {
          if (landmark >= options_.most_landmarks) break;
          graph.landmarks.push_back(graph.landmarks[static_cast<std::size_t>(sighting.landmark)]);
          last.push_back(0.0);
          taken.push_back(-1);
          account->landmarks.push_back({(*next_id_)++, scans.first_update + sighting.pose + 1});
        }
        sighting.landmark = static_cast<int>(landmark);
      }
      last[landmark] = now;
      taken[landmark] = sighting.pose;
    }
    return take(scans, account);
  }

  bool take(const Scans& scans, Account* account) const {
    if (!put_back(scans, options_.robust_width, &account->graph)) return false;
    forget_unseen(account);
    return true;
  }

  // With the landmarks that the sightings have, then better ones. In question is what was seen from
  // a scan on.
  bool settle(int from, Account* account) const {
    if (!solve(options_.robust_width, account)) return false;
    for (int i = 0; i < kMostMergers; ++i) {
      if (!merge_duplicates(from, account)) break;
    }
    for (int i = 0; i < kMostReassociations; ++i) {
      if (!improve_associations(account)) break;
    }
    return true;
  }

  bool merge_duplicates(int from, Account* account) const {
    const Scans scans = scans_of(*account);
    std::vector<int> seen;
    for (const SightingFactor& sighting : scans.sightings) {
      const bool is_asked = sighting.pose >= from || !is_part_of_large(*account);
      if (is_asked && sighting.landmark >= 0) seen.push_back(sighting.landmark);
    }
    std::sort(seen.begin(), seen.end());
    seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
    const Duplicates duplicates =
        find_duplicates(options_, statistics_, account->graph, *account->equations, seen);
    if (duplicates.pairs.empty()) return false;
    Account merged = *account;
    if (!merge(duplicates.pairs, options_.robust_width, &merged) ||
        !solve(options_.robust_width, &merged)) {
      return false;
    }
    double log_odds = duplicates.log_prior_odds - (merged.solution.cost - account->solution.cost);
    double least = kSureLogOdds;
    if (is_elsewhere(account->graph, merged.graph)) {
      // What moves the robot has to be sure without tracks of one landmark.
      log_odds -= duplicates.log_odds_of_near + cost_of_missed(*account, merged);
      if (is_part_of_large(*account)) least = kSureElsewhere;
    }
    if (!(log_odds >= least)) return false;
    *account = std::move(merged);
    return true;
  }

  // What speaks against a robot that is elsewhere: landmarks that it should have seen there. Those
  // that it did see may be alike, as aisles are.
  double cost_of_missed(const Account& account, const Account& elsewhere) const {
    const ViewPassages before = passages_of(account);
    const ViewPassages after = passages_of(elsewhere);
    const double share = (before.missed + 1.0) / (before.all + 2.0);
    return -std::log(share) * std::max(0, after.missed - before.missed);
  }

  ViewPassages passages_of(const Account& account) const {
    const SegmentGraph& graph = account.graph;
    std::vector<Eigen::Vector2d> places = past_.others;
    const std::vector<bool> are_seen = seen_landmarks(graph);
    for (std::size_t l = 0; l < are_seen.size(); ++l) {
      places.push_back(are_seen[l] ? graph.landmarks[l] : Eigen::Vector2d::Constant(kNowhere));
    }
    Scans scans = scans_of(account);
    for (SightingFactor& sighting : scans.sightings) {
      if (sighting.landmark >= 0) sighting.landmark += static_cast<int>(past_.others.size());
    }
    return view_passages(places, {&past_.scans, &scans});
  }

  bool improve_associations(Account* account) const {
    Scans scans = scans_of(*account);
    if (reassociate(options_, account->graph, &scans) == 0) return false;
    Account better = *account;
    if (!take(scans, &better) || !solve(options_.robust_width, &better)) return false;
    const auto cost = [&](const Account& of) {
      return association_cost(options_, of.solution.cost, of.graph);
    };
    if (!(cost(better) < cost(*account) - kWorthwhile)) return false;
    *account = std::move(better);
    return true;
  }

  // What was seen since an arrival decided by all of it together, where `account` decided bit by
  // bit, if that is surely better.
  bool decide_anew(int arrival, Account* account) {
    Account anew = undecided_;
    Scans scans = scans_of(anew);
    if (!track_anew(options_, arrival, &scans, &anew.graph)) return false;
    while (anew.landmarks.size() < anew.graph.landmarks.size()) {
      anew.landmarks.push_back({(*next_id_)++, scans.first_update + arrival + 1});
    }
    if (!take(scans, &anew) || !settle(arrival, &anew)) return false;
    if (!(evidence_of(anew) < evidence_of(*account) - kSureLogOdds)) return false;
    *account = std::move(anew);
    return true;
  }

  // Without a landmark that can be done without, unless all that was seen shows that it is there:
  // the likeliest, and one of the others in turn.
  bool simplify(Account* account) const {
    std::vector<Dispensable> candidates = find_dispensable(
        options_, statistics_.redundancy, account->graph, scans_of(*account), kMostGrowth);
    if (candidates.size() > 2) {
      const std::size_t turn = static_cast<std::size_t>(times_.updates) % (candidates.size() - 1);
      std::swap(candidates[1], candidates[1 + turn]);
    }
    candidates.resize(std::min(candidates.size(), kMostTried));
    return std::any_of(candidates.begin(), candidates.end(), [&](const Dispensable& candidate) {
      return do_without(candidate, account);
    });
  }

  bool do_without(const Dispensable& landmark, Account* account) const {
    const auto [older, newer] = std::minmax(landmark.landmark, landmark.other);
    Account other = *account;
    const Eigen::Vector2d place =
        account->graph.landmarks[static_cast<std::size_t>(landmark.other)];
    other.graph.landmarks[static_cast<std::size_t>(older)] = place;
    bool is_solved = merge({{older, newer}}, options_.robust_width, &other) &&
                     solve(options_.robust_width, &other);
    for (int i = 0; i < kMostReassociations && is_solved; ++i) {
      Scans scans = scans_of(other);
      if (reassociate(options_, other.graph, &scans) == 0) break;
      is_solved = take(scans, &other) && solve(options_.robust_width, &other);
    }
    if (!is_solved) return false;
    const auto growth = [&](double redundancy) {
      return evidence_of(other, redundancy) - evidence_of(*account, redundancy);
    };
    if (!(growth(statistics_.redundancy) < kSureLogOdds) || !(growth(1.0) < kMostAgainst)) {
      return false;
    }
    *account = std::move(other);
    return true;
  }

  const ReassociationOptions& options_;
  const DriveTimes& times_;
  const Past& past_;
  std::int64_t* next_id_;
  const Account& undecided_;
  const SightingStatistics statistics_;
};

// The segment that follows what has been decided.
std::size_t first_undecided(const DriveTimes& times, const SegmentGraph& graph) {
  int update = 0;
  std::size_t s = 0;
  while (s < graph.segments.size() && update < times.decided) {
    update += static_cast<int>(graph.segments[s++]->updates());
  }
  return s;
}

bool decide_locally(const ReassociationOptions& options, const DriveTimes& times, std::size_t from,
                    const SightingStatistics& statistics, std::int64_t* next_id, Account* account) {
  if (!condense_under_noise(options.robust_width, from, &account->graph)) return false;
  const std::optional<LocalGraph> local = local_graph(account->graph, from);
  if (!local) return false;
  DriveTimes newest = times;
  newest.begins.assign(times.begins.begin() + static_cast<std::ptrdiff_t>(from) - 1,
                       times.begins.end());
  for (std::size_t s = 0; s < from; ++s) {
    newest.before += static_cast<int>(account->graph.segments[s]->updates());
  }
  const Account undecided = part_of(*account, *local);
  Account part = undecided;
  const Past past = past_of(*account, times, from, *local);
  Accounts accounts(options, newest, next_id, statistics, undecided, past);
  if (!accounts.decide(&part)) return false;
  Account whole = *account;
  if (!put_back(part, *local, from, options.robust_width, &whole) ||
      !complete(options.robust_width, &whole)) {
    return false;
  }
  *account = std::move(whole);
  return true;
}

bool decide_on_all(const ReassociationOptions& options, const DriveTimes& times,
                   const SightingStatistics& statistics, std::int64_t* next_id, Account* account) {
  if (!condense_under_noise(options.robust_width, 0, &account->graph)) return false;
  const Account undecided = *account;
  const Past nothing;
  return Accounts(options, times, next_id, statistics, undecided, nothing).decide(account) &&
         complete(options.robust_width, account);
}

}  // namespace

bool decide_associations(const ReassociationOptions& options, const DriveTimes& times,
                         std::int64_t* next_id, Account* account) {
  if (!forget_seldom_seen(options.robust_width, account)) return false;
  const SightingStatistics statistics = statistics_of(account->graph, times.begins);
  const Account undecided = *account;
  const std::size_t first = first_undecided(times, account->graph);
  const double decided = first < times.begins.size() ? times.begins[first] : 0.0;
  const double now = times.begins.back() + account->graph.segments.back()->duration();
  const std::size_t from = first_in_question(account->graph, times.begins, decided, now);
  const bool is_large = from > 0 && account->graph.landmarks.size() >= kLargeMap;
  const bool is_decided =
      (is_large && decide_locally(options, times, from, statistics, next_id, account)) ||
      decide_on_all(options, times, statistics, next_id, account);
  if (!is_decided) *account = undecided;
  return is_decided;
}

}  // namespace pf_resampling
