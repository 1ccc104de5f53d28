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

// Of the priors.
constexpr double kFarAway = 100.0;   // m, of the first pose
constexpr double kAnyHeading = 3.0;  // rad
constexpr double kFixed = 1e-3;      // m, rad: of a first pose that is the frame
constexpr double kFixedScale = 1e-4;
constexpr double kBiased = 2.0;  // m
constexpr double kNamed = 0.95;  // probability
// Wheels are 1 % off, as a rule, and what they are off by looks like a bias of the ranges.
constexpr double kTightWheels = 0.45;

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
