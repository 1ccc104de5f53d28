#include "pf_resampling_core/range_memory/range_memory.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using RadioOf = RadioUnknown;

// Keyframes: so far apart that the noise of the odometry between them is small beside a range's.
constexpr double kLongestSpacing = 2.0;     // m
constexpr double kShortestSpacing = 0.05;   // m
constexpr double kNoisePerDistance = 0.05;  // m/sqrt(m), of the odometry
constexpr double kShareOfRangeNoise = 0.5;
constexpr double kTurn = 0.4;           // rad
constexpr double kDuration = 2.0;       // s
constexpr double kSlipDuration = 0.3;   // s, while wheels slip
constexpr double kStandingTurn = 0.05;  // rad, that a gyro drifts in that time

// A radio stands no higher than this share of the listed ones' area is long, as a rule.
constexpr double kHeightOfArea = 0.05;
constexpr double kOwnHeight = 0.3;  // share of the variance by which radios differ

// Of the priors.
constexpr double kFarAway = 100.0;   // m, of the first pose
constexpr double kAnyHeading = 3.0;  // rad
constexpr double kFixed = 1e-3;      // m, rad: of a first pose that is the frame
constexpr double kFixedScale = 1e-4;
constexpr double kBiased = 2.0;       // m
constexpr double kGrossSpread = 0.3;  // of scales, where the odometry is grossly wrong

void join(const OdometryIncrement& next, OdometryIncrement* increment) {
  const Eigen::Matrix3d by_past = by_first(increment->mean, next.mean);
  const Eigen::Matrix3d by_next = by_second(increment->mean);
  const auto propagate = [&](const Eigen::Vector3d& of_next, Eigen::Vector3d* sensitivity) {
    *sensitivity = (by_past * *sensitivity + by_next * of_next).eval();
  };
  const auto add = [&](const Eigen::Matrix3d& of_next, Eigen::Matrix3d* covariance) {
    *covariance =
        (by_past * *covariance * by_past.transpose() + by_next * of_next * by_next.transpose())
            .eval();
  };
  add(next.covariance, &increment->covariance);
  add(next.slip_covariance, &increment->slip_covariance);
  propagate(next.yaw_rate_sensitivity, &increment->yaw_rate_sensitivity);
  propagate(next.turn_scale_sensitivity, &increment->turn_scale_sensitivity);
  increment->mean = compose(increment->mean, next.mean);
  increment->duration += next.duration;
}

// Of a vector or the rows of a matrix: those of one radio are gone.
Eigen::MatrixXd without_rows(const Eigen::MatrixXd& all, Eigen::Index at) {
  Eigen::MatrixXd rest(all.rows() - RadioOf::count, all.cols());
  rest << all.topRows(at), all.bottomRows(all.rows() - at - RadioOf::count);
  return rest;
}

}  // namespace

RangeMemory::RangeMemory(const RangeMemoryOptions& options, const std::vector<Beacon>& beacons,
                         const RangeCalibrations& calibration,
                         const std::optional<PoseEstimate>& first)
    : options_(options), beacons_(beacons), calibration_(calibration), first_(first) {
  graph_.ranges.emplace_back();
  times_.push_back(0.0);
  for (const Beacon& beacon : beacons_) {
    if (listed(beacon.id) == &beacon) continue;
    throw Error("beacon " + std::to_string(beacon.id) +
                " appears twice; give every beacon an id of its own");
  }
}

const Beacon* RangeMemory::listed(int id) const {
  const auto found = std::find_if(beacons_.begin(), beacons_.end(),
                                  [&](const Beacon& beacon) { return beacon.id == id; });
  return found == beacons_.end() ? nullptr : &*found;
}

std::optional<int> RangeMemory::number_of(int id) const {
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    if (radios_[i].id == id) return static_cast<int>(i);
  }
  return std::nullopt;
}

// Nothing if there are too many to be solved for.
std::optional<int> RangeMemory::radio_of(int id) {
  if (const auto known = number_of(id)) return known;
  if (radios_.size() >= kMostRadios) return std::nullopt;
  Radio radio;
  radio.id = id;
  if (const Beacon* beacon = listed(id)) radio.listed = *beacon;
  radio.calibration = calibration_of(id, calibration_);
  radios_.push_back(radio);
  // Nothing is known of it but what is believed before.
  const RangePrior anew = prior();
  const Eigen::Index is = anew.constants.size();
  const auto append_to = [&](Eigen::VectorXd* constants) {
    constants->conservativeResize(is);
    constants->tail<RadioOf::count>() = anew.constants.tail<RadioOf::count>();
  };
  const auto resize = [&](Eigen::MatrixXd* matrix) {
    matrix->conservativeResize(kKeyframe + is, kKeyframe + is);
    matrix->rightCols<RadioOf::count>().setZero();
    matrix->bottomRows<RadioOf::count>().setZero();
  };
  for (RangeMode& mode : modes_) {
    mode.accounts.push_back(radio.listed ? RadioAccount::as_listed : RadioAccount::unlisted);
    append_to(&mode.prior.constants);
    mode.prior.constants_sigma = sigmas(mode.accounts, mode.loose);
    append_to(&mode.estimate.constants);
    mode.estimate.takes_part.push_back(radio.listed.has_value());
    for (std::optional<RangePast>* past : {&mode.past, &mode.settled}) {
      if (!*past) continue;
      append_to(&(*past)->constants);
      resize(&(*past)->information);
      (*past)->gradient.conservativeResize(kKeyframe + is);
      (*past)->gradient.tail<RadioOf::count>().setZero();
    }
    if (!mode.belief.is_usable) continue;
    resize(&mode.belief.covariance);
    mode.belief.covariance.diagonal().tail<RadioOf::count>() =
        mode.prior.constants_sigma.tail<RadioOf::count>().cwiseAbs2();
  }
  return static_cast<int>(radios_.size()) - 1;
}

