#include "pf_resampling_core/range_memory/range_graph.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace pf_resampling {
namespace {

constexpr int kState = KeyframeUnknown::count;

Eigen::VectorXd some_constants() {
  Eigen::VectorXd constants(radio_at(2));
  constants << 0.02, 0.3, 0.03, -0.04, 0.2, -0.1, 0.3, 0.5,  //
      5.0, 4.0, 0.01, -0.05, 0.7,                            //
      -6.0, 3.0, -0.01, 0.08, 0.0;
  return constants;
}

OdometryIncrement some_motion() {
  OdometryIncrement motion;
  for (int i = 0; i < 5; ++i) append(OdometryNoise{}, {0.1, 0.01, 0.05}, 0.2, &motion);
  return motion;
}

void expect_derivatives(const std::optional<double>& height) {
  HeldRange range;
  range.radio = 1;
  range.range = 7.0;
  range.variance = 0.04;
  range.antenna = {0.3, 0.2};
  range.height = height;
  range.since = some_motion();
  const RangeNoise noise;
  const KeyframeState state(1.0, 2.0, 0.7, 0.02);
  const Eigen::VectorXd constants = some_constants();
  const HeldRangeResidual residual = residual_of(range, noise, state, constants);
  constexpr double kStep = 1e-6;
  const auto difference = [&](const KeyframeState& by_state, const Eigen::VectorXd& by_constants) {
    return (residual_of(range, noise, state + by_state, constants + by_constants).value -
            residual_of(range, noise, state - by_state, constants - by_constants).value) /
           (2.0 * kStep);
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(constants.size());
  for (int i = 0; i < kState; ++i) {
    EXPECT_NEAR(residual.by_keyframe[i], difference(kStep * KeyframeState::Unit(i), none), 1e-6)
        << "keyframe " << i;
  }
  const auto by_constant = [&](int i) {
    return difference(KeyframeState::Zero(), kStep * Eigen::VectorXd::Unit(constants.size(), i));
  };
  for (int i = 0; i < CommonUnknown::count; ++i) {
    EXPECT_NEAR(residual.by_common[i], by_constant(i), 1e-6) << "common " << i;
  }
  for (int i = 0; i < RadioUnknown::count; ++i) {
    EXPECT_NEAR(residual.by_radio[i], by_constant(radio_at(1) + i), 1e-6) << "radio " << i;
  }
}

TEST(ResidualOfRange, HasItsDerivatives) {
  expect_derivatives(1.0);
  expect_derivatives(std::nullopt);
}

TEST(ResidualOfMotion, HasItsDerivatives) {
  const OdometryIncrement motion = some_motion();
  const RangeNoise noise;
  const KeyframeState from(1.0, 2.0, 0.7, 0.02);
  const KeyframeState to(1.4, 2.5, 0.9, 0.0201);
  const Eigen::VectorXd constants = some_constants();
  const auto value = [&](const KeyframeState& a, const KeyframeState& b,
                         const Eigen::VectorXd& c) -> Eigen::Vector4d {
    return residual_of(motion, noise, 1e-3, a, b, c).value;
  };
  const HeldMotionResidual residual = residual_of(motion, noise, 1e-3, from, to, constants);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < kState; ++i) {
    const KeyframeState step = kStep * KeyframeState::Unit(i);
    const Eigen::Vector4d by_from =
        (value(from + step, to, constants) - value(from - step, to, constants)) / (2.0 * kStep);
    const Eigen::Vector4d by_to =
        (value(from, to + step, constants) - value(from, to - step, constants)) / (2.0 * kStep);
    EXPECT_LT((residual.by_from.col(i) - by_from).norm(), 1e-5) << i;
    EXPECT_LT((residual.by_to.col(i) - by_to).norm(), 1e-5) << i;
  }
  for (int i = 0; i < 2; ++i) {
    const Eigen::VectorXd step =
        kStep * Eigen::VectorXd::Unit(constants.size(), CommonUnknown::distance_scale + i);
    const Eigen::Vector4d by_scale =
        (value(from, to, constants + step) - value(from, to, constants - step)) / (2.0 * kStep);
    EXPECT_LT((residual.by_scales.col(i) - by_scale).norm(), 1e-5) << i;
  }
}

TEST(RangeLoss, IsStudentsAboveAUniformFloor) {
  RangeNoise noise;
  noise.range = 0.5;
  noise.robust_width = 4.0;  // 15 degrees of freedom
  const RangeLoss loss(noise);
  const double variance = 0.25;
  const double sigma = 0.25;
  const auto density = [&](double residual) {
    const double student = std::exp(std::lgamma(8.0) - std::lgamma(7.5)) /
                           (std::sqrt(kPi) * 4.0 * sigma) *
                           std::pow(1.0 + residual * residual / 16.0, -8.0);
    return student + 0.05 / 200.0;
  };
  for (const double residual : {0.0, 0.5, 2.0, 5.0, 20.0}) {
    EXPECT_NEAR(loss.at(residual, variance).cost, std::log(density(0.0) / density(residual)), 1e-9);
    constexpr double kStep = 1e-5;
    const double slope =
        (loss.at(residual + kStep, variance).cost - loss.at(residual - kStep, variance).cost) /
        (2.0 * kStep);
    EXPECT_NEAR(loss.at(residual, variance).weight * residual, slope, 1e-6);
  }
  EXPECT_LT(loss.at(20.0, variance).weight, 1e-3);
}

/// A short drive as a graph, at its solution.
struct SmallProblem {
  RangeGraph graph;
  RangePrior prior;
  RangeNoise noise;
  RangeEstimate estimate;
};

SmallProblem small_problem() {
  SmallProblem problem;
  problem.noise.range = 0.1;
  problem.noise.robust_width = 100.0;
  problem.prior.constants = Eigen::VectorXd::Zero(radio_at(2));
  problem.prior.constants.segment<2>(radio_at(0)) = Eigen::Vector2d(5.0, 4.0);
  problem.prior.constants.segment<2>(radio_at(1)) = Eigen::Vector2d(-6.0, 3.0);
  problem.prior.constants_sigma = Eigen::VectorXd::Constant(radio_at(2), 0.05);
  problem.prior.first_sigma.setConstant(0.1);
  problem.estimate.constants = problem.prior.constants;
  problem.estimate.takes_part = {true, true};
  Pose2 pose;
  for (int k = 0; k < 6; ++k) {
    if (k > 0) {
      problem.graph.motions.push_back(some_motion());
      pose = compose(pose, some_motion().mean);
    }
    problem.estimate.keyframes.emplace_back(pose.x, pose.y, pose.heading, 0.0);
    problem.graph.ranges.emplace_back();
    for (int radio = 0; radio < 2; ++radio) {
      HeldRange range;
      range.radio = radio;
      range.variance = 1.0;
      const Eigen::Vector2d place = problem.prior.constants.segment<2>(radio_at(radio));
      range.range = std::hypot(place.x() - pose.x, place.y() - pose.y) + 0.03 * (k % 3);
      problem.graph.ranges.back().push_back(range);
    }
  }
  return problem;
}

// Motions alone say nothing of how long wheels or turns measure.
TEST(Solve, ScalesOfTheOdometryHaveNoEvidenceOfTheirOwn) {
  const auto log_evidence_of = [](double scale) {
    SmallProblem problem = small_problem();
    for (auto& ranges : problem.graph.ranges) ranges.clear();
    problem.prior.constants.segment<2>(CommonUnknown::distance_scale).setConstant(scale);
    problem.prior.constants_sigma.setConstant(1e-6);
    problem.estimate.constants = problem.prior.constants;
    return solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, {}, &problem.estimate)
        .log_evidence;
  };
  EXPECT_NEAR(log_evidence_of(-0.05), log_evidence_of(0.05), 0.1);
}

