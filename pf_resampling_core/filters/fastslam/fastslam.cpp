#include "pf_resampling_core/filters/fastslam/fastslam.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/kernels.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {
namespace {

// A redraw takes as long as the drive: from so many updates on, they come less often in proportion.
constexpr double kUpdatesOfDenseRedraws = 2000.0;

void check(const RangeBearingObservation& observation, DataAssociation method) {
  const bool usable =
      std::isfinite(observation.range) && observation.range > 0.0 &&
      std::isfinite(observation.bearing) && std::isfinite(observation.range_variance) &&
      observation.range_variance >= 0.0 && std::isfinite(observation.bearing_variance) &&
      observation.bearing_variance >= 0.0;
  if (!usable) {
    throw Error("observation of landmark " + std::to_string(observation.id) + " with range " +
                std::to_string(observation.range) + " m and bearing " +
                std::to_string(observation.bearing) +
                " rad cannot be used: everything has to be finite, the range positive and no "
                "variance negative");
  }
  if (method == DataAssociation::known && observation.id < 0) {
    throw Error("observation with id " + std::to_string(observation.id) +
                ": association/method is known, which needs ids of 0 or more; use "
                "maximum_likelihood or mutual_exclusion");
  }
}

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
}

// One NaN would spread to all particles and never leave them.
void check(const OdometryIncrement& odometry, const Pose2& sensor) {
  if (!is_finite(odometry.mean) || !odometry.covariance.allFinite() ||
      !odometry.slip_covariance.allFinite()) {
    throw Error("odometry (" + std::to_string(odometry.mean.x) + " m, " +
                std::to_string(odometry.mean.y) + " m, " + std::to_string(odometry.mean.heading) +
                " rad) cannot be used: it and its covariance have to be finite");
  }
  if (!is_finite(sensor)) {
    throw Error("the sensor's pose on the robot, (" + std::to_string(sensor.x) + " m, " +
                std::to_string(sensor.y) + " m, " + std::to_string(sensor.heading) +
                " rad), cannot be used: it has to be finite");
  }
}

}  // namespace

kernels::Observation kernels::make_observation(const LandmarkSensorOptions& model,
                                               const RangeBearingObservation& z,
                                               const Pose2& sensor) {
  kernels::Observation observation{};
  observation.range = z.range;
  observation.bearing = z.bearing;
  observation.range_variance = std::max(kernels::kSmallestVariance, range_variance(model, z));
  observation.bearing_variance = std::max(kernels::kSmallestVariance, bearing_variance(model, z));
  observation.sensor_x = sensor.x;
  observation.sensor_y = sensor.y;
  observation.sensor_yaw = sensor.heading;
  return observation;
}

FastSlam::FastSlam(const FastSlamOptions& options, std::uint64_t seed)
    : options_(options), seed_(seed), store_(options.particles) {
  validate(options_);
  reset();
}

void FastSlam::reset() {
  step_ = 0;
  const Eigen::Index count = options_.particles;
  particles_.x.setZero(count);
  particles_.y.setZero(count);
  particles_.heading.setZero(count);
  particles_.begin_anew();
  odometry_errors_.start(options_.odometry_errors, count);
  store_ = LandmarkStore(options_.particles);
  index_.clear();
  row_of_id_.clear();
  next_id_ = 0;
  ancestry_.start(options_.particles);
  has_landmarks_ = false;
  strategy_ = Strategy(options_.strategy);
  association_ = options_.association.method;
  requested_size_ = options_.particles;
  status_ = FastSlamStatus{};
  status_.particles = options_.particles;
  status_.distinct_ancestors_of_renewal = options_.particles;
  status_.distinct_ancestors_since_start = options_.particles;
  outcomes_.clear();
  sightings_.clear();
  paths_.clear();
  memory_.clear();
  is_lost_ = false;
  unplaced_since_ = -1.0;
  redraw_is_untested_ = false;
  view_ = {};
}

void FastSlam::set_options(const FastSlamOptions& options) {
  validate(options);
  if (options.association.method == DataAssociation::known && !all_have_ids()) {
    throw Error(
        "association/method cannot become known: the landmarks of the map were found without ids, "
        "and their numbers are no ids; reset the filter or load a map with ids first");
  }
  check_map_size(static_cast<std::size_t>(status_.landmarks), options.particles, options.map);
  strategy_.set_options(options.strategy);
  // What the first observations decided stays.
  if (options.association.method != DataAssociation::automatic) {
    const bool had_ids = association_ == DataAssociation::known;
    const bool have_ids = options.association.method == DataAssociation::known;
    if (had_ids != have_ids && association_ != DataAssociation::automatic) memory_.forget_drive();
    association_ = options.association.method;
  }
  options_ = options;
  requested_size_ = options.particles;
}

