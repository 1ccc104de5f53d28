#pragma once

#include <Eigen/Core>
#include <cmath>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/particle_columns.hpp"

namespace pf_resampling {

/// The poses of the population of FastSlam, structure of arrays: entry i of every array belongs to
/// particle i. Their maps are in a LandmarkStore, their errors of the odometry in an
/// OdometryErrorEstimator, their pasts in ParticlePaths.
struct FastSlamParticles {
  Eigen::ArrayXd x, y;        ///< m, map frame
  Eigen::ArrayXd heading;     ///< rad, in [-pi, pi]
  Eigen::ArrayXd log_weight;  ///< normalised
  Eigen::ArrayXd weight;      ///< normalised, linear
  Eigen::ArrayXi ancestor;    ///< slot before the last renewal

  Eigen::Index size() const { return x.size(); }
  Pose2 pose(Eigen::Index i) const { return {x[i], y[i], heading[i]}; }

  /// All weigh the same and descend from nobody else.
  void begin_anew() {
    log_weight.setConstant(size(), -std::log(static_cast<double>(size())));
    weight.setConstant(size(), 1.0 / static_cast<double>(size()));
    ancestor = Eigen::ArrayXi::LinSpaced(size(), 0, static_cast<int>(size()) - 1);
  }

  /// The one list of these arrays. Selecting, resizing, saving and loading go through it: see
  /// particle_columns.hpp. visit(name, array).
  template <typename Self, typename Visit>
  static void for_each_column(Self& self, const Visit& visit) {
    visit("x", self.x);
    visit("y", self.y);
    visit("heading", self.heading);
    visit("log_weight", self.log_weight);
    visit("weight", self.weight);
    visit("ancestor", self.ancestor);
  }
};

}  // namespace pf_resampling
