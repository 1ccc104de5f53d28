// What FastSlamPipeline finds to have changed, or to be wrong.
#include <algorithm>
#include <cmath>
#include <utility>

#include "fastslam_node/fastslam_pipeline.hpp"

namespace pf_resampling {
namespace {

constexpr double kSlipsApart = 5.0;  // s
// How far and by what angle a belief jumps that was wrong; and the squared error, three degrees of
// freedom, that names a slip, as in a redraw.
constexpr double kJump = 0.3;         // m
constexpr double kRedrawnJump = 1.0;  // m, where a map was loaded
constexpr double kTurnedJump = 0.1;   // rad
constexpr double kSlipSquare = 40.0;
constexpr double kSlipWindow = 3.0;         // s
constexpr double kGrossScale = 0.4;         // of the odometry, less 1
constexpr double kLeastScale = 1e-3;        // of odometry that counts while the robot stands
constexpr std::size_t kMostDoubtful = 300;  // scans
constexpr double kFound = 0.5;              // m
constexpr double kDrawnAlong = 30.0;        // s, and
constexpr double kDrawnFar = 6.0;           // m: one that is farther away is not believed

bool is_same_slip(const Finding& one, const Finding& other) {
  return one.kind == other.kind && one.begin < other.end + kSlipsApart &&
         other.begin < one.end + kSlipsApart;
}

}  // namespace

void FastSlamPipeline::note_findings(ros::Time stamp, const ScanPicture& scan) {
  if (given_ && !is_found_) {
    given_ = filter_->memory().state().time;
    is_found_ = filter_->is_placed() && position_sigma(filter_->place()) < kFound;
  }
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
    if (is_settled && std::exchange(belief_was_wrong_, false) &&
        changes_.retrace(filter_->path(), filter_->map())) {
      doubtful_scans_.clear();
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
  doubtful_scans_.clear();
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
    if (given_ && slip.begin <= *given_ + kSlipsApart) continue;
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
  if (filter_->memory().distrusts_odometry()) {
    belief_was_wrong_ = true;
    doubtful_scans_.push_back(seen);
    if (doubtful_scans_.size() > kMostDoubtful) doubtful_scans_.pop_front();
    return;
  }
  // The belief did not jump: it was right.
  for (const MapScan& scan_before : doubtful_scans_) changes_.add(scan_before);
  doubtful_scans_.clear();
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

}  // namespace pf_resampling
