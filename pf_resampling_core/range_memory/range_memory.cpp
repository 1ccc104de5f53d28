#include "pf_resampling_core/range_memory/range_memory.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using RadioOf = RadioUnknown;
constexpr int kKeyframe = KeyframeUnknown::count;
constexpr int kAllRadios = -1;

// Keyframes: so far apart that the noise of the odometry between them is small beside a range's.
constexpr double kLongestSpacing = 1.0;     // m
constexpr double kShortestSpacing = 0.05;   // m
constexpr double kNoisePerDistance = 0.05;  // m/sqrt(m), of the odometry
constexpr double kShareOfRangeNoise = 0.5;
constexpr double kTurn = 0.2;      // rad
constexpr double kDuration = 2.0;  // s

// A radio stands no higher than this share of the listed ones' area is long, as a rule.
constexpr double kHeightOfArea = 0.05;

// Of the start among listed radios.
constexpr int kStartRadios = 3;
constexpr double kPatience = 10.0;  // s with fewer radios
constexpr int kStartRanges = 12;
constexpr int kRingPlaces = 32;
constexpr int kHeadings = 24;
constexpr std::size_t kRefined = 16;
constexpr std::size_t kRefinedOfMany = 5;
constexpr double kFarAway = 100.0;   // m, of the first pose
constexpr double kAnyHeading = 3.0;  // rad
constexpr double kFixed = 1e-3;      // m, rad: of a first pose that is the frame
constexpr double kFixedScale = 1e-4;
constexpr double kSamePlace = 0.5;    // m, of two modes
constexpr double kSameHeading = 0.3;  // rad
constexpr double kAnywhere = 0.5;     // rad
constexpr double kModeMargin = 10.0;  // of the logarithm of the evidence
constexpr int kIterations = 8;
constexpr int kManyIterations = 30;
constexpr double kTolerance = 0.02;        // of the cost
constexpr double kSolvedAllEvery = 3.0;    // s
constexpr double kSolvedAllGrowth = 0.25;  // of the drive so far
constexpr std::size_t kMostModes = 6;
constexpr int kNoiseTrials = 4;
constexpr int kNewest = 60;  // keyframes that move in between
constexpr double kFinishingStep = 1.5;
constexpr int kMostNoiseTrials = 40;

// Of radios whose place is not listed.
constexpr std::size_t kFixRanges = 120;
constexpr std::size_t kFewestFixRanges = 8;
constexpr double kFixMargin = 30.0;
constexpr double kGain = 0.5;

// Of radios that are not as listed.
constexpr double kElsewhere = 3.0;  // m, standard deviation of the place
constexpr double kBiased = 2.0;     // m
constexpr int kFewestRanges = 30;
constexpr double kSuspiciousCost = 0.6;  // mean of a range; independent ones: 0.45
constexpr double kPull = 3.0;            // gain of the cost if its place were free
constexpr double kOwnBias = 2.0;         // standard deviations
constexpr double kRigid = 60.0;          // s that odometry alone has the shape of the path
constexpr int kRounds = 4;               // of faults and errors, one found in each
constexpr double kLeastFault = 0.3;      // m
// Two radios elsewhere and a scale explain what one radio elsewhere does, if they may.
constexpr double kAnotherFault = 1e-5;  // odds, before there are data
constexpr double kNamed = 0.95;         // probability
// Along one line mirrored paths and places explain ranges as well as the true ones: no radio is
// named.
constexpr double kTurnedBeforeNaming = 1.0;  // rad, between headings of most ranges
constexpr double kMostRanges = 0.9;
// Wheels are 1 % off, as a rule, and what they are off by looks like a bias of the ranges.
constexpr double kTightWheels = 0.45;
constexpr double kLooseOdds = 0.4;  // of an error that may be there, before there are data

constexpr double kBlock = 10.0;        // s, of means of residuals
constexpr double kExplained = 3.0;     // standard deviations
constexpr double kWild = 13.8;         // of the square of such a mean
constexpr double kPriorBlocks = 10.0;  // with a square of 1
constexpr double kLeastFactor = 0.01;
// Of the loss: narrower, it would take the differences of radios for wild ranges.
constexpr double kNarrowest = 3.0;
constexpr double kWidest = 8.0;
constexpr double kSmallestStep = 1.15;
constexpr double kMedianOfNormal = 0.6745;

void join(const OdometryIncrement& next, OdometryIncrement* increment) {
  const double cosine = std::cos(increment->mean.heading);
  const double sine = std::sin(increment->mean.heading);
  Eigen::Matrix3d by_past = Eigen::Matrix3d::Identity();
  by_past(0, 2) = -(sine * next.mean.x + cosine * next.mean.y);
  by_past(1, 2) = cosine * next.mean.x - sine * next.mean.y;
  Eigen::Matrix3d by_next = Eigen::Matrix3d::Identity();
  by_next.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  const auto propagate = [&](const Eigen::Vector3d& of_next, Eigen::Vector3d* sensitivity) {
    *sensitivity = (by_past * *sensitivity + by_next * of_next).eval();
  };
  increment->covariance = (by_past * increment->covariance * by_past.transpose() +
                           by_next * next.covariance * by_next.transpose())
                              .eval();
  propagate(next.yaw_rate_sensitivity, &increment->yaw_rate_sensitivity);
  propagate(next.turn_scale_sensitivity, &increment->turn_scale_sensitivity);
  increment->mean = compose(increment->mean, next.mean);
  increment->duration += next.duration;
}

}  // namespace

RangeMemory::RangeMemory(const RangeMemoryOptions& options, const std::vector<Beacon>& beacons,
                         const std::vector<std::pair<int, RangeCalibration>>& calibration)
    : options_(options), calibration_(calibration) {
  graph_.ranges.emplace_back();
  times_.push_back(0.0);
  for (const Beacon& beacon : beacons) {
    const int before = static_cast<int>(radios_.size());
    const int radio = radio_of(beacon.id);
    if (radio != before) {
      throw Error("beacon " + std::to_string(beacon.id) +
                  " appears twice; give every beacon an id of its own");
    }
    radios_.back().listed = beacon;
  }
}

