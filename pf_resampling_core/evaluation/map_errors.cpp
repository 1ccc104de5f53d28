#include "pf_resampling_core/evaluation/map_errors.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"

namespace pf_resampling {
namespace {

using Points = std::vector<Eigen::Vector2d>;

constexpr int kMostMatchingRounds = 20;  // of matching and aligning in turn

Pose2 alignment_of(const std::vector<PointLandmark>& estimated,
                   const std::vector<PointLandmark>& truth,
                   const std::vector<LandmarkMatch>& matches) {
  Points from, to;
  for (const LandmarkMatch& match : matches) {
    from.push_back(estimated[match.estimated].position);
    to.push_back(truth[match.truth].position);
  }
  return align_points(from, to);
}

double rms_of(const std::vector<PointLandmark>& estimated, const std::vector<PointLandmark>& truth,
              const std::vector<LandmarkMatch>& matches, const Pose2& alignment) {
  double squares = 0.0;
  for (const LandmarkMatch& match : matches) {
    squares += (moved(estimated[match.estimated].position, alignment) - truth[match.truth].position)
                   .squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(matches.size()));
}

bool ids_make_sense(const std::vector<PointLandmark>& estimated,
                    const std::vector<PointLandmark>& truth, double gate) {
  const std::vector<LandmarkMatch> matches = match_by_id(estimated, truth);
  if (matches.empty() || 2 * matches.size() < estimated.size()) return false;
  const Pose2 alignment = alignment_of(estimated, truth, matches);
  std::size_t near = 0;
  for (const LandmarkMatch& match : matches) {
    const Eigen::Vector2d position = moved(estimated[match.estimated].position, alignment);
    if ((position - truth[match.truth].position).norm() <= gate) ++near;
  }
  return 2 * near >= matches.size();
}

/// Matches by nearest in the first frame, aligns the matched, and again until nothing changes.
std::vector<LandmarkMatch> match_and_align(const std::vector<PointLandmark>& estimated,
                                           const std::vector<PointLandmark>& truth, double gate,
                                           Pose2 alignment) {
  std::vector<LandmarkMatch> matches = match_by_nearest(moved(estimated, alignment), truth, gate);
  for (int round = 0; round < kMostMatchingRounds && matches.size() >= 2; ++round) {
    alignment = alignment_of(estimated, truth, matches);
    std::vector<LandmarkMatch> next = match_by_nearest(moved(estimated, alignment), truth, gate);
    if (next.size() < matches.size()) break;
    const bool is_same = std::equal(next.begin(), next.end(), matches.begin(), matches.end(),
                                    [](const LandmarkMatch& a, const LandmarkMatch& b) {
                                      return a.estimated == b.estimated && a.truth == b.truth;
                                    });
    matches = std::move(next);
    if (is_same) break;
  }
  return matches;
}

/// Consistency of the matched landmarks with the covariances they state.
void add_consistency(const std::vector<PointLandmark>& estimated,
                     const std::vector<PointLandmark>& truth, MapErrors* errors) {
  int inside = 0;
  double sum = 0.0;
  bool states_covariance = false;
  for (const LandmarkMatch& match : errors->matches) {
    const PointLandmark& estimate = estimated[match.estimated];
    const PointLandmark& real = truth[match.truth];
    states_covariance = states_covariance || estimate.covariance.trace() > 0.0;
    const Eigen::Matrix2d covariance = estimate.covariance + real.covariance;
    const Eigen::LLT<Eigen::Matrix2d> factor(covariance);
    const Eigen::Vector2d error = estimate.position - real.position;
    double squared = std::numeric_limits<double>::infinity();
    if (factor.info() == Eigen::Success && factor.matrixLLT().diagonal().minCoeff() > 0.0) {
      squared = error.dot(factor.solve(error));
    }
    sum += squared;
    if (squared <= kChiSquare95TwoDof) ++inside;
  }
  if (!states_covariance) return;
  errors->coverage95 = static_cast<double>(inside) / errors->matched;
  errors->normalized_error = sum / errors->matched;
}

}  // namespace

void check_map(const std::vector<PointLandmark>& map, const char* name) {
  for (const PointLandmark& landmark : map) {
    if (landmark.position.allFinite() && landmark.covariance.allFinite()) continue;
    throw Error(std::string(name) + ": landmark " + std::to_string(landmark.id) + " is not finite");
  }
}

std::vector<EstimatedPose> moved(std::vector<EstimatedPose> path, const Pose2& by) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(by.heading).toRotationMatrix();
  for (EstimatedPose& pose : path) {
    pose.pose = compose(by, pose.pose);
    pose.covariance = (turn * pose.covariance * turn.transpose()).eval();
  }
  return path;
}

std::vector<PointLandmark> moved(std::vector<PointLandmark> map, const Pose2& by) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(by.heading).toRotationMatrix();
  for (PointLandmark& landmark : map) {
    landmark.position = moved(landmark.position, by);
    landmark.covariance = (turn * landmark.covariance * turn.transpose()).eval();
  }
  return map;
}

