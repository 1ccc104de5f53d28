// What RangeMemory says of radios, and of the robot at the newest time.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using RadioOf = RadioUnknown;
constexpr double kNamed = 0.99;  // probability
constexpr double kApart = 9.0;   // of two places, in standard deviations, squared
constexpr double kTorn = 0.02;   // probability

// Of places that begin at these rows.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& all, const std::vector<int>& places) {
  const auto size = static_cast<Eigen::Index>(2 * places.size());
  Eigen::MatrixXd covariance(size, size);
  for (std::size_t a = 0; a < places.size(); ++a) {
    for (std::size_t b = 0; b < places.size(); ++b) {
      covariance.block<2, 2>(static_cast<Eigen::Index>(2 * a), static_cast<Eigen::Index>(2 * b)) =
          all.block<2, 2>(places[a], places[b]);
    }
  }
  return covariance;
}

// Without what a shift, a turn and a stretch of all make: where a frame lies that began with the
// first pose, and how long its metre is, says nothing of how well the beacons are known.
Eigen::MatrixXd without_frame(const std::vector<Beacon>& beacons,
                              const Eigen::MatrixXd& covariance) {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  for (const Beacon& beacon : beacons) center += beacon.position.head<2>();
  center /= static_cast<double>(beacons.size());
  Eigen::MatrixXd similar(covariance.rows(), 4);
  for (std::size_t b = 0; b < beacons.size(); ++b) {
    const Eigen::Vector2d off = beacons[b].position.head<2>() - center;
    similar.middleRows<2>(static_cast<Eigen::Index>(2 * b)) << 1.0, 0.0, -off.y(), off.x(),  //
        0.0, 1.0, off.x(), off.y();
  }
  // About the center, these are orthogonal.
  for (Eigen::Index c = 0; c < similar.cols(); ++c) similar.col(c).normalize();
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(covariance.rows(), covariance.rows()) -
                               similar * similar.transpose();
  return rest * covariance * rest.transpose();
}

}  // namespace

std::vector<RadioKnowledge> RangeMemory::radios() const {
  std::vector<RadioKnowledge> all;
  for (const Beacon& beacon : beacons_) all.push_back(knowledge_of(beacon.id));
  for (const Radio& radio : radios_) {
    if (!radio.listed) all.push_back(knowledge_of(radio.id));
  }
  return all;
}