// Whether every landmark has the id of its observations, not a number in order of discovery.
bool FastSlam::all_have_ids() const {
  const std::vector<int> used = rows();
  return std::all_of(used.begin(), used.end(),
                     [&](int row) { return row_of_id_.count(store_.birth(row)) > 0; });
}

DataAssociation FastSlam::method_for(
    const std::vector<RangeBearingObservation>& observations) const {
  if (association_ != DataAssociation::automatic || observations.empty()) return association_;
  const bool have_ids =
      std::all_of(observations.begin(), observations.end(),
                  [](const RangeBearingObservation& observation) { return observation.id >= 0; });
  return have_ids ? DataAssociation::known : DataAssociation::mutual_exclusion;
}

// The filter's steps, Kwak section 2: draw the poses, update the landmarks, weigh, renew.
void FastSlam::update(const OdometryIncrement& odometry,
                      const std::vector<RangeBearingObservation>& measured, const Pose2& sensor) {
  check(odometry, sensor);
  const DataAssociation method = method_for(measured);
  for (const RangeBearingObservation& observation : measured) check(observation, method);
  // Without ids it shows late whether there is memory for a scan.
  const bool may_be_refused = method != DataAssociation::known;
  FastSlamParticles before;
  OdometryErrorEstimator errors_before;
  if (may_be_refused) {
    before = particles_;
    errors_before = odometry_errors_;
  }
  const auto association_before = std::make_pair(association_, view_);
  association_ = method;
  ++step_;
  const bool is_kept = keeps_past() && (!memory_.is_empty() || start_past());
  if (!memory_.is_empty() && !is_kept) memory_.forget_drive();
  std::vector<RangeBearingObservation> corrected;
  if (is_kept) corrected = with_found_noise(measured);
  const std::vector<RangeBearingObservation>& observations = is_kept ? corrected : measured;
  const double share = is_kept ? options_.strategy.redraw.tempering : options_.strategy.tempering;
  Eigen::ArrayXd log_weights_before;
  if (share < 1.0) log_weights_before = particles_.log_weight;
  const Eigen::Index count = particles_.size();
  const kernels::PoseGaussians pose = proposal();
  odometry_errors_.predict(with_found_noise(odometry));
  drawn_.resize(count, 3);
  drawn_ << particles_.x, particles_.y, particles_.heading;
  kernels::predict(odometry_errors_.motion(), odometry_errors_.covariance(), count, pose);
  // FastSLAM 1.0 is 2.0 with a proposal that the observations find already drawn.
  if (options_.version == FastSlamVersion::fastslam_1) draw();

  try {
    associate(observations, sensor);
  } catch (...) {
    if (may_be_refused) {
      particles_ = before;
      odometry_errors_ = errors_before;
      --step_;
    }
    std::tie(association_, view_) = association_before;
    throw;
  }
  if (redraw_is_untested_) test_redraw(observations, sensor);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const kernels::Observation z =
        kernels::make_observation(options_.sensor, observations[k], sensor);
    Association& association = associations_[k];
    for (std::size_t c = 0; c < association.rows.size(); ++c) {
      const Eigen::Index column = static_cast<Eigen::Index>(c);
      // Of the landmarks near by, most are no particle's choice.
      if (!(association.takes.col(column) > 0.0).any()) continue;
      kernels::propose(z, options_.association.gate, count, pose, store_.row(association.rows[c]),
                       association.takes.col(column).data(), particles_.log_weight.data(),
                       association.accepted.col(column).data());
    }
  }
  if (options_.version == FastSlamVersion::fastslam_2) draw();

  for (std::size_t k = 0; k < observations.size() && !options_.map.frozen; ++k) {
    const kernels::Observation z =
        kernels::make_observation(options_.sensor, observations[k], sensor);
    const Association& association = associations_[k];
    for (std::size_t c = 0; c < association.rows.size(); ++c) {
      const auto accepted = association.accepted.col(static_cast<Eigen::Index>(c));
      if (!(accepted > 0.0).any()) continue;
      kernels::update(z, count, pose, accepted.data(), store_.row(association.rows[c]));
    }
  }
  for (std::size_t k = 0; k < observations.size(); ++k) start_landmark(k, observations[k], sensor);
  if (observations.empty()) {
    if (is_kept) note_past(odometry, measured, sensor);
    paths_.append(particles_.x, particles_.y, particles_.heading);
    return;
  }

  // The likelihood that the status states is that of all that was observed.
  status_.log_likelihood =
      share < 1.0 ? temper(share, log_weights_before, particles_.log_weight) : 0.0;
  normalize_weights();
  note_outcomes(observations);
  if (is_kept) note_past(odometry, measured, sensor);
  if (!options_.map.frozen) update_existence(observations, sensor);
  ++status_.updates;
  paths_.append(particles_.x, particles_.y, particles_.heading);
  renew();
}

