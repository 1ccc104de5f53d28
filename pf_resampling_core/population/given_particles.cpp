#include "pf_resampling_core/population/given_particles.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr double kLargestTurn = 1e4;  // rad

template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw Error(text.str());
}

}  // namespace

bool is_in_reach(const Pose2& pose) {
  return std::abs(pose.x) <= kFarthestPosition && std::abs(pose.y) <= kFarthestPosition &&
         std::isfinite(pose.heading);
}

void check_given_particles(const GivenParticles& particles) {
  const std::size_t count = particles.poses.size();
  if (count == 0) refuse("there are 0 particles; give at least one");
  if (count > kMostGivenParticles) {
    refuse("there are ", count, " particles; give ", kMostGivenParticles, " at most");
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Pose2& pose = particles.poses[i];
    if (!is_in_reach(pose) || std::abs(pose.heading) > kLargestTurn) {
      refuse("particle ", i, " is at (", pose.x, " m, ", pose.y, " m, ", pose.heading,
             " rad); give finite numbers within 1e9 m");
    }
  }
  if (particles.weights.empty()) return;
  if (particles.weights.size() != count) {
    refuse("there are ", particles.weights.size(), " weights for ", count,
           " particles; give as many, or none for particles that weigh the same");
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double weight = particles.weights[i];
    if (!(std::isfinite(weight) && weight >= 0.0)) {
      refuse("the weight of particle ", i, " is ", weight, "; give finite numbers from 0");
    }
  }
  const double largest = *std::max_element(particles.weights.begin(), particles.weights.end());
  if (largest == 0.0) refuse("all weights are 0; give at least one that is not");
}

Eigen::ArrayXd log_weights_of(const GivenParticles& particles) {
  const auto count = static_cast<Eigen::Index>(particles.poses.size());
  if (particles.weights.empty()) return Eigen::ArrayXd::Zero(count);
  const Eigen::Map<const Eigen::ArrayXd> weights(particles.weights.data(), count);
  return (weights / weights.maxCoeff()).log();
}

}  // namespace pf_resampling
