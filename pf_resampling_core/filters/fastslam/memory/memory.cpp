#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/joining.hpp"
#include "pf_resampling_core/filters/fastslam/memory/odometry_scales.hpp"
#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"

namespace pf_resampling {
namespace {

// Updates of a segment, whose poses are solved for together.
constexpr std::size_t kMostMotions = 50;
constexpr double kSettled = 75.0;     // s
constexpr double kMostSquare = 16.0;  // of the odometry of what is joined; see slip_square()
// Updates that keep their data at least, since what was seen in them may change its landmarks; and
// segments before them.
constexpr int kMostUpdatesWithData = 1500;
constexpr std::size_t kMostPast = 40;
constexpr int kMostUndecided = 500;  // updates without a solution, without ids
constexpr double kSlipped = 0.2;     // weight of the odometry
constexpr std::ptrdiff_t kFewSlips = 2;
constexpr double kLargeConstant = 3.0;  // standard deviations
constexpr double kGrossSigma = 0.25;  // of an odometry's scale that was found so, as a share of it
constexpr double kGrossFault = 14.0;  // cost: one odometry in a million has a wrong scale
// Segments in which a robot that does not know where it is may have been carried; the weight of
// its odometry there.
constexpr std::size_t kSuspects = 15;
constexpr double kCarriedShare = 1e-4;
// Passages of landmarks that were missed where the robot may still be where it believes: so many,
// and this share of all. A sensor that hardly sees landmarks misses a share of them twice over.
constexpr double kFewMissed = 3.0;
constexpr double kMissedShare = 0.04;
// A whole group of landmarks can be taken for its neighbours at once, and the Gaussian of one
// association knows nothing of that. By as much, where no sighting's landmark is sure, its draws
// are wider: read off MRCLAM, whose landmarks stand .2 m apart.
constexpr double kWidening = 0.5;
constexpr int kNewestUpdates = 500;  // which say how well landmarks can be told apart
constexpr double kNowhere = 1e9;     // m
constexpr double kSameTime = 1e-6;   // s
constexpr double kSmallestPrior = 1e-9;
constexpr double kUnknown = 1e9;  // standard deviation of constants that a belief knows

// Whether a solution may be a bad one: constants far beyond what is known of their size, or
// odometry that is wrong here and there.
bool is_doubtful(const SegmentGraph& graph) {
  const auto slipped = std::count_if(graph.motion_shares.begin(), graph.motion_shares.end(),
                                     [](double share) { return share < kSlipped; });
  const bool is_far = ((graph.constants - graph.constants_mean).array().abs() >
                       kLargeConstant * graph.constants_sigma.array().max(kSmallestPrior))
                          .any();
  return is_far || slipped > kFewSlips;
}

// As if the robot had been carried in segment `s`: what came after it goes along.
SegmentGraph carried(const SegmentGraph& graph, std::size_t s, const Pose2& newest) {
  SegmentGraph after = graph;
  const Pose2& was = graph.newest();
  for (std::size_t b = s + 1; b < after.bases.size(); ++b) {
    after.bases[b] = compose(newest, relative(was, graph.bases[b]));
  }
  std::size_t first_new = 0;  // landmarks are numbered as they were seen
  for (std::size_t b = 0; b <= s; ++b) {
    for (const int landmark : graph.segments[b]->landmarks) {
      first_new = std::max(first_new, static_cast<std::size_t>(landmark) + 1);
    }
  }
  for (std::size_t l = first_new; l < after.landmarks.size(); ++l) {
    after.landmarks[l] = moved(seen_from(was, graph.landmarks[l]), newest);
  }
  after.motion_shares[s] = kCarriedShare;
  return after;
}

}  // namespace

void Memory::forget_drive() {
  MemoryState left;
  left.graph.noise = state_.graph.noise;
  left.passages = std::move(state_.passages);
  left.windows = std::move(state_.windows);
  resume(left);
}

void Memory::resume(const MemoryState& state) {
  state_ = state;
  equations_.reset();
  number_landmarks();
  misses_landmarks_ = false;
  if (state_.decided > 0) look_for_missed();
}

void Memory::number_landmarks() {
  numbers_.clear();
  for (std::size_t l = 0; l < state_.landmarks.size(); ++l) {
    const std::int64_t id = state_.landmarks[l].id;
    if (id >= 0) numbers_[id] = static_cast<int>(l);
  }
}

void Memory::start(const Pose2& pose, const SensorConstants& sigma) {
  forget_drive();
  state_.graph.bases = {pose};
  state_.graph.constants_sigma = sigma;
}

bool Memory::start(const StartingBelief& belief) {
  const Eigen::LLT<Eigen::MatrixXd> root(belief.covariance);
  if (root.info() != Eigen::Success) return false;
  const Eigen::Index size = belief.covariance.rows();
  Segment segment;
  segment.poses = {belief.pose};
  segment.tracks = belief.landmarks;
  segment.constants = belief.constants;
  for (std::size_t l = 0; l < belief.landmarks.size(); ++l) {
    segment.landmarks.push_back(static_cast<int>(l));
  }
  const Eigen::MatrixXd information = root.solve(Eigen::MatrixXd::Identity(size, size));
  if (!information.allFinite()) return false;
  segment.condensed = condensed_belief(information, Eigen::VectorXd::Zero(size));
  forget_drive();
  segment.noise = state_.graph.noise;
  state_.graph.bases = {Pose2{}, belief.pose};
  state_.graph.segments = {std::make_shared<const Segment>(std::move(segment))};
  state_.graph.motion_shares = {1.0};
  state_.graph.landmarks = belief.landmarks;
  state_.graph.constants = belief.constants;
  state_.graph.constants_sigma.setConstant(kUnknown);
  for (const std::int64_t id : belief.landmark_ids) {
    state_.landmarks.push_back({id, 0, kFewFitted + 1});
  }
  state_.begins = {0.0};
  number_landmarks();
  return true;
}

void Memory::append(const MotionFactor& motion) {
  state_.open.motions.push_back(motion);
  ++state_.updates;
  state_.longest_absence = 0;
  state_.time += motion.duration();
  const double distance = std::hypot(motion.mean.x, motion.mean.y);
  if (!(distance > 0.0 && motion.duration() > 0.0)) return;
  state_.distance += distance;
  state_.speed += distance / state_.distance * (distance / motion.duration() - state_.speed);
}

void Memory::append_sighting(std::int64_t landmark_id, SightingFactor sighting) {
  Segment& open = state_.open;
  const auto [found, is_new] =
      numbers_.try_emplace(landmark_id, static_cast<int>(state_.landmarks.size()));
  sighting.pose = static_cast<int>(open.motions.size()) - 1;
  add_sighting(found->second, sighting, &open);
  if (is_new) return state_.landmarks.push_back({landmark_id, state_.updates, 1});
  RememberedLandmark& landmark = state_.landmarks[static_cast<std::size_t>(found->second)];
  ++landmark.fitted;
  note_newest(-1);
  state_.longest_absence =
      std::max(state_.longest_absence, state_.updates - landmark.last_seen - 1);
  landmark.last_seen = state_.updates;
}

void Memory::append_unassigned(SightingFactor sighting) {
  sighting.pose = static_cast<int>(state_.open.motions.size()) - 1;
  sighting.landmark = -1;
  state_.open.unassigned.push_back(sighting);
}

void Memory::give_up_landmark(std::int64_t landmark_id) {
  const auto found = numbers_.find(landmark_id);
  if (found == numbers_.end()) return;
  state_.landmarks[static_cast<std::size_t>(found->second)].is_dormant = true;
}

void Memory::forget_landmark(std::int64_t landmark_id) {
  const auto found = numbers_.find(landmark_id);
  if (found == numbers_.end()) return;
  state_.landmarks[static_cast<std::size_t>(found->second)].id = -1;
  numbers_.erase(found);
}

// Short segments that what is new does not put in question any more become long ones: a redraw
// costs as much as there are segments. Wheels slipped in all of it, or in none.
void Memory::join_settled(double robust_width) {
  SegmentGraph& graph = state_.graph;
  const auto slips = [&](std::size_t s) { return slip_square(graph, s) >= kMostSquare; };
  const auto is_settled = [&](std::size_t s) {
    if (!graph.segments[s]->has_data() ||
        state_.begins[s] + graph.segments[s]->duration() >= state_.closed - kSettled) {
      return false;
    }
    const OdometryError error = odometry_error(graph, s, s + 1);
    return error.square(error.slip_covariance) < kMostSquare;
  };
  for (std::size_t first = 0; first < graph.segments.size(); ++first) {
    std::size_t motions = 0;
    std::size_t last = first;
    while (last < graph.segments.size() && is_settled(last) && slips(last) == slips(first) &&
           motions + graph.segments[last]->motions.size() <= kMostMotions) {
      motions += graph.segments[last++]->motions.size();
    }
    // Until the last of them is settled more may come.
    if (last == graph.segments.size() || !is_settled(last)) continue;
    if (last - first < 2 || !join_segments(first, last - first, robust_width, &graph)) continue;
    state_.begins.erase(state_.begins.begin() + static_cast<std::ptrdiff_t>(first) + 1,
                        state_.begins.begin() + static_cast<std::ptrdiff_t>(last));
  }
}

// Of the past, neighbours that have seen the fewest landmarks become one, and their data go, as
// long as there are many: so a drive of hours costs what its map costs.
void Memory::condense_past() {
  SegmentGraph& graph = state_.graph;
  const std::size_t past = first_of_newest(graph, kMostUpdatesWithData);
  if (past <= kMostPast) return;
  for (std::size_t left = past; left > kMostPast; --left) {
    const std::vector<bool> anchored = anchored_segments(graph, state_.begins);
    const auto is_past = [&](std::size_t s) {
      const Segment& segment = *graph.segments[s];
      if (!segment.has_data()) return segment.updates() > 0;
      return anchored[s] && slip_square(graph, s) < kMostSquare;
    };
    std::size_t best = 0;
    std::size_t fewest = std::numeric_limits<std::size_t>::max();
    for (std::size_t s = 0; s + 1 < left; ++s) {
      if (!is_past(s) || !is_past(s + 1)) continue;
      std::vector<int> landmarks = graph.segments[s]->landmarks;
      const std::vector<int>& next = graph.segments[s + 1]->landmarks;
      landmarks.insert(landmarks.end(), next.begin(), next.end());
      std::sort(landmarks.begin(), landmarks.end());
      const auto end = std::unique(landmarks.begin(), landmarks.end());
      const std::size_t count = static_cast<std::size_t>(end - landmarks.begin());
      if (count >= fewest) continue;
      fewest = count;
      best = s;
    }
    if (fewest > graph.landmarks.size() || !join_without_data(best, &graph)) return;
    state_.begins.erase(state_.begins.begin() + static_cast<std::ptrdiff_t>(best) + 1);
  }
}

// Condenses what came since the last segment, in pieces, and puts it behind that.
bool Memory::close_segments(double robust_width) {
  join_settled(robust_width);
  condense_past();
  leave_out_doubts();
  while (!state_.open.motions.empty()) {
    const std::size_t motions = state_.open.motions.size();
    const std::size_t pieces = (motions + kMostMotions - 1) / kMostMotions;
    auto [piece, rest] = cut(motions / pieces, state_.open);
    if (!close(std::move(piece), robust_width)) return false;
    state_.open = std::move(rest);
  }
  return true;
}

// Condenses what came before that time, in s since the start.
bool Memory::close_before(double time, double robust_width) {
  std::size_t motions = 0;
  double reached = state_.closed;
  while (motions < state_.open.motions.size() && reached < time - kSameTime) {
    reached += state_.open.motions[motions++].duration();
  }
  if (motions == 0 || motions == state_.open.motions.size()) return true;
  auto [before, rest] = cut(motions, state_.open);
  if (!close(std::move(before), robust_width)) return false;
  state_.open = std::move(rest);
  return true;
}

// New landmarks, which are numbered as they were seen, are put where the segment saw them.
bool Memory::close(Segment segment, double robust_width) {
  SegmentGraph& graph = state_.graph;
  segment.constants = graph.constants;
  segment.noise = graph.noise;
  compare_with_noise(&segment.motions);
  initialize(&segment);
  if (!fit(FreePart::between_end_and_tracks, robust_width, &segment) ||
      !condense(robust_width, &segment)) {
    return false;
  }
  const Pose2 base = graph.newest();
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    if (static_cast<std::size_t>(segment.landmarks[k]) < graph.landmarks.size()) continue;
    graph.landmarks.push_back(moved(segment.tracks[k], base));
  }
  graph.bases.push_back(compose(base, segment.poses.back()));
  graph.motion_shares.push_back(1.0);
  state_.begins.push_back(state_.closed);
  state_.closed += segment.duration();
  graph.segments.push_back(std::make_shared<const Segment>(std::move(segment)));
  return true;
}