int RangeMemory::radio_of(int id) {
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    if (radios_[i].id == id) return static_cast<int>(i);
  }
  Radio radio;
  radio.id = id;
  radio.calibration = calibration_of(id);
  radios_.push_back(radio);
  const RangePrior anew = prior();
  for (RangeMode& mode : modes_) {
    const Eigen::Index was = mode.prior.constants.size();
    const Eigen::Index is = anew.constants.size();
    for (Eigen::VectorXd* to : {&mode.prior.constants, &mode.estimate.constants}) {
      to->conservativeResize(is);
      to->tail(is - was) = anew.constants.tail(is - was);
    }
    mode.accounts.push_back(RadioAccount::unlisted);
    mode.prior.constants_sigma = sigmas(mode.accounts, mode.loose);
    mode.estimate.takes_part.push_back(false);
    mode.belief = RangeBelief{};
    mode.past.reset();
  }
  before_.reset();
  return static_cast<int>(radios_.size()) - 1;
}

RangeCalibration RangeMemory::calibration_of(int id) const {
  RangeCalibration calibration;
  for (const int wanted : {kAllRadios, id}) {
    for (const auto& [of, given] : calibration_) {
      if (of == wanted) calibration = given;
    }
  }
  return calibration;
}

RangePrior RangeMemory::prior() const {
  RangePrior prior;
  prior.constants = Eigen::VectorXd::Zero(radio_at(static_cast<int>(radios_.size())));
  prior.yaw_rate_walk = options_.yaw_rate_walk;
  const RangeCalibration all = calibration_of(kAllRadios);
  prior.constants[Common::scale] = all.scale - 1.0;
  prior.constants[Common::bias] = all.bias;
  int listed = 0;
  std::vector<RadioAccount> accounts;
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    const Radio& radio = radios_[i];
    const int at = radio_at(static_cast<int>(i));
    prior.constants[at + RadioOf::scale] = radio.calibration.scale - all.scale;
    prior.constants[at + RadioOf::bias] = radio.calibration.bias - all.bias;
    accounts.push_back(radio.listed ? RadioAccount::as_listed : RadioAccount::unlisted);
    if (!radio.listed) continue;
    ++listed;
    prior.constants.segment<2>(at + RadioOf::x) = radio.listed->position.head<2>();
  }
  prior.constants_sigma = sigmas(accounts, {});
  prior.first_sigma << kFarAway, kFarAway, kAnyHeading, options_.yaw_rate;
  if (listed < 2) prior.first_sigma.head<3>().setConstant(kFixed);
  return prior;
}

bool RangeMemory::may_be_loose(LooseError::Index error) const {
  if (error == LooseError::antenna) return !lever_is_stated_;
  if (error != LooseError::heights) return true;
  return std::any_of(radios_.begin(), radios_.end(),
                     [](const Radio& radio) { return !radio.listed || radio.listed->is_planar; });
}

Eigen::VectorXd RangeMemory::sigmas(const std::vector<RadioAccount>& accounts,
                                    const LooseErrors& loose) const {
  const auto share = [&](LooseError::Index error) { return loose[error] ? 1.0 : options_.tight; };
  int listed = 0;
  Eigen::AlignedBox2d area;
  for (const Radio& radio : radios_) {
    if (!radio.listed) continue;
    ++listed;
    area.extend(Eigen::Vector2d(radio.listed->position.head<2>()));
  }
  const double height = listed >= 2
                            ? std::min(options_.height, kHeightOfArea * area.diagonal().norm())
                            : options_.height;
  const double lever =
      lever_is_stated_ ? options_.stated_lever : share(LooseError::antenna) * options_.lever;
  const double wheels = loose[LooseError::wheels] ? 1.0 : kTightWheels;
  Eigen::VectorXd sigmas(radio_at(static_cast<int>(radios_.size())));
  sigmas.head<Common::count>() << options_.scale, options_.bias,
      listed >= 2 ? wheels * options_.distance_scale : kFixedScale, wheels * options_.turn_scale,
      lever, lever;
  const double own = share(LooseError::radios);
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    const bool is_planar = !radios_[i].listed || radios_[i].listed->is_planar;
    double place = options_.surveyed;
    if (accounts[i] == RadioAccount::unlisted) place = options_.unknown;
    if (accounts[i] == RadioAccount::elsewhere) place = kElsewhere;
    sigmas.segment<RadioOf::count>(radio_at(static_cast<int>(i))) << place, place,
        own * options_.own_scale,
        accounts[i] == RadioAccount::biased ? kBiased : own * options_.own_bias,
        is_planar ? share(LooseError::heights) * height * height : kFixed;
  }
  return sigmas;
}

void RangeMemory::set_account(int radio, RadioAccount account, RangeMode* mode) const {
  mode->accounts[static_cast<std::size_t>(radio)] = account;
  mode->prior.constants_sigma = sigmas(mode->accounts, mode->loose);
}

// ---- data in ----------------------------------------------------------------------------------

double RangeMemory::spacing() const {
  const double noise = kShareOfRangeNoise * noise_.range * options_.sigma / kNoisePerDistance;
  return std::min(kLongestSpacing, std::max(kShortestSpacing, noise * noise));
}

