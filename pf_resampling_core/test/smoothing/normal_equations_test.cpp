#include "pf_resampling_core/smoothing/normal_equations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <string>

#include "pf_resampling_core/population/random_stream.hpp"
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
  add_radios(8, {}, &drive);
  return drive;
}

// The Hessian entry by entry, from what each kind of data says along two unknowns.
Eigen::MatrixXd dense_hessian(const NormalEquations& equations, const SmoothingGraph& graph) {
  const Eigen::Index size = equations.size();
  Eigen::MatrixXd hessian(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      Directions both = Directions::Zero(size, 2);
      both(i, 0) = 1.0;
      both(j, 1) = 1.0;
      const InformationParts parts = equations.information_along(graph, kRobustWidth, {}, both);
      const double entry = (parts.ranges + parts.bearings + parts.motions + parts.prior)(0, 1);
      hessian(i, j) = entry;
      hessian(j, i) = entry;
    }
  }
  return hessian;
}

Directions random_directions(Eigen::Index size) {
  Directions directions(size, 2);
  RandomStream(11, RandomPurpose::test, 0).fill_normal(0, directions.size(), directions.data());
  return directions;
}

double largest(const Eigen::MatrixXd& matrix) {
  return matrix.size() == 0 ? 0.0 : matrix.cwiseAbs().maxCoeff();
}

// Poses: none but the newest, one cut, segments that are full, one short or one over, some.
class DrivesOf : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Segments, DrivesOf,
                         testing::Values(1, 2, 3, 4, 12, 13, 14, 15, 16, 25, 26, 27, 28, 29, 40),
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
    EXPECT_LT(largest(equations.step() - step), 1e-7 * (1.0 + largest(step)));
    const Directions right = random_directions(equations.size());
    const Eigen::MatrixXd solution = dense.solve(right);
    EXPECT_LT(largest(equations.solve(right) - solution), 1e-7 * largest(solution));
  }
}

TEST_P(DrivesOf, LeaveTheInformationOfWhatAFilterGoesOnWith) {
  const RingDrive drive = drive_of(GetParam());
  NormalEquations equations(drive.graph);
  equations.linearize(drive.graph, kRobustWidth);
  ASSERT_TRUE(equations.factorize(0.0));
  const Eigen::MatrixXd hessian = dense_hessian(equations, drive.graph);
  const Eigen::Index kept = equations.trailing_size();
  ASSERT_EQ(kept, 2 * static_cast<Eigen::Index>(drive.graph.landmarks.size() +
                                                drive.graph.radios.size()) +
                      kSensorConstants + 3);
  // The covariance of some of the unknowns is a block of that of all.
  const Eigen::MatrixXd covariance =
      hessian.llt().solve(Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols()));
  const Eigen::MatrixXd root = equations.trailing_root();
  const Eigen::MatrixXd of_kept =
      root * root.transpose() * covariance.bottomRightCorner(kept, kept);
  EXPECT_LT(largest(of_kept - Eigen::MatrixXd::Identity(kept, kept)), 1e-6);
  // And so is the step.
  const Eigen::VectorXd step =
      -(root * root.transpose()).llt().solve(equations.trailing_gradient());
  const Eigen::VectorXd whole = equations.step();
  EXPECT_LT(largest(whole.tail(kept) - step), 1e-6 * (1.0 + largest(whole)));
}

TEST_P(DrivesOf, HaveTheGradientOfTheirCost) {
  constexpr double kStep = 1e-5;
  const RingDrive drive = drive_of(GetParam());
  NormalEquations equations(drive.graph);
  equations.linearize(drive.graph, kRobustWidth);
  const double scale = 1.0 + largest(equations.gradient());
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

// Segments grow with the drive: too many unknowns to compare them all, so along random directions.
TEST(NormalEquations, OfLongDrivesAreSolved) {
  for (const int poses : {700, 1021, 1022}) {
    SCOPED_TRACE(poses);
    const RingDrive drive = drive_of(poses);
    NormalEquations equations(drive.graph);
    equations.linearize(drive.graph, kRobustWidth);
    ASSERT_TRUE(equations.factorize(0.0));
    const Directions right = random_directions(equations.size());
    const Directions solution = equations.solve(right);
    const InformationParts parts =
        equations.information_along(drive.graph, kRobustWidth, {}, solution);
    const Eigen::Matrix2d along = parts.ranges + parts.bearings + parts.motions + parts.prior;
    const Eigen::Matrix2d expected = solution.transpose() * right;
    EXPECT_LT(largest(along - expected), 1e-6 * largest(expected));
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
