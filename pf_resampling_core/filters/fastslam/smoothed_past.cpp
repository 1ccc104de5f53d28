#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

// Blocks that are left out at a time, a factorisation each; and that are kept of each kind.
constexpr std::size_t kMostBlocks = 8;
constexpr std::size_t kMostKept = 300;
// Attempts to find better associations for one solution.
constexpr int kMostReassociations = 3;
constexpr int kMostMergers = 3;
// Of a landmark that may be done without: what that costs before anything has adapted.
constexpr double kMostGrowth = 60.0;
// Logarithm of the odds for it, were the errors of all sightings independent. Those of a passage
// are not, but what speaks louder shows that the robot would be elsewhere without it.
constexpr double kMostAgainst = 25.0;
// Landmarks that are done without for one solution; the others wait for the next.
constexpr int kMostDropped = 5;
// Of the solutions that associations are judged by: small against the cost of a sighting. The
// better has to be better by more.
constexpr double kTrialTolerance = 0.01;
constexpr double kWorthwhile = 0.1;
// s: without a sighting for so long, where the robot arrives is in doubt; and how long after that
// it is decided anew. How many arrivals are.
constexpr double kBlindness = 5.0;
constexpr double kLatestDecisions = 60.0;
constexpr int kMostArrivals = 2;
// Sightings of a landmark that is real, though it was not seen where it should be.
constexpr int kOftenSeen = 5;
// Of each landmark that a visit of the past is to have more.
constexpr double kSplitLogOdds = 10.0;
// s: out of view for so long, a landmark may be mistaken for another when it comes back.
constexpr double kPassageGap = 10.0;

// Seconds since the start.
std::vector<double> times_of(const SmoothedPastState& state) {
  std::vector<double> times(state.graph.poses.size(), state.time);
  for (std::size_t i = times.size() - 1; i > 0; --i) {
    times[i - 1] = times[i] - state.graph.motions[i - 1].duration();
  }
  return times;
}

// Evenly over all of them.
void keep_some(std::vector<LeftOutBlock>* blocks) {
  if (blocks->size() <= kMostBlocks) return;
  for (std::size_t i = 0; i < kMostBlocks; ++i) {
    (*blocks)[i] = (*blocks)[i * blocks->size() / kMostBlocks];
  }
  blocks->resize(kMostBlocks);
}

void add_newest(const std::vector<PredictedBlock>& blocks, std::vector<PredictedBlock>* all) {
  all->insert(all->end(), blocks.begin(), blocks.end());
  if (all->size() > kMostKept) {
    all->erase(all->begin(), all->end() - static_cast<std::ptrdiff_t>(kMostKept));
  }
}

}  // namespace

void SmoothedPast::clear() {
  *this = SmoothedPast();
}

void SmoothedPast::forget_drive() {
  SmoothedPastState left;
  left.graph.noise = state_.graph.noise;
  left.passages = std::move(state_.passages);
  left.windows = std::move(state_.windows);
  resume(left);
}

void SmoothedPast::start(const GaussianPrior& prior,
                         const std::vector<std::int64_t>& landmark_ids) {
  forget_drive();
  SmoothedPastState state = state_;
  state.graph.prior = prior;
  state.graph.poses = {prior.pose};
  state.graph.landmarks = prior.landmarks;
  state.graph.constants = prior.constants;
  state.landmark_ids = landmark_ids;
  state.last_seen.assign(landmark_ids.size(), 0);
  state.is_dormant.assign(landmark_ids.size(), false);
  resume(state);
}

void SmoothedPast::resume(const SmoothedPastState& state) {
  state_ = state;
  numbers_.clear();
  for (std::size_t l = 0; l < state.landmark_ids.size(); ++l) {
    if (state.landmark_ids[l] >= 0) numbers_[state.landmark_ids[l]] = static_cast<int>(l);
  }
}

void SmoothedPast::append(const MotionFactor& motion) {
  SmoothingGraph& graph = state_.graph;
  graph.poses.push_back(compose(graph.poses.back(), corrected_motion(motion, graph.constants)));
  graph.motions.push_back(motion);
  state_.longest_absence = 0;
  state_.time += motion.duration();
}

