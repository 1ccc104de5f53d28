#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/population/particle_columns.hpp"

namespace pf_resampling {

/// The population of BeaconMcl, structure of arrays: row i of every array belongs to particle i.
struct BeaconMclParticles {
  Eigen::ArrayXd x, y;                    ///< m, map frame
  Eigen::ArrayXd heading;                 ///< rad, in [-pi, pi]
  Eigen::ArrayXd log_weight;              ///< normalised
  Eigen::ArrayXd weight;                  ///< normalised, linear
  Eigen::ArrayXi ancestor;                ///< slot before the last renewal
  Eigen::ArrayXd yaw_rate_bias;           ///< rad/s, mean of the particle's Kalman filter
  Eigen::ArrayXd yaw_rate_bias_variance;  ///< and its variance
  /// Of the dead reckoning's standard deviations.
  Eigen::ArrayXd translation_factor, heading_factor;
  Eigen::ArrayXd scale, bias;  ///< of the first radio: means of the particle's Kalman filters
  Eigen::ArrayXd scale_variance, scale_bias_covariance, bias_variance;

  Eigen::Index size() const { return x.size(); }

  /// The one list of what a particle carries, in the order in which it is saved. Selecting,
  /// resizing, checking, saving and loading go through it: see particle_columns.hpp. visit(name,
  /// kind, array).
  template <typename Self, typename Visit>
  static void for_each_column(Self& self, const Visit& visit) {
    visit("x", ColumnKind::number, self.x);
    visit("y", ColumnKind::number, self.y);
    visit("heading", ColumnKind::number, self.heading);
    visit("log_weight", ColumnKind::log_weight, self.log_weight);
    visit("weight", ColumnKind::weight, self.weight);
    visit("ancestor", ColumnKind::ancestor, self.ancestor);
    visit("yaw_rate_bias", ColumnKind::number, self.yaw_rate_bias);
    visit("yaw_rate_bias_variance", ColumnKind::variance, self.yaw_rate_bias_variance);
    visit("translation_factor", ColumnKind::factor, self.translation_factor);
    visit("heading_factor", ColumnKind::factor, self.heading_factor);
    visit("scale", ColumnKind::number, self.scale);
    visit("bias", ColumnKind::number, self.bias);
    visit("scale_variance", ColumnKind::number, self.scale_variance);
    visit("scale_bias_covariance", ColumnKind::number, self.scale_bias_covariance);
    visit("bias_variance", ColumnKind::number, self.bias_variance);
  }
};

}  // namespace pf_resampling
