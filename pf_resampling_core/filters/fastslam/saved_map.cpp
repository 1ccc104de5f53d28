// What a filter saves, and how it goes on from there.

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {
namespace {

// A landmark that less of the weight holds is no part of the map that particles share.
constexpr double kHeldEnough = 0.5;

// Of what was computed the halves differ by rounding; what differs by more stays as it is.
Eigen::Matrix3d without_rounding(const Eigen::Matrix3d& covariance) {
  constexpr double kRounding = 1e-6;
  const Eigen::Matrix3d symmetric = covariance.selfadjointView<Eigen::Lower>();
  const double difference = (symmetric - covariance).cwiseAbs().maxCoeff();
  return difference <= kRounding * covariance.cwiseAbs().maxCoeff() ? symmetric : covariance;
}

// Rows `chosen` of every column.
FastSlamParticles rows_of(const FastSlamParticles& particles, const Eigen::ArrayXi& chosen) {
  FastSlamParticles rows = particles;
  FastSlamParticles::for_each_column(rows, [&](const char*, auto& column) {
    const auto all = column;
    column.resize(chosen.size());
    for (Eigen::Index i = 0; i < chosen.size(); ++i) column[i] = all[chosen[i]];
  });
  return rows;
}

}  // namespace

SavedMap saved_map(FastSlam* filter, int particles) {
  const FastSlamParticles& population = filter->particles_;
  SavedMap map;
  // Left open by load() if there are ids.
  const bool is_open = filter->association_ == DataAssociation::automatic && filter->has_landmarks_;
  map.association = is_open ? DataAssociation::known : filter->association_;
  map.pose = filter->estimate();
  map.view_range = filter->view_.range;
  map.view_bearing = filter->view_.bearing;
  map.step = filter->step_;
  map.next_id = filter->next_id_;
  map.observations_since_renewal = filter->strategy_.observations_since_renewal();

  const int size = static_cast<int>(population.size());
  Eigen::ArrayXi chosen = Eigen::ArrayXi::LinSpaced(size, 0, size - 1);
  map.particles = population;
  if (particles == 0) {
    chosen.resize(0);
    map.particles = FastSlamParticles();
  } else if (particles < size) {
    Resampler resampler;
    const ResamplingResult drawn =
        resampler.resample(population.weight, particles, filter->stream(RandomPurpose::selection));
    chosen = drawn.ancestors;
    map.particles = rows_of(population, chosen);
    map.particles.log_weight = drawn.log_weights;
    map.particles.weight = map.particles.log_weight.exp();
  }
  map.particle_maps.resize(static_cast<std::size_t>(chosen.size()));
  if (chosen.size() > 0) {
    map.memory = filter->memory_.state();
    map.is_lost = filter->is_lost_;
    map.unplaced_since = filter->unplaced_since_;
  }
  map.observations_since_redraw = filter->strategy_.observations_since_redraw();

  const OdometryErrorState& errors = filter->odometry_errors_.state();
  map.odometry_errors = errors;
  map.odometry_errors.means.resize(chosen.size(), OdometryErrorEstimator::kCount);
  for (Eigen::Index i = 0; i < chosen.size(); ++i) {
    map.odometry_errors.means.row(i) = errors.means.row(chosen[i]);
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
      map.particle_maps[static_cast<std::size_t>(i)].push_back(
          {landmark.estimate.id, data.mean(from), data.covariance(from), data.log_odds[from]});
    }
  }
  return map;
}

void FastSlam::load(const SavedMap& map) {
  check_saved_map(map);
  const bool ids_are_known = map.association == DataAssociation::known;
  if (options_.association.method == DataAssociation::known && !ids_are_known &&
      !map.landmarks.empty()) {
    throw Error(
        "map to load: its landmarks are numbered as they were discovered (" +
        to_string(map.association) +
        "), so they have no ids that association/method known could use; set it to automatic");
  }
  const bool has_particles = map.particles.size() > 0;
  const int count = has_particles ? static_cast<int>(map.particles.size()) : options_.particles;
  check_map_size(map.landmarks.size(), std::max(count, options_.particles), options_.map);
  FastSlam loaded(options_, seed_);
  loaded.take_map(map);
  *this = std::move(loaded);
}