void SmoothedPast::append_sighting(std::int64_t landmark_id, bool is_new, SightingFactor sighting) {
  SmoothingGraph& graph = state_.graph;
  const int pose = static_cast<int>(graph.poses.size()) - 1;
  if (is_new) forget_landmark(landmark_id);
  int number = number_of(landmark_id);
  if (number < 0) {
    const Pose2 eye = compose(graph.poses.back(), sighting.sensor);
    const double direction = eye.heading + sighting.bearing;
    graph.landmarks.emplace_back(eye.x + sighting.range * std::cos(direction),
                                 eye.y + sighting.range * std::sin(direction));
    number = add_landmark(landmark_id, pose);
  }
  sighting.pose = pose;
  sighting.landmark = number;
  graph.sightings.push_back(sighting);
  int& last = state_.last_seen[static_cast<std::size_t>(number)];
  state_.longest_absence = std::max(state_.longest_absence, pose - last - 1);
  last = pose;
}

// One that the graph has already.
int SmoothedPast::add_landmark(std::int64_t id, int pose) {
  const int number = static_cast<int>(state_.landmark_ids.size());
  numbers_[id] = number;
  state_.landmark_ids.push_back(id);
  state_.last_seen.push_back(pose);
  state_.is_dormant.push_back(false);
  return number;
}

void SmoothedPast::append_unassigned(SightingFactor sighting) {
  sighting.pose = static_cast<int>(state_.graph.poses.size()) - 1;
  sighting.landmark = -1;
  state_.graph.unassigned.push_back(sighting);
}

void SmoothedPast::forget_landmark(std::int64_t id) {
  const int number = number_of(id);
  if (number < 0) return;
  numbers_.erase(id);
  state_.landmark_ids[static_cast<std::size_t>(number)] = -1;
  SmoothingGraph& graph = state_.graph;
  std::vector<SightingFactor> others;
  for (SightingFactor sighting : graph.sightings) {
    if (sighting.landmark != number) {
      others.push_back(sighting);
      continue;
    }
    sighting.landmark = -1;
    graph.unassigned.push_back(sighting);
  }
  graph.sightings = std::move(others);
  std::stable_sort(
      graph.unassigned.begin(), graph.unassigned.end(),
      [](const SightingFactor& a, const SightingFactor& b) { return a.pose < b.pose; });
}

void SmoothedPast::give_up_landmark(std::int64_t id) {
  const int number = number_of(id);
  if (number < 0) return;
  const std::vector<SightingFactor>& sightings = graph().sightings;
  const auto seen =
      std::count_if(sightings.begin(), sightings.end(),
                    [&](const SightingFactor& sighting) { return sighting.landmark == number; });
  if (seen < kOftenSeen) return forget_landmark(id);
  state_.is_dormant[static_cast<std::size_t>(number)] = true;
}

// By a later sighting than the last.
void SmoothedPast::wake_seen() {
  for (const SightingFactor& sighting : graph().sightings) {
    const std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
    if (sighting.pose <= state_.last_seen[landmark]) continue;
    state_.last_seen[landmark] = sighting.pose;
    state_.is_dormant[landmark] = false;
  }
}

void SmoothedPast::remove_forgotten() {
  std::vector<bool> is_forgotten;
  for (const std::int64_t id : state_.landmark_ids) is_forgotten.push_back(id < 0);
  if (std::find(is_forgotten.begin(), is_forgotten.end(), true) == is_forgotten.end()) return;
  SmoothedPastState left = std::move(state_);
  remove_landmarks(is_forgotten, &left.graph);
  const auto keep = [&](auto* values) {
    std::size_t kept = 0;
    for (std::size_t l = 0; l < is_forgotten.size(); ++l) {
      if (!is_forgotten[l]) (*values)[kept++] = (*values)[l];
    }
    values->resize(kept);
  };
  keep(&left.landmark_ids);
  keep(&left.last_seen);
  keep(&left.is_dormant);
  resume(left);
}

// Of which neither a sighting nor the prior says anything.
void SmoothedPast::forget_unseen() {
  std::vector<bool> is_seen(state_.landmark_ids.size(), false);
  std::fill_n(is_seen.begin(), state_.graph.prior.landmarks.size(), true);
  for (const SightingFactor& sighting : state_.graph.sightings) {
    is_seen[static_cast<std::size_t>(sighting.landmark)] = true;
  }
  for (std::size_t l = 0; l < is_seen.size(); ++l) {
    if (!is_seen[l]) forget_landmark(state_.landmark_ids[l]);
  }
}