TEST(Solve, RangesOverruleAMotionThatWasNone) {
  SmallProblem problem = small_problem();
  problem.noise.range = 0.3;
  for (OdometryIncrement& motion : problem.graph.motions) {
    motion.covariance = 4e-4 * Eigen::Matrix3d::Identity();
    motion.slip_covariance.setZero();
  }
  for (auto& ranges : problem.graph.ranges) {
    for (std::size_t i = 0; i < 10; ++i) ranges.push_back(HeldRange(ranges[i]));
  }
  problem.prior.constants_sigma.setConstant(1e-3);
  const std::vector<KeyframeState> truth = problem.estimate.keyframes;
  problem.graph.motions[2].mean.x += 1.0;
  for (std::size_t k = 3; k < truth.size(); ++k) {
    const KeyframeState& before = problem.estimate.keyframes[k - 1];
    const Pose2 pose = compose(pose_of(before), problem.graph.motions[k - 1].mean);
    problem.estimate.keyframes[k] << pose.x, pose.y, pose.heading, 0.0;
  }
  solve(problem.graph, problem.prior, problem.noise, 50, 1e-6, {}, &problem.estimate);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    EXPECT_LT((problem.estimate.keyframes[k] - truth[k]).head<2>().norm(), 0.3) << k;
  }
}

