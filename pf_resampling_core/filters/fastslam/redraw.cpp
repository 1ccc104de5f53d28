// FastSLAM's redraw: the whole population drawn anew from the Laplace approximation of the
// smoothing posterior, so that what resampling has lost of the past comes back.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/kernels.hpp"

namespace pf_resampling {
namespace {

// A landmark that less of the weight holds is no part of the map that all particles get.
constexpr double kBelieved = 0.5;
constexpr double kSmallestSigma = 1e-6;      // m, rad: of what all particles agree on
constexpr double kSmallestVariance = 1e-18;  // of a sensor's constant that is known
constexpr int kFewToStartFrom = 50;          // landmarks from which a past starts at once, ...
constexpr int kMostToStartFrom = 500;        // ... and at most,
constexpr int kStepsBetweenStarts = 20;      // updates after which it is tried again
constexpr double kLargestSquare = 13.8;      // of an innovation: 99.9 % are within it

// Of a landmark in each particle, m. A Gaussian bends what is rigid: turned by an angle a, what is
// known from the robot to a hand's breadth would be a²/2 times its distance too far away, and the
// weights would take that for a wrong heading. So it turns with the robot, unless it is better
// known in the map.
Eigen::ArrayX2d places_of(const Eigen::Vector2d& mean, const Eigen::ArrayX2d& deviations,
                          const Pose2& newest, const Eigen::ArrayX3d& pose_deviations) {
  const Eigen::Vector2d offset(mean.x() - newest.x, mean.y() - newest.y);
  // As seen from the robot, in the axes of the map.
  Eigen::ArrayX2d seen = deviations - pose_deviations.leftCols<2>();
  seen.col(0) += pose_deviations.col(2) * offset.y();
  seen.col(1) -= pose_deviations.col(2) * offset.x();
  const bool is_known_from_robot = seen.square().sum() < deviations.square().sum();
  if (!is_known_from_robot) return deviations.rowwise() + mean.transpose().array();
  seen.rowwise() += offset.transpose().array();
  const Eigen::ArrayXd cosine = pose_deviations.col(2).cos(), sine = pose_deviations.col(2).sin();
  Eigen::ArrayX2d places(seen.rows(), 2);
  places.col(0) = newest.x + pose_deviations.col(0) + cosine * seen.col(0) - sine * seen.col(1);
  places.col(1) = newest.y + pose_deviations.col(1) + sine * seen.col(0) + cosine * seen.col(1);
  return places;
}

}  // namespace

bool FastSlam::keeps_past() const {
  const int most = options_.strategy.redraw.max_landmarks;
  const std::size_t remembered = memory_.state().landmarks.size();
  return options_.strategy.renewal == Renewal::redraw && !options_.map.frozen &&
         status_.landmarks <= most && remembered <= static_cast<std::size_t>(most);
}

SensorConstants FastSlam::prior_sigma() const {
  SensorConstants sigma = SensorConstants::Zero();
  const OdometryErrorOptions& errors = options_.odometry_errors;
  if (errors.estimate) {
    sigma.head<kOdometryConstants>() << errors.distance_scale, errors.turn_scale, errors.drift,
        errors.yaw_rate, errors.delay;
  }
  sigma[SensorConstant::range_scale] = options_.sensor.range_scale_sigma;
  sigma[SensorConstant::bearing_bias] = options_.sensor.bearing_bias_sigma;
  return sigma;
}

double FastSlam::noise_doubt() const {
  if (!keeps_past() || !options_.strategy.redraw.learn_noise) return 1.0;
  const MemoryState& memory = memory_.state();
  return pf_resampling::noise_doubt(memory.passages.size() + memory.windows.size());
}

// What the particles are given: noise as large as it was found to be, and the errors of the sensor
// taken out as far as they are known.
OdometryIncrement FastSlam::with_found_noise(OdometryIncrement odometry) const {
  const double scale = memory_.is_empty() ? 1.0 : noise().motion;
  odometry.covariance *= scale * scale;
  odometry.covariance += odometry.slip_covariance;
  if (memory_.distrusts_odometry()) {
    odometry.covariance += memory_.slip_covariance_of(odometry.mean, odometry.duration);
  }
  return odometry;
}

std::vector<RangeBearingObservation> FastSlam::with_found_noise(
    std::vector<RangeBearingObservation> observations) const {
  const SensorConstants& constants = memory_.graph().constants;
  const NoiseScales& noise = this->noise();
  for (RangeBearingObservation& observation : observations) {
    observation.range_variance =
        noise.range * noise.range * range_variance(options_.sensor, observation);
    observation.bearing_variance =
        noise.bearing * noise.bearing * bearing_variance(options_.sensor, observation);
    observation.range /= 1.0 + constants[SensorConstant::range_scale];
    observation.bearing = wrap_angle(observation.bearing - constants[SensorConstant::bearing_bias]);
  }
  return observations;
}

// The belief to begin with: where all agree and there is no map, that pose; else the moments of the
// population. False if these do not make a Gaussian.
bool FastSlam::start_past() {
  // The joint covariance of a large map takes a second: it has to wait for its turn.
  if (status_.landmarks > kMostToStartFrom) return false;
  if (status_.landmarks > kFewToStartFrom && step_ % kStepsBetweenStarts != 0) return false;
  if (!has_landmarks_ && (particles_.x == particles_.x[0]).all() &&
      (particles_.y == particles_.y[0]).all() &&
      (particles_.heading == particles_.heading[0]).all()) {
    memory_.start(particles_.pose(0), prior_sigma());
    return true;
  }
  const ConstArray weights = particles_.weight;
  const Pose2 pose = estimate().mean;
  std::vector<Eigen::Vector2d> landmarks;
  SensorConstants constants = SensorConstants::Zero();
  std::vector<std::int64_t> ids;
  std::vector<LandmarkRow> maps;
  for (const int row : rows()) {
    LandmarkEstimate landmark;
    if (!summarize(row, &landmark) || landmark.held < kBelieved) continue;
    ids.push_back(landmark.id);
    landmarks.push_back(landmark.mean);
    maps.push_back(store_.row(row));
  }
  const Eigen::ArrayXXd& errors = odometry_errors_.state().means;
  for (int k = 0; k < kOdometryConstants; ++k) {
    constants[k] = (weights * errors.col(k)).sum();
  }
  const Eigen::Index count = particles_.size();
  const Eigen::Index size = 3 + 2 * static_cast<Eigen::Index>(landmarks.size()) + kSensorConstants;
  const Eigen::Index constants_at = size - kSensorConstants;
  Eigen::MatrixXd deviations = Eigen::MatrixXd::Zero(size, count);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < count; ++i) {
    deviations(0, i) = particles_.x[i] - pose.x;
    deviations(1, i) = particles_.y[i] - pose.y;
    deviations(2, i) = wrap_angle(particles_.heading[i] - pose.heading);
    deviations.col(i).segment<kOdometryConstants>(constants_at) =
        errors.row(i).transpose().matrix() - constants.head<kOdometryConstants>();
  }
  for (std::size_t l = 0; l < maps.size(); ++l) {
    const LandmarkRow& map = maps[l];
    const Eigen::Index at = 3 + 2 * static_cast<Eigen::Index>(l);
    Eigen::Matrix2d own = kSmallestSigma * kSmallestSigma * Eigen::Matrix2d::Identity();
    for (Eigen::Index i = 0; i < count; ++i) {
      if (map.held[i] == 0) continue;
      deviations.block<2, 1>(at, i) = map.mean(i) - landmarks[l];
      own += weights[i] * map.covariance(i);
    }
    covariance.block<2, 2>(at, at) = own;
  }
  covariance.noalias() += deviations * weights.matrix().asDiagonal() * deviations.transpose();
  covariance.diagonal().head<3>().array() += kSmallestSigma * kSmallestSigma;
  const SensorConstants sigma = prior_sigma();
  const OdometryInformation odometry =
      odometry_errors_.state().covariance + kSmallestVariance * OdometryInformation::Identity();
  covariance.block<kOdometryConstants, kOdometryConstants>(constants_at, constants_at) += odometry;
  for (int k = kOdometryConstants; k < kSensorConstants; ++k) {
    covariance(constants_at + k, constants_at + k) += sigma[k] * sigma[k] + kSmallestVariance;
  }
  return memory_.start({pose, landmarks, ids, constants, covariance});
}

