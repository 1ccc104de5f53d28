// The places that fit what RangeMemory holds, and how it solves for all; the noise of the data.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {
namespace {

using RadioOf = RadioUnknown;

// Of the start among listed radios.
constexpr int kStartRadios = 3;
constexpr double kPatience = 10.0;  // s with fewer radios
constexpr int kStartRanges = 12;
constexpr int kHeadings = 24;
constexpr double kRaster = 0.5;                   // m, between first poses
constexpr double kSameHeading = 0.3;              // rad
constexpr double kAnywhere = 0.5;                 // rad
constexpr double kTolerance = 0.1;                // of the cost
constexpr double kToleranceOfNewest = 1.0;        // likewise, where the next solution goes on
constexpr double kSolvedAllEvery = 2.0;           // s
constexpr double kSolvedAllGrowth = 0.25;         // of the drive so far
constexpr double kSolvedAllGrowthOfPlaces = 0.1;  // likewise, while places are found
constexpr double kSolvedAllAtLeastEvery = 60.0;   // s
constexpr std::size_t kMostPlaces = 20;           // of the robot and of radios that are wrong
constexpr int kNoiseTrials = 4;
constexpr int kNewest = 10;          // keyframes that move in between
constexpr int kNewestOfPlaces = 30;  // likewise, while places are found
constexpr int kShareThatLeaves = 4;  // of the keyframes, when there are too many
constexpr int kFewestKeyframes = 100;
constexpr double kMostWork = 1000.0 * 100.0 * 100.0;  // keyframes · constants²

constexpr double kLooseMargin = 4.0;  // of the logarithm of the evidence, where it hardly matters

constexpr double kBlock = 10.0;        // s, of means of residuals
constexpr double kExplained = 3.0;     // standard deviations
constexpr double kWild = 13.8;         // of the square of such a mean
constexpr double kFollowed = 0.8;      // share of it that the path follows: the rest says nothing
constexpr double kPriorBlocks = 10.0;  // with a square of 1
constexpr double kLeastFactor = 0.01;
// Of the loss: narrower, it would take the differences of radios for wild ranges.
constexpr double kNarrowest = 3.0;
constexpr double kWidest = 8.0;
constexpr double kSmallestStep = 1.15;
constexpr double kLargestStep = 2.0;
constexpr double kMedianOfNormal = 0.6745;

}  // namespace

// ---- modes ------------------------------------------------------------------------------------

bool RangeMemory::are_at_one_place(const RangeMode& a, const RangeMode& b) {
  const KeyframeState off = a.estimate.keyframes.back() - b.estimate.keyframes.back();
  return off.head<2>().norm() < kSamePlace && std::abs(wrap_angle(off[2])) < kSameHeading;
}

double RangeMemory::median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// In standard deviations.
double RangeMemory::residual_in(const RangeMode& mode, std::size_t keyframe,
                                const HeldRange& range) const {
  return residual_of(range, noise_, mode.estimate.keyframes[keyframe], mode.estimate.constants)
      .value;
}

bool RangeMemory::solved(int iterations, RangeMode* mode, double least_evidence) const {
  mode->belief = pf_resampling::solve(graph_, mode->prior, noise_, iterations, kTolerance,
                                      mode->past, &mode->estimate, nullptr, least_evidence);
  return mode->belief.is_usable;
}

RangeMode RangeMemory::as_listed() const {
  RangeMode mode;
  mode.prior = prior();
  for (const Radio& radio : radios_) {
    mode.accounts.push_back(radio.listed ? RadioAccount::as_listed : RadioAccount::unlisted);
    mode.estimate.takes_part.push_back(radio.listed.has_value());
  }
  mode.estimate.constants = mode.prior.constants;
  return mode;
}

void RangeMemory::start() {
  RangeMode mode = as_listed();
  if (beacons_.size() >= 2 && !first_) {
    modes_ = starts(mode, kRefined, &noise_);
    return weigh_modes();
  }
  mode.estimate.keyframes = driven_by_odometry(graph_, mode.prior.first, mode.estimate.constants);
  modes_ = {mode};
}