void SmoothedPast::merge(const std::vector<std::pair<int, int>>& pairs) {
  merge_landmarks(pairs, &state_.graph);
  for (const auto& [older, newer] : pairs) {
    int& last = state_.last_seen[static_cast<std::size_t>(older)];
    last = std::max(last, state_.last_seen[static_cast<std::size_t>(newer)]);
    if (!state_.is_dormant[static_cast<std::size_t>(newer)]) {
      state_.is_dormant[static_cast<std::size_t>(older)] = false;
    }
    forget_landmark(state_.landmark_ids[static_cast<std::size_t>(newer)]);
  }
}

SmoothingResult SmoothedPast::solve(const SmoothingOptions& options) {
  remove_forgotten();
  return smooth(options, &state_.graph);
}

// What comes back into view may be another landmark: until it is clear that it is not, it is one of
// those seen lately, or a new one.
bool SmoothedPast::part_arrivals(const ReassociationOptions& options, std::int64_t* next_id) {
  SmoothingGraph& graph = state_.graph;
  const std::vector<double> times = times_of(state_);
  std::vector<double> last(graph.landmarks.size(), -std::numeric_limits<double>::infinity());
  std::vector<int> taken(graph.landmarks.size(), -1);  // pose
  bool is_changed = false;
  for (SightingFactor& sighting : graph.sightings) {
    const std::size_t pose = static_cast<std::size_t>(sighting.pose);
    std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
    const bool is_first =
        !std::isfinite(last[landmark]) && landmark >= graph.prior.landmarks.size();
    if (sighting.pose >= state_.decided && !is_first &&
        times[pose] - last[landmark] > kPassageGap) {
      double least = -options.log_density_of_new;
      landmark = graph.landmarks.size();
      for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
        if (times[pose] - last[l] > kPassageGap || taken[l] == sighting.pose) continue;
        const double cost = sighting_cost(options, graph, sighting, static_cast<int>(l));
        if (cost >= least) continue;
        least = cost;
        landmark = l;
      }
      if (landmark == graph.landmarks.size()) {
        if (landmark >= options.most_landmarks) return true;
        graph.landmarks.push_back(graph.landmarks[static_cast<std::size_t>(sighting.landmark)]);
        last.push_back(0.0);
        taken.push_back(-1);
        add_landmark((*next_id)++, sighting.pose);
      }
      sighting.landmark = static_cast<int>(landmark);
      is_changed = true;
    }
    last[landmark] = times[pose];
    taken[landmark] = sighting.pose;
  }
  return is_changed;
}

// With the landmarks that the sightings have, then better ones.
SmoothingResult SmoothedPast::settle(const SmoothingOptions& options,
                                     const ReassociationOptions& reassociation) {
  SmoothingOptions trial = options;
  trial.tolerance = std::max(options.tolerance, kTrialTolerance);
  SmoothingResult solution = solve(trial);
  if (solution.fault != SmoothingFault::none) return solution;
  for (int i = 0; i < kMostMergers; ++i) {
    if (!merge_duplicates(trial, reassociation, &solution)) break;
  }
  trial.with_belief = false;
  for (int i = 0; i < kMostReassociations; ++i) {
    if (!improve_associations(trial, reassociation, &solution)) break;
  }
  return solution;
}

SmoothingResult SmoothedPast::solve(const SmoothingOptions& options,
                                    const ReassociationOptions& given, std::int64_t* next_id) {
  const SmoothedPast undecided = *this;
  // Errors may stay the same as long as a landmark is in view.
  ReassociationOptions reassociation = given;
  reassociation.redundancy = redundancy_of(graph(), times_of(state_), kPassageGap);
  SmoothingResult solution;
  bool is_solved = false;
  if (part_arrivals(reassociation, next_id)) {
    solution = settle(options, reassociation);
    is_solved = solution.fault == SmoothingFault::none;
    if (!is_solved) *this = undecided;
  }
  if (!is_solved) solution = settle(options, reassociation);
  if (solution.fault != SmoothingFault::none) {
    *this = undecided;
    return solution;
  }
  for (const Visit& visit : undecided.doubtful_visits()) {
    if (undecided.decide_anew(options, reassociation, visit, next_id, this, &solution)) break;
  }
  reconsider_visit(options, reassociation, next_id, &solution);
  for (int i = 0; i < kMostDropped; ++i) {
    if (!simplify(options, reassociation, &solution)) break;
  }
  state_.decided = static_cast<int>(graph().poses.size());
  wake_seen();
  return solve(options);
}