// A listed radio that is not among the data any more.
void RangeMemory::forget(int radio) {
  const int at = radio_at(radio);
  const auto leave_matrix = [&](Eigen::MatrixXd* matrix) {
    *matrix = without_rows(without_rows(*matrix, kKeyframe + at).transpose(), kKeyframe + at);
  };
  for (RangeMode& mode : modes_) {
    if (mode.past) {
      RangePast& past = *mode.past;
      past = without_radio(radio, mode.prior, std::move(past));
      past.constants = without_rows(past.constants, at);
      past.gradient = without_rows(past.gradient, kKeyframe + at);
      leave_matrix(&past.information);
    }
    mode.settled.reset();
    mode.accounts.erase(mode.accounts.begin() + radio);
    mode.prior.constants = without_rows(mode.prior.constants, at);
    mode.prior.constants_sigma = without_rows(mode.prior.constants_sigma, at);
    mode.estimate.constants = without_rows(mode.estimate.constants, at);
    mode.estimate.takes_part.erase(mode.estimate.takes_part.begin() + radio);
    leave_matrix(&mode.belief.covariance);
  }
  radios_.erase(radios_.begin() + radio);
  for (auto& ranges : graph_.ranges) {
    for (HeldRange& range : ranges) {
      if (range.radio > radio) --range.radio;
    }
  }
}

RangePrior RangeMemory::prior() const {
  RangePrior prior;
  prior.constants = Eigen::VectorXd::Zero(radio_at(static_cast<int>(radios_.size())));
  prior.yaw_rate_walk = options_.yaw_rate_walk;
  const RangeCalibration all = calibration_of(kAllRadios, calibration_);
  prior.constants[Common::scale] = all.scale - 1.0;
  prior.constants[Common::bias] = all.bias;
  std::vector<RadioAccount> accounts;
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    const Radio& radio = radios_[i];
    const int at = radio_at(static_cast<int>(i));
    prior.constants[at + RadioOf::scale] = radio.calibration.scale - all.scale;
    prior.constants[at + RadioOf::bias] = radio.calibration.bias - all.bias;
    accounts.push_back(radio.listed ? RadioAccount::as_listed : RadioAccount::unlisted);
    if (!radio.listed) continue;
    prior.constants.segment<2>(at + RadioOf::x) = radio.listed->position.head<2>();
  }
  prior.constants_sigma = sigmas(accounts, {});
  prior.first_sigma << kFarAway, kFarAway, kAnyHeading, options_.yaw_rate;
  if (first_) {
    prior.first.head<3>() << first_->mean.x, first_->mean.y, first_->mean.heading;
    prior.first_sigma.head<3>() =
        first_->covariance.diagonal().cwiseSqrt().cwiseMax(Eigen::Vector3d::Constant(kFixed));
  }
  if (beacons_.size() < 2) {
    prior.first_sigma.head<3>().setConstant(kFixed);
    prior.metre = options_.metre;
  }
  return prior;
}

bool RangeMemory::may_be_loose(LooseError::Index error) const {
  if (error != LooseError::heights) return true;
  return std::any_of(radios_.begin(), radios_.end(),
                     [](const Radio& radio) { return !radio.listed || radio.listed->is_planar; });
}

Eigen::VectorXd RangeMemory::sigmas(const std::vector<RadioAccount>& accounts,
                                    const LooseErrors& loose) const {
  const auto share = [&](LooseError::Index error) { return loose[error] ? 1.0 : options_.tight; };
  Eigen::AlignedBox2d area;
  for (const Beacon& beacon : beacons_) area.extend(Eigen::Vector2d(beacon.position.head<2>()));
  const double height = beacons_.size() >= 2
                            ? std::min(options_.height, kHeightOfArea * area.diagonal().norm())
                            : options_.height;
  const double lever = lever_is_stated_ ? options_.stated_lever : options_.lever;
  const double lever_height = lever_is_stated_ ? options_.stated_lever : options_.lever_height;
  const bool is_gross = odometry_factors_ != OdometryFactors{};
  const double distance = is_gross ? kGrossSpread : options_.distance_scale;
  const double turn = is_gross ? kGrossSpread : options_.turn_scale;
  Eigen::VectorXd sigmas(radio_at(static_cast<int>(radios_.size())));
  sigmas.head<Common::count>() << options_.scale, options_.bias,
      beacons_.size() >= 2 ? distance : kFixedScale, turn, lever, lever, lever_height,
      share(LooseError::heights) * height * height;
  const double own = share(LooseError::radios);
  for (std::size_t i = 0; i < radios_.size(); ++i) {
    const bool is_planar = !radios_[i].listed || radios_[i].listed->is_planar;
    const bool is_stated = radios_[i].listed && radios_[i].listed->sigma > 0.0;
    double place = is_stated ? radios_[i].listed->sigma : options_.surveyed;
    if (accounts[i] == RadioAccount::unlisted) place = options_.unknown;
    if (accounts[i] == RadioAccount::elsewhere) place = kElsewhere;
    sigmas.segment<RadioOf::count>(radio_at(static_cast<int>(i))) << place, place,
        own * options_.own_scale,
        accounts[i] == RadioAccount::biased ? kBiased : own * options_.own_bias,
        is_planar ? kOwnHeight * share(LooseError::heights) * height * height : kFixed;
  }
  return sigmas;
}

