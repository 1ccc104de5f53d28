#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace pf_resampling {

/// Root mean square error of the landmarks that particles hold (Kwak eq. 5):
///
///     f_rmse = sqrt( 1/(M N) sum_k sum_i |theta_i - mu_i^[k]|^2 ),
///
/// over particles k and the landmarks i "which a particle has". Unweighted, as in the paper: the
/// spread of the particles is part of it, so whatever shrinks the cloud lowers it. With maps of
/// different sizes every landmark of every particle counts the same.
class FeatureError {
 public:
  /// Adds one landmark. `truth`: where it is (m); x, y: where each particle has it (m, of
  /// `particles` entries, contiguous); held: 0 where a particle does not have it, null if all have.
  /// All in one frame.
  void add(const Eigen::Vector2d& truth, const double* x, const double* y, const std::uint8_t* held,
           int particles);

  /// m; 0 if nothing was added.
  double rms() const;
  /// Landmarks of particles that were added: M N of the equation.
  std::int64_t count() const { return count_; }

 private:
  double squares_ = 0.0;
  std::int64_t count_ = 0;
};

/// Root mean square error of the particles' positions (Kwak eq. 6; x and y only, unweighted), m.
/// `truth`: where the robot is; x, y: of each particle, m. Throws Error on no particles or
/// different sizes.
double position_error(const Eigen::Vector2d& truth, const Eigen::Ref<const Eigen::ArrayXd>& x,
                      const Eigen::Ref<const Eigen::ArrayXd>& y);

}  // namespace pf_resampling
