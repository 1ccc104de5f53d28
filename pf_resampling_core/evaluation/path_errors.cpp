#include "pf_resampling_core/evaluation/path_errors.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/models/lost_error.hpp"

namespace pf_resampling {
namespace {

constexpr double kChiSquare95ThreeDof = 7.814727903251179;
constexpr double kConvergedFor = 10.0;   // s
constexpr double kTimeToConverge = 0.2;  // share of the time that never counts as lost
constexpr double kMostLost = 0.1;        // share of the rest that may

/// Squared length of `error` in units of `covariance`.
template <typename Matrix, typename Vector>
double mahalanobis_squared(const Matrix& covariance, const Vector& error) {
  const Eigen::LLT<Matrix> factor(covariance);
  // Eigen's factor of the zero matrix succeeds in some versions; its diagonal tells.
  if (factor.info() != Eigen::Success || !(factor.matrixLLT().diagonal().minCoeff() > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  return error.dot(factor.solve(error));
}

double square_root(double variance) {
  return std::sqrt(std::max(0.0, variance));
}

PathErrorSample compare(const TruePose& truth, const std::optional<double>& direction,
                        const EstimatedPose& estimate) {
  const Eigen::Vector2d error(estimate.pose.x - truth.x, estimate.pose.y - truth.y);
  const Eigen::Matrix2d covariance = estimate.covariance.topLeftCorner<2, 2>();
  PathErrorSample sample;
  sample.time = truth.time;
  sample.cartesian = error.norm();
  if (direction) {
    const Eigen::Vector2d ahead(std::cos(*direction), std::sin(*direction));
    const Eigen::Vector2d left(-ahead.y(), ahead.x());
    sample.along_track = ahead.dot(error);
    sample.cross_track = left.dot(error);
    sample.along_track_sigma = square_root(ahead.dot(covariance * ahead));
    sample.cross_track_sigma = square_root(left.dot(covariance * left));
  }
  sample.heading_sigma = square_root(estimate.covariance(2, 2));
  sample.position_sigma =
      square_root(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance, Eigen::EigenvaluesOnly)
                      .eigenvalues()
                      .maxCoeff());
  sample.normalized_squared = normalized_squared(covariance, error);
  if (truth.heading) {
    sample.heading = wrap_angle(estimate.pose.heading - *truth.heading);
    sample.normalized_squared_pose = mahalanobis_squared(
        estimate.covariance, Eigen::Vector3d(error.x(), error.y(), *sample.heading));
  }
  return sample;
}

std::optional<double> mean_if_any(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

void summarize(PathErrors* errors) {
  std::vector<double> cross_track, along_track, cartesian, heading;
  std::vector<double> inside95, inside95_pose, inside_3sigma, normalized;
  for (const PathErrorSample& sample : errors->samples) {
    if (sample.is_clipped) continue;
    cartesian.push_back(sample.cartesian);
    if (sample.cross_track) cross_track.push_back(*sample.cross_track);
    if (sample.along_track) along_track.push_back(*sample.along_track);
    if (sample.heading) heading.push_back(*sample.heading);
    inside95.push_back(sample.normalized_squared <= kChiSquare95TwoDof ? 1.0 : 0.0);
    inside_3sigma.push_back(sample.normalized_squared <= kThreeSigmaSquared ? 1.0 : 0.0);
    normalized.push_back(sample.normalized_squared);
    if (sample.normalized_squared_pose) {
      inside95_pose.push_back(*sample.normalized_squared_pose <= kChiSquare95ThreeDof ? 1.0 : 0.0);
    }
  }
  errors->cross_track = absolute_errors(cross_track);
  errors->along_track = absolute_errors(along_track);
  errors->cartesian = absolute_errors(cartesian);
  errors->heading = absolute_errors(heading);

  const bool states_covariance =
      std::any_of(errors->samples.begin(), errors->samples.end(),
                  [](const PathErrorSample& sample) { return sample.position_sigma > 0.0; });
  if (!states_covariance) return;
  errors->coverage95 = mean_if_any(inside95);
  errors->coverage95_pose = mean_if_any(inside95_pose);
  errors->coverage_3sigma = mean_if_any(inside_3sigma);
  errors->normalized_error = mean_if_any(normalized);
}

/// Whether position and heading are known at each true pose.
std::optional<double> converged_after(const std::vector<TruePose>& truth,
                                      const std::vector<bool>& is_known) {
  std::size_t start = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!is_known[i]) {
      start = i + 1;
      continue;
    }
    const bool is_long_enough = truth[i].time - truth[start].time >= kConvergedFor;
    if (is_long_enough || i + 1 == truth.size()) return truth[start].time - truth.front().time;
  }
  return std::nullopt;
}

/// Share of the true poses from `start` on at which the error is above the bound.
double lost_share(const std::vector<TruePose>& truth, const std::vector<double>& cartesian,
                  double bound, double start) {
  int poses = 0;
  int lost = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i].time < start) continue;
    ++poses;
    if (!(cartesian[i] <= bound)) ++lost;
  }
  return poses > 0 ? static_cast<double>(lost) / poses : 0.0;
}

}  // namespace

