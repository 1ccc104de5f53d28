#include "pf_resampling_core/filters/fastslam/memory/segment.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr int kMostFits = 20;
constexpr double kFitted = 1e-4;  // of the cost, that a step promises
constexpr double kLeastFitDamping = 1e-6;
constexpr double kLargestFitDamping = 1e8;
constexpr double kTogether = 1.1;    // s
constexpr double kSureChange = 3.0;  // times the mean square of noise
constexpr double kSureTurn = 30.0;

Eigen::Index between_size(const Segment& segment) {
  return 3 * (static_cast<Eigen::Index>(segment.poses.size()) - 1);
}

Eigen::Index track_at(const Segment& segment, int track) {
  return between_size(segment) + 3 + 2 * track;
}

Pose2 pose_before(const Segment& segment, std::size_t i) {
  return i == 0 ? Pose2{} : segment.poses[i - 1];
}

double motion_scale(const Segment& segment) {
  return segment.noise.motion / std::sqrt(segment.motion_share);
}

double cost_of(const Segment& segment, const std::vector<Eigen::Matrix3d>& roots, double width) {
  double cost = 0.0;
  for (std::size_t i = 0; i < segment.motions.size(); ++i) {
    const MotionResidual r = motion_residual(segment.motions[i], roots[i], pose_before(segment, i),
                                             segment.poses[i], segment.constants);
    cost += robust_cost(r.value.squaredNorm(), width);
  }
  for (const SightingFactor& sighting : segment.sightings) {
    const SightingResidual r = sighting_residual(
        sighting, segment.noise, segment.poses[static_cast<std::size_t>(sighting.pose)],
        segment.tracks[static_cast<std::size_t>(sighting.landmark)], segment.constants);
    cost += robust_cost(r.value.squaredNorm(), width);
  }
  return cost;
}

std::vector<Eigen::Matrix3d> motion_roots(const Segment& segment) {
  std::vector<Eigen::Matrix3d> roots;
  roots.reserve(segment.motions.size());
  for (const MotionFactor& motion : segment.motions) {
    roots.push_back(motion_root(motion, motion_scale(segment)));
  }
  return roots;
}

void linearize(const Segment& segment, const std::vector<Eigen::Matrix3d>& roots, double width,
               SegmentLinearization* linear) {
  const Eigen::Index between = between_size(segment);
  const Eigen::Index size = between + segment.size();
  const Eigen::Index constants = size - kSensorConstants;
  for (std::size_t kind = 0; kind < SegmentLinearization::kKinds; ++kind) {
    linear->hessian[kind].set_zero(between, segment.size());
    linear->gradient[kind].setZero(size);
    linear->cost[kind] = 0.0;
  }
  BorderedChain& of_motions = linear->hessian[DataKind::motion];
  Eigen::VectorXd& motion_gradient = linear->gradient[DataKind::motion];
  for (std::size_t i = 0; i < segment.motions.size(); ++i) {
    const MotionResidual r = motion_residual(segment.motions[i], roots[i], pose_before(segment, i),
                                             segment.poses[i], segment.constants);
    const double squared = r.value.squaredNorm();
    const double weight = robust_weight(squared, width);
    linear->cost[DataKind::motion] += robust_cost(squared, width);
    const Eigen::Index to = 3 * static_cast<Eigen::Index>(i);
    const auto by_constants = r.by_constants;
    of_motions.add(to, to, weight * r.by_to.transpose() * r.by_to);
    of_motions.add(constants, to, weight * by_constants.transpose() * r.by_to);
    of_motions.add(constants, constants, weight * by_constants.transpose() * by_constants);
    motion_gradient.segment<3>(to).noalias() += weight * r.by_to.transpose() * r.value;
    motion_gradient.segment<kOdometryConstants>(constants).noalias() +=
        weight * by_constants.transpose() * r.value;
    if (i == 0) continue;
    of_motions.add(to - 3, to - 3, weight * r.by_from.transpose() * r.by_from);
    of_motions.add(to, to - 3, weight * r.by_to.transpose() * r.by_from);
    of_motions.add(constants, to - 3, weight * by_constants.transpose() * r.by_from);
    motion_gradient.segment<3>(to - 3).noalias() += weight * r.by_from.transpose() * r.value;
  }
  for (const SightingFactor& sighting : segment.sightings) {
    const SightingResidual r = sighting_residual(
        sighting, segment.noise, segment.poses[static_cast<std::size_t>(sighting.pose)],
        segment.tracks[static_cast<std::size_t>(sighting.landmark)], segment.constants);
    const double squared = r.value.squaredNorm();
    const double weight = robust_weight(squared, width);
    const double cost = robust_cost(squared, width);
    const Eigen::Index pose = 3 * sighting.pose;
    const Eigen::Index track = track_at(segment, sighting.landmark);
    const Eigen::Index sensor = constants + SensorConstant::range_scale;
    for (int row = 0; row < 2; ++row) {
      const std::size_t kind = row == 0 ? DataKind::range : DataKind::bearing;
      linear->cost[kind] +=
          squared > 0.0 ? cost * r.value[row] * r.value[row] / squared : 0.5 * cost;
      const Eigen::RowVector3d by_pose = r.by_pose.row(row);
      const Eigen::RowVector2d by_track = r.by_landmark.row(row);
      const Eigen::RowVector2d by_sensor = r.by_constants.row(row);
      const double value = weight * r.value[row];
      BorderedChain& hessian = linear->hessian[kind];
      Eigen::VectorXd& gradient = linear->gradient[kind];
      hessian.add(pose, pose, weight * by_pose.transpose() * by_pose);
      hessian.add(track, pose, weight * by_track.transpose() * by_pose);
      hessian.add(track, track, weight * by_track.transpose() * by_track);
      hessian.add(sensor, pose, weight * by_sensor.transpose() * by_pose);
      hessian.add(sensor, track, weight * by_sensor.transpose() * by_track);
      hessian.add(sensor, sensor, weight * by_sensor.transpose() * by_sensor);
      gradient.segment<3>(pose) += value * by_pose.transpose();
      gradient.segment<2>(track) += value * by_track.transpose();
      gradient.segment<2>(sensor) += value * by_sensor.transpose();
    }
  }
}