void RangeMemory::add(const OdometryIncrement& odometry,
                      const std::vector<RangeObservation>& ranges) {
  join(odometry, &pending_);
  time_ += odometry.duration;
  if (ranges.empty()) return;
  const bool moved = std::hypot(pending_.mean.x, pending_.mean.y) > spacing() ||
                     std::abs(pending_.mean.heading) > kTurn || pending_.duration > kDuration;
  if (moved) add_keyframe();
  for (const RangeObservation& observation : ranges) {
    HeldRange range;
    range.radio = radio_of(observation.beacon);
    Radio& radio = radios_[static_cast<std::size_t>(range.radio)];
    ++radio.ranges;
    const double given = radio.calibration.sigma;
    range.range = observation.range;
    range.variance = given > 0.0                  ? given * given
                     : observation.variance > 0.0 ? observation.variance
                                                  : options_.sigma * options_.sigma;
    range.antenna = observation.antenna.head<2>();
    if (observation.antenna_is_stated || range.antenna.squaredNorm() > 0.0) lever_is_stated_ = true;
    if (radio.listed && !radio.listed->is_planar) {
      range.height = radio.listed->position.z() - observation.antenna.z();
    }
    range.since = pending_;
    graph_.ranges.back().push_back(range);
  }
}

void RangeMemory::add_keyframe() {
  for (RangeMode& mode : modes_) {
    const KeyframeState& last = mode.estimate.keyframes.back();
    const Pose2 pose =
        compose(pose_of(last), corrected_motion(pending_, last, mode.estimate.constants));
    mode.estimate.keyframes.emplace_back(pose.x, pose.y, pose.heading, last[3]);
  }
  graph_.motions.push_back(pending_);
  graph_.ranges.emplace_back();
  times_.push_back(time_);
  pending_ = OdometryIncrement{};
}

// ---- modes ------------------------------------------------------------------------------------

RangeBelief RangeMemory::solved(int iterations, RangeMode* mode) const {
  mode->belief =
      pf_resampling::solve(graph_, mode->prior, noise_, iterations, kTolerance, &mode->estimate);
  return mode->belief;
}

void RangeMemory::start() {
  int listed = 0;
  for (const Radio& radio : radios_) listed += radio.listed ? 1 : 0;
  if (listed >= 2) {
    modes_ = starts(-1, &noise_);
    return weigh_modes();
  }
  RangeMode mode;
  mode.prior = prior();
  mode.accounts.assign(radios_.size(), RadioAccount::unlisted);
  mode.estimate.constants = mode.prior.constants;
  mode.estimate.takes_part.assign(radios_.size(), false);
  mode.estimate.keyframes = {mode.prior.first};
  for (const OdometryIncrement& motion : graph_.motions) {
    const KeyframeState& last = mode.estimate.keyframes.back();
    const Pose2 pose =
        compose(pose_of(last), corrected_motion(motion, last, mode.estimate.constants));
    mode.estimate.keyframes.emplace_back(pose.x, pose.y, pose.heading, last[3]);
  }
  modes_ = {mode};
}

// On the ring of the first range to a listed radio, all headings; the best of them refined by least
// squares. `noise`: the factor of the ranges' is found, unless a radio is excluded.
std::vector<RangeMode> RangeMemory::starts(int excluded, RangeNoise* noise) const {
  std::set<int> heard;
  std::vector<const HeldRange*> ranges;
  std::vector<std::size_t> keyframes;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      if (!radios_[static_cast<std::size_t>(range.radio)].listed || range.radio == excluded) {
        continue;
      }
      heard.insert(range.radio);
      ranges.push_back(&range);
      keyframes.push_back(k);
    }
  }
  const bool is_enough = static_cast<int>(ranges.size()) >= kStartRanges && heard.size() >= 2 &&
                         (static_cast<int>(heard.size()) >= kStartRadios || time_ > kPatience);
  if (!is_enough) return {};

  RangeMode mode;
  mode.prior = prior();
  mode.estimate.constants = mode.prior.constants;
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    const bool is_listed = radios_[r].listed.has_value();
    mode.accounts.push_back(is_listed ? RadioAccount::as_listed : RadioAccount::unlisted);
    mode.estimate.takes_part.push_back(is_listed && static_cast<int>(r) != excluded);
  }
  // Keyframes as odometry has them, in the frame of the first.
  std::vector<Pose2> driven = {Pose2{}};
  for (const OdometryIncrement& motion : graph_.motions) {
    driven.push_back(compose(driven.back(), motion.mean));
  }
  const auto placed_at = [&](const Pose2& first) {
    std::vector<KeyframeState> states;
    for (const Pose2& pose : driven) {
      const Pose2 there = compose(first, pose);
      states.emplace_back(there.x, there.y, there.heading, 0.0);
    }
    return states;
  };
  const HeldRange& first = *ranges.front();
  const Pose2 first_heard = driven[keyframes.front()];
  const std::size_t stride = std::max<std::size_t>(1, ranges.size() / 60);
  std::vector<std::pair<double, Pose2>> candidates;
  const int coarseness = excluded >= 0 ? 2 : 1;  // among many that are tried
  for (int i = 0; i < kRingPlaces; i += coarseness) {
    for (int h = 0; h < kHeadings; h += coarseness) {
      const double angle = 2.0 * kPi * i / kRingPlaces;
      const double heading = 2.0 * kPi * h / kHeadings;
      const Eigen::Vector2d radio =
          mode.prior.constants.segment<2>(radio_at(first.radio) + RadioOf::x);
      const double height = first.height;
      const double distance =
          std::sqrt(std::max(0.01, first.range * first.range - height * height));
      const Pose2 there = {radio.x() + distance * std::cos(angle),
                           radio.y() + distance * std::sin(angle), heading};
      const Pose2 origin = compose(there, relative(first_heard, Pose2{}));
      double cost = 0.0;
      for (std::size_t r = 0; r < ranges.size(); r += stride) {
        const Pose2 pose = compose(origin, driven[keyframes[r]]);
        const KeyframeState state(pose.x, pose.y, pose.heading, 0.0);
        // A coarse raster: a metre is nothing.
        const HeldRangeResidual residual =
            residual_of(*ranges[r], *noise, state, mode.estimate.constants);
        const double off = residual.value * noise->range * std::sqrt(ranges[r]->variance);
        cost += std::log1p(off * off);
      }
      candidates.emplace_back(cost, origin);
    }
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  // The noise is not known yet: found from the first solution that is good.
  std::vector<RangeMode> found;
  for (int round = 0; round < 2; ++round) {
    found.clear();
    for (std::size_t c = 0;
         c < std::min(excluded >= 0 ? kRefinedOfMany : kRefined, candidates.size()); ++c) {
      RangeMode candidate = mode;
      const Pose2& origin = candidates[c].second;
      candidate.prior.first << origin.x, origin.y, origin.heading, 0.0;
      candidate.estimate.keyframes = placed_at(origin);
      candidate.belief = pf_resampling::solve(graph_, candidate.prior, *noise, kManyIterations,
                                              kTolerance, &candidate.estimate);
      if (candidate.belief.is_usable) found.push_back(candidate);
    }
    if (found.empty()) return {};
    std::sort(found.begin(), found.end(), [](const RangeMode& a, const RangeMode& b) {
      return a.belief.log_evidence > b.belief.log_evidence;
    });
    if (round > 0 || excluded >= 0) break;
    std::vector<double> residuals;
    for (std::size_t r = 0; r < ranges.size(); ++r) {
      residuals.push_back(
          std::abs(residual_of(*ranges[r], noise_, found[0].estimate.keyframes[keyframes[r]],
                               found[0].estimate.constants)
                       .value));
    }
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    const double median = *middle / kMedianOfNormal;
    // Few ranges fit better than they are.
    noise->range = std::max(kLeastFactor, noise->range * std::max(1.5 * median, 0.03));
  }
  std::vector<RangeMode> modes;
  for (const RangeMode& candidate : found) {
    if (found[0].belief.log_evidence - candidate.belief.log_evidence > kModeMargin) break;
    const KeyframeState& last = candidate.estimate.keyframes.back();
    const bool is_known = std::any_of(modes.begin(), modes.end(), [&](const RangeMode& before) {
      const KeyframeState& other = before.estimate.keyframes.back();
      return (last - other).head<2>().norm() < kSamePlace &&
             std::abs(wrap_angle(last[2] - other[2])) < kSameHeading;
    });
    if (!is_known) modes.push_back(candidate);
  }
  return modes;
}

