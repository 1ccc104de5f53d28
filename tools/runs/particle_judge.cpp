#include "tools/runs/particle_judge.hpp"

#include <algorithm>

#include "pf_resampling_core/evaluation/particle_errors.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"

namespace pf_resampling {
namespace {

const char* const kTruth = "/ground_truth";
const char* const kTrueLandmarks = "/ground_truth_landmarks";

}  // namespace

ParticleJudge::ParticleJudge(const rosbag::Bag& bag, const std::string& odom, bool frame_is_given) {
  if (!has_topic(bag, kTruth)) return;
  truth_ = read_truth(bag, kTruth);
  if (truth_.empty()) return;
  max_gap_ = usual_max_gap(truth_);
  if (frame_is_given) {
    to_filter_ = Pose2{};
  } else if (!has_topic(bag, odom)) {
    return;  // it is on /tf: the filter's frame is not known
  } else {
    const std::vector<EstimatedPose> odometry = read_odometry(bag, odom).poses;
    const auto first =
        std::find_if(odometry.begin(), odometry.end(),
                     [&](const EstimatedPose& pose) { return pose.time >= truth_.front().time; });
    if (first == odometry.end()) return;
    const auto there = interpolate(truth_, first->time, max_gap_);
    if (!there || !there->heading) return;
    // The filter begins at nothing; until the truth begins it is where odometry has brought it.
    const Pose2 in_filter = relative(odometry.front().pose, first->pose);
    to_filter_ = compose(in_filter, relative({there->x, there->y, *there->heading}, {}));
  }
  landmarks_ = moved(read_landmark_map(bag, kTrueLandmarks).value_or(std::vector<PointLandmark>()),
                     *to_filter_);
  if (!landmarks_.empty()) gate_ = usual_gate(landmarks_);
}

std::optional<ParticleErrors> ParticleJudge::judge(ros::Time stamp, FastSlam* filter) const {
  const auto there = interpolate(truth_, stamp.toSec(), max_gap_);
  if (!there) return std::nullopt;
  const FastSlamParticles& particles = filter->particles();
  ParticleErrors errors;
  errors.header.stamp = stamp;
  errors.position_rms = position_error(moved(Eigen::Vector2d(there->x, there->y), *to_filter_),
                                       particles.x, particles.y);
  FeatureError features;
  for (const int row : filter->rows()) {
    const LandmarkRow data = filter->store().row(row);
    const PointLandmark* truth = truth_of(filter, row, data.x, data.y, data.held);
    if (truth == nullptr) continue;
    features.add(truth->position, data.x, data.y, data.held, static_cast<int>(particles.size()));
  }
  errors.feature_rms = features.rms();
  errors.features = static_cast<std::uint64_t>(features.count());
  return errors;
}

// By id, or, where these are the filter's own, the nearest to where the particles have it.
const PointLandmark* ParticleJudge::truth_of(FastSlam* filter, int row, const double* x,
                                             const double* y, const std::uint8_t* held) const {
  if (filter->association() == DataAssociation::known) {
    const auto found = std::find_if(
        landmarks_.begin(), landmarks_.end(),
        [&](const PointLandmark& landmark) { return landmark.id == filter->id_of(row); });
    return found == landmarks_.end() ? nullptr : &*found;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double holders = 0.0;
  for (Eigen::Index i = 0; i < filter->particles().size(); ++i) {
    if (held[i] == 0) continue;
    mean += Eigen::Vector2d(x[i], y[i]);
    holders += 1.0;
  }
  if (!(holders > 0.0)) return nullptr;
  mean /= holders;
  const PointLandmark* nearest = nullptr;
  double distance = gate_;
  for (const PointLandmark& landmark : landmarks_) {
    const double candidate = (landmark.position - mean).norm();
    if (candidate < distance) {
      distance = candidate;
      nearest = &landmark;
    }
  }
  return nearest;
}

}  // namespace pf_resampling