kernels::PoseGaussians FastSlam::proposal() {
  proposal_.resize(particles_.size(), 6);
  return {particles_.x.data(),     particles_.y.data(),     particles_.heading.data(),
          proposal_.col(0).data(), proposal_.col(1).data(), proposal_.col(2).data(),
          proposal_.col(3).data(), proposal_.col(4).data(), proposal_.col(5).data()};
}

void FastSlam::draw() {
  const Eigen::Index count = particles_.size();
  work_.resize(4 * count);
  double* z = work_.data();
  stream(RandomPurpose::motion).fill_normal4(0, count, z, z + count, z + 2 * count, z + 3 * count);
  kernels::draw(count, z, z + count, z + 2 * count, proposal());
  proposal_.setZero();
  learn_odometry_errors();
}

// What the particles' draws say of the odometry.
void FastSlam::learn_odometry_errors() {
  if (!options_.odometry_errors.estimate) return;
  kernels::motion_since(particles_.size(), proposal(), drawn_.col(0).data(), drawn_.col(1).data(),
                        drawn_.col(2).data());
  odometry_errors_.condition(drawn_);
}

void FastSlam::start_landmark(std::size_t observation, const RangeBearingObservation& z,
                              const Pose2& sensor) {
  const Association& association = associations_[observation];
  if (!(association.starts > 0.0).any()) return;
  const bool known = association_ == DataAssociation::known;
  const std::int64_t id = known ? z.id : next_id_++;
  const auto found = known ? row_of_id_.find(id) : row_of_id_.end();
  const bool is_there = found != row_of_id_.end();  // some particles gave it up
  if (!is_there && !has_room_for_landmark()) {
    ++status_.landmarks_refused;
    return;
  }
  const int row = is_there ? found->second : store_.add(id);
  const LandmarkRow landmark = store_.row(row);
  kernels::start(kernels::make_observation(options_.sensor, z, sensor), particles_.size(),
                 proposal(), association.starts.data(), options_.association.seen_log_odds,
                 landmark);
  if (known) {
    row_of_id_[id] = row;
    next_id_ = std::max(next_id_, id + 1);  // for landmarks found without ids from now on
  }
  associations_[observation].started_row = row;
  if (is_there) return;
  ++status_.landmarks;
  if (!has_landmarks_) ancestry_.start(static_cast<int>(particles_.size()));
  has_landmarks_ = true;
}

bool FastSlam::has_room_for_landmark() const {
  const std::int64_t landmarks = status_.landmarks + 1;
  const std::int64_t particles = std::max<std::int64_t>(particles_.size(), requested_size_);
  return landmarks <= options_.map.max_landmarks &&
         landmarks * particles <= options_.map.max_estimates;
}

void FastSlam::normalize_weights() {
  if (!is_normalizable(particles_.log_weight)) {
    ++status_.weight_resets;
    const double count = static_cast<double>(particles_.size());
    particles_.log_weight.setConstant(-std::log(count));
    particles_.weight.setConstant(1.0 / count);
    status_.effective_sample_size = status_.entropy_sample_size = count;
    return;
  }
  const WeightSummary summary = normalize(particles_.log_weight, particles_.weight);
  status_.log_likelihood += summary.log_sum;
  status_.effective_sample_size = summary.effective_sample_size;
  status_.entropy_sample_size = summary.entropy_sample_size;
}

void FastSlam::renew() {
  Population population = population_of(
      &particles_, [this](ConstIndices ancestors) { select(ancestors); },
      [this](const std::vector<BlendPair>& pairs) { blend(pairs); });
  if (keeps_past()) {
    population.redraw = [this](int size) { return redraw(size); };
    const int absence = options_.strategy.redraw.closure_absence;
    if (!is_lost_) {
      population.redraw_spacing =
          std::max(1.0, static_cast<double>(memory_.updates()) / kUpdatesOfDenseRedraws);
    }
    population.closes_loop = is_lost_ || memory_.closes_loop(absence);
    population.needs_redraw = memory_.needs_solution();
  }
  const RenewalOutcome outcome = strategy_.renew(
      status_.effective_sample_size, requested_size_, false,
      [this](RandomPurpose purpose) { return stream(purpose); }, population);
  status_.renewed = outcome.renewed;
  status_.particles = static_cast<int>(particles_.size());
  if (!outcome.renewed) return;
  status_.renewals = strategy_.renewals();
  status_.distinct_ancestors_of_renewal = outcome.distinct_ancestors;
  status_.distinct_ancestors_since_start = ancestry_.distinct();
}

