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
constexpr double kSlipsApart = 5.0;  // s
// How far and by what angle a belief jumps that was wrong; and the squared error, three degrees of
// freedom, that names a slip, as in a redraw.
constexpr double kJump = 0.3;         // m
constexpr double kRedrawnJump = 1.0;  // m, where a map was loaded
constexpr double kTurnedJump = 0.1;   // rad
constexpr double kSlipSquare = 40.0;
constexpr double kSlipWindow = 3.0;   // s
constexpr double kGrossScale = 0.4;   // of the odometry, less 1
constexpr double kLeastScale = 1e-3;  // of odometry that counts while the robot stands
constexpr double kDrawnAlong = 30.0;  // s, and
constexpr double kDrawnFar = 6.0;     // m: one that is farther away is not believed
// How far a sensor's z axis may be off the robot's: cosine.
constexpr double kUpright = 0.9;

RangeBearingObservation to_observation(const LandmarkObservation& message) {
  return {message.id, message.range, wrap_angle(message.bearing), message.range_variance,
          message.bearing_variance};
}

bool is_same_slip(const Finding& one, const Finding& other) {
  return one.kind == other.kind && one.begin < other.end + kSlipsApart &&
         other.begin < one.end + kSlipsApart;
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
  filter_->set_deferred_redraws(options_.deferred);
  if (options_.deferred) redraws_.emplace(sinks_.stopwatch, &take_overs_);
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
  if (redraws_) {
    redraws_->update(filter_.get(), odometry, observations, used.sensor);
  } else {
    filter_->update(odometry, observations, used.sensor);
  }
  const FastSlamStatus& status = filter_->status();
  for (std::int64_t i = refused_before; i < status.landmarks_refused; ++i) {
    reject(rejection(RejectReason::too_many, "a new landmark is not taken: there are ",
                     status.landmarks, " in ", status.particles, " particles; the limits are ",
                     options_.filter.map.max_landmarks, " landmarks and ",
                     options_.filter.map.max_estimates, " in all particles together"));
  }
}

bool FastSlamPipeline::apply_finished_redraw() {
  return redraws_ && redraws_->take_over(filter_.get());
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

// What the filter did not believe is counted: a misread id, a reflection, or a robot that is lost.
// One landmark that was moved says the same time and again, so that counts once.
void FastSlamPipeline::note_outcomes(const ScanPicture& scan, double duration) {
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
    doubts_ = is_again ? doubts_ + 1 : is_believed ? 0 : 1;
    doubted_id_ = z.id;
    if (is_believed) continue;
    ++not_believed_;
    last_not_believed_ = "landmark " + std::to_string(z.id) + " seen at " + number_text(z.range) +
                         " m and " + number_text(z.bearing) + " rad";
  }
}

// ---- findings ---------------------------------------------------------------------------------

void FastSlamPipeline::note_findings(ros::Time stamp, const ScanPicture& scan) {
  const bool is_redrawn =
      filter_->status().redraws != std::exchange(redraws_searched_, filter_->status().redraws);
  if (is_redrawn) {
    note_slips(stamp);
    note_odometry_scale(stamp);
  }
  note_jump(stamp, scan, is_redrawn && given_ ? kRedrawnJump : kJump);
  if (is_redrawn) {  // what was seen under a belief that was wrong is where the path has it now
    changes_.follow(filter_->map());
    const bool is_settled = !filter_->memory().distrusts_odometry();
    if (is_settled && std::exchange(belief_was_wrong_, false)) {
      changes_.retrace(filter_->path(), filter_->map());
    }
  }
  if (watches_landmarks()) note_changes(stamp, scan);
}