void Memory::check_odometry_scales() {
  if (state_.updates < state_.next_scale_check) return;
  state_.next_scale_check = 2 * state_.updates;
  const Eigen::Vector2d gross = gross_odometry_scales(state_.graph, state_.open);
  for (int k = 0; k < 2; ++k) {
    state_.scale_is_wrong |=
        gross[k] != 0.0 && state_.graph.constants_sigma[k] > 0.0 &&
        std::abs(gross[k] - state_.graph.constants[k]) > 0.5 * std::abs(gross[k]);
  }
}

// From the odometry as it is: constants at their means, no segment bent by a solution. Where its
// scales are grossly wrong, least squares would rather have it slip in every segment.
bool Memory::start_anew(double robust_width, SegmentGraph* graph) const {
  const Eigen::Vector2d gross = gross_odometry_scales(*graph, state_.open);
  for (int k = 0; k < 2; ++k) {
    if (gross[k] == 0.0 || !(graph->constants_sigma[k] > 0.0)) continue;
    graph->constants_sigma[k] = kGrossSigma * std::abs(1.0 + gross[k]);
    graph->constants_mean[k] = gross[k];
  }
  graph->constants = graph->constants_mean;
  Pose2 base = graph->bases.front();
  std::vector<bool> is_placed(graph->landmarks.size(), false);
  for (std::size_t s = 0; s < graph->segments.size(); ++s) {
    Segment segment = *graph->segments[s];
    if (segment.has_data()) {
      segment.constants = graph->constants;
      segment.noise = graph->noise;
      segment.motion_share = 1.0;
      initialize(&segment);
      if (!fit(FreePart::between_end_and_tracks, robust_width, &segment) ||
          !condense(robust_width, &segment)) {
        return false;
      }
    }
    for (std::size_t k = 0; k < segment.tracks.size(); ++k) {
      const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
      if (is_placed[landmark]) continue;
      graph->landmarks[landmark] = moved(segment.tracks[k], base);
      is_placed[landmark] = true;
    }
    base = compose(base, segment.poses.back());
    graph->bases[s + 1] = base;
    graph->motion_shares[s] = 1.0;
    graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
  }
  return true;
}

