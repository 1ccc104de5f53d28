#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace pf_resampling {
namespace {

constexpr std::size_t kMostPredicted = 300;  // blocks of each kind
// Blocks that are predicted at a time, a factorisation each; and how much of the drive passes from
// one time to the next: their number grows with its logarithm.
constexpr std::size_t kMostPassages = 8;
constexpr std::size_t kMostWindows = 4;
constexpr double kValidationStride = 0.01;
// Factor that the noise may fall by at a time: what the drive is linearised at follows it.
constexpr double kMostNoiseFall = 1.25;
constexpr double kGapOfPassage = 10.0;    // s
constexpr double kLongestPassage = 30.0;  // s
// Squared error of three degrees of freedom that names a slip: a chance of 1e-8 without one.
constexpr double kSlip = 40.0;
constexpr double kSlipped = 0.2;  // weight of the odometry
constexpr std::ptrdiff_t kFewSlips = 2;
constexpr double kLargeConstant = 3.0;  // standard deviations
constexpr double kSmallestPrior = 1e-9;
constexpr double kUnknown = 1e9;  // standard deviation of constants that a belief knows

void append_newest(const std::vector<PredictedBlock>& blocks, std::vector<PredictedBlock>* all) {
  all->insert(all->end(), blocks.begin(), blocks.end());
  if (all->size() > kMostPredicted) {
    all->erase(all->begin(), all->end() - static_cast<std::ptrdiff_t>(kMostPredicted));
  }
}

// Evenly over all of them.
void keep_evenly(std::size_t most, std::vector<LeftOutSightings>* blocks) {
  if (blocks->size() <= most) return;
  for (std::size_t i = 0; i < most; ++i) {
    (*blocks)[i] = std::move((*blocks)[i * blocks->size() / most]);
  }
  blocks->resize(most);
}

// Whether a solution may be a bad one: constants far beyond what is known of their size, or
// odometry that is wrong here and there.
bool is_doubtful(const SegmentGraph& graph) {
  const auto slipped = std::count_if(graph.motion_shares.begin(), graph.motion_shares.end(),
                                     [](double share) { return share < kSlipped; });
  const bool is_far = (graph.constants.array().abs() >
                       kLargeConstant * graph.constants_sigma.array().max(kSmallestPrior))
                          .any();
  return is_far || slipped > kFewSlips;
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
  numbers_.clear();
  for (std::size_t l = 0; l < state.landmark_ids.size(); ++l) {
    numbers_[state.landmark_ids[l]] = static_cast<int>(l);
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
  segment.information[DataKind::given] = root.solve(Eigen::MatrixXd::Identity(size, size));
  segment.between.resize(0, size);
  segment.gradient[DataKind::given] = Eigen::VectorXd::Zero(size);
  if (!segment.information[DataKind::given].allFinite()) return false;
  forget_drive();
  segment.noise = state_.graph.noise;
  state_.graph.bases = {Pose2{}, belief.pose};
  state_.graph.segments = {std::make_shared<const Segment>(std::move(segment))};
  state_.graph.motion_shares = {1.0};
  state_.graph.landmarks = belief.landmarks;
  state_.graph.constants = belief.constants;
  state_.graph.constants_sigma.setConstant(kUnknown);
  state_.landmark_ids = belief.landmark_ids;
  state_.last_seen.assign(belief.landmark_ids.size(), 0);
  state_.placed = belief.landmark_ids.size();
  state_.begins = {0.0};
  resume(MemoryState(state_));
  return true;
}

void Memory::append(const MotionFactor& motion) {
  state_.open.motions.push_back(motion);
  ++state_.updates;
  state_.longest_absence = 0;
  state_.time += motion.duration();
}

void Memory::append_sighting(std::int64_t landmark_id, SightingFactor sighting) {
  Segment& open = state_.open;
  const auto [found, is_new] =
      numbers_.try_emplace(landmark_id, static_cast<int>(state_.landmark_ids.size()));
  const int number = found->second;
  if (is_new) {
    state_.landmark_ids.push_back(landmark_id);
    state_.last_seen.push_back(state_.updates);
  }
  sighting.pose = static_cast<int>(open.motions.size()) - 1;
  const auto track = std::find(open.landmarks.begin(), open.landmarks.end(), number);
  sighting.landmark = static_cast<int>(track - open.landmarks.begin());
  if (track == open.landmarks.end()) open.landmarks.push_back(number);
  open.sightings.push_back(sighting);
  int& last = state_.last_seen[static_cast<std::size_t>(number)];
  state_.longest_absence = std::max(state_.longest_absence, state_.updates - last - 1);
  last = state_.updates;
}

// Condenses what came since the last segment, puts it behind that, and new landmarks where it saw
// them.
bool Memory::close_segment(double robust_width) {
  SegmentGraph& graph = state_.graph;
  if (state_.open.motions.empty()) return true;
  Segment segment = state_.open;
  segment.constants = graph.constants;
  segment.noise = graph.noise;
  initialize(&segment);
  if (!fit(FreePart::between_end_and_tracks, robust_width, &segment) ||
      !condense(robust_width, &segment)) {
    return false;
  }
  const Pose2 base = graph.newest();
  graph.landmarks.resize(state_.landmark_ids.size(), Eigen::Vector2d::Zero());
  for (std::size_t k = 0; k < segment.landmarks.size(); ++k) {
    const std::size_t landmark = static_cast<std::size_t>(segment.landmarks[k]);
    if (landmark < state_.placed) continue;
    const Pose2 place = compose(base, {segment.tracks[k].x(), segment.tracks[k].y(), 0.0});
    graph.landmarks[landmark] = {place.x, place.y};
  }
  state_.placed = state_.landmark_ids.size();
  graph.bases.push_back(compose(base, segment.poses.back()));
  graph.motion_shares.push_back(1.0);
  state_.begins.push_back(state_.time - segment.duration());
  graph.segments.push_back(std::make_shared<const Segment>(std::move(segment)));
  state_.open = Segment{};
  note_passages(graph.segments.size() - 1);
  return true;
}

// From the odometry as it is: constants at their means, no segment bent by a solution.
bool Memory::start_anew(double robust_width, SegmentGraph* graph) const {
  graph->constants.setZero();
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
      const Pose2 place = compose(base, {segment.tracks[k].x(), segment.tracks[k].y(), 0.0});
      graph->landmarks[landmark] = {place.x, place.y};
      is_placed[landmark] = true;
    }
    base = compose(base, segment.poses.back());
    graph->bases[s + 1] = base;
    graph->motion_shares[s] = 1.0;
    graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
  }
  return true;
}

