#pragma once

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "pf_resampling_core/smoothing/smoothing_graph.hpp"

namespace pf_resampling {

/// The same least squares by Ceres, with derivatives that it takes itself: what smooth() is held
/// against. Of a graph whose prior is that of prior_at().
class CeresSmoother {
 public:
  explicit CeresSmoother(const SmoothingGraph& graph) {
    double heading = 0.0;  // not wrapped: to Ceres it is a number like others
    for (const Pose2& pose : graph.poses) {
      heading += wrap_angle(pose.heading - heading);
      poses_.push_back({pose.x, pose.y, heading});
    }
    for (const Eigen::Vector2d& l : graph.landmarks) landmarks_.push_back({l.x(), l.y()});
    for (int k = 0; k < kSensorConstants; ++k) constants_[static_cast<std::size_t>(k)] = 0.0;
    for (std::size_t i = 0; i < graph.motions.size(); ++i) {
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Motion, 3, 3, 3, kSensorConstants>(
                                    new Motion(graph.motions[i])),
                                nullptr, poses_[i].data(), poses_[i + 1].data(), constants_.data());
    }
    for (const SightingFactor& sighting : graph.sightings) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Sighting, 2, 3, 2, kSensorConstants>(
              new Sighting{sighting}),
          nullptr, poses_[static_cast<std::size_t>(sighting.pose)].data(),
          landmarks_[static_cast<std::size_t>(sighting.landmark)].data(), constants_.data());
    }
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Prior, kSensorConstants, kSensorConstants>(
            new Prior{graph.prior.information.diagonal().tail<kSensorConstants>().cwiseSqrt()}),
        nullptr, constants_.data());
    problem_.SetParameterBlockConstant(poses_.front().data());
  }

  /// False if it did not converge.
  bool solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.termination_type == ceres::CONVERGENCE;
  }

  /// Of landmarks and newest pose.
  Eigen::MatrixXd covariance() {
    std::vector<double*> blocks;
    for (auto& landmark : landmarks_) blocks.push_back(landmark.data());
    blocks.push_back(poses_.back().data());
    std::vector<const double*> wanted(blocks.begin(), blocks.end());
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    ceres::Covariance covariance(options);
    if (!covariance.Compute(wanted, &problem_)) return {};
    const Eigen::Index size = 2 * static_cast<Eigen::Index>(landmarks_.size()) + 3;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(size, size);
    covariance.GetCovarianceMatrix(wanted, matrix.data());
    return matrix;
  }

  std::vector<std::array<double, 3>> poses_;
  std::vector<std::array<double, 2>> landmarks_;
  std::array<double, kSensorConstants> constants_{};

 private:
  struct Motion {
    explicit Motion(const MotionFactor& motion) : factor(motion) {
      const Eigen::Matrix3d covariance = factor.covariance + 1e-10 * Eigen::Matrix3d::Identity();
      root = covariance.llt().matrixL().solve(Eigen::Matrix3d::Identity());
    }
    template <typename T>
    bool operator()(const T* from, const T* to, const T* constants, T* residual) const {
      using std::cos;
      using std::sin;
      const T dx = to[0] - from[0];
      const T dy = to[1] - from[1];
      const T c = cos(from[2]);
      const T s = sin(from[2]);
      T turned = to[2] - from[2];
      const double share = factor.turn_share;
      T value[3] = {(c * dx + s * dy) / (1.0 + constants[0]) - factor.mean.x,
                    (c * dy - s * dx) / (1.0 + constants[0]) - factor.mean.y,
                    turned * (1.0 - share + share / (1.0 + constants[1])) - factor.mean.heading};
      for (int row = 0; row < 3; ++row) {
        for (int k = row < 2 ? 1 : 2; k < kOdometryConstants; ++k) {
          value[row] -= factor.sensitivity(row, k) * constants[k];
        }
      }
      for (int row = 0; row < 3; ++row) {
        residual[row] = T(0.0);
        for (int k = 0; k < 3; ++k) residual[row] += root(row, k) * value[k];
      }
      return true;
    }
    MotionFactor factor;
    Eigen::Matrix3d root;
  };

  struct Sighting {
    template <typename T>
    bool operator()(const T* pose, const T* landmark, const T* constants, T* residual) const {
      using std::atan2;
      using std::cos;
      using std::sin;
      using std::sqrt;
      const T dx = landmark[0] - pose[0];
      const T dy = landmark[1] - pose[1];
      const T direction = pose[2] + factor.bearing - constants[6];
      const T ahead = cos(direction) * dx + sin(direction) * dy;
      const T left = cos(direction) * dy - sin(direction) * dx;
      residual[0] = ((1.0 + constants[5]) * sqrt(dx * dx + dy * dy) - factor.range) /
                    std::sqrt(factor.range_variance);
      residual[1] = atan2(left, ahead) / std::sqrt(factor.bearing_variance);
      return true;
    }
    SightingFactor factor;
  };

  struct Prior {
    template <typename T>
    bool operator()(const T* constants, T* residual) const {
      for (int k = 0; k < kSensorConstants; ++k) residual[k] = roots[k] * constants[k];
      return true;
    }
    SensorConstants roots;
  };

  ceres::Problem problem_;
};

}  // namespace pf_resampling