// Of the chain and as much of the border as `right` has; empty where that is not determined.
Eigen::VectorXd solve(const BorderedChain& matrix, double damping, const Eigen::VectorXd& right) {
  ChainCholesky chain;
  if (!chain.compute(matrix, damping)) return {};
  const Eigen::Index between = matrix.diagonal.cols();
  const Eigen::Index rest = right.size() - between;
  Eigen::VectorXd solution(right.size());
  solution.head(between) = chain.solve(right.head(between));
  if (rest == 0) return solution;
  const Eigen::MatrixXd border = matrix.border.topRows(rest);
  const Eigen::MatrixXd follow = chain.solve(border.transpose());
  Eigen::MatrixXd corner = matrix.corner.topLeftCorner(rest, rest);
  corner.diagonal() *= 1.0 + damping;
  corner.noalias() -= border * follow;
  const Eigen::LLT<Eigen::MatrixXd> root(corner);
  if (root.info() != Eigen::Success) return {};
  solution.tail(rest) = root.solve(right.tail(rest) - border * solution.head(between));
  solution.head(between) -= follow * solution.tail(rest);
  return solution;
}

void move(const Eigen::VectorXd& step, Segment* segment) {
  for (std::size_t i = 0; i < segment->poses.size(); ++i) {
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(i);
    if (at + 3 > step.size()) return;
    Pose2& pose = segment->poses[i];
    pose = {pose.x + step[at], pose.y + step[at + 1], wrap_angle(pose.heading + step[at + 2])};
  }
  for (std::size_t k = 0; k < segment->tracks.size(); ++k) {
    segment->tracks[k] += step.segment<2>(track_at(*segment, static_cast<int>(k)));
  }
}

}  // namespace

double Segment::duration() const {
  double sum = 0.0;
  for (const MotionFactor& motion : motions) sum += motion.duration();
  return sum;
}