SegmentSolution Memory::solve_for_all(double robust_width) {
  equations_.reset();
  if (!close_segments(robust_width) || state_.graph.segments.empty()) return {};
  return solve_closed(robust_width);
}

SegmentSolution Memory::solve_closed(double robust_width) {
  SegmentGraph& graph = state_.graph;
  std::unique_ptr<SegmentEquations> equations;
  SegmentSolution solution = pf_resampling::solve(robust_width, &graph, &equations);
  const bool is_suspect =
      (!solution.is_solved || is_doubtful(graph)) && graph.segments.size() >= state_.next_start;
  if (std::exchange(state_.scale_is_wrong, false) || is_suspect) {
    state_.next_start = graph.segments.size() + graph.segments.size() / 10 + 1;
    SegmentGraph anew = graph;
    std::unique_ptr<SegmentEquations> equations_anew;
    if (start_anew(robust_width, &anew)) {
      SegmentSolution other = pf_resampling::solve(robust_width, &anew, &equations_anew);
      if (anew.constants_mean != graph.constants_mean) other.cost += kGrossFault;
      if (other.negative_log_evidence() < solution.negative_log_evidence()) {
        solution = other;
        graph = std::move(anew);
        equations = std::move(equations_anew);
      }
    }
  }
  equations_ = std::move(equations);
  if (solution.is_solved) state_.is_refused = false;
  return solution;
}