// Of the data, with what is believed of faults before.
double RangeMemory::log_probability(const RangeMode& mode) const {
  double log_prior = 0.0;
  for (const RadioAccount account : mode.accounts) {
    const bool is_fault = account == RadioAccount::elsewhere || account == RadioAccount::biased;
    if (is_fault) log_prior += std::log(log_prior < 0.0 ? kAnotherFault : options_.fault_odds);
  }
  const auto loose = std::count(mode.loose.begin(), mode.loose.end(), true);
  log_prior += static_cast<double>(loose) * std::log(kLooseOdds);
  return mode.belief.log_evidence / (doubt_ * doubt_) + log_prior;
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
  for (RangeMode& mode : modes_) {
    const double log_odds = log_probability(mode) - best;
    if (log_odds < -kModeMargin || kept.size() == kMostModes) break;
    const KeyframeState& last = mode.estimate.keyframes.back();
    const bool is_known = std::any_of(kept.begin(), kept.end(), [&](const RangeMode& other) {
      return other.accounts == mode.accounts &&
             (other.estimate.keyframes.back() - last).head<2>().norm() < kSamePlace &&
             std::abs(wrap_angle(other.estimate.keyframes.back()[2] - last[2])) < kSameHeading &&
             (other.estimate.constants - mode.estimate.constants).norm() < kSamePlace;
    });
    if (is_known) continue;
    mode.probability = std::exp(log_odds);
    sum += mode.probability;
    kept.push_back(std::move(mode));
  }
  for (RangeMode& mode : kept) mode.probability /= sum;
  modes_ = std::move(kept);
}

void RangeMemory::solve() {
  // A robot that stood has any heading: least squares from one of them would end anywhere.
  const bool may_head_anywhere = !modes_.empty() && modes_.front().belief.is_usable &&
                                 modes_.front().belief.covariance(2, 2) > kAnywhere * kAnywhere;
  if (may_head_anywhere) modes_.clear();
  if (modes_.empty()) start();
  if (modes_.empty()) return;
  if (time_ < next_solution_of_all_ && follow()) return;
  solve_all();
  for (RangeMode& mode : modes_) keep_past(&mode);
  next_solution_of_all_ = time_ + std::max(kSolvedAllEvery, kSolvedAllGrowth * time_);
}

// The newest keyframes, with what is before them as a quadratic.
bool RangeMemory::follow() {
  if (modes_.size() > 1 || !modes_.front().past) {
    // All data tell modes apart.
    for (RangeMode& mode : modes_) solved(kIterations, &mode);
    weigh_modes();
    return !modes_.empty();
  }
  for (RangeMode& mode : modes_) {
    const double log_evidence = mode.belief.log_evidence;
    mode.belief =
        solve_rest(graph_, mode.prior, noise_, kIterations, kTolerance, *mode.past, &mode.estimate);
    if (!mode.belief.is_usable) return false;
    mode.belief.log_evidence = log_evidence;
  }
  return true;
}

void RangeMemory::solve_all() {
  for (RangeMode& mode : modes_) solved(kIterations, &mode);
  weigh_modes();
  if (modes_.empty()) return;
  RangeMode& best = modes_.front();
  let_radios_enter(&best);
  if (before_) try_all_places_anew(*before_, &best);
  try_other_places(&best);
  find_doubt();
  judge_radios();
  for (int i = 0; i < kNoiseTrials; ++i) try_noise();
  weigh_modes();
  if (!modes_.empty()) before_ = modes_.front().estimate;
}