void compare_with_noise(std::vector<MotionFactor>* motions) {
  const auto velocity = [](const MotionFactor& motion) -> Eigen::Array3d {
    return Eigen::Array3d(motion.mean.x, motion.mean.y, motion.mean.heading) / motion.duration();
  };
  const auto noise_of_velocity = [](const MotionFactor& motion) -> Eigen::Array3d {
    return motion.covariance.diagonal().array() / std::pow(motion.duration(), 2);
  };
  Eigen::Array3d changes = Eigen::Array3d::Zero();
  Eigen::Array3d noise = Eigen::Array3d::Zero();
  double turns = 0.0;
  double variance = 0.0;
  double turn = 0.0;  // within the present second
  double time = 0.0;  // s
  for (std::size_t i = 0; i < motions->size(); ++i) {
    const MotionFactor& motion = (*motions)[i];
    turn += motion.mean.heading;
    time += motion.duration();
    variance += motion.covariance(2, 2);
    if (time > kTogether || i + 1 == motions->size()) {
      turns += turn * turn;
      turn = time = 0.0;
    }
    if (i < 2 || motion.duration() + (*motions)[i - 1].duration() > 2.0 * kTogether) continue;
    changes += (velocity(motion) - velocity((*motions)[i - 2])).square();
    noise += noise_of_velocity(motion) + noise_of_velocity((*motions)[i - 2]);
  }
  const double along = changes[0] > kSureChange * noise[0] ? 1.0 : 0.0;
  const double turning = changes[2] > kSureChange * noise[2] ? 1.0 : 0.0;
  for (MotionFactor& motion : *motions) {
    motion.turn_share = turns > kSureTurn * variance ? 1.0 : 0.0;
    motion.sensitivity.col(SensorConstant::delay).array() *=
        Eigen::Array3d(along, turning, turning);
  }
}

void initialize(Segment* segment) {
  segment->poses.clear();
  Pose2 pose;
  for (const MotionFactor& motion : segment->motions) {
    pose = compose(pose, corrected_motion(motion, segment->constants));
    segment->poses.push_back(pose);
  }
  segment->tracks.resize(segment->landmarks.size());
  for (std::size_t s = segment->sightings.size(); s-- > 0;) {  // the first has the last word
    const SightingFactor& sighting = segment->sightings[s];
    const Pose2 eye =
        compose(segment->poses[static_cast<std::size_t>(sighting.pose)], sighting.sensor);
    segment->tracks[static_cast<std::size_t>(sighting.landmark)] =
        place_seen(eye, sighting.range / (1.0 + segment->constants[SensorConstant::range_scale]),
                   sighting.bearing - segment->constants[SensorConstant::bearing_bias]);
  }
}

bool fit(FreePart free, double robust_width, Segment* segment) {
  const Eigen::Index between = between_size(*segment);
  const Eigen::Index rest = free == FreePart::between ? 0 : segment->size() - kSensorConstants;
  if (between + rest == 0) return true;
  const std::vector<Eigen::Matrix3d> roots = motion_roots(*segment);
  SegmentLinearization linear;
  double cost = cost_of(*segment, roots, robust_width);
  double damping = 0.0;
  for (int i = 0; i < kMostFits; ++i) {
    linearize(*segment, roots, robust_width, &linear);
    const BorderedChain hessian = linear.whole_hessian();
    const Eigen::VectorXd gradient = linear.whole_gradient().head(between + rest);
    if (!gradient.allFinite()) return false;
    for (bool is_better = false; !is_better;) {
      if (damping > kLargestFitDamping) return true;
      const Eigen::VectorXd step = -solve(hessian, damping, gradient);
      if (step.size() > 0) {
        const double promise = -0.5 * step.dot(gradient);
        Segment moved = *segment;
        move(step, &moved);
        const double moved_cost = cost_of(moved, roots, robust_width);
        is_better = moved_cost <= cost;
        if (is_better) {
          segment->poses = std::move(moved.poses);
          segment->tracks = std::move(moved.tracks);
          cost = moved_cost;
        }
        if (promise < kFitted) return true;
      }
      damping = is_better ? 0.1 * damping : std::max(kLeastFitDamping, 10.0 * damping);
      if (damping < kLeastFitDamping) damping = 0.0;
    }
  }
  return std::isfinite(cost);
}