void RangeMemory::set_account(int radio, RadioAccount account, RangeMode* mode) const {
  mode->accounts[static_cast<std::size_t>(radio)] = account;
  mode->prior.constants_sigma = sigmas(mode->accounts, mode->loose);
}

double RangeMemory::spacing() const {
  const double noise = kShareOfRangeNoise * noise_.range * options_.sigma / kNoisePerDistance;
  return std::min(kLongestSpacing, std::max(kShortestSpacing, noise * noise));
}

void RangeMemory::add(const OdometryIncrement& odometry,
                      const std::vector<RangeObservation>& ranges) {
  join(without_factors(odometry), &pending_);
  time_ += odometry.duration;
  if (ranges.empty()) return;
  const bool moved =
      std::hypot(pending_.mean.x, pending_.mean.y) > spacing() ||
      std::abs(pending_.mean.heading) > kTurn || pending_.duration > kDuration ||
      (pending_.duration > kSlipDuration && (has_slipped() || contradicts_odometry()));
  if (moved && has_begun()) add_keyframe();
  for (const RangeObservation& observation : ranges) {
    const std::optional<int> number = radio_of(observation.beacon);
    if (!number) continue;
    Radio& radio = radios_[static_cast<std::size_t>(*number)];
    note_copy(observation.range, &radio);
    holds_newest_ = !radio.repeats();
    if (radio.repeats()) {
      if (radio.ranges > 0) leave_out(*number);
      continue;
    }
    HeldRange range;
    range.radio = *number;
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

OdometryIncrement RangeMemory::without_factors(OdometryIncrement motion) const {
  const double excess = 1.0 - 1.0 / odometry_factors_.turn;
  motion.mean.x -= excess * motion.turn_scale_sensitivity[0];
  motion.mean.y -= excess * motion.turn_scale_sensitivity[1];
  const double length = 1.0 / odometry_factors_.distance;
  const Eigen::Vector3d share(length, length, 1.0 / odometry_factors_.turn);
  motion.mean = {share[0] * motion.mean.x, share[1] * motion.mean.y,
                 share[2] * motion.mean.heading};
  for (Eigen::Matrix3d* covariance : {&motion.covariance, &motion.slip_covariance}) {
    *covariance = (share.asDiagonal() * *covariance * share.asDiagonal()).eval();
  }
  for (Eigen::Vector3d* sensitivity :
       {&motion.yaw_rate_sensitivity, &motion.turn_scale_sensitivity}) {
    *sensitivity = share.cwiseProduct(*sensitivity).eval();
  }
  return motion;
}

// Keyframes lie too far apart to be corrected for such factors: all data begin anew.
void RangeMemory::begin_anew(const OdometryFactors& factors) {
  odometry_factors_ = factors;
  graph_ = RangeGraph{};
  graph_.ranges.emplace_back();
  times_ = {time_};
  pending_ = OdometryIncrement{};
  noise_ = RangeNoise{};
  modes_.clear();
  first_.reset();  // it is not there any more
  for (Radio& radio : radios_) radio.ranges = 0;
}

// A robot that stands has no path yet. Were the frame that of its first pose, all places would turn
// with what the gyro is found to drift until it drives.
bool RangeMemory::has_begun() {
  const bool stands = graph_.keyframes() == 1 && beacons_.size() < 2 &&
                      std::hypot(pending_.mean.x, pending_.mean.y) < kShortestSpacing &&
                      std::abs(pending_.mean.heading) < kStandingTurn;
  if (!stands) return true;
  pending_ = OdometryIncrement{};
  graph_.ranges.back().clear();
  times_.back() = time_;
  return false;
}

void RangeMemory::add_keyframe() {
  for (RangeMode& mode : modes_) {
    mode.estimate.keyframes.push_back(
        moved(mode.estimate.keyframes.back(), pending_, mode.estimate.constants));
  }
  graph_.motions.push_back(pending_);
  graph_.slipped.push_back(false);
  graph_.ranges.emplace_back();
  times_.push_back(time_);
  pending_ = OdometryIncrement{};
}

}  // namespace pf_resampling