bool SmoothedPast::merge_duplicates(const SmoothingOptions& options,
                                    const ReassociationOptions& reassociation,
                                    SmoothingResult* solution) {
  const Duplicates duplicates = find_duplicates(reassociation, graph(), solution->belief);
  if (duplicates.pairs.empty()) return false;
  SmoothedPast other = *this;
  other.merge(duplicates.pairs);
  const SmoothingResult merged = other.solve(options);
  if (merged.fault != SmoothingFault::none) return false;
  const double log_odds = duplicates.log_prior_odds - (merged.cost - solution->cost);
  if (!(log_odds >= kSureLogOdds)) return false;
  *this = std::move(other);
  *solution = merged;
  return true;
}

// The poses between whiles without a sighting, after which only odometry says where the robot
// arrives.
std::vector<SmoothedPast::Visit> SmoothedPast::visits() const {
  const std::vector<double> times = times_of(state_);
  std::vector<bool> sees(times.size(), false);
  for (const SightingFactor& sighting : graph().sightings) {
    sees[static_cast<std::size_t>(sighting.pose)] = true;
  }
  std::vector<Visit> found;
  double last = -std::numeric_limits<double>::infinity();
  for (int pose = 0; pose < static_cast<int>(times.size()); ++pose) {
    const std::size_t i = static_cast<std::size_t>(pose);
    if (!sees[i]) continue;
    if (times[i] - last > kBlindness) found.push_back({pose, pose});
    found.back().to = pose + 1;
    last = times[i];
  }
  return found;
}

// What may have been taken for the wrong landmarks: what is new, and what was seen since arrivals.
std::vector<SmoothedPast::Visit> SmoothedPast::doubtful_visits() const {
  const std::vector<double> times = times_of(state_);
  const int poses = static_cast<int>(times.size());
  std::vector<Visit> found;
  if (state_.decided > 0 && state_.decided < poses) found.push_back({state_.decided, poses});
  const std::vector<Visit> all = visits();
  for (std::size_t i = all.size(); i > 1 && i + kMostArrivals > all.size(); --i) {
    const int from = all[i - 1].from;
    const int before = all[i - 2].to - 1;
    if (times.back() - times[static_cast<std::size_t>(before)] > kLatestDecisions) break;
    found.push_back({from, poses});
  }
  return found;
}

// One of the visits of the past, each in its turn: what was seen later may show that it was
// elsewhere.
void SmoothedPast::reconsider_visit(const SmoothingOptions& options,
                                    const ReassociationOptions& reassociation,
                                    std::int64_t* next_id, SmoothingResult* solution) {
  const std::vector<Visit> all = visits();
  if (all.size() < 2) return;
  // By the clock, which has nothing to do with how often it is solved.
  const double count = static_cast<double>(all.size());
  const auto turn = static_cast<std::size_t>(std::fmod(std::max(0.0, state_.time), count));
  SmoothedPast found = *this;
  SmoothingResult anew = *solution;
  if (!decide_anew(options, reassociation, all[turn], next_id, &found, &anew)) return;
  // There is always a way to make two landmarks of one by chance, and many are tried.
  const double more = static_cast<double>(found.graph().landmarks.size()) -
                      static_cast<double>(graph().landmarks.size());
  const double gain = association_evidence(reassociation, *solution, graph()) -
                      association_evidence(reassociation, anew, found.graph());
  if (!(gain > kSureLogOdds + kSplitLogOdds * std::max(0.0, more))) return;
  *this = std::move(found);
  *solution = anew;
}

// What was seen on a visit decided by all of it together, where it was decided bit by bit. True,
// in place of `best`, if that is clearly more probable.
bool SmoothedPast::decide_anew(const SmoothingOptions& options,
                               const ReassociationOptions& reassociation, const Visit& visit,
                               std::int64_t* next_id, SmoothedPast* best,
                               SmoothingResult* solution) const {
  SmoothedPast other = *this;
  if (!track_anew(reassociation, visit.from, visit.to, kPassageGap, times_of(state_),
                  &other.state_.graph)) {
    return false;
  }
  while (other.state_.landmark_ids.size() < other.graph().landmarks.size()) {
    other.add_landmark((*next_id)++, visit.from);
  }
  other.forget_unseen();
  const SmoothingResult anew = other.settle(options, reassociation);
  if (anew.fault != SmoothingFault::none) return false;
  const double before = association_evidence(reassociation, *solution, best->graph());
  const double after = association_evidence(reassociation, anew, other.graph());
  if (!(after < before - kSureLogOdds)) return false;
  *best = std::move(other);
  *solution = anew;
  return true;
}