void RangeMemory::keep_past(RangeMode* mode) const {
  mode->past.reset();
  const int keyframe = graph_.keyframes() - kNewest;
  if (keyframe <= 0) return;
  RangePast past;
  mode->belief = pf_resampling::solve(graph_, mode->prior, noise_, 1, kTolerance, keyframe,
                                      &mode->estimate, &past);
  if (mode->belief.is_usable) mode->past = std::move(past);
}

void RangeMemory::finish() {
  if (modes_.empty()) start();
  if (modes_.empty()) return;
  solve_all();
  if (modes_.empty()) return;
  for (double& step : trial_steps_) step = std::min(step, kFinishingStep);
  for (int i = 0; i<kMostNoiseTrials&& * std::max_element(trial_steps_.begin(), trial_steps_.end())>
           kSmallestStep;
       ++i) {
    try_noise();
  }
  solved(kManyIterations, &modes_.front());
  find_doubt();
  judge_radios();
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
      const double value =
          residual_of(range, noise_, mode.estimate.keyframes[at], mode.estimate.constants).value;
      if (std::abs(value) < kExplained) ++explained;
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

// One of the noise's numbers, up and down: that under which the data are most probable. Steps
// become smaller where neither is better.
bool RangeMemory::try_noise() {
  RangeMode& mode = modes_.front();
  const std::array numbers = {&RangeNoise::range, &RangeNoise::translation, &RangeNoise::heading,
                              &RangeNoise::robust_width};
  const std::size_t trial = static_cast<std::size_t>(next_trial_++) % numbers.size();
  double& step = trial_steps_[trial];
  const RangeNoise before = noise_;
  const double best = mode.belief.log_evidence + log_prior_of_noise(noise_);
  for (const double factor : {step, 1.0 / step}) {
    noise_ = before;
    double& number = noise_.*numbers[trial];
    number = std::max(kLeastFactor, number * factor);
    noise_.robust_width = std::min(kWidest, std::max(kNarrowest, noise_.robust_width));
    RangeMode other = mode;
    if (solved(kIterations, &other).is_usable &&
        other.belief.log_evidence + log_prior_of_noise(noise_) > best) {
      mode = std::move(other);
      for (std::size_t m = 1; m < modes_.size(); ++m) solved(kIterations, &modes_[m]);
      return true;
    }
  }
  noise_ = before;
  step = std::max(kSmallestStep, std::sqrt(step));
  return false;
}

// Errors that last show in means of residuals over a while, not in single ones.
void RangeMemory::find_doubt() {
  const RangeMode& mode = modes_.front();
  const std::size_t count = radios_.size();
  std::vector<double> sums(count, 0.0), weights(count, 0.0);
  double squares = kPriorBlocks;
  double blocks = kPriorBlocks;
  double begin = 0.0;
  const auto end_block = [&] {
    for (std::size_t r = 0; r < count; ++r) {
      if (weights[r] > 1.0) {
        squares += std::min(kWild, sums[r] * sums[r] / weights[r]);
        blocks += 1.0;
      }
      sums[r] = weights[r] = 0.0;
    }
  };
  const double width = noise_.robust_width;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    if (times_[k] - begin > kBlock) {
      end_block();
      begin = times_[k];
    }
    for (const HeldRange& range : graph_.ranges[k]) {
      const auto radio = static_cast<std::size_t>(range.radio);
      if (!mode.estimate.takes_part[radio]) continue;
      const double value =
          residual_of(range, noise_, mode.estimate.keyframes[k], mode.estimate.constants).value;
      const double weight = 1.0 / (1.0 + value * value / (width * width));
      sums[radio] += weight * value;
      weights[radio] += weight * weight;
    }
  }
  end_block();
  doubt_ = std::sqrt(std::max(1.0, squares / blocks));
}

// ---- radios whose place is not listed ---------------------------------------------------------