// The elimination against the inverse of the whole, dense Hessian, by differences of the cost.
TEST(Solve, CovarianceIsThatOfTheWholeHessian) {
  SmallProblem problem = small_problem();
  const RangeBelief belief =
      solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, {}, &problem.estimate);
  ASSERT_TRUE(belief.is_usable);
  const int poses = kState * problem.graph.keyframes();
  const int size = poses + radio_at(2);
  const auto cost = [&](const Eigen::VectorXd& step) {
    RangeEstimate moved = problem.estimate;
    for (int k = 0; k < problem.graph.keyframes(); ++k) {
      moved.keyframes[static_cast<std::size_t>(k)] += step.segment<kState>(kState * k);
    }
    moved.constants += step.tail(radio_at(2));
    return solve(problem.graph, problem.prior, problem.noise, 0, 0.0, {}, &moved).cost;
  };
  // Steps of about a hundredth of what the unknowns may be off by.
  Eigen::VectorXd steps = Eigen::VectorXd::Constant(size, 1e-3);
  for (int k = 0; k < problem.graph.keyframes(); ++k) steps[kState * k + 3] = 1e-6;
  Eigen::MatrixXd hessian(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      const Eigen::VectorXd a = steps[i] * Eigen::VectorXd::Unit(size, i);
      const Eigen::VectorXd b = steps[j] * Eigen::VectorXd::Unit(size, j);
      hessian(i, j) = hessian(j, i) =
          (cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)) / (4.0 * steps[i] * steps[j]);
    }
  }
  const int rest = kState + radio_at(2);
  const Eigen::MatrixXd all = hessian.inverse();
  const Eigen::MatrixXd expected = all.bottomRightCorner(rest, rest);
  for (int i = 0; i < rest; ++i) {
    const double sigma = std::sqrt(expected(i, i));
    EXPECT_NEAR(std::sqrt(belief.covariance(i, i)), sigma, 0.05 * sigma) << i;
  }
  const std::vector<Eigen::Matrix2d> positions =
      position_covariances(problem.graph, problem.prior, problem.noise, {}, problem.estimate);
  ASSERT_EQ(positions.size(), problem.graph.ranges.size());
  for (int k = 0; k < problem.graph.keyframes(); ++k) {
    const Eigen::Matrix2d position = all.block<2, 2>(kState * k, kState * k);
    const Eigen::Matrix2d off = positions[static_cast<std::size_t>(k)] - position;
    EXPECT_LT(off.norm(), 0.1 * position.norm()) << k;
  }
}

TEST(Solve, GivesUpWhereTheEvidenceWillNotDo) {
  const auto solved = [](double least_evidence) {
    SmallProblem problem = small_problem();
    problem.estimate.keyframes.back()[0] += 0.5;
    return solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, {}, &problem.estimate,
                 nullptr, least_evidence);
  };
  const RangeBelief whole = solved(-std::numeric_limits<double>::infinity());
  EXPECT_EQ(solved(whole.log_evidence - 1.0).log_evidence, whole.log_evidence);
  EXPECT_FALSE(solved(whole.log_evidence + 1.0).is_usable);
}

TEST(Solve, APastSaysWhatItsDataSaid) {
  SmallProblem problem = small_problem();
  RangePast past;
  past.keyframe = 3;
  const RangeBelief whole =
      solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, {}, &problem.estimate, &past);
  RangeEstimate estimate = problem.estimate;
  estimate.keyframes.back()[0] += 0.05;
  estimate.constants[CommonUnknown::bias] += 0.02;
  const RangeBelief rest =
      solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, past, &estimate);
  ASSERT_TRUE(rest.is_usable);
  EXPECT_LT((estimate.keyframes.back() - problem.estimate.keyframes.back()).norm(), 1e-5);
  EXPECT_LT((estimate.constants - problem.estimate.constants).norm(), 1e-5);
  EXPECT_LT((rest.covariance - whole.covariance).norm(), 1e-4 * whole.covariance.norm());
  EXPECT_NEAR(rest.log_evidence, whole.log_evidence, 1e-3);
}

// A radio that is integrated over is as if it had been another one before: its prior is taken
// twice, once for each.
TEST(Solve, ARadioThatIsAnotherOneFromNowOnKeepsNothing) {
  SmallProblem problem = small_problem();
  RangePast past;
  past.keyframe = 3;
  solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, {}, &problem.estimate, &past);
  const RangePast without = without_radio(1, problem.prior, past);
  RangeEstimate estimate = problem.estimate;
  const RangeBelief belief =
      solve(problem.graph, problem.prior, problem.noise, 50, 1e-12, without, &estimate);
  // The same drive among three radios, of which the second is not heard any more after the past.
  SmallProblem other = small_problem();
  other.prior.constants.conservativeResize(radio_at(3));
  other.prior.constants.tail<RadioUnknown::count>() =
      other.prior.constants.segment<RadioUnknown::count>(radio_at(1));
  other.prior.constants_sigma = Eigen::VectorXd::Constant(radio_at(3), 0.05);
  other.estimate.constants = other.prior.constants;
  other.estimate.takes_part = {true, true, true};
  for (std::size_t k = 3; k < other.graph.ranges.size(); ++k) other.graph.ranges[k][1].radio = 2;
  const RangeBelief expected =
      solve(other.graph, other.prior, other.noise, 50, 1e-12, {}, &other.estimate);
  const auto rows = kState + radio_at(1);
  EXPECT_LT(
      (estimate.constants.head(radio_at(1)) - other.estimate.constants.head(radio_at(1))).norm(),
      1e-3);
  EXPECT_LT((estimate.constants.tail<RadioUnknown::count>() -
             other.estimate.constants.tail<RadioUnknown::count>())
                .norm(),
            1e-3);
  EXPECT_LT(
      (belief.covariance.topLeftCorner(rows, rows) - expected.covariance.topLeftCorner(rows, rows))
          .norm(),
      1e-2 * expected.covariance.topLeftCorner(rows, rows).norm());
  EXPECT_NEAR(belief.log_evidence, expected.log_evidence, 0.05);
}

}  // namespace
}  // namespace pf_resampling
