#include "pf_resampling_core/evaluation/particle_errors.hpp"

#include <cmath>
#include <string>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

void FeatureError::add(const Eigen::Vector2d& truth, const double* x, const double* y,
                       const std::uint8_t* held, int particles) {
  for (int k = 0; k < particles; ++k) {
    if (held != nullptr && held[k] == 0) continue;
    const double dx = x[k] - truth.x();
    const double dy = y[k] - truth.y();
    squares_ += dx * dx + dy * dy;
    ++count_;
  }
}

double FeatureError::rms() const {
  return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
}

double position_error(const Eigen::Vector2d& truth, const Eigen::Ref<const Eigen::ArrayXd>& x,
                      const Eigen::Ref<const Eigen::ArrayXd>& y) {
  if (x.size() == 0 || x.size() != y.size()) {
    throw Error("position error of " + std::to_string(x.size()) + " x and " +
                std::to_string(y.size()) + " y: it needs as many of both, and at least one");
  }
  return std::sqrt(((x - truth.x()).square() + (y - truth.y()).square()).mean());
}

}  // namespace pf_resampling