bool Memory::solve(const ReassociationOptions& options, std::int64_t* next_id) {
  const bool is_decided = decide(options, next_id);
  // What could not be solved for so long will not be: it begins anew with the population.
  if (!is_decided && state_.updates - state_.decided > kMostUndecided) forget_drive();
  return is_decided;
}

bool Memory::decide(const ReassociationOptions& options, std::int64_t* next_id) {
  equations_.reset();
  if (!close_segments(options.robust_width) || state_.graph.segments.empty()) return false;
  Account account = {state_.graph, state_.landmarks, {}, nullptr};
  const DriveTimes times = {state_.begins, 0, state_.updates, state_.decided};
  if (!decide_associations(options, times, next_id, &account)) return false;
  equations_ = std::move(account.equations);
  state_.graph = std::move(account.graph);
  state_.landmarks = std::move(account.landmarks);
  state_.decided = state_.updates;
  number_landmarks();
  look_for_missed();
  const Scans newest = newest_scans(state_.graph, state_.begins, kNewestUpdates);
  ambiguity_ = ambiguous_share(options, state_.graph, newest);
  return true;
}

void Memory::look_for_missed() {
  const SegmentGraph& graph = state_.graph;
  std::vector<Eigen::Vector2d> places = graph.landmarks;
  const std::vector<bool> are_seen = seen_landmarks(graph);
  for (std::size_t l = 0; l < are_seen.size(); ++l) {
    if (!are_seen[l]) places[l].setConstant(kNowhere);
  }
  const Scans scans = newest_scans(graph, state_.begins, std::numeric_limits<int>::max());
  const ViewPassages passages = view_passages(places, {&scans});
  const double hardly =
      static_cast<double>(passages.hardly_seen) / std::max(1, passages.all - passages.missed);
  misses_landmarks_ =
      passages.missed > kFewMissed + (kMissedShare + hardly * hardly) * passages.all;
}