// Where the robot is not where odometry has brought it, what did not fit before may fit now. In a
// map that is known, the wheels slipped: at once, or within seconds while the landmarks in view
// held the belief. `least`: m, of a belief that was wrong; by less a redraw moves all of a map that
// is gone on from. In one that is being made, the map was wrong.
void FastSlamPipeline::note_jump(ros::Time stamp, const ScanPicture& scan, double least) {
  const bool is_known = options_.filter.map.frozen;
  const auto error = [&](const Prediction& prediction) {
    const Pose2 &is = belief_->mean, expected = prediction.pose.mean;
    return Eigen::Vector3d(is.x - expected.x, is.y - expected.y,
                           wrap_angle(is.heading - expected.heading));
  };
  const auto is_jump = [&](const Eigen::Vector3d& by) {
    return by.head<2>().norm() >= least || std::abs(by[2]) >= kTurnedJump;
  };
  if (!predictions_.empty() && is_jump(error(predictions_.back()))) note_wrong_belief();
  if (!predictions_.empty() && is_known) {
    const Prediction& oldest = predictions_.front();
    const Eigen::Vector3d by = error(oldest);
    const double square = by.dot((oldest.pose.covariance + belief_->covariance).llt().solve(by));
    if (is_jump(by) && square > kSlipSquare) {
      note_wrong_belief();
      Finding slip;
      slip.begin = oldest.since.toSec();
      slip.end = stamp.toSec();
      slip.place = {belief_->mean.x, belief_->mean.y};
      slip.size = by.head<2>().norm();
      slip.probability = 1.0 - std::exp(-0.5 * square);
      const bool is_part =
          std::any_of(findings_.begin(), findings_.end(), [&](const Finding& known) {
            return is_same_slip(slip, known) && slip.size < known.size;
          });
      if (!is_part) note_finding(slip);
    }
  }
  // Of a robot that no landmark confirms nothing is expected.
  const auto is_confirmed = [](const ObservationOutcome& outcome) {
    return !outcome.is_new && outcome.is_believed();
  };
  if (std::none_of(scan.outcomes.begin(), scan.outcomes.end(), is_confirmed)) return;
  const ros::Duration window(is_known ? kSlipWindow : 0.0);
  const auto is_old = [&](const Prediction& prediction) {  // or of a clock that was set back since
    return prediction.since + window < stamp || stamp < prediction.since;
  };
  while (!predictions_.empty() && is_old(predictions_.front())) predictions_.pop_front();
  predictions_.push_back({stamp, *belief_});
}

void FastSlamPipeline::note_wrong_belief() {
  changes_.forget_latest();
  belief_was_wrong_ = true;
}

// Where the whole drive, solved for anew, contradicts the odometry.
void FastSlamPipeline::note_slips(ros::Time stamp) {
  const double began = stamp.toSec() - filter_->memory().state().time;
  const std::vector<Slip> slips = filter_->memory().slips();
  const auto is_explained = [&](const Finding& finding) {
    const auto holds = [&](const Slip& slip) {
      return finding.begin <= began + slip.end && began + slip.begin <= finding.end;
    };
    return finding.kind == FindingKind::wheels_slipped && finding.begin >= began &&
           std::none_of(slips.begin(), slips.end(), holds);
  };
  withdraw(is_explained);
  for (const Slip& slip : slips) {
    // Where a saved map is gone on from, the robot may be anywhere.
    if (given_ && slip.begin <= *given_ + kSlipsApart && *given_ <= slip.end) continue;
    Finding finding;
    finding.kind = FindingKind::wheels_slipped;
    finding.begin = began + slip.begin;
    finding.end = began + slip.end;
    finding.place = {slip.pose.x, slip.pose.y};
    finding.size = slip.distance;
    finding.probability = 1.0 - std::exp(-0.5 * slip.square);
    note_finding(finding);
  }
}

void FastSlamPipeline::note_odometry_scale(ros::Time stamp) {
  const SensorConstants& constants = filter_->memory().graph().constants;
  for (const auto constant : {SensorConstant::distance_scale, SensorConstant::turn_scale}) {
    const double scale = 1.0 + constants[constant];
    Finding finding;
    finding.kind = constant == SensorConstant::turn_scale ? FindingKind::odometry_turns_wrong
                                                          : FindingKind::odometry_counts_wrong;
    if (std::abs(constants[constant]) < kGrossScale) {  // or not any more
      withdraw([&](const Finding& known) { return known.kind == finding.kind; });
      continue;
    }
    const auto known = std::find_if(findings_.begin(), findings_.end(), [&](const Finding& other) {
      return other.kind == finding.kind;
    });
    finding.begin = known == findings_.end() ? stamp.toSec() : known->begin;
    finding.end = stamp.toSec();
    finding.place = {belief_->mean.x, belief_->mean.y};
    finding.size = 1.0 / std::copysign(std::max(std::abs(scale), kLeastScale), scale);
    finding.probability = 1.0;
    finding.is_open = true;
    note_finding(finding);
  }
}

