#include "pf_resampling_core/filters/fastslam/memory/segment_graph.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace pf_resampling {
namespace {

constexpr double kSmallestConstantSigma = 1e-9;  // of a constant that is known
constexpr double kSmallestVariance = 1e-8;       // of odometry

}  // namespace

std::array<double, kDataKinds> weights_of(const SegmentGraph& graph, std::size_t s,
                                          const Segment& segment) {
  const auto square = [](double value) { return value * value; };
  return {square(segment.noise.range / graph.noise.range),
          square(segment.noise.bearing / graph.noise.bearing),
          square(segment.noise.motion / graph.noise.motion) * graph.motion_shares[s] /
              segment.motion_share,
          1.0};
}

SensorConstants constants_information(const SegmentGraph& graph) {
  return graph.constants_sigma.cwiseMax(kSmallestConstantSigma).array().square().inverse();
}

Segment at_estimate(const SegmentGraph& graph, std::size_t s) {
  const Segment& old = *graph.segments[s];
  const Eigen::VectorXd moved = difference(graph, s, old);
  Segment segment;
  segment.motions = old.motions;
  segment.sightings = old.sightings;
  segment.unassigned = old.unassigned;
  segment.landmarks = old.landmarks;
  segment.poses = poses_of(graph, s);
  segment.tracks = old.tracks;
  for (std::size_t k = 0; k < segment.tracks.size(); ++k) {
    segment.tracks[k] += moved.segment<2>(3 + 2 * static_cast<Eigen::Index>(k));
  }
  segment.constants = graph.constants;
  segment.noise = graph.noise;
  segment.motion_share = graph.motion_shares[s];
  return segment;
}

std::vector<Pose2> poses_of(const SegmentGraph& graph, std::size_t s) {
  const Segment& segment = *graph.segments[s];
  const Eigen::VectorXd moved = difference(graph, s, segment);
  std::vector<Pose2> poses = segment.poses;
  Eigen::VectorXd between;
  if (segment.has_data()) between = segment.condensed->between * moved;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const double share = static_cast<double>(i + 1) / static_cast<double>(poses.size());
    const Eigen::Vector3d step = segment.has_data()
                                     ? Eigen::Vector3d(between.segment<3>(3 * static_cast<int>(i)))
                                     : Eigen::Vector3d(share * moved.head<3>());
    Pose2& pose = poses[i];
    pose = {pose.x + step.x(), pose.y + step.y(), wrap_angle(pose.heading + step.z())};
  }
  poses.back() = relative(graph.bases[s], graph.bases[s + 1]);
  return poses;
}

Eigen::VectorXd difference(const SegmentGraph& graph, std::size_t s, const Segment& segment) {
  Eigen::VectorXd e(segment.size());
  const Pose2& base = graph.bases[s];
  const Pose2 end = relative(base, graph.bases[s + 1]);
  const Pose2& was = segment.poses.back();
  e.head<3>() << end.x - was.x, end.y - was.y, wrap_angle(end.heading - was.heading);
  const double cosine = std::cos(base.heading);
  const double sine = std::sin(base.heading);
  for (std::size_t k = 0; k < segment.tracks.size(); ++k) {
    const Eigen::Vector2d& landmark =
        graph.landmarks[static_cast<std::size_t>(segment.landmarks[k])];
    const double dx = landmark.x() - base.x;
    const double dy = landmark.y() - base.y;
    const Eigen::Index at = 3 + 2 * static_cast<Eigen::Index>(k);
    e[at] = cosine * dx + sine * dy - segment.tracks[k].x();
    e[at + 1] = -sine * dx + cosine * dy - segment.tracks[k].y();
  }
  e.tail<kSensorConstants>() = graph.constants - segment.constants;
  return e;
}

double OdometryError::square(const Eigen::Matrix3d& more) const {
  return value.dot((covariance + more).llt().solve(value));
}

OdometryError odometry_error(const SegmentGraph& graph, std::size_t first, std::size_t end) {
  OdometryError error;
  error.covariance = kSmallestVariance * Eigen::Matrix3d::Identity();
  Pose2 reached;
  for (std::size_t s = first; s < end; ++s) {
    if (!graph.segments[s]->has_data()) return {};
    for (const MotionFactor& motion : graph.segments[s]->motions) {
      const Pose2 step = corrected_motion(motion, graph.constants);
      const Eigen::Matrix3d by_past = by_first(reached, step);
      const Eigen::Matrix3d turn = by_second(reached);
      const auto add = [&](const Eigen::Matrix3d& of_step, Eigen::Matrix3d* covariance) {
        *covariance =
            by_past * *covariance * by_past.transpose() + turn * of_step * turn.transpose();
      };
      add(graph.noise.motion * graph.noise.motion * motion.covariance, &error.covariance);
      add(motion.slip_covariance, &error.slip_covariance);
      reached = compose(reached, step);
    }
  }
  const Pose2 driven = relative(graph.bases[first], graph.bases[end]);
  error.value << driven.x - reached.x, driven.y - reached.y,
      wrap_angle(driven.heading - reached.heading);
  return error;
}

double slip_square(const SegmentGraph& graph, std::size_t s) {
  return odometry_error(graph, s, s + 1).square(Eigen::Matrix3d::Zero());
}

}  // namespace pf_resampling