bool Memory::solve_carried(double robust_width, const Pose2& newest, double since) {
  if (belief_is_wrong()) believe_doubts();
  equations_.reset();
  if (!close_before(since, robust_width) || !close_segments(robust_width) ||
      state_.graph.segments.empty()) {
    return false;
  }
  // A solution of what contradicts itself is no start.
  const SegmentGraph start = state_.graph;
  const SegmentSolution believed = since < 0.0 ? solve_closed(robust_width) : SegmentSolution{};
  SegmentGraph& graph = state_.graph;
  auto equations = std::make_unique<SegmentEquations>(graph);
  SegmentGraph best;
  double least = std::numeric_limits<double>::infinity();
  const std::size_t count = start.segments.size();
  std::size_t first = count - std::min(count, kSuspects);
  std::size_t end = count;
  if (since >= 0.0) {  // the segment that begins then, or holds that time
    const auto next =
        std::upper_bound(state_.begins.begin(), state_.begins.end(), since + kSameTime);
    end = static_cast<std::size_t>(next - state_.begins.begin());
    first = end - std::min<std::size_t>(end, 1);
  }
  for (std::size_t s = first; s < end; ++s) {
    if (!start.segments[s]->has_data()) continue;
    SegmentGraph candidate = carried(start, s, newest);
    if (!relinearize(robust_width, s, &candidate)) continue;
    const double cost = equations->linearize_gradient(candidate);
    if (!(cost < least)) continue;
    least = cost;
    best = std::move(candidate);
  }
  if (!std::isfinite(least)) return false;
  const SegmentSolution solution = pf_resampling::solve(robust_width, &best, &equations);
  if (!(solution.negative_log_evidence() < believed.negative_log_evidence())) return false;
  graph = std::move(best);
  equations_ = std::move(equations);
  return true;
}

MemoryDraw Memory::draw(int particles, const RandomStream& stream) const {
  MemoryDraw draw;
  draw.deviations = (1.0 + kWidening * ambiguity_) *
                    draw_deviations(*equations_, state_.graph, particles, stream);
  for (std::size_t l = 0; l < state_.graph.landmarks.size(); ++l) {
    draw.landmarks_given_path.push_back(equations_->landmark_information(l).inverse());
  }
  const OdometryInformation information = equations_->odometry_information();
  const OdometryInformation covariance = information.llt().solve(OdometryInformation::Identity());
  draw.odometry_given_path = 0.5 * (covariance + covariance.transpose());
  return draw;
}

int Memory::number_of(std::int64_t landmark_id) const {
  const auto found = numbers_.find(landmark_id);
  const bool is_placed = found != numbers_.end() &&
                         static_cast<std::size_t>(found->second) < state_.graph.landmarks.size();
  return is_placed ? found->second : -1;
}

std::vector<Pose2> Memory::path() const {
  std::vector<Pose2> path;
  const SegmentGraph& graph = state_.graph;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    if (graph.segments[s]->updates() == 0) continue;
    for (const Pose2& pose : poses_of(graph, s)) path.push_back(compose(graph.bases[s], pose));
  }
  return path;
}

}  // namespace pf_resampling