bool Memory::solve(double robust_width) {
  equations_.reset();
  SegmentGraph& graph = state_.graph;
  if (!close_segment(robust_width) || graph.segments.empty()) return false;
  std::unique_ptr<SegmentEquations> equations;
  SegmentSolution solution = pf_resampling::solve(robust_width, &graph, &equations);
  if ((!solution.is_solved || is_doubtful(graph)) && graph.segments.size() >= state_.next_start) {
    state_.next_start = graph.segments.size() + graph.segments.size() / 10 + 1;
    SegmentGraph anew = graph;
    std::unique_ptr<SegmentEquations> equations_anew;
    if (start_anew(robust_width, &anew)) {
      const SegmentSolution other = pf_resampling::solve(robust_width, &anew, &equations_anew);
      if (other.is_solved && !(solution.is_solved && solution.cost <= other.cost)) {
        solution = other;
        graph = std::move(anew);
        equations = std::move(equations_anew);
      }
    }
  }
  equations_ = std::move(equations);
  return solution.is_solved;
}

MemoryDraw Memory::draw(int particles, const RandomStream& stream) const {
  MemoryDraw draw;
  draw.deviations = draw_deviations(*equations_, state_.graph, particles, stream);
  for (std::size_t l = 0; l < state_.graph.landmarks.size(); ++l) {
    draw.landmarks_given_path.push_back(equations_->landmark_information(l).inverse());
  }
  draw.odometry_given_path = equations_->odometry_information().inverse();
  return draw;
}