// On the ring of the first range to a radio that takes part, all headings: their cost, the least
// first.
std::vector<std::pair<double, Pose2>> RangeMemory::first_poses(const RangeMode& mode,
                                                               int coarseness) const {
  std::set<int> heard;
  std::vector<const HeldRange*> ranges;
  std::vector<std::size_t> keyframes;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      if (!mode.estimate.takes_part[static_cast<std::size_t>(range.radio)]) continue;
      heard.insert(range.radio);
      ranges.push_back(&range);
      keyframes.push_back(k);
    }
  }
  const bool is_enough = static_cast<int>(ranges.size()) >= kStartRanges && heard.size() >= 2 &&
                         (static_cast<int>(heard.size()) >= kStartRadios || time_ > kPatience);
  if (!is_enough) return {};
  const std::vector<KeyframeState> driven =
      driven_by_odometry(graph_, KeyframeState::Zero(), mode.estimate.constants);
  const HeldRange& first = *ranges.front();
  const Pose2 first_heard = pose_of(driven[keyframes.front()]);
  const std::size_t stride = std::max<std::size_t>(1, ranges.size() / 60);
  std::vector<std::pair<double, Pose2>> candidates;
  for (int i = 0; i < kRingPlaces; i += coarseness) {
    for (int h = 0; h < kHeadings; h += coarseness) {
      const double angle = 2.0 * kPi * i / kRingPlaces;
      const double heading = 2.0 * kPi * h / kHeadings;
      const Eigen::Vector2d radio =
          mode.prior.constants.segment<2>(radio_at(first.radio) + RadioOf::x);
      const double height = first.height.value_or(0.0);
      const double distance =
          std::sqrt(std::max(0.01, first.range * first.range - height * height));
      const Pose2 there = {radio.x() + distance * std::cos(angle),
                           radio.y() + distance * std::sin(angle), heading};
      const Pose2 origin = compose(there, relative(first_heard, Pose2{}));
      double cost = 0.0;
      for (std::size_t r = 0; r < ranges.size(); r += stride) {
        const Pose2 pose = compose(origin, pose_of(driven[keyframes[r]]));
        const KeyframeState state(pose.x, pose.y, pose.heading, 0.0);
        // A coarse raster: a metre is nothing.
        const HeldRangeResidual residual =
            residual_of(*ranges[r], noise_, state, mode.estimate.constants);
        const double off = residual.value * noise_.range * std::sqrt(ranges[r]->variance);
        cost += std::log1p(off * off);
      }
      candidates.emplace_back(cost, origin);
    }
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  return candidates;
}

// The best first poses refined by least squares. `noise`: the factor of the ranges' is found, if
// all are refined.
std::vector<RangeMode> RangeMemory::starts(const RangeMode& mode, std::size_t refined,
                                           RangeNoise* noise) const {
  const bool is_all = refined == kRefined;
  const auto candidates = first_poses(mode, is_all ? 1 : 2);
  double least_sigma = kRaster;
  for (const auto& ranges : graph_.ranges) {
    for (const HeldRange& range : ranges) {
      least_sigma = std::min(least_sigma, std::sqrt(range.variance));
    }
  }
  // The noise is not known yet: found from the first solution that is good.
  std::vector<RangeMode> found;
  for (int round = 0; round < (is_all ? 2 : 1); ++round) {
    found.clear();
    // From between the points of the raster all ranges are wild, if they are exact.
    RangeNoise coarse = *noise;
    coarse.range = std::max(coarse.range, kRaster / least_sigma);
    for (std::size_t c = 0; c < std::min(refined, candidates.size()); ++c) {
      RangeMode candidate = mode;
      const Pose2& origin = candidates[c].second;
      candidate.prior.first << origin.x, origin.y, origin.heading, 0.0;
      candidate.estimate.keyframes =
          driven_by_odometry(graph_, candidate.prior.first, mode.estimate.constants);
      for (const RangeNoise& stage : {coarse, *noise}) {
        candidate.belief = pf_resampling::solve(graph_, candidate.prior, stage, kManyIterations,
                                                kTolerance, {}, &candidate.estimate);
      }
      if (candidate.belief.is_usable) found.push_back(candidate);
    }
    if (found.empty()) return {};
    std::sort(found.begin(), found.end(), [](const RangeMode& a, const RangeMode& b) {
      return a.belief.log_evidence > b.belief.log_evidence;
    });
    if (round > 0 || !is_all) break;
    std::vector<double> residuals;
    for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
      for (const HeldRange& range : graph_.ranges[k]) {
        if (!mode.estimate.takes_part[static_cast<std::size_t>(range.radio)]) continue;
        const RangeEstimate& best = found[0].estimate;
        residuals.push_back(
            std::abs(residual_of(range, *noise, best.keyframes[k], best.constants).value));
      }
    }
    const double median = median_of(std::move(residuals)) / kMedianOfNormal;
    // Few ranges fit better than they are.
    noise->range = std::max(kLeastFactor, noise->range * std::max(1.5 * median, 0.03));
  }
  std::vector<RangeMode> modes;
  for (const RangeMode& candidate : found) {
    if (found[0].belief.log_evidence - candidate.belief.log_evidence > kModeMargin) break;
    const bool is_known = std::any_of(modes.begin(), modes.end(), [&](const RangeMode& before) {
      return are_at_one_place(before, candidate);
    });
    if (!is_known) modes.push_back(candidate);
  }
  return modes;
}

