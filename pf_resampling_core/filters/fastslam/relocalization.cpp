#include "pf_resampling_core/filters/fastslam/relocalization.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/models/point_alignment.hpp"

namespace pf_resampling {
namespace {

// rad; with a heading less certain than this, particles are not put anywhere.
constexpr double kUsableHeading = 0.3;
constexpr double kAgreement = 3.0;      // sigmas within which a sighting agrees
constexpr double kLeastAgreeing = 0.6;  // share of the sightings that have to
constexpr int kLeastLandmarksSeen = 2;  // different ones that have to be among these
constexpr std::size_t kLeastScans = 3;

std::vector<LandmarkSighting> agreeing(const std::vector<LandmarkSighting>& sightings,
                                       const Pose2& correction) {
  std::vector<LandmarkSighting> found;
  std::copy_if(sightings.begin(), sightings.end(), std::back_inserter(found),
               [&](const LandmarkSighting& sighting) {
                 const Eigen::Vector2d seen = moved(sighting.seen, correction);
                 return (seen - sighting.mapped).norm() <= kAgreement * sighting.sigma;
               });
  return found;
}

// Sightings of a landmark share most of their errors: together they count as one.
std::vector<LandmarkSighting> one_per_landmark(const std::vector<LandmarkSighting>& sightings) {
  std::map<std::int64_t, std::vector<LandmarkSighting>> by_id;
  for (const LandmarkSighting& sighting : sightings) by_id[sighting.id].push_back(sighting);
  std::vector<LandmarkSighting> means;
  for (const auto& [id, same] : by_id) {
    LandmarkSighting mean;
    mean.id = id;
    mean.sigma = 0.0;
    for (const LandmarkSighting& sighting : same) {
      const double share = 1.0 / static_cast<double>(same.size());
      mean.seen += share * sighting.seen;
      mean.mapped += share * sighting.mapped;
      mean.sigma = std::max(mean.sigma, sighting.sigma);
    }
    means.push_back(mean);
  }
  return means;
}

Pose2 correction_of(const std::vector<LandmarkSighting>& sightings) {
  std::vector<Eigen::Vector2d> seen;
  std::vector<Eigen::Vector2d> mapped;
  for (const LandmarkSighting& sighting : sightings) {
    seen.push_back(sighting.seen);
    mapped.push_back(sighting.mapped);
  }
  return align_points(seen, mapped);
}

std::optional<Pose2> best_correction(const std::vector<LandmarkSighting>& sightings) {
  std::optional<Pose2> best;
  std::size_t most = 0;
  for (std::size_t a = 0; a < sightings.size(); ++a) {
    for (std::size_t b = a + 1; b < sightings.size(); ++b) {
      const LandmarkSighting& first = sightings[a];
      const LandmarkSighting& second = sightings[b];
      if (first.id == second.id) continue;
      const double tolerance = kAgreement * std::hypot(first.sigma, second.sigma);
      const double apart = (first.mapped - second.mapped).norm();
      if (std::abs((first.seen - second.seen).norm() - apart) > tolerance) continue;
      const Pose2 correction = correction_of({first, second});
      const std::size_t agree = agreeing(sightings, correction).size();
      if (agree > most) {
        most = agree;
        best = correction;
      }
    }
  }
  return best;
}

// Of the belief after the correction: of landmarks with independent errors, about their centre.
PoseEstimate corrected(const Pose2& belief, const Pose2& correction,
                       const std::vector<LandmarkSighting>& landmarks) {
  const double count = static_cast<double>(landmarks.size());
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const LandmarkSighting& landmark : landmarks) centre += landmark.mapped / count;
  double variance = 0.0;
  double moment = 0.0;
  for (const LandmarkSighting& landmark : landmarks) {
    variance = std::max({variance, landmark.sigma * landmark.sigma,
                         (moved(landmark.seen, correction) - landmark.mapped).squaredNorm()});
    moment += (landmark.mapped - centre).squaredNorm();
  }
  PoseEstimate pose;
  pose.mean = compose(correction, belief);
  const Eigen::Vector3d turn(-(pose.mean.y - centre.y()), pose.mean.x - centre.x(), 1.0);
  pose.covariance = turn * turn.transpose();  // symmetric to the bit before it is scaled
  pose.covariance *= variance / moment;
  pose.covariance(0, 0) += variance / count;
  pose.covariance(1, 1) += variance / count;
  return pose;
}

}  // namespace

void RecentSightings::forget_before(std::int64_t stamp) {
  std::size_t gone = 0;
  while (gone < sightings_.size() &&
         (sightings_.size() - gone > most_ || stamp - sightings_[gone].stamp > window_)) {
    ++gone;
  }
  sightings_.erase(sightings_.begin(), sightings_.begin() + static_cast<std::ptrdiff_t>(gone));
}

void RecentSightings::move(const Pose2& correction) {
  for (LandmarkSighting& sighting : sightings_) sighting.seen = moved(sighting.seen, correction);
}

bool RecentSightings::are_of_several_scans() const {
  std::set<std::int64_t> scans;
  for (const LandmarkSighting& sighting : sightings_) scans.insert(sighting.stamp);
  return scans.size() >= kLeastScans;
}

std::optional<PoseEstimate> relocalize(const std::vector<LandmarkSighting>& sightings,
                                       const Pose2& belief) {
  const std::optional<Pose2> best = best_correction(sightings);
  if (!best) return std::nullopt;
  const std::vector<LandmarkSighting> agree = agreeing(sightings, *best);
  const std::vector<LandmarkSighting> landmarks = one_per_landmark(agree);
  if (static_cast<double>(agree.size()) < kLeastAgreeing * static_cast<double>(sightings.size()) ||
      static_cast<int>(landmarks.size()) < kLeastLandmarksSeen) {
    return std::nullopt;
  }
  const PoseEstimate pose = corrected(belief, correction_of(landmarks), landmarks);
  const double heading_variance = pose.covariance(2, 2);
  if (!(heading_variance < kUsableHeading * kUsableHeading)) return std::nullopt;
  return pose;
}

}  // namespace pf_resampling