// As after construction. Every particle gets its own landmarks, or all those that most of the
// weight holds.
void FastSlam::take_map(const SavedMap& map) {
  const bool ids_are_known = map.association == DataAssociation::known;
  const bool has_particles = map.particles.size() > 0;
  const bool is_shared = options_.map.frozen || !has_particles;
  const int count = has_particles ? static_cast<int>(map.particles.size()) : options_.particles;
  store_ = LandmarkStore(count);
  std::unordered_map<std::int64_t, LandmarkRow> rows;
  for (std::size_t i = 0; i < map.particle_maps.size() && !is_shared; ++i) {
    for (const ParticleLandmark& landmark : map.particle_maps[i]) rows.try_emplace(landmark.id);
  }
  for (const SavedLandmark& landmark : map.landmarks) {
    const LandmarkEstimate& estimate = landmark.estimate;
    if (is_shared ? estimate.held < kHeldEnough : rows.count(estimate.id) == 0) continue;
    const int row = store_.add(estimate.id);
    index_.place(row, is_shared ? estimate.mean : landmark.last_seen);
    if (ids_are_known) row_of_id_[estimate.id] = row;
    ++status_.landmarks;
    rows[estimate.id] = store_.row(row);
    for (int i = 0; i < count && is_shared; ++i) {
      rows[estimate.id].put(i, estimate.mean, estimate.covariance, estimate.log_odds);
    }
  }
  for (std::size_t i = 0; i < map.particle_maps.size() && !is_shared; ++i) {
    for (const ParticleLandmark& landmark : map.particle_maps[i]) {
      rows.at(landmark.id)
          .put(static_cast<Eigen::Index>(i), landmark.mean, landmark.covariance, landmark.log_odds);
    }
  }
  has_landmarks_ = status_.landmarks > 0;
  next_id_ = map.next_id;
  if (!map.landmarks.empty()) next_id_ = std::max(next_id_, map.landmarks.back().estimate.id + 1);
  step_ = map.step;
  view_ = {map.view_range, map.view_bearing};
  strategy_.resume(map.observations_since_renewal, map.observations_since_redraw);
  // Of a map with ids alone the first observations decide whether these are used.
  const bool leaves_open = is_shared && ids_are_known;
  if (association_ == DataAssociation::automatic && !leaves_open) association_ = map.association;
  if (has_particles) {
    take_particles(map);
  } else {
    set_poses(map.pose);
  }
}

void FastSlam::take_particles(const SavedMap& map) {
  const int saved = static_cast<int>(map.particles.size());
  particles_ = map.particles;
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(saved, 0, saved - 1);
  ancestry_.start(saved);
  odometry_errors_.start(options_.odometry_errors, saved);
  odometry_errors_.resume(map.odometry_errors);
  memory_.resume(map.memory);
  is_lost_ = map.is_lost;
  unplaced_since_ = map.unplaced_since;
  if (saved == options_.particles) return;
  draw_population(options_.particles);
  ancestry_.start(options_.particles);
}

void FastSlam::begin_drive() {
  unplaced_since_ = memory_.state().time;
}

void FastSlam::set_poses(const PoseEstimate& poses) {
  const Pose2 mean = {poses.mean.x, poses.mean.y, wrap_angle(poses.mean.heading)};
  const Eigen::Matrix3d covariance = without_rounding(poses.covariance);
  std::string fault = map_checks::fault_of_pose(mean);
  if (fault.empty()) fault = map_checks::fault_of_pose_covariance(covariance);
  if (!fault.empty())
    throw Error("poses to set: " + fault + "; give a position and its covariance");
  ++step_;  // for a draw of its own
  sightings_.clear();
  paths_.clear();
  memory_.forget_drive();
  if (!is_placed()) unplaced_since_ = memory_.state().time;
  draw_poses({mean, covariance}, stream(RandomPurpose::initialization), 0, particles_.size(),
             &particles_.x, &particles_.y, &particles_.heading);
  particles_.begin_anew();
}

}  // namespace pf_resampling
