#include "fastslam_node/fastslam_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fastslam_node/landmark_checks.hpp"
#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "src/pipeline/filter_pipeline_impl.hpp"

namespace pf_resampling {

template class FilterPipeline<FastSlamTypes>;

namespace {

// Squared distance that two standard normal numbers have on average.
constexpr double kBelievedDistance = 2.0;
// Squared distance that one counts with that was not believed: far out, for a filter that is right.
constexpr double kUnbelievedDistance = 25.0;
// m: a robot that has just begun has no scene yet.
constexpr double kSmallestScene = 1.0;
// How far a sensor's z axis may be off the robot's: cosine.
constexpr double kUpright = 0.9;

RangeBearingObservation to_observation(const LandmarkObservation& message) {
  return {message.id, message.range, wrap_angle(message.bearing), message.range_variance,
          message.bearing_variance};
}

}  // namespace

FastSlamPipeline::FastSlamPipeline(const FastSlamPipelineOptions& options,
                                   const FastSlamSinks& sinks)
    : FilterPipeline(options, sinks),
      own_sinks_(sinks),
      starts_frozen_(options.filter.map.frozen),
      tags_(FramePattern(options.tag_pattern), options.frames) {
  for (const auto& [frame, place] : options_.sensors) {
    frames_.add(options_.frames.base, frame, {place.x, place.y, 0.0}, place.heading);
  }
  filter_ = std::make_unique<FastSlam>(options_.filter, static_cast<std::uint64_t>(options_.seed));
  try {
    if (!options_.map_file.empty()) {
      start_map_ = read_map(options_.map_file, options_.frames.map);
    }
    start_anew();
  } catch (const std::exception& error) {
    if (!options_.starts_without_map) throw;
    start_problem_ = std::string("started without the map: ") + error.what();
    log(LogLevel::error, start_problem_);
    start_map_.reset();
    start_anew();
  }
}

// With the map it was started with, and its landmarks as movable as the parameters say, whatever
// load_map has said since.
void FastSlamPipeline::restart_filter() {
  if (options_.filter.map.frozen != starts_frozen_) {
    options_.filter.map.frozen = starts_frozen_;
    filter_->set_options(options_.filter);
  }
  filter_->reset();
  if (start_map_) {
    filter_->load(*start_map_);
    filter_->begin_drive();
  }
  loaded_map_ = start_map_ ? options_.map_file : "";
  if (start_map_) {
    log(LogLevel::info, "map " + options_.map_file + ": " +
                            std::to_string(start_map_->landmarks.size()) + " landmarks" +
                            (options_.filter.map.frozen ? ", frozen" : ""));
  }
  note_given_map();
  if (start_map_ && options_.starts_anywhere) spread_over_map();
}

void FastSlamPipeline::set_parameters(const std::map<std::string, std::string>& values) {
  const bool frozen = options_.filter.map.frozen;
  FilterPipeline::set_parameters(values);
  if (options_.filter.map.frozen != frozen) starts_frozen_ = !frozen;
}

// ---- messages in ------------------------------------------------------------------------------

std::optional<Rejection> FastSlamPipeline::fault_in(const LandmarkObservationArray& scan) const {
  return check(scan, options_.max_observations);
}

bool FastSlamPipeline::take_transform(const geometry_msgs::TransformStamped& transform) {
  if (!tags_.is_tag(transform)) return false;
  const ros::Time newest = odometry_.empty() ? ros::Time() : odometry_.newest();
  if (const auto rejection = tags_.take(transform, newest, &frames_)) reject(*rejection);
  return true;
}

void FastSlamPipeline::hand_over_observations() {
  const ros::Time newest = odometry_.empty() ? ros::Time() : odometry_.newest();
  for (const LandmarkObservationArray& scan : tags_.take_complete(newest)) handle(scan);
}

std::optional<LandmarkScan> FastSlamPipeline::to_observations(
    const std::vector<LandmarkObservationArray>& group) {
  const LandmarkObservationArray& scan = group.front();
  const std::optional<Pose2> sensor = sensor_of(scan.header.frame_id);
  if (!sensor) return std::nullopt;
  std::vector<RangeBearingObservation> observations = usable_observations(scan);
  if (scan.observations.empty()) note_empty_scan(scan.header.stamp, *sensor);
  if (observations.empty()) return std::nullopt;
  return LandmarkScan{*sensor, std::move(observations)};
}

std::optional<Pose2> FastSlamPipeline::sensor_of(const std::string& frame) {
  const std::string name = without_slash(frame);
  const auto pose = frames_.pose(options_.frames.base, name);
  if (!pose) {
    reject({RejectReason::unknown_frame, "where '" + frame + "' is on '" + options_.frames.base +
                                             "' is not known: give it on /tf_static, or in the "
                                             "list `sensors` of the configuration"});
    return std::nullopt;
  }
  const Eigen::Matrix3d turn = pose->linear();
  if (turn(2, 2) < kUpright) {
    reject({RejectReason::wrong_frame, "the z axis of '" + frame + "' does not point up"});
    return std::nullopt;
  }
  return Pose2{pose->translation().x(), pose->translation().y(),
               std::atan2(turn(1, 0), turn(0, 0))};
}

std::vector<RangeBearingObservation> FastSlamPipeline::usable_observations(
    const LandmarkObservationArray& scan) {
  std::vector<RangeBearingObservation> usable;
  const bool with_ids = filter_->association() != DataAssociation::mutual_exclusion;
  if (with_ids) note_id_at_two_places(id_at_two_places(scan));
  for (const LandmarkObservation& observation : scan.observations) {
    if (const auto rejection = check(observation)) {
      reject(*rejection);
    } else if (const auto repeated = with_ids && observation.id >= 0
                                         ? check_repeated(observation, scan)
                                         : std::nullopt) {
      reject(*repeated);
    } else if (observation.id < 0 && filter_->association() == DataAssociation::known) {
      reject({RejectReason::unknown_id,
              "an observation has the id " + std::to_string(observation.id) +
                  ", but association/method is known; mutual_exclusion needs no ids"});
    } else {
      usable.push_back(to_observation(observation));
    }
  }
  return usable;
}

void FastSlamPipeline::note_id_at_two_places(const std::string& which) {
  if (which.empty()) return;
  if (ids_at_two_places_ == 0) log(LogLevel::warning, which);
  ++ids_at_two_places_;
  last_id_at_two_places_ = which;
}

// ---- the filter -------------------------------------------------------------------------------

void FastSlamPipeline::update_filter(const OdometryIncrement& odometry, const LandmarkScan& used) {
  const std::int64_t refused_before = filter_->status().landmarks_refused;
  for (Prediction& each : predictions_) each.pose = moved_by(each.pose, odometry);
  if (search_) search_->move(odometry.mean);
  static const std::vector<RangeBearingObservation> kNone;
  const auto& observations = search_ ? kNone : used.observations;
  filter_->update(odometry, observations, used.sensor);
  const FastSlamStatus& status = filter_->status();
  for (std::int64_t i = refused_before; i < status.landmarks_refused; ++i) {
    reject(rejection(RejectReason::too_many, "a new landmark is not taken: there are ",
                     status.landmarks, " in ", status.particles, " particles; the limits are ",
                     options_.filter.map.max_landmarks, " landmarks and ",
                     options_.filter.map.max_estimates, " in all particles together"));
  }
}

void FastSlamPipeline::note_observations(ros::Time stamp, const LandmarkScan& used,
                                         double duration) {
  if (own_sinks_.scan) own_sinks_.scan(used);
  if (search_) return search(stamp, used);
  const ScanPicture picture = {belief_->mean, used.sensor, used.observations, filter_->outcomes()};
  note_outcomes(picture, duration);
  note_scene(picture);
  recover(stamp, used);
  note_findings(stamp, picture);
  latest_ = {stamp, picture};
  if (own_sinks_.updated) own_sinks_.updated(stamp, filter_.get());
}

// Until a landmark fits that was known before them, new ones may hang on odometry alone.
void FastSlamPipeline::note_adrift(const ScanPicture& scan) {
  const auto is_anchor = [&](const ObservationOutcome& outcome) {
    return !outcome.is_new && outcome.is_believed() && adrift_.count(outcome.landmark) == 0;
  };
  if (std::any_of(scan.outcomes.begin(), scan.outcomes.end(), is_anchor)) {
    adrift_.clear();
    doubts_ = 0;
    return;
  }
  for (const ObservationOutcome& outcome : scan.outcomes) {
    if (outcome.is_new) adrift_.insert(outcome.landmark);
  }
  // All of the map cannot be: the first landmarks are what is known.
  if (static_cast<int>(adrift_.size()) >= filter_->status().landmarks) adrift_.clear();
}

// What the filter did not believe is counted: a misread id, a reflection, or a robot that is lost.
// One landmark that was moved says the same time and again, so that counts once.
void FastSlamPipeline::note_outcomes(const ScanPicture& scan, double duration) {
  note_adrift(scan);
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    const ObservationOutcome& outcome = scan.outcomes[k];
    if (outcome.is_new) continue;
    const bool is_believed = outcome.is_believed();
    const RangeBearingObservation& z = scan.observations[k];
    const bool is_again = !is_believed && z.id >= 0 && doubts_ > 0 && z.id == doubted_id_;
    if (!is_again) {
      lost_.observe(is_believed ? kBelievedDistance : kUnbelievedDistance, 2, duration);
      duration = 0.0;
    }
    if (is_believed) continue;
    doubts_ = is_again ? doubts_ + 1 : 1;
    doubted_id_ = z.id;
    ++not_believed_;
    last_not_believed_ = "landmark " + std::to_string(z.id) + " seen at " + number_text(z.range) +
                         " m and " + number_text(z.bearing) + " rad";
  }
}