// The poses are copied, the maps are not: their store takes note.
void FastSlam::select(ConstIndices ancestors) {
  select_columns(ancestors, &particles_);
  odometry_errors_.select(ancestors);
  store_.select(ancestors);
  ancestry_.select(ancestors);
  paths_.select(ancestors);
}

// Another number of particles, drawn from the present ones outside of any renewal.
void FastSlam::draw_population(int size) {
  Resampler resampler;
  const ResamplingResult drawn =
      resampler.resample(particles_.weight, size, stream(RandomPurpose::selection));
  select(drawn.ancestors);
  particles_.ancestor = drawn.ancestors;
  particles_.log_weight = drawn.log_weights;
  particles_.weight = particles_.log_weight.exp();
}

void FastSlam::blend(const std::vector<BlendPair>& pairs) {
  blend_poses(pairs, particles_.x, particles_.y, particles_.heading);
  odometry_errors_.blend(pairs);
  if (!options_.map.frozen) store_.blend(pairs, options_.strategy.compensation.covariance);
}

PoseEstimate FastSlam::estimate() const {
  const PoseStatistics all =
      pose_statistics(particles_.weight, particles_.x, particles_.y, particles_.heading);
  return {all.mean, all.covariance};
}

std::vector<int> FastSlam::rows() const {
  std::vector<int> used;
  for (int row = 0; row < store_.rows(); ++row) {
    if (store_.is_used(row)) used.push_back(row);
  }
  return used;
}

std::optional<LandmarkEstimate> FastSlam::landmark(std::int64_t id) {
  const auto found = row_of_id_.find(id);
  LandmarkEstimate landmark;
  if (found == row_of_id_.end() || !summarize(found->second, &landmark)) return std::nullopt;
  return landmark;
}

std::vector<LandmarkEstimate> FastSlam::map() {
  std::vector<LandmarkEstimate> landmarks;
  for (const int row : rows()) {
    LandmarkEstimate landmark;
    if (summarize(row, &landmark) && landmark.held > 0.0) landmarks.push_back(landmark);
  }
  std::sort(landmarks.begin(), landmarks.end(),
            [](const LandmarkEstimate& a, const LandmarkEstimate& b) { return a.id < b.id; });
  return landmarks;
}

// Moments of a landmark over the particles that hold it; false if none does. Where none of these
// has any weight, all count alike. Sums are of differences to the first of them, so that particles
// that agree give what they agree on, to the bit.
bool FastSlam::summarize(int row, LandmarkEstimate* landmark) {
  const LandmarkRow data = store_.row(row);
  const Eigen::Index count = particles_.size();
  Eigen::Index first = -1;
  double total = 0.0;
  bool all_hold = true;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (data.held[i] == 0) {
      all_hold = false;
      continue;
    }
    if (first < 0) first = i;
    total += particles_.weight[i];
  }
  if (first < 0) return false;
  const auto share = [&](Eigen::Index i) {
    return total > 0.0 ? particles_.weight[i] / total : 1.0;
  };
  double shares = 0.0;
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();
  double log_odds = 0.0;
  for (Eigen::Index i = first; i < count; ++i) {
    if (data.held[i] == 0) continue;
    shares += share(i);
    offset += share(i) * (data.mean(i) - data.mean(first));
    log_odds += share(i) * (data.log_odds[i] - data.log_odds[first]);
  }
  landmark->id = store_.birth(row);
  landmark->held = all_hold ? 1.0 : std::min(1.0, total);
  landmark->mean = data.mean(first) + offset / shares;
  landmark->log_odds = data.log_odds[first] + log_odds / shares;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (Eigen::Index i = first; i < count; ++i) {
    if (data.held[i] == 0) continue;
    const Eigen::Vector2d deviation = data.mean(i) - landmark->mean;
    spread += share(i) *
              (data.covariance(i) - data.covariance(first) + deviation * deviation.transpose());
  }
  landmark->covariance = data.covariance(first) + spread / shares;
  return true;
}

void FastSlam::remove_landmark(int row) {
  index_.remove(row);
  row_of_id_.erase(store_.birth(row));
  store_.remove(row);
  --status_.landmarks;
}

RandomStream FastSlam::stream(RandomPurpose purpose) const {
  return {seed_, purpose, step_};
}

}  // namespace pf_resampling
