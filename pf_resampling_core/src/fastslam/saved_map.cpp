// What a filter saves, and how it goes on from there.

#include "pf_resampling_core/fastslam/saved_map.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/resampling/resampling.hpp"

namespace pf_resampling {
namespace {

constexpr double kSurveyedSigma = 0.001;  // m

Eigen::Matrix2d covariance_of(const LandmarkRow& row, Eigen::Index particle) {
  Eigen::Matrix2d covariance;
  covariance << row.xx[particle], row.xy[particle], row.xy[particle], row.yy[particle];
  return covariance;
}

}  // namespace

SavedMap saved_map(FastSlam* filter, int particles) {
  if (particles < 0) {
    throw Error("map to save: " + std::to_string(particles) +
                " particles were asked for; ask for 0 or more");
  }
  const FastSlamParticles& population = filter->particles_;
  SavedMap map;
  map.association = filter->association_;
  map.pose = filter->estimate();
  map.view_range = filter->view_range_;
  map.view_bearing = filter->view_bearing_;
  map.step = filter->step_;
  map.next_id = filter->next_id_;
  map.observations_since_renewal = filter->control_.observations_since_renewal();

  const int size = static_cast<int>(population.size());
  Eigen::ArrayXi chosen = Eigen::ArrayXi::LinSpaced(size, 0, size - 1);
  Eigen::ArrayXd log_weights = population.log_weight;
  Eigen::ArrayXd weights = population.weight;
  if (particles == 0) {
    chosen.resize(0);
  } else if (particles < size) {
    Resampler resampler;
    const ResamplingResult result =
        resampler.resample(population.weight, particles, filter->stream(RandomPurpose::selection));
    chosen = result.ancestors;
    log_weights = result.log_weights;
    weights = log_weights.exp();
  }
  for (Eigen::Index i = 0; i < chosen.size(); ++i) {
    SavedParticle particle;
    particle.pose = {population.x[chosen[i]], population.y[chosen[i]],
                     population.heading[chosen[i]]};
    particle.log_weight = log_weights[i];
    particle.weight = weights[i];
    map.particles.push_back(particle);
  }

  std::vector<int> rows = filter->rows();
  std::sort(rows.begin(), rows.end(),
            [&](int a, int b) { return filter->id_of(a) < filter->id_of(b); });
  for (const int row : rows) {
    const LandmarkRow data = filter->store_.row(row);
    SavedLandmark landmark;
    if (!filter->summarize(row, &landmark.estimate)) continue;
    landmark.last_seen = filter->index_.position(row);
    map.landmarks.push_back(landmark);
    for (Eigen::Index i = 0; i < chosen.size(); ++i) {
      const Eigen::Index from = chosen[i];
      if (data.held[from] == 0) continue;
      map.particles[static_cast<std::size_t>(i)].landmarks.push_back(
          {landmark.estimate.id, Eigen::Vector2d(data.x[from], data.y[from]),
           covariance_of(data, from), data.log_odds[from]});
    }
  }
  return map;
}

SavedMap surveyed_map(const std::vector<SurveyedLandmark>& landmarks, const std::string& frame) {
  SavedMap map;
  map.frame = frame;
  map.association = DataAssociation::known;
  for (const SurveyedLandmark& surveyed : landmarks) {
    SavedLandmark landmark;
    landmark.estimate.id = surveyed.id;
    landmark.estimate.mean = landmark.last_seen = surveyed.position;
    landmark.estimate.covariance = surveyed.covariance;
    if (surveyed.covariance.isZero(0.0)) {
      landmark.estimate.covariance.diagonal().setConstant(kSurveyedSigma * kSurveyedSigma);
    }
    landmark.estimate.held = 1.0;
    landmark.estimate.log_odds = FastSlamOptions().association.largest_log_odds;
    map.landmarks.push_back(landmark);
  }
  std::stable_sort(
      map.landmarks.begin(), map.landmarks.end(),
      [](const SavedLandmark& a, const SavedLandmark& b) { return a.estimate.id < b.estimate.id; });
  if (!map.landmarks.empty()) map.next_id = map.landmarks.back().estimate.id + 1;
  check_saved_map(map);
  return map;
}

}  // namespace pf_resampling