// Without a landmark that can be done without, unless all that was seen shows that it is there.
bool SmoothedPast::simplify(const SmoothingOptions& options,
                            const ReassociationOptions& reassociation, SmoothingResult* solution) {
  std::vector<Dispensable> candidates = find_dispensable(reassociation, graph(), kMostGrowth);
  if (candidates.empty()) return false;
  if (do_without(options, reassociation, candidates[0], solution)) return true;
  // The others in turn.
  if (candidates.size() == 1) return false;
  const std::size_t next = 1 + graph().poses.size() % (candidates.size() - 1);
  return do_without(options, reassociation, candidates[next], solution);
}

bool SmoothedPast::do_without(const SmoothingOptions& options,
                              const ReassociationOptions& reassociation,
                              const Dispensable& landmark, SmoothingResult* solution) {
  SmoothingOptions trial = options;
  trial.tolerance = std::max(options.tolerance, kTrialTolerance);
  trial.with_belief = false;
  SmoothedPast other = *this;
  const auto [older, newer] = std::minmax(landmark.landmark, landmark.other);
  const Eigen::Vector2d place = graph().landmarks[static_cast<std::size_t>(landmark.other)];
  other.merge({{older, newer}});
  other.state_.graph.landmarks[static_cast<std::size_t>(older)] = place;
  SmoothingResult without = other.solve(trial);
  for (int i = 0; i < kMostReassociations && without.fault == SmoothingFault::none; ++i) {
    if (reassociate(reassociation, &other.state_.graph) == 0) break;
    other.forget_unseen();
    without = other.solve(trial);
  }
  if (without.fault != SmoothingFault::none) return false;
  const auto growth = [&](const ReassociationOptions& assumed) {
    return association_evidence(assumed, without, other.graph()) -
           association_evidence(assumed, *solution, graph());
  };
  ReassociationOptions independent = reassociation;
  independent.redundancy = 1.0;
  if (!(growth(reassociation) < kSureLogOdds) || !(growth(independent) < kMostAgainst)) {
    return false;
  }
  *this = std::move(other);
  *solution = without;
  return true;
}

bool SmoothedPast::improve_associations(const SmoothingOptions& options,
                                        const ReassociationOptions& reassociation,
                                        SmoothingResult* solution) {
  SmoothedPast other = *this;
  if (reassociate(reassociation, &other.state_.graph) == 0) return false;
  other.forget_unseen();
  const SmoothingResult better = other.solve(options);
  const double before = association_cost(reassociation, solution->cost, graph());
  const double after = association_cost(reassociation, better.cost, other.graph());
  if (better.fault != SmoothingFault::none || !(after < before - kWorthwhile)) return false;
  *this = std::move(other);
  *solution = better;
  return true;
}

void SmoothedPast::validate(double robust_width) {
  const std::vector<double> times = times_of(state_);
  SmoothingGraph& graph = state_.graph;
  std::vector<LeftOutBlock> of_passages = passages(graph, times, state_.validated, state_.time);
  std::vector<LeftOutBlock> of_windows = windows(graph, times, state_.validated, state_.time);
  state_.validated = state_.time;
  if (of_passages.empty() && of_windows.empty()) return;
  keep_some(&of_passages);
  keep_some(&of_windows);
  add_newest(cross_validate(graph, robust_width, of_passages), &state_.passages);
  add_newest(cross_validate(graph, robust_width, of_windows), &state_.windows);
  graph.noise = noise_scales(state_.passages, state_.windows);
}

void SmoothedPast::bound(int window, double robust_width) {
  const int surplus = static_cast<int>(state_.graph.poses.size()) - window;
  if (2 * surplus <= window) return;
  if (!forget_oldest(surplus, robust_width, &state_.graph)) return;
  for (std::size_t l = 0; l < state_.last_seen.size(); ++l) {
    state_.last_seen[l] -= surplus;
    if (state_.is_dormant[l] && state_.last_seen[l] < 0) forget_landmark(state_.landmark_ids[l]);
  }
  state_.decided -= surplus;
}

int SmoothedPast::number_of(std::int64_t landmark_id) const {
  const auto found = numbers_.find(landmark_id);
  return found == numbers_.end() ? -1 : found->second;
}

}  // namespace pf_resampling