// Each observation as what most of the weight took it for; others take no part, but what has no id
// may find its landmark later.
void FastSlam::note_past(const OdometryIncrement& odometry,
                         const std::vector<RangeBearingObservation>& observations,
                         const Pose2& sensor) {
  MotionFactor motion = {odometry.mean, odometry.covariance, odometry.slip_covariance,
                         odometry_errors_.sensitivity()};
  if (memory_.distrusts_odometry()) {
    motion.slip_covariance += memory_.slip_covariance_of(odometry.mean, odometry.duration);
  }
  memory_.append(motion);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const ObservationOutcome& outcome = outcomes_[k];
    const kernels::Observation z =
        kernels::make_observation(options_.sensor, observations[k], sensor);
    const SightingFactor sighting = {
        0, 0, z.range, z.bearing, z.range_variance, z.bearing_variance, sensor};
    if (association_ != DataAssociation::known) {
      if (outcome.landmark >= 0 && outcome.is_believed()) {
        memory_.append_sighting(outcome.landmark, sighting);
      } else {
        memory_.append_unassigned(sighting);
      }
      continue;
    }
    const std::int64_t id = observations[k].id;
    const auto is_same = [&](const RangeBearingObservation& other) { return other.id == id; };
    const bool is_twice = std::count_if(observations.begin(), observations.end(), is_same) > 1;
    if (outcome.is_new) memory_.forget_landmark(id);
    if (outcome.is_new || outcome.is_believed()) {
      memory_.append_sighting(id, sighting);
    } else {
      if (is_twice) memory_.note_twice(id);
      memory_.append_doubtful_sighting(id, sighting, is_placed());
    }
  }
  if (association_ == DataAssociation::known) memory_.check_odometry_scales();
}