std::vector<RangeMemory::Fix> RangeMemory::fixes(int radio, const RangeMode& mode) const {
  struct Seen {
    Eigen::Vector2d from;
    double distance;
    double sigma;
  };
  std::vector<Seen> all;
  const Eigen::VectorXd& constants = mode.estimate.constants;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      if (range.radio != radio) continue;
      const KeyframeState& state = mode.estimate.keyframes[k];
      const Pose2 pose = compose(pose_of(state), corrected_motion(range.since, state, constants));
      const Eigen::Vector2d lever = range.antenna + constants.segment<2>(Common::lever_x);
      const Pose2 antenna = compose(pose, {lever.x(), lever.y(), 0.0});
      const double stretch = 1.0 + constants[Common::scale];
      all.push_back({{antenna.x, antenna.y},
                     (range.range - constants[Common::bias]) / stretch,
                     noise_.range * std::sqrt(range.variance)});
    }
  }
  if (all.size() < kFewestFixRanges) return {};
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < kFixRanges && i < all.size(); ++i) {
    seen.push_back(all[i * all.size() / std::min(kFixRanges, all.size())]);
  }
  const double share = static_cast<double>(all.size()) / static_cast<double>(seen.size());
  const double width = noise_.robust_width;
  const double bias_sigma = std::hypot(options_.own_bias, 0.1);
  // Place and bias; the cost and its quadratic approximation.
  const auto look = [&](const Eigen::Vector3d& x, Eigen::Matrix3d* hessian,
                        Eigen::Vector3d* gradient) {
    double cost = 0.5 * x[2] * x[2] / (bias_sigma * bias_sigma);
    hessian->setZero();
    gradient->setZero();
    (*hessian)(2, 2) = 1.0 / (bias_sigma * bias_sigma);
    (*gradient)[2] = x[2] / (bias_sigma * bias_sigma);
    for (const Seen& range : seen) {
      const Eigen::Vector2d away = x.head<2>() - range.from;
      const double distance = std::max(1e-3, away.norm());
      const double residual = (distance + x[2] - range.distance) / range.sigma;
      const double weight = share / (1.0 + residual * residual / (width * width));
      const Eigen::Vector3d by(away.x() / distance / range.sigma, away.y() / distance / range.sigma,
                               1.0 / range.sigma);
      *hessian += weight * by * by.transpose();
      *gradient += weight * residual * by;
      cost += share * 0.5 * width * width * std::log1p(residual * residual / (width * width));
    }
    return cost;
  };
  std::vector<Fix> found;
  for (int i = 0; i < kRingPlaces; ++i) {
    const double angle = 2.0 * kPi * i / kRingPlaces;
    Eigen::Vector3d x(seen[0].from.x() + seen[0].distance * std::cos(angle),
                      seen[0].from.y() + seen[0].distance * std::sin(angle), 0.0);
    Eigen::Matrix3d hessian;
    Eigen::Vector3d gradient;
    double cost = look(x, &hessian, &gradient);
    double damping = 1e-3;
    for (int iteration = 0; iteration < 30; ++iteration) {
      Eigen::Matrix3d damped = hessian;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::Vector3d moved = x - damped.ldlt().solve(gradient);
      Eigen::Matrix3d next_hessian;
      Eigen::Vector3d next_gradient;
      const double next = look(moved, &next_hessian, &next_gradient);
      if (!(next < cost)) {
        damping *= 10.0;
        if (damping > 1e4) break;
        continue;
      }
      const double gain = cost - next;
      x = moved;
      cost = next;
      hessian = next_hessian;
      gradient = next_gradient;
      damping = std::max(1e-6, 0.1 * damping);
      if (gain < 1e-3) break;
    }
    Fix fix;
    fix.position = x.head<2>();
    fix.covariance = hessian.inverse().topLeftCorner<2, 2>();
    fix.cost = cost;
    fix.distance = seen.back().distance;
    if (!fix.covariance.allFinite() || !(fix.covariance.determinant() > 0.0)) continue;
    const auto same = std::find_if(found.begin(), found.end(), [&](const Fix& other) {
      return (other.position - fix.position).norm() < kSamePlace;
    });
    if (same == found.end()) {
      found.push_back(fix);
    } else if (fix.cost < same->cost) {
      *same = fix;
    }
  }
  std::sort(found.begin(), found.end(), [](const Fix& a, const Fix& b) { return a.cost < b.cost; });
  while (!found.empty() && found.back().cost > found.front().cost + kFixMargin) found.pop_back();
  return found;
}

void RangeMemory::let_radios_enter(RangeMode* mode) {
  bool changed = false;
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    if (mode->estimate.takes_part[r]) continue;
    const std::vector<Fix> found = fixes(static_cast<int>(r), *mode);
    radios_[r].other_places.clear();
    if (found.empty()) continue;
    double sum = 0.0;
    for (const Fix& fix : found) sum += std::exp(found[0].cost - fix.cost);
    for (const Fix& fix : found) {
      radios_[r].other_places.push_back(
          {fix.position, fix.covariance, std::exp(found[0].cost - fix.cost) / sum});
    }
    const Fix& best = found.front();
    const double largest = std::sqrt(best.covariance.trace());
    if (largest > std::sqrt(best.distance * noise_.range * options_.sigma)) continue;
    mode->estimate.takes_part[r] = true;
    mode->estimate.constants.segment<2>(radio_at(static_cast<int>(r)) + RadioOf::x) = best.position;
    changed = true;
  }
  if (changed) solved(kIterations, mode);
}

// Of each radio that may be anywhere: another minimum, with everything solved anew.
void RangeMemory::try_other_places(RangeMode* mode) {
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    const RadioAccount account = mode->accounts[r];
    const bool is_free = account == RadioAccount::unlisted || account == RadioAccount::elsewhere;
    if (!is_free || !mode->estimate.takes_part[r]) continue;
    radios_[r].other_places.clear();
    const int at = radio_at(static_cast<int>(r)) + RadioOf::x;
    const Eigen::Vector2d here = mode->estimate.constants.segment<2>(at);
    for (const Fix& fix : fixes(static_cast<int>(r), *mode)) {
      if ((fix.position - here).norm() < kSamePlace) continue;
      RangeMode other = *mode;
      other.estimate.constants.segment<2>(at) = fix.position;
      if (!solved(kIterations, &other).is_usable) continue;
      const double gain = mode->belief.cost - other.belief.cost;
      RangeMode* worse = &other;
      if (gain > kGain) {
        std::swap(*mode, other);
      } else if (gain < -kModeMargin) {
        continue;
      }
      const Eigen::Vector2d there = worse->estimate.constants.segment<2>(at);
      if ((there - mode->estimate.constants.segment<2>(at)).norm() < kSamePlace) continue;
      const double odds =
          std::exp((worse->belief.log_evidence - mode->belief.log_evidence) / (doubt_ * doubt_));
      radios_[r].other_places.push_back(
          {there, worse->belief.covariance.block<2, 2>(kKeyframe + at, kKeyframe + at),
           odds / (1.0 + odds)});
    }
  }
}

// Several wrong mirrors together bend the path, and no single one brings it back: all at once, from
// the path of the last solution and the odometry since.
void RangeMemory::try_all_places_anew(const RangeEstimate& before, RangeMode* mode) {
  RangeMode other = *mode;
  other.estimate.keyframes = before.keyframes;
  for (std::size_t k = before.keyframes.size(); k < mode->estimate.keyframes.size(); ++k) {
    const KeyframeState& last = other.estimate.keyframes.back();
    const Pose2 pose =
        compose(pose_of(last), corrected_motion(graph_.motions[k - 1], last, before.constants));
    other.estimate.keyframes.emplace_back(pose.x, pose.y, pose.heading, last[3]);
  }
  bool is_other = false;
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    if (other.accounts[r] != RadioAccount::unlisted || !other.estimate.takes_part[r]) continue;
    const std::vector<Fix> found = fixes(static_cast<int>(r), other);
    if (found.empty()) continue;
    const int at = radio_at(static_cast<int>(r)) + RadioOf::x;
    is_other |= (found[0].position - mode->estimate.constants.segment<2>(at)).norm() > kSamePlace;
    other.estimate.constants.segment<2>(at) = found[0].position;
  }
  if (!is_other || !solved(kIterations, &other).is_usable) return;
  if (other.belief.cost < mode->belief.cost - kGain) *mode = std::move(other);
}

