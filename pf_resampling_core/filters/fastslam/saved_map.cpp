// What a filter saves, and how it goes on from there.

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/weights.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

namespace pf_resampling {
namespace {

// A landmark that less of the weight holds is no part of the map that particles share.
constexpr double kBelieved = 0.5;

Eigen::Matrix2d covariance_of(const LandmarkRow& row, Eigen::Index particle) {
  Eigen::Matrix2d covariance;
  covariance << row.xx[particle], row.xy[particle], row.xy[particle], row.yy[particle];
  return covariance;
}

void put(std::int64_t particle, const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance,
         double log_odds, const LandmarkRow& row) {
  row.x[particle] = mean.x();
  row.y[particle] = mean.y();
  row.xx[particle] = covariance(0, 0);
  row.xy[particle] = covariance(0, 1);
  row.yy[particle] = covariance(1, 1);
  row.log_odds[particle] = log_odds;
  row.held[particle] = 1;
}

// Position of each particle's landmarks in the map's list, particle by particle.
std::vector<std::size_t> numbers_in_map(const SavedMap& map) {
  std::vector<std::size_t> numbers;
  for (const SavedParticle& particle : map.particles) {
    std::size_t number = 0;
    for (const ParticleLandmark& landmark : particle.landmarks) {
      while (map.landmarks[number].estimate.id != landmark.id) ++number;
      numbers.push_back(number);
    }
  }
  return numbers;
}

}  // namespace

SavedMap saved_map(FastSlam* filter, int particles) {
  if (particles < 0) {
    throw Error("map to save: " + std::to_string(particles) +
                " particles were asked for; ask for 0 or more");
  }
  const FastSlamParticles& population = filter->particles_;
  SavedMap map;
  // Left open by load() if there are ids.
  const bool is_open = filter->association_ == DataAssociation::automatic && filter->has_landmarks_;
  map.association = is_open ? DataAssociation::known : filter->association_;
  map.pose = filter->estimate();
  map.view_range = filter->view_range_;
  map.view_bearing = filter->view_bearing_;
  map.step = filter->step_;
  map.next_id = filter->next_id_;
  map.observations_since_renewal = filter->strategy_.observations_since_renewal();

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
      map.particles[static_cast<std::size_t>(i)].landmarks.push_back(
          {landmark.estimate.id, Eigen::Vector2d(data.x[from], data.y[from]),
           covariance_of(data, from), data.log_odds[from]});
    }
  }
  return map;
}