bool FastSlam::count_refusal() {
  ++status_.redraws_refused;
  memory_.note_refusal();
  return false;
}

// Before the observations are used: each as of the landmark that most of the weight takes it for.
void FastSlam::test_redraw(const std::vector<RangeBearingObservation>& observations,
                           const Pose2& sensor) {
  double squares = 0.0;
  int tested = 0;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Association& association = associations_[k];
    for (std::size_t c = 0; c < association.rows.size(); ++c) {
      const auto takes = association.takes.col(static_cast<Eigen::Index>(c));
      if ((takes * particles_.weight).sum() < kBelieved) continue;
      const double square = kernels::squared_innovation(
          kernels::make_observation(options_.sensor, observations[k], sensor), particles_.weight,
          proposal(), store_.row(association.rows[c]));
      if (!std::isfinite(square)) continue;
      squares += std::min(square, kLargestSquare);
      ++tested;
    }
  }
  if (tested == 0) return;
  redraw_is_untested_ = false;
  status_.redraw_innovation = squares / (2.0 * tested);
  status_.redraw_innovation_observations = tested;
}

bool FastSlam::smooth() {
  if (!keeps_past()) return false;
  return redraw(requested_size_);
}

bool FastSlam::redraw(int size) {
  if (memory_.is_empty()) return false;
  // What most of the weight gave up does not come back.
  for (const int row : rows()) {
    LandmarkEstimate landmark;
    const bool is_held = summarize(row, &landmark) && landmark.held >= kBelieved;
    if (!is_held) forget(store_.birth(row));
  }
  return solve_memory() ? draw_from_memory(size) : count_refusal();
}

// The memory, too, does without the landmark; without ids, unless all data say that it is there.
void FastSlam::forget(std::int64_t landmark) {
  if (association_ == DataAssociation::known) {
    memory_.forget_landmark(landmark);
  } else {
    memory_.give_up_landmark(landmark);
  }
}

bool FastSlam::solve_memory() {
  const RedrawOptions& options = options_.strategy.redraw;
  if (association_ == DataAssociation::known) {
    // A robot that was carried since the last drive is no reason to bend the map.
    if (!is_placed() && memory_.has_doubts()) return false;
    return memory_.solve(options.robust_width);
  }
  // As many landmarks as there are to be seen: of these, new_landmark_share are new.
  const double log_density = log_density_of_new();
  return memory_.solve({options.robust_width, log_density,
                        log_density - std::log(options_.association.new_landmark_share),
                        static_cast<std::size_t>(options.max_landmarks)},
                       &next_id_);
}

