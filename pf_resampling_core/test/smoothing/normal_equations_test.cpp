#include "pf_resampling_core/smoothing/normal_equations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/smoothing/residuals.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kRobustWidth = 2.0;

// The first pose is known to a decimetre only, so that all unknowns are of a size.
RingDrive drive_of(int poses) {
  SensorConstants sigma;
  sigma << 0.02, 0.02, 0.01, 0.01, 0.05, 0.02, 0.02;
  RingDrive drive(poses, 20, 7, sigma);
  drive.graph.prior.information.topLeftCorner<3, 3>() = 100.0 * Eigen::Matrix3d::Identity();
  return drive;
}

// A factor's derivatives, and of which unknowns.
struct Rows {
  std::vector<int> places;
  Eigen::MatrixXd jacobian;
};

std::vector<Rows> rows_of(const NormalEquations& equations, const SmoothingGraph& graph) {
  std::vector<Rows> all;
  const auto add = [&](const std::vector<std::pair<int, Eigen::MatrixXd>>& blocks, double weight) {
    all.emplace_back();
    for (const auto& [first, block] : blocks) {
      const Eigen::Index before = all.back().jacobian.cols();
      all.back().jacobian.conservativeResize(block.rows(), before + block.cols());
      all.back().jacobian.rightCols(block.cols()) = std::sqrt(weight) * block;
      for (int i = 0; i < block.cols(); ++i) all.back().places.push_back(first + i);
    }
  };
  const int sensor = equations.constants_at() + SensorConstant::range_scale;
  for (int i = 0; i < static_cast<int>(graph.motions.size()); ++i) {
    const std::size_t at = static_cast<std::size_t>(i);
    const MotionResidual r =
        motion_residual(graph.motions[at], motion_root(graph.motions[at], graph.noise.motion),
                        graph.poses[at], graph.poses[at + 1], graph.constants);
    add({{equations.pose_at(i), r.by_from},
         {equations.pose_at(i + 1), r.by_to},
         {equations.constants_at(), r.by_constants}},
        1.0);
  }
  for (const SightingFactor& sighting : graph.sightings) {
    const SightingResidual r = sighting_residual(
        sighting, graph.noise, graph.poses[static_cast<std::size_t>(sighting.pose)],
        graph.landmarks[static_cast<std::size_t>(sighting.landmark)], graph.constants);
    add({{equations.pose_at(sighting.pose), r.by_pose},
         {equations.landmark_at(sighting.landmark), r.by_landmark},
         {sensor, r.by_constants}},
        robust_weight(r.value.squaredNorm(), kRobustWidth));
  }
  all.emplace_back();  // the prior: of the first pose and the constants
  std::vector<int>& places = all.back().places;
  for (int i = 0; i < 3; ++i) places.push_back(equations.pose_at(0) + i);
  for (int i = 0; i < kSensorConstants; ++i) places.push_back(equations.constants_at() + i);
  all.back().jacobian = graph.prior.information.llt().matrixU();
  return all;
}

Eigen::MatrixXd dense_hessian(const NormalEquations& equations, const SmoothingGraph& graph) {
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(equations.size(), equations.size());
  for (const Rows& rows : rows_of(equations, graph)) {
    const Eigen::MatrixXd block = rows.jacobian.transpose() * rows.jacobian;
    for (std::size_t i = 0; i < rows.places.size(); ++i) {
      for (std::size_t j = 0; j < rows.places.size(); ++j) {
        hessian(rows.places[i], rows.places[j]) +=
            block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
  }
  return hessian;
}

double largest_in(const Eigen::MatrixXd& matrix) {
  return matrix.size() == 0 ? 0.0 : matrix.cwiseAbs().maxCoeff();
}

// Poses: none but the newest, one more, two more, some.
class DrivesOf : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Segments, DrivesOf, testing::Values(1, 2, 3, 40),
                         [](const auto& given) { return std::to_string(given.param) + "Poses"; });

TEST_P(DrivesOf, AreSolvedLikeDenseEquations) {
  const RingDrive drive = drive_of(GetParam());
  NormalEquations equations(drive.graph);
  equations.linearize(drive.graph, kRobustWidth);
  const Eigen::MatrixXd hessian = dense_hessian(equations, drive.graph);
  for (const double damping : {0.0, 0.1}) {
    SCOPED_TRACE(damping);
    ASSERT_TRUE(equations.factorize(damping));
    Eigen::MatrixXd damped = hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LLT<Eigen::MatrixXd> dense(damped);
    ASSERT_EQ(dense.info(), Eigen::Success);
    const double log_determinant =
        2.0 * Eigen::MatrixXd(dense.matrixL()).diagonal().array().log().sum();
    EXPECT_NEAR(equations.log_determinant(), log_determinant, 1e-6);
    const Eigen::VectorXd step = -dense.solve(equations.gradient());
    EXPECT_LT(largest_in(equations.step() - step), 1e-7 * (1.0 + largest_in(step)));
  }
}

TEST_P(DrivesOf, HaveTheGradientOfTheirCost) {
  constexpr double kStep = 1e-5;
  const RingDrive drive = drive_of(GetParam());
  NormalEquations equations(drive.graph);
  equations.linearize(drive.graph, kRobustWidth);
  const double scale = 1.0 + largest_in(equations.gradient());
  for (Eigen::Index i = 0; i < equations.size(); ++i) {
    const auto cost_at = [&](double by) {
      SmoothingGraph moved = drive.graph;
      equations.move(by * Eigen::VectorXd::Unit(equations.size(), i), &moved);
      return equations.cost(moved, kRobustWidth);
    };
    EXPECT_NEAR(equations.gradient()[i], (cost_at(kStep) - cost_at(-kStep)) / (2.0 * kStep),
                1e-5 * scale);
  }
}

// Segments grow with the drive.
TEST(NormalEquations, OfLongDrivesAreSolved) {
  for (const int poses : {700, 1021, 1022}) {
    SCOPED_TRACE(poses);
    const RingDrive drive = drive_of(poses);
    NormalEquations equations(drive.graph);
    equations.linearize(drive.graph, kRobustWidth);
    ASSERT_TRUE(equations.factorize(0.0));
    const Eigen::VectorXd left = dense_hessian(equations, drive.graph) * equations.step();
    EXPECT_LT(largest_in(left + equations.gradient()), 1e-6 * largest_in(equations.gradient()));
  }
}

TEST(NormalEquations, SayWhenTheyHaveNoSolution) {
  RingDrive drive = drive_of(5);
  drive.graph.prior.information(0, 0) = -1e6;
  NormalEquations equations(drive.graph);
  equations.linearize(drive.graph, kRobustWidth);
  EXPECT_FALSE(equations.factorize(0.0));
}

}  // namespace
}  // namespace pf_resampling