bool condense(double robust_width, Segment* segment, SegmentLinearization* linearization) {
  segment->robust_width = robust_width;
  segment->log_noise = 0.0;
  for (const SightingFactor& sighting : segment->sightings) {
    segment->log_noise += 0.5 * std::log(sighting.range_variance * sighting.bearing_variance);
  }
  const Eigen::Index between = between_size(*segment);
  const Eigen::Index size = segment->size();
  SegmentLinearization own_linearization;
  SegmentLinearization& linear = linearization == nullptr ? own_linearization : *linearization;
  linearize(*segment, motion_roots(*segment), robust_width, &linear);
  const BorderedChain whole = linear.whole_hessian();
  ChainCholesky root;
  if (!root.compute(whole)) return false;
  CondensedSegment condensed;
  condensed.between = -root.solve(whole.border.transpose());
  condensed.log_determinant = root.log_determinant();
  const Eigen::MatrixXd& follow = condensed.between;
  for (std::size_t kind = 0; kind < SegmentLinearization::kKinds; ++kind) {
    const BorderedChain& hessian = linear.hessian[kind];
    Eigen::MatrixXd half = 0.5 * hessian.chain_times(follow) + hessian.border.transpose();
    Eigen::MatrixXd information = hessian.corner.selfadjointView<Eigen::Lower>();
    information.noalias() += follow.transpose() * half;
    information.noalias() += half.transpose() * follow;
    const Eigen::VectorXd gradient =
        linear.gradient[kind].tail(size) + follow.transpose() * linear.gradient[kind].head(between);
    if (!information.allFinite() || !gradient.allFinite()) return false;
    condensed.information[kind] = std::move(information);
    condensed.gradient[kind] = gradient;
    condensed.cost[kind] = linear.cost[kind];
  }
  segment->condensed = std::make_shared<const CondensedSegment>(std::move(condensed));
  return true;
}

std::shared_ptr<const CondensedSegment> condensed_belief(const Eigen::MatrixXd& information,
                                                         const Eigen::VectorXd& gradient) {
  CondensedSegment condensed;
  condensed.information[DataKind::given] = information;
  condensed.gradient[DataKind::given] = gradient;
  condensed.between.resize(0, gradient.size());
  return std::make_shared<const CondensedSegment>(std::move(condensed));
}

void add_sighting(int landmark, SightingFactor sighting, Segment* segment) {
  std::vector<int>& landmarks = segment->landmarks;
  const auto track = std::find(landmarks.begin(), landmarks.end(), landmark);
  sighting.landmark = static_cast<int>(track - landmarks.begin());
  if (track == landmarks.end()) landmarks.push_back(landmark);
  segment->sightings.push_back(sighting);
}

std::pair<Segment, Segment> cut(std::size_t motions, const Segment& segment) {
  std::pair<Segment, Segment> parts;
  const auto middle = segment.motions.begin() + static_cast<std::ptrdiff_t>(motions);
  parts.first.motions.assign(segment.motions.begin(), middle);
  parts.second.motions.assign(middle, segment.motions.end());
  for (SightingFactor sighting : segment.sightings) {
    const bool is_first = static_cast<std::size_t>(sighting.pose) < motions;
    Segment& part = is_first ? parts.first : parts.second;
    if (!is_first) sighting.pose -= static_cast<int>(motions);
    add_sighting(segment.landmarks[static_cast<std::size_t>(sighting.landmark)], sighting, &part);
  }
  for (SightingFactor sighting : segment.unassigned) {
    const bool is_first = static_cast<std::size_t>(sighting.pose) < motions;
    if (!is_first) sighting.pose -= static_cast<int>(motions);
    (is_first ? parts.first : parts.second).unassigned.push_back(sighting);
  }
  return parts;
}

Segment without(const std::vector<std::size_t>& sightings, const Segment& segment) {
  Segment left = segment;
  left.sightings.clear();
  left.landmarks.clear();
  left.tracks.clear();
  std::vector<int> new_track(segment.landmarks.size(), -1);
  for (std::size_t i = 0; i < segment.sightings.size(); ++i) {
    if (std::binary_search(sightings.begin(), sightings.end(), i)) continue;
    SightingFactor sighting = segment.sightings[i];
    const std::size_t track = static_cast<std::size_t>(sighting.landmark);
    if (new_track[track] < 0) {
      new_track[track] = static_cast<int>(left.landmarks.size());
      left.landmarks.push_back(segment.landmarks[track]);
      if (!segment.tracks.empty()) left.tracks.push_back(segment.tracks[track]);
    }
    sighting.landmark = new_track[track];
    left.sightings.push_back(sighting);
  }
  return left;
}

}  // namespace pf_resampling