void RangeMemory::weigh_modes() {
  modes_.erase(std::remove_if(modes_.begin(), modes_.end(),
                              [](const RangeMode& mode) { return !mode.belief.is_usable; }),
               modes_.end());
  if (modes_.empty()) return;
  std::stable_sort(modes_.begin(), modes_.end(), [&](const RangeMode& a, const RangeMode& b) {
    return log_probability(a) > log_probability(b);
  });
  const double best = log_probability(modes_.front());
  std::vector<RangeMode> kept;
  double sum = 0.0;
  std::size_t places = 0;
  for (RangeMode& mode : modes_) {
    const double log_odds = log_probability(mode) - best;
    if (log_odds < -kModeMargin) break;
    const auto is_near = [&](const RangeMode& other) {
      return other.accounts == mode.accounts && are_at_one_place(other, mode) &&
             (other.estimate.constants - mode.estimate.constants).norm() < kSamePlace;
    };
    // Of one place, with an error and without: while nobody knows, the belief is both.
    const auto is_known = [&](const RangeMode& other) {
      return is_near(other) && (other.loose == mode.loose || log_odds < -kLooseMargin);
    };
    if (std::any_of(kept.begin(), kept.end(), is_known)) continue;
    if (std::none_of(kept.begin(), kept.end(), is_near) && ++places > kMostPlaces) continue;
    mode.probability = std::exp(log_odds);
    sum += mode.probability;
    kept.push_back(std::move(mode));
  }
  for (RangeMode& mode : kept) mode.probability /= sum;
  modes_ = std::move(kept);
}

bool RangeMemory::solve() {
  if (!is_due() && follow() && explains_newest()) return false;
  solve_all();
  return true;
}

bool RangeMemory::is_due() const {
  return modes_.empty() || may_head_anywhere() || is_too_large() || !explains_newest() ||
         time_ >= next_solution_of_all_ || newest_change();
}

// A robot that stood has any heading: least squares from one of them would end anywhere. One whose
// wheels slipped may have turned, but the drive before is known.
bool RangeMemory::may_head_anywhere() const {
  return modes_.front().belief.is_usable &&
         modes_.front().belief.covariance(2, 2) > kAnywhere * kAnywhere &&
         !(has_slipped_since(times_.front()) && explains_newest());
}

// Keyframe.
int RangeMemory::first_that_moves(const RangeMode& mode) {
  return mode.settled ? mode.settled->keyframe : 0;
}

void RangeMemory::solve_newest(RangeMode* mode) const {
  mode->belief = pf_resampling::solve(graph_, mode->prior, noise_, kIterations, kToleranceOfNewest,
                                      mode->settled ? mode->settled : mode->past, &mode->estimate);
}

bool RangeMemory::follow() {
  for (RangeMode& mode : modes_) {
    if (graph_.keyframes() - first_that_moves(mode) > 2 * newest_keyframes()) {
      settle(&mode);
    } else {
      solve_newest(&mode);
    }
  }
  weigh_modes();
  if (modes_.empty()) return false;
  try_slip();
  return true;
}

void RangeMemory::solve_all() {
  if (!modes_.empty() && may_head_anywhere()) modes_.clear();
  if (modes_.empty()) start();
  if (const std::optional<Change> change = newest_change()) forget_before(*change);
  for (RangeMode& mode : modes_) solved(kIterations, &mode);
  weigh_modes();
  if (modes_.empty()) return;
  try_slip();
  let_radios_enter(&modes_.front());
  // The evidence of fewer ranges is no evidence against more.
  modes_.erase(std::remove_if(modes_.begin() + 1, modes_.end(),
                              [&](const RangeMode& mode) {
                                return mode.estimate.takes_part !=
                                       modes_.front().estimate.takes_part;
                              }),
               modes_.end());
  RangeMode& best = modes_.front();
  try_all_places_anew(&best);
  try_other_places(&best);
  find_doubt();
  if (try_gross_odometry()) return;
  judge_radios();
  learn_noise();
  if (modes_.empty()) return;
  while (is_too_large()) let_oldest_leave();
  for (RangeMode& mode : modes_) {
    mode.settled.reset();
    settle(&mode);
  }
  const double growth = are_listed() ? kSolvedAllGrowth : kSolvedAllGrowthOfPlaces;
  next_solution_of_all_ =
      time_ + std::min(kSolvedAllAtLeastEvery, std::max(kSolvedAllEvery, growth * time_));
}