void FastSlamPipeline::note_scene(const ScanPicture& scan) {
  const Pose2 sensor = compose(scan.robot, scan.sensor);
  scene_.extend(Eigen::Vector2d(scan.robot.x, scan.robot.y));
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    if (!scan.outcomes[k].is_new && !scan.outcomes[k].is_believed()) continue;
    const RangeBearingObservation& z = scan.observations[k];
    scene_.extend(place_seen(sensor, z.range, z.bearing));
  }
}

void FastSlamPipeline::note_given_map() {
  const Pose2 robot = filter_->estimate().mean;
  const std::vector<LandmarkEstimate> map = filter_->map();
  scene_ = Eigen::AlignedBox2d(Eigen::Vector2d(robot.x, robot.y));
  for (const LandmarkEstimate& landmark : map) scene_.extend(landmark.mean);
  findings_.clear();
  adrift_.clear();
  doubts_ = 0;
  predictions_.clear();
  belief_was_wrong_ = false;
  doubtful_scans_.clear();
  given_.reset();
  is_found_ = false;
  if (!filter_->is_placed()) given_ = filter_->memory().state().time;
  changes_.start(map);
}

// Over the rectangle of the landmarks, in all directions.
void FastSlamPipeline::spread_over_map() {
  Eigen::AlignedBox2d area;
  for (const LandmarkEstimate& landmark : filter_->map()) area.extend(landmark.mean);
  PoseEstimate anywhere;
  anywhere.mean = {area.center().x(), area.center().y(), 0.0};
  // Of a uniform density over a length: its square over twelve.
  anywhere.covariance.setZero();
  anywhere.covariance.diagonal() << std::pow(area.sizes().x(), 2) / 12.0 + kSmallestScene,
      std::pow(area.sizes().y(), 2) / 12.0 + kSmallestScene, std::pow(2.0 * kPi, 2) / 12.0;
  filter_->set_poses(anywhere);
  predictions_.clear();
  begins_search_ = true;
}