bool FastSlam::draw_from_memory(int size) {
  const RedrawOptions& options = options_.strategy.redraw;
  MemoryDraw drawn = memory_.draw(size, stream(RandomPurpose::redraw));
  drawn.deviations *= std::cbrt(noise_doubt());  // its noise may be larger by a standard error
  if (!drawn.deviations.allFinite()) return count_refusal();
  if (options.learn_noise) {
    memory_.validate(options.robust_width);
  } else {
    memory_.take_noise_as_stated();
  }
  const Pose2 origin = relative(estimate().mean, {});
  sightings_.move(compose(memory_.graph().newest(), origin));
  take_draw(size, drawn);
  redraw_maps(size, drawn);
  return true;
}

// The population as drawn, but for the maps.
void FastSlam::take_draw(int size, const MemoryDraw& drawn) {
  const Eigen::MatrixXd& deviations = drawn.deviations;
  const SegmentGraph& graph = memory_.graph();
  const Pose2& newest = graph.newest();
  ++status_.redraws;
  redraw_is_untested_ = true;
  status_.redraw_innovation = 0.0;
  status_.redraw_innovation_observations = 0;
  paths_.replace_newest(memory_.path(), particles_.weight, size);
  const auto pose = deviations.rightCols<3>().array();
  particles_.x = newest.x + pose.col(0);
  particles_.y = newest.y + pose.col(1);
  particles_.heading = newest.heading + pose.col(2);
  for (Eigen::Index i = 0; i < size; ++i) {
    particles_.heading[i] = wrap_angle(particles_.heading[i]);
  }
  const Eigen::Index at = deviations.cols() - 3 - kSensorConstants;
  Eigen::ArrayXXd errors = deviations.middleCols<kOdometryConstants>(at).array();
  errors.rowwise() += graph.constants.head<kOdometryConstants>().transpose().array();
  odometry_errors_.redraw(errors, drawn.odometry_given_path);
  particles_.begin_anew();
  ancestry_.start(size);
}

// Every particle gets the landmarks of the graph; others, that few particles hold, go.
void FastSlam::redraw_maps(int size, const MemoryDraw& drawn) {
  const SegmentGraph& graph = memory_.graph();
  const std::size_t count = graph.landmarks.size();
  std::vector<std::int64_t> ids;  // -1: not for the particles
  for (const RememberedLandmark& landmark : memory_.state().landmarks) {
    ids.push_back(landmark.is_dormant ? -1 : landmark.id);
  }
  std::vector<int> row_of(count, -1);
  std::vector<double> log_odds(count, options_.association.seen_log_odds);
  for (const int row : rows()) {
    const int number = memory_.number_of(store_.birth(row));
    if (number < 0 || ids[static_cast<std::size_t>(number)] < 0) {
      remove_landmark(row);
      continue;
    }
    LandmarkEstimate landmark;
    summarize(row, &landmark);
    row_of[static_cast<std::size_t>(number)] = row;
    log_odds[static_cast<std::size_t>(number)] = landmark.log_odds;
  }
  if (size != store_.particles()) store_.select(Eigen::ArrayXi::Zero(size));
  for (std::size_t l = 0; l < count; ++l) {
    if (ids[l] < 0) continue;
    if (row_of[l] < 0) {
      row_of[l] = store_.add(ids[l]);
      if (association_ == DataAssociation::known) row_of_id_[ids[l]] = row_of[l];
      ++status_.landmarks;
    }
    const Eigen::Vector2d& mean = graph.landmarks[l];
    const LandmarkRow landmark = store_.row(row_of[l]);
    const Eigen::ArrayX2d places =
        places_of(mean, drawn.deviations.middleCols<2>(2 * static_cast<Eigen::Index>(l)),
                  graph.newest(), drawn.deviations.rightCols<3>());
    for (Eigen::Index i = 0; i < size; ++i) {
      landmark.put(i, places.row(i).transpose(), drawn.landmarks_given_path[l], log_odds[l]);
    }
    index_.place(row_of[l], mean);
  }
}

}  // namespace pf_resampling