// Which passages the sightings of a new segment go on with, begin or end.
void Memory::note_passages(std::size_t s) {
  const Segment& segment = *state_.graph.segments[s];
  std::vector<double> times;
  double time = state_.begins[s];
  for (const MotionFactor& motion : segment.motions) times.push_back(time += motion.duration());
  state_.open_passages.resize(state_.landmark_ids.size());
  const auto end = [&](OpenPassage* passage) {
    if (!passage->sightings.empty()) {
      state_.passages_left.push_back({passage->sightings, {passage->sightings}});
    }
    passage->sightings.clear();
  };
  for (std::size_t i = 0; i < segment.sightings.size(); ++i) {
    const SightingFactor& sighting = segment.sightings[i];
    const double at = times[static_cast<std::size_t>(sighting.pose)];
    OpenPassage& passage = state_.open_passages[static_cast<std::size_t>(
        segment.landmarks[static_cast<std::size_t>(sighting.landmark)])];
    if (at > passage.last + kGapOfPassage || at > passage.begin + kLongestPassage) end(&passage);
    if (passage.sightings.empty()) passage.begin = at;
    passage.last = at;
    passage.sightings.push_back({s, i});
  }
  for (OpenPassage& passage : state_.open_passages) {
    if (state_.time > passage.last + kGapOfPassage) end(&passage);
  }
}

void Memory::validate(double robust_width) {
  if (equations_ == nullptr || state_.time < state_.next_validation) return;
  std::vector<LeftOutSightings> windows =
      completed_windows(state_.graph, state_.begins, state_.validated, state_.time);
  std::vector<LeftOutSightings> passages = std::move(state_.passages_left);
  state_.passages_left.clear();
  state_.validated = state_.time;
  state_.next_validation = (1.0 + kValidationStride) * state_.time;
  if (passages.empty() && windows.empty()) return;
  keep_evenly(kMostPassages, &passages);
  keep_evenly(kMostWindows, &windows);
  append_newest(predict(state_.graph, robust_width, passages), &state_.passages);
  append_newest(predict(state_.graph, robust_width, windows), &state_.windows);
  const NoiseScales found = noise_scales(state_.passages, state_.windows, NoiseDirection::both);
  const auto approach = [](double from, double to) { return std::max(to, from / kMostNoiseFall); };
  NoiseScales& noise = state_.graph.noise;
  noise = {approach(noise.range, found.range), approach(noise.bearing, found.bearing),
           approach(noise.motion, found.motion)};
}

int Memory::number_of(std::int64_t landmark_id) const {
  const auto found = numbers_.find(landmark_id);
  return found == numbers_.end() || static_cast<std::size_t>(found->second) >= state_.placed
             ? -1
             : found->second;
}

std::vector<Pose2> Memory::path() const {
  std::vector<Pose2> path;
  const SegmentGraph& graph = state_.graph;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const Eigen::VectorXd moved = difference(graph, s, segment);
    const Eigen::VectorXd between = segment.between * moved;
    for (std::size_t i = 0; i + 1 < segment.poses.size(); ++i) {
      Pose2 pose = segment.poses[i];
      const Eigen::Index at = 3 * static_cast<Eigen::Index>(i);
      pose.x += between[at];
      pose.y += between[at + 1];
      pose.heading += between[at + 2];
      path.push_back(compose(graph.bases[s], pose));
    }
    if (segment.has_data()) path.push_back(graph.bases[s + 1]);
  }
  return path;
}

std::vector<Slip> Memory::slips() const {
  std::vector<Slip> slips;
  for (std::size_t s = 0; s < state_.graph.segments.size(); ++s) {
    const double square = slip_square(state_.graph, s);
    if (square < kSlip) continue;
    const double begin = state_.begins[s];
    const double end = begin + state_.graph.segments[s]->duration();
    if (!slips.empty() && begin - slips.back().end < 1.0) {
      slips.back().end = end;
      slips.back().square = std::max(square, slips.back().square);
    } else {
      slips.push_back({begin, end, square});
    }
  }
  return slips;
}

}  // namespace pf_resampling