// Without ids, a landmark of a map that grows may vanish for other reasons; and without a redraw
// nobody says how those move that are not in view.
bool FastSlamPipeline::watches_landmarks() const {
  if (options_.filter.map.frozen) return true;
  return filter_->association() == DataAssociation::known &&
         options_.filter.strategy.renewal == Renewal::redraw;
}

// It says what is gone, and moves no particle.
void FastSlamPipeline::note_empty_scan(ros::Time stamp, const Pose2& sensor) {
  if (!belief_ || search_ || !watches_landmarks() || stamp < odometry_.used()) return;
  const PoseEstimate there = moved_by(*belief_, odometry_.until(stamp, noise()));
  note_changes(stamp, {there.mean, sensor, {}, {}});
}

void FastSlamPipeline::note_changes(ros::Time stamp, const ScanPicture& scan) {
  const Pose2 eye = compose(scan.robot, scan.sensor);
  const bool with_ids = filter_->association() == DataAssociation::known;
  std::vector<MapSighting> sightings;
  for (std::size_t k = 0; k < scan.outcomes.size(); ++k) {
    const RangeBearingObservation& z = scan.observations[k];
    const ObservationOutcome& outcome = scan.outcomes[k];
    MapSighting sighting;
    sighting.id = with_ids ? z.id : outcome.landmark;
    if (sighting.id < 0) continue;
    const auto mapped = filter_->landmark(sighting.id);
    if (with_ids && !mapped && !outcome.is_new) continue;  // of nothing in the map
    if (mapped) sighting.mapped = mapped->mean;
    sighting.seen = place_seen(eye, z.range, z.bearing);
    sighting.is_believed = outcome.is_new || outcome.is_believed();
    sighting.is_started = outcome.is_new;
    sighting.sigma =
        std::sqrt(0.5 * (range_variance(options_.filter.sensor, z) +
                         z.range * z.range * bearing_variance(options_.filter.sensor, z)));
    sightings.push_back(sighting);
  }
  const MapScan seen = {stamp.toSec(), path_stamps_.size() - 1,          belief_->mean,
                        eye,           position_sigma(filter_->place()), sightings};
  changes_.remember(seen);
  if (filter_->memory().distrusts_odometry()) return note_wrong_belief();
  changes_.add(seen);
  const std::vector<Finding> found = changes_.findings();
  // In a map that is known, a landmark that was moved may have drawn the belief along.
  const auto is_withdrawn = [&](const Finding& known) {
    const bool is_slip = known.kind == FindingKind::wheels_slipped;
    if (!is_slip && !is_of_landmark(known)) return false;
    const auto explains = [&](const Finding& finding) {
      return is_slip ? finding.kind != FindingKind::landmark_gone && known.size < finding.size &&
                           finding.size < kDrawnFar &&
                           std::abs(finding.begin - known.begin) < kDrawnAlong
                     : finding.id == known.id;
    };
    return (!is_slip || options_.filter.map.frozen) &&
           std::any_of(found.begin(), found.end(), explains) == is_slip;
  };
  withdraw(is_withdrawn);
  for (const Finding& finding : found) note_finding(finding);
}

void FastSlamPipeline::withdraw(const std::function<bool(const Finding&)>& is_withdrawn) {
  findings_.erase(std::remove_if(findings_.begin(), findings_.end(), is_withdrawn),
                  findings_.end());
}

void FastSlamPipeline::note_finding(const Finding& finding) {
  const auto known = std::find_if(findings_.begin(), findings_.end(), [&](const Finding& other) {
    if (is_of_landmark(finding)) return other.id == finding.id;
    return finding.kind == other.kind &&
           (finding.kind != FindingKind::wheels_slipped || is_same_slip(finding, other));
  });
  const bool is_new = known == findings_.end() || known->kind != finding.kind;
  const auto place = known - findings_.begin();
  if (known == findings_.end()) findings_.emplace_back();
  findings_[static_cast<std::size_t>(place)] = finding;
  if (is_new) log(LogLevel::warning, findings_in_words()[static_cast<std::size_t>(place)].text);
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
  predictions_.clear();
  belief_was_wrong_ = false;
  given_.reset();
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
  const double lost = lost_.probability();
  const std::optional<PoseEstimate> found =
      redraws_ ? redraws_->recover(filter_.get(), scan.observations, scan.sensor, time, lost)
               : filter_->recover(scan.observations, scan.sensor, time, lost);
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