double normalized_squared(const Eigen::Matrix2d& covariance, const Eigen::Vector2d& error) {
  return mahalanobis_squared(covariance, error);
}

void check_options(const PathErrorOptions& options) {
  if (!(options.clip >= 0.0 && options.clip < 1.0)) {
    throw Error("clip is " + std::to_string(options.clip) +
                ": it is the share of the time that is left out, in [0, 1)");
  }
  if (!(options.max_gap >= 0.0)) {
    throw Error("max_gap is " + std::to_string(options.max_gap) + " s: it has to be >= 0");
  }
}

AbsoluteErrors absolute_errors(const std::vector<double>& errors) {
  AbsoluteErrors result;
  result.count = static_cast<int>(errors.size());
  if (errors.empty()) return result;
  const double count = static_cast<double>(errors.size());
  double squares = 0.0;
  std::vector<double> sizes;
  for (const double error : errors) {
    sizes.push_back(std::abs(error));
    result.mean += std::abs(error) / count;
    result.max = std::max(result.max, std::abs(error));
    squares += error * error;
  }
  result.rms = std::sqrt(squares / count);
  result.median = median(std::move(sizes));
  double deviations = 0.0;
  for (const double error : errors) {
    deviations += (std::abs(error) - result.mean) * (std::abs(error) - result.mean);
  }
  result.std = std::sqrt(deviations / count);
  return result;
}

PathErrors evaluate_path(const std::vector<TruePose>& truth,
                         const std::vector<EstimatedPose>& estimate,
                         const PathErrorOptions& options) {
  check_options(options);
  check_path(truth, "ground truth");
  check_path(estimate, "estimate");

  const double max_gap = options.max_gap > 0.0 ? options.max_gap : usual_max_gap(estimate);
  PathErrors errors;
  errors.lost_error = lost_error(extent_diagonal(truth));
  errors.duration = truth.back().time - truth.front().time;
  const double clipped_until = truth.front().time + options.clip * errors.duration;

  const std::vector<std::optional<double>> directions = track_directions(truth);
  std::vector<double> cartesian(truth.size(), std::numeric_limits<double>::infinity());
  std::vector<bool> is_known(truth.size(), false);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const bool is_clipped = truth[i].time < clipped_until;
    const std::optional<EstimatedPose> pose = interpolate(estimate, truth[i].time, max_gap);
    if (!is_clipped) ++errors.truth_poses;
    if (!is_clipped && !pose) ++errors.uncovered;
    if (!pose) continue;
    PathErrorSample sample = compare(truth[i], directions[i], *pose);
    sample.is_clipped = is_clipped;
    cartesian[i] = sample.cartesian;
    is_known[i] = sample.cartesian <= errors.lost_error &&
                  std::abs(sample.heading.value_or(0.0)) <= kLostHeading;
    errors.samples.push_back(sample);
  }
  if (errors.uncovered == errors.truth_poses) {
    throw Error("the estimate (" + std::to_string(estimate.front().time) + " to " +
                std::to_string(estimate.back().time) + " s) covers none of the " +
                std::to_string(errors.truth_poses) + " poses of the ground truth (" +
                std::to_string(clipped_until) + " to " + std::to_string(truth.back().time) +
                " s): their clocks have to agree");
  }
  summarize(&errors);
  errors.converged_after = converged_after(truth, is_known);
  errors.lost_share = lost_share(truth, cartesian, errors.lost_error, clipped_until);
  const double judged_from =
      truth.front().time + std::max(options.clip, kTimeToConverge) * errors.duration;
  errors.lost = lost_share(truth, cartesian, errors.lost_error, judged_from) > kMostLost;
  return errors;
}

}  // namespace pf_resampling
