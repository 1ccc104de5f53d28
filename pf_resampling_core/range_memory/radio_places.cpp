// Where RangeMemory finds radios whose place is not listed.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using RadioOf = RadioUnknown;

// Of radios whose place is not listed.
constexpr std::size_t kFixRanges = 120;
constexpr std::size_t kFewestFixRanges = 8;
constexpr double kFixMargin = 30.0;
constexpr double kGain = 0.5;

}  // namespace

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
      const double stretch = 1.0 + constants[Common::scale];
      all.push_back({moved(lever, pose), (range.range - constants[Common::bias]) / stretch,
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
  // Of place and bias: the cost and its quadratic approximation.
  struct Look {
    double cost;
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  };
  const auto look_at = [&](const Eigen::Vector3d& x) {
    Look look;
    look.hessian(2, 2) = 1.0 / (bias_sigma * bias_sigma);
    look.gradient[2] = look.hessian(2, 2) * x[2];
    look.cost = 0.5 * look.gradient[2] * x[2];
    for (const Seen& range : seen) {
      const Eigen::Vector2d away = x.head<2>() - range.from;
      const double distance = std::max(1e-3, away.norm());
      const double residual = (distance + x[2] - range.distance) / range.sigma;
      const double weight = share / (1.0 + residual * residual / (width * width));
      const Eigen::Vector3d by(away.x() / distance / range.sigma, away.y() / distance / range.sigma,
                               1.0 / range.sigma);
      look.hessian += weight * by * by.transpose();
      look.gradient += weight * residual * by;
      look.cost += share * 0.5 * width * width * std::log1p(residual * residual / (width * width));
    }
    return look;
  };
  std::vector<Fix> found;
  for (int i = 0; i < kRingPlaces; ++i) {
    const double angle = 2.0 * kPi * i / kRingPlaces;
    Eigen::Vector3d x(seen[0].from.x() + seen[0].distance * std::cos(angle),
                      seen[0].from.y() + seen[0].distance * std::sin(angle), 0.0);
    Look look = look_at(x);
    double damping = 1e-3;
    for (int iteration = 0; iteration < 30 && damping <= 1e4; ++iteration) {
      Eigen::Matrix3d damped = look.hessian;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::Vector3d moved = x - damped.ldlt().solve(look.gradient);
      const Look next = look_at(moved);
      const double gain = look.cost - next.cost;
      if (!(gain > 0.0)) {
        damping *= 10.0;
        continue;
      }
      x = moved;
      look = next;
      damping = std::max(1e-6, 0.1 * damping);
      if (gain < 1e-3) break;
    }
    const Fix fix = {x.head<2>(), look.hessian.inverse().topLeftCorner<2, 2>(), look.cost,
                     seen.back().distance};
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
    for (const Fix& fix : found) {
      radios_[r].other_places.push_back(
          {fix.position, fix.covariance, std::exp(found[0].cost - fix.cost)});
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
      if (!solved(kIterations, &other)) continue;
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
          {there, worse->belief.covariance.block<2, 2>(kKeyframe + at, kKeyframe + at), odds});
    }
  }
}

// Several wrong mirrors together bend the path, and no single one brings it back: all at once, from
// the path that odometry alone has, as long as it has its shape.
void RangeMemory::try_all_places_anew(RangeMode* mode) {
  if (time_ > kRigid || mode->past) return;
  RangeMode other = *mode;
  other.estimate.constants = mode->prior.constants;
  other.estimate.keyframes = driven_by_odometry(graph_, mode->prior.first, mode->prior.constants);
  // That path is not known to the noise of ranges: they would all be wild.
  const RangeNoise learnt = std::exchange(noise_, RangeNoise{});
  bool is_other = false;
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    if (other.accounts[r] != RadioAccount::unlisted || !other.estimate.takes_part[r]) continue;
    const std::vector<Fix> found = fixes(static_cast<int>(r), other);
    if (found.empty()) continue;
    const int at = radio_at(static_cast<int>(r)) + RadioOf::x;
    is_other |= (found[0].position - mode->estimate.constants.segment<2>(at)).norm() > kSamePlace;
    other.estimate.constants.segment<2>(at) = found[0].position;
  }
  if (is_other) solved(kManyIterations, &other);
  noise_ = learnt;
  if (!is_other || !solved(kIterations, &other)) return;
  if (other.belief.cost < mode->belief.cost - kGain) *mode = std::move(other);
}

}  // namespace pf_resampling