RadioKnowledge RangeMemory::knowledge_of(int id) const {
  RadioKnowledge radio;
  radio.id = id;
  radio.account = listed(id) != nullptr ? RadioAccount::as_listed : RadioAccount::unlisted;
  const std::optional<int> number = number_of(id);
  if (number) radio.ranges = radios_[static_cast<std::size_t>(*number)].ranges;
  if (number && radios_[static_cast<std::size_t>(*number)].repeats()) {
    radio.repeats = true;
    radio.in_place_of = radios_[static_cast<std::size_t>(*number)].copies;
    radio.fault = 1.0;
    return radio;
  }
  if (modes_.empty() || !modes_.front().belief.is_usable) return radio;
  const RangeMode& mode = modes_.front();
  const Eigen::VectorXd& constants = mode.estimate.constants;
  const Eigen::MatrixXd& covariance = mode.belief.covariance;
  const RangeCalibration given = calibration_of(id, calibration_);
  const RangeCalibration all = calibration_of(kAllRadios, calibration_);
  // Without ranges, it differs from the others as is said.
  const auto own = [&](RadioOf::Index of, double otherwise) {
    return number ? constants[radio_at(*number) + of] : otherwise;
  };
  radio.calibration.scale =
      1.0 + constants[Common::scale] + own(RadioOf::scale, given.scale - all.scale);
  radio.calibration.bias = constants[Common::bias] + own(RadioOf::bias, given.bias - all.bias);
  radio.calibration.sigma =
      noise_.range_deviation() * (given.sigma > 0.0 ? given.sigma : options_.sigma);
  const auto sigma_of_sum = [&](Common::Index common, RadioOf::Index of) {
    const int a = kKeyframe + common;
    double variance = covariance(a, a);
    if (number) {
      const int b = kKeyframe + radio_at(*number) + of;
      variance += covariance(b, b) + 2.0 * covariance(a, b);
    }
    return doubt_ * std::sqrt(std::max(0.0, variance));
  };
  radio.scale_sigma = sigma_of_sum(Common::scale, RadioOf::scale);
  radio.bias_sigma = sigma_of_sum(Common::bias, RadioOf::bias);
  if (!number) return radio;

  const auto r = static_cast<std::size_t>(*number);
  for (const RangeMode& other : modes_) {
    if (radios_[r].listed && other.accounts[r] != RadioAccount::as_listed) {
      radio.fault += other.probability;
    }
  }
  if (radio.fault > kNamed && has_turned_) {
    const bool is_mistaken = mode.accounts[r] == RadioAccount::mistaken;
    radio.account = is_mistaken ? RadioAccount::elsewhere : mode.accounts[r];
  }
  if (mode.estimate.takes_part[r]) {
    const int at = radio_at(*number);
    radio.places.push_back(
        {constants.segment<2>(at),
         doubt_ * doubt_ * covariance.block<2, 2>(kKeyframe + at, kKeyframe + at), 1.0});
  }
  for (const RadioPlace& place : radios_[r].other_places) radio.places.push_back(place);
  double sum = 0.0;
  for (const RadioPlace& place : radio.places) sum += place.probability;
  for (RadioPlace& place : radio.places) place.probability /= sum;
  if (radio.account != RadioAccount::elsewhere || radio.places.empty()) return radio;
  for (const Beacon& other : beacons_) {
    const Eigen::Vector2d off = other.position.head<2>() - radio.places.front().position;
    if (other.id != id && off.norm() < kSamePlace) radio.in_place_of = other.id;
  }
  return radio;
}

std::vector<Beacon> RangeMemory::found() const {
  std::vector<Beacon> found = beacons_;
  std::vector<Beacon> anew;
  for (const RadioKnowledge& radio : radios()) {
    const bool is_free =
        radio.account == RadioAccount::unlisted || radio.account == RadioAccount::elsewhere;
    if (!is_free || radio.places.size() != 1) continue;
    const auto number = static_cast<std::size_t>(*number_of(radio.id));
    if (!modes_.front().estimate.takes_part[number]) continue;
    Beacon beacon;
    beacon.is_planar = true;
    if (const Beacon* known = listed(radio.id)) beacon = *known;
    beacon.id = radio.id;
    beacon.position.head<2>() = radio.places.front().position;
    anew.push_back(beacon);
  }
  // One that is hardly known makes the frame, and with it the others, less sure: it goes first.
  const auto is_less_sure = [](const Beacon& a, const Beacon& b) { return a.sigma < b.sigma; };
  while (!anew.empty()) {
    std::vector<int> places;
    for (const Beacon& beacon : anew) {
      places.push_back(kKeyframe + radio_at(*number_of(beacon.id)));
    }
    Eigen::MatrixXd covariance = covariance_of(modes_.front().belief.covariance, places);
    if (beacons_.size() < 2) covariance = without_frame(anew, covariance);
    for (std::size_t b = 0; b < anew.size(); ++b) {
      const auto at = static_cast<Eigen::Index>(2 * b);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance.block<2, 2>(at, at));
      anew[b].sigma = doubt_ * std::sqrt(std::max(0.0, axes.eigenvalues()[1]));
    }
    const auto worst = std::max_element(anew.begin(), anew.end(), is_less_sure);
    if (worst->sigma < kFound) break;
    anew.erase(worst);
  }
  for (const Beacon& beacon : anew) {
    const auto known = std::find_if(found.begin(), found.end(),
                                    [&](const Beacon& other) { return other.id == beacon.id; });
    if (known != found.end()) {
      *known = beacon;
    } else {
      found.push_back(beacon);
    }
  }
  return found;
}