AlignedPathErrors evaluate_aligned_path(const std::vector<TruePose>& truth,
                                        const std::vector<EstimatedPose>& estimate,
                                        const PathErrorOptions& options) {
  check_options(options);
  check_path(truth, "ground truth");
  check_path(estimate, "estimate");
  const double max_gap = options.max_gap > 0.0 ? options.max_gap : usual_max_gap(estimate);
  const double begin = truth.front().time + options.clip * (truth.back().time - truth.front().time);
  Points from, to;
  for (const TruePose& pose : truth) {
    if (pose.time < begin) continue;
    const std::optional<EstimatedPose> there = interpolate(estimate, pose.time, max_gap);
    if (!there) continue;
    from.emplace_back(there->pose.x, there->pose.y);
    to.emplace_back(pose.x, pose.y);
  }
  if (from.empty()) throw Error("the estimate covers no pose of the ground truth");
  AlignedPathErrors result;
  result.alignment = align_points(from, to);
  std::vector<double> distances;
  for (std::size_t i = 0; i < from.size(); ++i) {
    distances.push_back((moved(from[i], result.alignment) - to[i]).norm());
  }
  result.cartesian = absolute_errors(distances);
  return result;
}

std::vector<LandmarkMatch> match_by_id(const std::vector<PointLandmark>& estimated,
                                       const std::vector<PointLandmark>& truth) {
  std::map<std::int32_t, std::size_t> by_id;
  for (std::size_t i = 0; i < truth.size(); ++i) by_id.emplace(truth[i].id, i);
  std::vector<LandmarkMatch> matches;
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    const auto found = by_id.find(estimated[i].id);
    if (found == by_id.end()) continue;
    matches.push_back({i, found->second});
    by_id.erase(found);
  }
  return matches;
}

std::vector<LandmarkMatch> match_by_nearest(const std::vector<PointLandmark>& estimated,
                                            const std::vector<PointLandmark>& truth, double gate) {
  struct Pair {
    double distance;
    LandmarkMatch match;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    for (std::size_t j = 0; j < truth.size(); ++j) {
      const double distance = (estimated[i].position - truth[j].position).norm();
      if (distance <= gate) pairs.push_back({distance, {i, j}});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  std::vector<bool> estimated_taken(estimated.size()), truth_taken(truth.size());
  std::vector<LandmarkMatch> matches;
  for (const Pair& pair : pairs) {
    const LandmarkMatch& match = pair.match;
    if (estimated_taken[match.estimated] || truth_taken[match.truth]) continue;
    estimated_taken[match.estimated] = true;
    truth_taken[match.truth] = true;
    matches.push_back(match);
  }
  std::sort(matches.begin(), matches.end(), [](const LandmarkMatch& a, const LandmarkMatch& b) {
    return a.estimated < b.estimated;
  });
  return matches;
}

double usual_gate(const std::vector<PointLandmark>& truth) {
  constexpr double kLeast = 0.5;  // m
  if (truth.size() < 2) return kLeast;
  std::vector<double> distances;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < truth.size(); ++j) {
      if (i == j) continue;
      nearest = std::min(nearest, (truth[i].position - truth[j].position).norm());
    }
    distances.push_back(nearest);
  }
  return std::max(kLeast, 0.5 * median(std::move(distances)));
}

MapErrors evaluate_map(const std::vector<PointLandmark>& estimated,
                       const std::vector<PointLandmark>& truth, const MapErrorOptions& options) {
  check_map(estimated, "estimated map");
  check_map(truth, "true map");
  if (truth.empty()) throw Error("the true map has no landmarks: there is nothing to compare with");
  MapErrors errors;
  errors.gate = usual_gate(truth);
  errors.matching = options.matching;
  if (errors.matching == LandmarkMatching::automatic) {
    errors.matching = ids_make_sense(estimated, truth, errors.gate) ? LandmarkMatching::id
                                                                    : LandmarkMatching::nearest;
  }
  errors.matches = errors.matching == LandmarkMatching::id
                       ? match_by_id(estimated, truth)
                       : match_and_align(estimated, truth, errors.gate, options.first_alignment);
  errors.landmarks = static_cast<int>(estimated.size());
  errors.matched = static_cast<int>(errors.matches.size());
  errors.false_landmarks = errors.landmarks - errors.matched;
  errors.missed = static_cast<int>(truth.size()) - errors.matched;
  if (errors.matched == 0) return errors;
  errors.rms = rms_of(estimated, truth, errors.matches, {});
  if (errors.matched >= 2) {
    errors.alignment = alignment_of(estimated, truth, errors.matches);
    errors.rms_aligned = rms_of(estimated, truth, errors.matches, errors.alignment);
  }
  add_consistency(estimated, truth, &errors);
  return errors;
}

}  // namespace pf_resampling