// ---- radios that are not as listed ------------------------------------------------------------

void RangeMemory::judge_radios() {
  has_turned_ = heading_spread(modes_.front()) > kTurnedBeforeNaming;
  for (int round = 0; round < kRounds; ++round) {
    const RangeMode mode = modes_.front();
    std::vector<int> listed, faults;
    for (std::size_t r = 0; r < radios_.size(); ++r) {
      if (mode.accounts[r] == RadioAccount::as_listed && radios_[r].ranges >= kFewestRanges) {
        listed.push_back(static_cast<int>(r));
      } else if (mode.accounts[r] != RadioAccount::unlisted) {
        faults.push_back(static_cast<int>(r));
      }
    }
    std::vector<std::optional<RangeMode>> others;
    for (const int fault : faults) {
      if (mode.accounts[static_cast<std::size_t>(fault)] == RadioAccount::as_listed) continue;
      others.push_back(with_fault(mode, fault, RadioAccount::as_listed, fault));
      for (const int radio : listed) {
        others.push_back(with_fault(mode, radio, RadioAccount::elsewhere, fault));
      }
    }
    if (listed.size() >= 3) {
      const std::vector<bool> is_suspicious = suspicious(mode);
      for (const int radio : listed) {
        if (!is_suspicious[static_cast<std::size_t>(radio)]) continue;
        others.push_back(with_fault(mode, radio, RadioAccount::elsewhere, -1));
        others.push_back(with_fault(mode, radio, RadioAccount::biased, -1));
      }
    }
    for (std::size_t error = 0; error < LooseError::count; ++error) {
      others.push_back(with_other_error(mode, static_cast<LooseError::Index>(error)));
    }
    for (std::optional<RangeMode>& other : others) {
      if (other) modes_.push_back(std::move(*other));
    }
    weigh_modes();
    if (modes_.front().accounts == mode.accounts && modes_.front().loose == mode.loose) return;
  }
}

// rad, that the headings of most ranges are apart.
double RangeMemory::heading_spread(const RangeMode& mode) const {
  std::vector<double> headings;
  double heading = 0.0;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    heading += wrap_angle(mode.estimate.keyframes[k][2] - heading);
    headings.insert(headings.end(), graph_.ranges[k].size(), heading);
  }
  std::sort(headings.begin(), headings.end());
  const auto left_out =
      static_cast<std::size_t>(0.5 * (1.0 - kMostRanges) * static_cast<double>(headings.size()));
  return headings[headings.size() - 1 - left_out] - headings[left_out];
}

// Of each radio: whether its ranges fit badly, or pull at its place or bias.
std::vector<bool> RangeMemory::suspicious(const RangeMode& mode) const {
  std::vector<double> costs(radios_.size(), 0.0), counts(radios_.size(), 0.0);
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      const auto radio = static_cast<std::size_t>(range.radio);
      const double value =
          residual_of(range, noise_, mode.estimate.keyframes[k], mode.estimate.constants).value;
      const double width = noise_.robust_width;
      costs[radio] += 0.5 * width * width * std::log1p(value * value / (width * width));
      counts[radio] += 1.0;
    }
  }
  std::vector<bool> is_suspicious(radios_.size(), false);
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    if (mode.accounts[r] != RadioAccount::as_listed || counts[r] < 1.0) continue;
    const int at = radio_at(static_cast<int>(r));
    const double information = 1.0 / (options_.surveyed * options_.surveyed);
    const Eigen::Vector2d pull =
        information * (mode.estimate.constants - mode.prior.constants).segment<2>(at);
    const Eigen::Matrix2d place =
        mode.belief.covariance.block<2, 2>(kKeyframe + at, kKeyframe + at);
    const Eigen::Matrix2d data = place.inverse() - information * Eigen::Matrix2d::Identity() +
                                 1.0 / (kElsewhere * kElsewhere) * Eigen::Matrix2d::Identity();
    const double own = (mode.estimate.constants - mode.prior.constants)[at + RadioOf::bias];
    is_suspicious[r] = costs[r] / counts[r] > kSuspiciousCost ||
                       0.5 * pull.dot(data.inverse() * pull) > kPull ||
                       std::abs(own) > kOwnBias * options_.own_bias;
  }
  return is_suspicious;
}

// The mode with an error that may be there, or is not there any more; nothing if it cannot be.
std::optional<RangeMode> RangeMemory::with_other_error(const RangeMode& mode,
                                                       LooseError::Index error) const {
  if (!may_be_loose(error)) return std::nullopt;
  RangeMode other = mode;
  other.past.reset();
  other.loose[error] = !other.loose[error];
  other.prior.constants_sigma = sigmas(other.accounts, other.loose);
  if (!solved(kIterations, &other).is_usable) return std::nullopt;
  return other;
}