bool RangeMemory::is_ambiguous() const {
  const std::vector<RadioKnowledge> all = radios();
  return std::any_of(all.begin(), all.end(),
                     [](const RadioKnowledge& radio) { return radio.places.size() > 1; });
}

bool RangeMemory::is_torn() const {
  if (modes_.empty() || !modes_.front().belief.is_usable) return false;
  const RangeMode& best = modes_.front();
  const Eigen::Matrix2d covariance = doubt_ * doubt_ * best.belief.covariance.topLeftCorner<2, 2>();
  double elsewhere = 0.0;
  for (const RangeMode& mode : modes_) {
    const Eigen::Vector2d off =
        (mode.estimate.keyframes.back() - best.estimate.keyframes.back()).head<2>();
    const bool is_other =
        mode.accounts != best.accounts && off.dot(covariance.inverse() * off) > kApart;
    if (is_other) elsewhere += mode.probability;
  }
  return elsewhere > kTorn;
}

std::optional<RangeInnovation> RangeMemory::innovation() const {
  if (modes_.empty() || !modes_.front().belief.is_usable || graph_.ranges.back().empty() ||
      !holds_newest_) {
    return std::nullopt;
  }
  const RangeMode& mode = modes_.front();
  const HeldRange& range = graph_.ranges.back().back();
  if (!mode.estimate.takes_part[static_cast<std::size_t>(range.radio)]) return std::nullopt;
  const HeldRangeResidual residual =
      residual_of(range, noise_, mode.estimate.keyframes.back(), mode.estimate.constants);
  constexpr int kFront = kKeyframe + Common::count;
  const int own = kKeyframe + radio_at(range.radio);
  Eigen::VectorXd by = Eigen::VectorXd::Zero(mode.belief.covariance.rows());
  by.head<kFront>() << residual.by_keyframe.transpose(), residual.by_common.transpose();
  by.segment<RadioOf::count>(own) = residual.by_radio.transpose();
  const double of_estimate = doubt_ * doubt_ * by.dot(mode.belief.covariance * by);
  const double stated = std::sqrt(range.variance);
  const double of_range = noise_.range_deviation() / noise_.range;
  const double unit = noise_.range * stated;
  return RangeInnovation{radios_[static_cast<std::size_t>(range.radio)].id, -unit * residual.value,
                         unit * std::sqrt(of_range * of_range + of_estimate)};
}

RangeMemory::Newest RangeMemory::newest(const RangeMode& mode) const {
  const Eigen::VectorXd& constants = mode.estimate.constants;
  const KeyframeState& last = mode.estimate.keyframes.back();
  const Pose2 moved = corrected_motion(pending_, last, constants);
  const Pose2 pose = compose(pose_of(last), moved);
  Newest newest;
  newest.mean.resize(kKeyframe + constants.size());
  newest.mean << pose.x, pose.y, pose.heading, last[3], constants;
  const Eigen::Matrix3d turn = by_second(pose_of(last));
  Eigen::MatrixXd by = Eigen::MatrixXd::Identity(3, newest.mean.size());
  by.leftCols<3>() = by_first(pose_of(last), moved);
  by.col(3) = -turn * pending_.yaw_rate_sensitivity;
  by.col(kKeyframe + Common::turn_scale) = -turn * pending_.turn_scale_sensitivity;
  by.col(kKeyframe + Common::distance_scale) = -turn * Eigen::Vector3d(moved.x, moved.y, 0.0);
  newest.covariance = mode.belief.covariance;
  newest.covariance.topRows<3>() = by * mode.belief.covariance;
  newest.covariance.leftCols<3>() = newest.covariance * by.transpose();
  newest.covariance *= doubt_ * doubt_;
  const Eigen::Vector3d factors(noise_.translation, noise_.translation, noise_.heading);
  const Eigen::Matrix3d since = factors.asDiagonal() * pending_.covariance * factors.asDiagonal();
  newest.covariance.topLeftCorner<3, 3>() +=
      turn * (since + pending_.slip_covariance) * turn.transpose();
  return newest;
}

}  // namespace pf_resampling