// A solution takes keyframes · constants².
bool RangeMemory::is_too_large() const {
  const int keyframes = graph_.keyframes();
  const auto constants = static_cast<double>(radio_at(static_cast<int>(radios_.size())));
  return keyframes > options_.most_keyframes ||
         (keyframes > kFewestKeyframes &&
          (keyframes * constants * constants > kMostWork || radios_.size() >= kMostRadios));
}

// Each mode keeps what they say, but for what would hold a radio back that may be elsewhere, or was
// moved.
void RangeMemory::let_oldest_leave() {
  const int leaving = graph_.keyframes() / kShareThatLeaves;
  for (RangeMode& mode : modes_) {
    RangePast past;
    past.keyframe = leaving;
    mode.belief = pf_resampling::solve(graph_, mode.prior, noise_, 1, kTolerance, mode.past,
                                       &mode.estimate, &past);
    for (std::size_t r = 0; r < radios_.size(); ++r) {
      const bool is_wrong = radios_[r].listed && mode.accounts[r] != RadioAccount::as_listed;
      if (!is_wrong && radios_[r].other_places.empty()) continue;
      past = without_radio(static_cast<int>(r), mode.prior, std::move(past));
    }
    past.keyframe = 0;
    mode.past = std::move(past);
    auto& keyframes = mode.estimate.keyframes;
    keyframes.erase(keyframes.begin(), keyframes.begin() + leaving);
  }
  graph_.motions.erase(graph_.motions.begin(), graph_.motions.begin() + leaving);
  graph_.slipped.erase(graph_.slipped.begin(), graph_.slipped.begin() + leaving);
  graph_.ranges.erase(graph_.ranges.begin(), graph_.ranges.begin() + leaving);
  times_.erase(times_.begin(), times_.begin() + leaving);
  weigh_modes();
  std::vector<bool> is_needed(radios_.size(), false);
  for (const auto& ranges : graph_.ranges) {
    for (const HeldRange& range : ranges) is_needed[static_cast<std::size_t>(range.radio)] = true;
  }
  for (int r = static_cast<int>(radios_.size()) - 1; r >= 0; --r) {
    const auto radio = static_cast<std::size_t>(r);
    const bool is_as_listed = std::all_of(modes_.begin(), modes_.end(), [&](const RangeMode& mode) {
      return mode.accounts[radio] == RadioAccount::as_listed;
    });
    if (is_as_listed && !is_needed[radio] && !radios_[radio].repeats()) forget(r);
  }
}

bool RangeMemory::are_listed() const {
  return std::all_of(radios_.begin(), radios_.end(),
                     [](const Radio& radio) { return radio.listed.has_value(); });
}

int RangeMemory::newest_keyframes() const {
  return are_listed() ? kNewest : kNewestOfPlaces;
}

void RangeMemory::settle(RangeMode* mode) const {
  const int keyframe = graph_.keyframes() - newest_keyframes();
  if (keyframe <= 0) return;
  RangePast settled;
  settled.keyframe = keyframe;
  const std::optional<RangePast>& past = mode->settled ? mode->settled : mode->past;
  mode->belief = pf_resampling::solve(graph_, mode->prior, noise_, kIterations, kTolerance, past,
                                      &mode->estimate, &settled);
  if (mode->belief.is_usable) mode->settled = std::move(settled);
}

bool RangeMemory::explains_newest() const {
  const RangeMode& mode = modes_.front();
  int heard = 0, explained = 0;
  for (int k = graph_.keyframes() - 1; k >= 0; --k) {
    const auto at = static_cast<std::size_t>(k);
    if (times_[at] < time_ - kBlock) break;
    for (const HeldRange& range : graph_.ranges[at]) {
      if (!mode.estimate.takes_part[static_cast<std::size_t>(range.radio)]) continue;
      ++heard;
      if (std::abs(residual_in(mode, at, range)) < kExplained) ++explained;
    }
  }
  return 2 * explained >= heard;
}

// ---- noise ------------------------------------------------------------------------------------

double RangeMemory::log_prior_of_noise(const RangeNoise& noise) const {
  const double translation = std::log(noise.translation) / options_.noise_spread;
  const double heading = std::log(noise.heading) / options_.noise_spread;
  return -0.5 * (translation * translation + heading * heading);
}

