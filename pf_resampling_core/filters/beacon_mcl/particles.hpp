#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/geometry.hpp"
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
  void put(Eigen::Index particle, const Pose2& pose) {
    x[particle] = pose.x;
    y[particle] = pose.y;
    heading[particle] = pose.heading;
  }

  /// The one list of what a particle carries. Selecting, resizing, saving and loading go through
  /// it: see particle_columns.hpp. visit(name, array).
  template <typename Self, typename Visit>
  static void for_each_column(Self& self, const Visit& visit) {
    visit("x", self.x);
    visit("y", self.y);
    visit("heading", self.heading);
    visit("log_weight", self.log_weight);
    visit("weight", self.weight);
    visit("ancestor", self.ancestor);
    visit("yaw_rate_bias", self.yaw_rate_bias);
    visit("yaw_rate_bias_variance", self.yaw_rate_bias_variance);
    visit("translation_factor", self.translation_factor);
    visit("heading_factor", self.heading_factor);
    visit("scale", self.scale);
    visit("bias", self.bias);
    visit("scale_variance", self.scale_variance);
    visit("scale_bias_covariance", self.scale_bias_covariance);
    visit("bias_variance", self.bias_variance);
  }
};

}  // namespace pf_resampling