void FastSlamPipeline::global_localization() {
  if (filter_->map().empty()) {
    throw Error(
        "global_localization: there is no map yet to localize in; load one, or give initialpose");
  }
  spread_over_map();
  take_new_belief();
  log(LogLevel::info, "global localization in the whole map");
}

void FastSlamPipeline::search(ros::Time stamp, const LandmarkScan& scan) {
  const bool with_ids =
      filter_->association() == DataAssociation::known ||
      (filter_->association() == DataAssociation::automatic && scan.observations.front().id >= 0);
  const std::optional<PoseEstimate> found =
      search_->add(static_cast<std::int64_t>(stamp.toNSec()), scan.observations, scan.sensor,
                   options_.filter.sensor, filter_->map(), with_ids);
  if (!found && search_->is_ambiguous() && !std::exchange(search_is_ambiguous_, true)) {
    log(LogLevel::info,
        "global localization: what was seen lately fits the map from several places; drive on, to "
        "where they differ");
  }
  if (!found) return;
  filter_->set_poses(*found);
  predictions_.clear();
  log(LogLevel::info, "localized: the observations fit the map at (" + number_text(found->mean.x) +
                          ", " + number_text(found->mean.y) + ") m, heading " +
                          number_text(found->mean.heading) + " rad");
  take_new_belief();
}

void FastSlamPipeline::recover(ros::Time stamp, const LandmarkScan& scan) {
  const auto time = static_cast<std::int64_t>(stamp.toNSec());
  const std::optional<PoseEstimate> found =
      filter_->recover(scan.observations, scan.sensor, time, lost_.probability());
  if (!found) return;
  note_wrong_belief();
  log(LogLevel::warning, "lost: the latest landmarks fit the map at (" +
                             std::to_string(found->mean.x) + ", " + std::to_string(found->mean.y) +
                             "); the robot is placed there");
  if (filter_->path().empty()) {
    take_new_belief();
  } else {  // the whole drive was solved for anew
    lost_.reset();
    take_belief();
  }
}

void FastSlamPipeline::forget_observations() {
  tags_.clear();
  latest_.reset();
}

void FastSlamPipeline::forget_past() {
  search_.reset();
  search_is_ambiguous_ = false;
  if (std::exchange(begins_search_, false)) search_.emplace();
  latest_.reset();
  path_stamps_.clear();
}

OdometryIncrement FastSlamPipeline::motion_since_update() const {
  return filter_->corrected(odometry_.since());
}

double FastSlamPipeline::extent(const PoseEstimate& belief) const {
  Eigen::AlignedBox2d scene = scene_;
  scene.extend(Eigen::Vector2d(belief.mean.x, belief.mean.y));
  return std::max(scene.diagonal().norm(), kSmallestScene);
}

void FastSlamPipeline::save_filter(FastSlamCheckpoint* checkpoint) {
  checkpoint->scene = scene_;
  checkpoint->filter = saved_map(filter_.get(), static_cast<int>(filter_->particles().size()));
  checkpoint->filter.frame = options_.frames.map;
}

void FastSlamPipeline::load_filter(const FastSlamCheckpoint& checkpoint) {
  filter_->load(checkpoint.filter);
  loaded_map_.clear();
  note_given_map();
  scene_ = checkpoint.scene;
}

}  // namespace pf_resampling