void FastSlam::load(const SavedMap& map) {
  check_saved_map(map);
  const bool ids_are_known = map.association == DataAssociation::known;
  if (options_.association.method == DataAssociation::known && !ids_are_known &&
      !map.landmarks.empty()) {
    throw Error("map to load: its landmarks are numbered as they were discovered (" +
                to_string(map.association) +
                "), but association/method is known; set it to automatic");
  }
  const int saved = static_cast<int>(map.particles.size());
  const int count = saved > 0 ? saved : options_.particles;
  // Whether all particles get the same map.
  const bool is_shared = options_.map.frozen || saved == 0;
  const std::vector<std::size_t> numbers =
      is_shared ? std::vector<std::size_t>() : numbers_in_map(map);
  std::vector<std::uint8_t> is_wanted(map.landmarks.size(), 0);
  for (const std::size_t number : numbers) is_wanted[number] = 1;

  LandmarkStore store(count);
  LandmarkIndex index;
  std::unordered_map<std::int64_t, int> row_of_id;
  std::vector<LandmarkRow> rows(map.landmarks.size());
  for (std::size_t k = 0; k < map.landmarks.size(); ++k) {
    const LandmarkEstimate& estimate = map.landmarks[k].estimate;
    if (is_shared) is_wanted[k] = estimate.held >= kBelieved ? 1 : 0;
    if (is_wanted[k] == 0) continue;
    const int row = store.add(estimate.id);
    rows[k] = store.row(row);
    index.place(row, is_shared ? estimate.mean : map.landmarks[k].last_seen);
    if (ids_are_known) row_of_id[estimate.id] = row;
    for (int i = 0; is_shared && i < count; ++i) {
      put(i, estimate.mean, estimate.covariance, estimate.log_odds, rows[k]);
    }
  }
  auto number = numbers.begin();
  FastSlamParticles particles;
  for (Eigen::ArrayXd* array :
       {&particles.x, &particles.y, &particles.heading, &particles.log_weight, &particles.weight}) {
    array->resize(saved);
  }
  for (int i = 0; i < saved; ++i) {
    const SavedParticle& particle = map.particles[static_cast<std::size_t>(i)];
    particles.x[i] = particle.pose.x;
    particles.y[i] = particle.pose.y;
    particles.heading[i] = particle.pose.heading;
    particles.log_weight[i] = particle.log_weight;
    particles.weight[i] = particle.weight;
    for (std::size_t k = 0; !is_shared && k < particle.landmarks.size(); ++k) {
      const ParticleLandmark& landmark = particle.landmarks[k];
      put(i, landmark.mean, landmark.covariance, landmark.log_odds, rows[*number++]);
    }
  }

  reset();
  store_ = std::move(store);
  index_ = std::move(index);
  row_of_id_ = std::move(row_of_id);
  status_.landmarks = static_cast<int>(std::count(is_wanted.begin(), is_wanted.end(), 1));
  has_landmarks_ = status_.landmarks > 0;
  next_id_ = map.next_id;
  if (!map.landmarks.empty()) next_id_ = std::max(next_id_, map.landmarks.back().estimate.id + 1);
  step_ = map.step;
  view_range_ = map.view_range;
  view_bearing_ = map.view_bearing;
  strategy_.resume(map.observations_since_renewal);
  // Of a map with ids alone the first observations decide whether these are used.
  const bool leaves_open = is_shared && ids_are_known;
  if (association_ == DataAssociation::automatic && !leaves_open) association_ = map.association;

  if (saved == 0) {
    set_poses(map.pose);
    return;
  }
  particles_ = std::move(particles);
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(saved, 0, saved - 1);
  ancestry_.start(saved);
  odometry_errors_.start(options_.odometry_errors, saved);
  odometry_errors_.resume(map.odometry_errors);
  if (saved != options_.particles) {
    Resampler resampler;
    const ResamplingResult drawn =
        resampler.resample(particles_.weight, options_.particles, stream(RandomPurpose::selection));
    select(drawn.ancestors);
    particles_.ancestor = drawn.ancestors;
    particles_.log_weight = drawn.log_weights;
    particles_.weight = particles_.log_weight.exp();
    ancestry_.start(options_.particles);
  }
}

void FastSlam::set_poses(const PoseEstimate& poses) {
  const Pose2 mean = {poses.mean.x, poses.mean.y, wrap_angle(poses.mean.heading)};
  std::string fault = map_checks::fault_of_pose(mean);
  if (fault.empty()) fault = map_checks::fault_of_pose_covariance(poses.covariance);
  if (!fault.empty()) throw Error("poses to set: " + fault + "; give a place and its covariance");
  ++step_;  // for a draw of its own
  paths_.clear();
  const Eigen::Index count = particles_.size();
  const Eigen::Matrix3d root = lower_root(poses.covariance);
  const RandomStream normals = stream(RandomPurpose::initialization);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::uint64_t first = 4 * static_cast<std::uint64_t>(i);
    const Eigen::Vector3d offset =
        root * Eigen::Vector3d(normals.normal(first), normals.normal(first + 1),
                               normals.normal(first + 2));
    particles_.x[i] = mean.x + offset[0];
    particles_.y[i] = mean.y + offset[1];
    particles_.heading[i] = wrap_angle(mean.heading + offset[2]);
  }
  particles_.log_weight.setConstant(-std::log(static_cast<double>(count)));
  particles_.weight.setConstant(1.0 / static_cast<double>(count));
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
}

void FastSlam::set_particles(const GivenParticles& particles) {
  check_given_particles(particles);
  ++step_;  // for a draw of its own
  const int count = static_cast<int>(particles.poses.size());
  Resampler resampler;
  select(resampler.resample(particles_.weight, count, stream(RandomPurpose::selection)).ancestors);
  paths_.clear();
  for (Eigen::Index i = 0; i < count; ++i) {
    const Pose2& pose = particles.poses[static_cast<std::size_t>(i)];
    particles_.x[i] = pose.x;
    particles_.y[i] = pose.y;
    particles_.heading[i] = wrap_angle(pose.heading);
  }
  particles_.log_weight = log_weights_of(particles);
  particles_.weight.resize(count);
  const WeightSummary summary = normalize(particles_.log_weight, particles_.weight);
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(count, 0, count - 1);
  status_.particles = count;
  status_.effective_sample_size = summary.effective_sample_size;
  status_.entropy_sample_size = summary.entropy_sample_size;
}

}  // namespace pf_resampling