// Each of the noise's numbers, until none is better in another place. A path of few ranges can fit
// them as if they had no noise, and noise and path then keep each other: that of ranges at most
// halves at a time.
void RangeMemory::learn_noise() {
  bool is_other_noise = false;
  const double least_of_ranges = 0.5 * noise_.range;
  for (int failed = 0; failed < kNoiseTrials;) {
    const bool is_better = try_noise(least_of_ranges);
    is_other_noise |= is_better;
    failed = is_better ? 0 : failed + 1;
  }
  for (std::size_t m = 1; is_other_noise && m < modes_.size(); ++m) {
    solved(kIterations, &modes_[m]);
  }
  weigh_modes();
}

// One of the noise's numbers, up and down: that under which the data are most probable. Steps
// become larger where one is better; else smaller, and the next number is tried.
bool RangeMemory::try_noise(double least_of_ranges) {
  RangeMode& mode = modes_.front();
  const std::array numbers = {&RangeNoise::range, &RangeNoise::translation, &RangeNoise::heading,
                              &RangeNoise::robust_width};
  const std::size_t trial = static_cast<std::size_t>(next_trial_) % numbers.size();
  double& step = trial_steps_[trial];
  const RangeNoise before = noise_;
  const double best = mode.belief.log_evidence + log_prior_of_noise(noise_);
  for (const double factor : {step, 1.0 / step}) {
    noise_ = before;
    double& number = noise_.*numbers[trial];
    number = std::max(kLeastFactor, number * factor);
    noise_.range = std::max(least_of_ranges, noise_.range);
    noise_.robust_width = std::min(kWidest, std::max(kNarrowest, noise_.robust_width));
    // A narrower loss has a smaller scale: apart, neither is better from where they are.
    if (numbers[trial] == &RangeNoise::robust_width) {
      noise_.range *= before.range_deviation() / noise_.range_deviation();
    }
    RangeMode other = mode;
    if (solved(kIterations, &other, best - log_prior_of_noise(noise_)) &&
        other.belief.log_evidence + log_prior_of_noise(noise_) > best) {
      mode = std::move(other);
      // Few ranges fit better than they are: what grows may grow fast.
      if (factor > 1.0) step = std::min(kLargestStep, step * step);
      return true;
    }
  }
  noise_ = before;
  step = std::max(kSmallestStep, std::sqrt(step));
  ++next_trial_;
  return false;
}

// Errors that last show in means of residuals over a while, not in single ones. Where ranges are
// dear the path follows those that err alike: it takes its share of their mean.
void RangeMemory::find_doubt() {
  const RangeMode& mode = modes_.front();
  const std::vector<Eigen::Matrix2d> positions =
      position_covariances(graph_, mode.prior, noise_, mode.past, mode.estimate);
  if (positions.empty()) return;
  const std::size_t count = radios_.size();
  std::vector<double> sums(count, 0.0), weights(count, 0.0);
  std::vector<Eigen::Vector2d> directions(count, Eigen::Vector2d::Zero());
  double squares = kPriorBlocks;
  double blocks = kPriorBlocks;
  std::size_t begin = 0;
  const auto end_block = [&](std::size_t end) {
    const Eigen::Matrix2d& position = positions[(begin + end) / 2];
    for (std::size_t r = 0; r < count; ++r) {
      if (weights[r] > 1.0) {
        const double followed = directions[r].dot(position * directions[r]) / weights[r];
        const double left = followed < kFollowed ? 1.0 - followed : 1.0;
        squares += std::min(kWild, sums[r] * sums[r] / (left * weights[r]));
        blocks += 1.0;
      }
      sums[r] = weights[r] = 0.0;
      directions[r].setZero();
    }
    begin = end;
  };
  const RangeLoss loss(noise_);
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    if (times_[k] - times_[begin] > kBlock) end_block(k);
    for (const HeldRange& range : graph_.ranges[k]) {
      const auto radio = static_cast<std::size_t>(range.radio);
      if (!mode.estimate.takes_part[radio]) continue;
      const HeldRangeResidual residual =
          residual_of(range, noise_, mode.estimate.keyframes[k], mode.estimate.constants);
      const double weight = loss.at(residual.value, range.variance).weight;
      directions[radio] += weight * residual.by_keyframe.head<2>();
      sums[radio] += weight * residual.value;
      weights[radio] += weight * weight;
    }
  }
  end_block(graph_.ranges.size());
  doubt_ = std::sqrt(std::max(1.0, squares / blocks));
}

}  // namespace pf_resampling