// The mode with one radio as `account` says, and another one (`cleared`; -1: none) as listed again;
// nothing if that is no other mode. Looked for from the path without the ranges of both and, while
// odometry alone has its shape, from a start without them.
std::optional<RangeMode> RangeMemory::with_fault(const RangeMode& mode, int radio,
                                                 RadioAccount account, int cleared) const {
  const auto r = static_cast<std::size_t>(radio);
  const int at = radio_at(radio);
  RangeMode without = mode;
  without.past.reset();
  without.estimate.takes_part[r] = false;
  if (cleared >= 0) {
    set_account(cleared, RadioAccount::as_listed, &without);
    const int place = radio_at(cleared);
    without.estimate.takes_part[static_cast<std::size_t>(cleared)] = cleared != radio;
    without.estimate.constants.segment<RadioOf::count>(place) =
        without.prior.constants.segment<RadioOf::count>(place);
  }
  std::vector<RangeMode> paths;
  if (solved(kIterations, &without).is_usable) paths.push_back(without);
  if (time_ < kRigid && account == RadioAccount::elsewhere) {
    RangeNoise noise = noise_;
    std::vector<RangeMode> anew = starts(radio, &noise);
    // Only that radio is not as listed in these.
    if (!anew.empty()) paths.push_back(std::move(anew.front()));
  }
  std::optional<RangeMode> best;
  for (RangeMode& path : paths) {
    set_account(radio, account, &path);
    path.estimate.takes_part[r] = true;
    if (account == RadioAccount::elsewhere) {
      const std::vector<Fix> found = fixes(radio, path);
      if (found.empty()) continue;
      path.estimate.constants.segment<2>(at) = found[0].position;
    }
    if (!solved(kManyIterations, &path).is_usable) continue;
    const Eigen::VectorXd off = path.estimate.constants - path.prior.constants;
    const double size = account == RadioAccount::elsewhere ? off.segment<2>(at).norm()
                                                           : std::abs(off[at + RadioOf::bias]);
    if (account != RadioAccount::as_listed && size < kLeastFault) continue;
    if (!best || log_probability(path) > log_probability(*best)) best = std::move(path);
  }
  return best;
}

// ---- what is known ----------------------------------------------------------------------------

std::vector<RadioKnowledge> RangeMemory::radios() const {
  std::vector<RadioKnowledge> all;
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    RadioKnowledge radio;
    radio.id = radios_[r].id;
    radio.account = radios_[r].listed ? RadioAccount::as_listed : RadioAccount::unlisted;
    radio.ranges = radios_[r].ranges;
    if (!modes_.empty() && modes_.front().belief.is_usable) {
      const RangeMode& mode = modes_.front();
      const int at = radio_at(static_cast<int>(r));
      for (const RangeMode& other : modes_) {
        if (radios_[r].listed && other.accounts[r] != RadioAccount::as_listed) {
          radio.fault += other.probability;
        }
      }
      if (radio.fault > kNamed && has_turned_) radio.account = mode.accounts[r];
      const Eigen::VectorXd& constants = mode.estimate.constants;
      const Eigen::MatrixXd& covariance = mode.belief.covariance;
      radio.calibration.scale = 1.0 + constants[Common::scale] + constants[at + RadioOf::scale];
      radio.calibration.bias = constants[Common::bias] + constants[at + RadioOf::bias];
      radio.calibration.sigma =
          noise_.range *
          (radios_[r].calibration.sigma > 0.0 ? radios_[r].calibration.sigma : options_.sigma);
      const auto sigma_of_sum = [&](int first, int second) {
        const int a = kKeyframe + first;
        const int b = kKeyframe + second;
        return doubt_ * std::sqrt(std::max(
                            0.0, covariance(a, a) + covariance(b, b) + 2.0 * covariance(a, b)));
      };
      radio.scale_sigma = sigma_of_sum(Common::scale, at + RadioOf::scale);
      radio.bias_sigma = sigma_of_sum(Common::bias, at + RadioOf::bias);
      if (mode.estimate.takes_part[r]) {
        double others = 0.0;
        for (const RadioPlace& place : radios_[r].other_places) others += place.probability;
        radio.places.push_back(
            {constants.segment<2>(at),
             doubt_ * doubt_ * covariance.block<2, 2>(kKeyframe + at, kKeyframe + at),
             1.0 / (1.0 + others)});
        for (const RadioPlace& place : radios_[r].other_places) {
          radio.places.push_back({place.position, place.covariance, place.probability});
        }
      } else {
        radio.places = radios_[r].other_places;
      }
    }
    if (radio.account == RadioAccount::elsewhere && !radio.places.empty()) {
      for (const Radio& other : radios_) {
        if (other.id == radio.id || !other.listed) continue;
        const Eigen::Vector2d off =
            other.listed->position.head<2>() - radio.places.front().position;
        if (off.norm() < kSamePlace) radio.in_place_of = other.id;
      }
    }
    all.push_back(radio);
  }
  return all;
}

RangeMemory::Newest RangeMemory::newest(const RangeMode& mode) const {
  const Eigen::VectorXd& constants = mode.estimate.constants;
  const KeyframeState& last = mode.estimate.keyframes.back();
  const Pose2 moved = corrected_motion(pending_, last, constants);
  const Pose2 pose = compose(pose_of(last), moved);
  Newest newest;
  newest.mean.resize(kKeyframe + constants.size());
  newest.mean << pose.x, pose.y, pose.heading, last[3], constants;
  const double cosine = std::cos(last[2]);
  const double sine = std::sin(last[2]);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << cosine, -sine, sine, cosine;
  Eigen::MatrixXd by = Eigen::MatrixXd::Identity(newest.mean.size(), newest.mean.size());
  by(0, 2) = -(sine * moved.x + cosine * moved.y);
  by(1, 2) = cosine * moved.x - sine * moved.y;
  by.block<3, 1>(0, 3) = -turn * pending_.yaw_rate_sensitivity;
  by.block<3, 1>(0, kKeyframe + Common::turn_scale) = -turn * pending_.turn_scale_sensitivity;
  by.block<3, 1>(0, kKeyframe + Common::distance_scale) =
      -turn * Eigen::Vector3d(moved.x, moved.y, 0.0);
  newest.covariance = doubt_ * doubt_ * by * mode.belief.covariance * by.transpose();
  const Eigen::Vector3d factors(noise_.translation, noise_.translation, noise_.heading);
  newest.covariance.topLeftCorner<3, 3>() +=
      turn * factors.asDiagonal() * pending_.covariance * factors.asDiagonal() * turn.transpose();
  return newest;
}

}  // namespace pf_resampling
