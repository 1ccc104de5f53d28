// What of the messages that BeaconMclPipeline gives out is its own.
#include <algorithm>
#include <cmath>
#include <limits>

#include "beacon_mcl_node/beacon_markers.hpp"
#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "pf_resampling_core/range_memory/radio_remark.hpp"
#include "src/diagnostics/diagnostics.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

// Beacons stand still: their markers are repeated for viewers that come late.
constexpr double kBeaconMarkerPeriod = 5.0;  // s
// What is found changes; places that are no more vanish.
constexpr double kFoundPeriod = 1.0;    // s
constexpr double kFoundLifetime = 2.5;  // s
// A beacon is silent after so long, and so many of its usual periods.
constexpr double kBeaconSilence = 5.0;  // s
// Without that many the path is that of the odometry.
constexpr std::size_t kFewestBeacons = 2;
constexpr double kSilentPeriods = 8.0;
constexpr double kNewFinding = 10.0;  // s
// Between so many keyframes the true motion over the odometry's, less 1, that is a fault.
constexpr int kFewestKeyframes = 20;
constexpr double kGrossScale = 0.4;

}  // namespace

// The listed ones; or all places where the memory of all ranges takes beacons to be.
std::vector<PlacedBeacon> BeaconMclPipeline::places() const {
  std::vector<PlacedBeacon> places;
  const auto add = [&](const Beacon& beacon) -> PlacedBeacon& {
    const bool is_new = places.empty() || places.back().beacon.id != beacon.id;
    PlacedBeacon place;
    place.beacon = beacon;
    place.color = places.empty() ? 0 : places.back().color + (is_new ? 1 : 0);
    return places.emplace_back(place);
  };
  if (!finds_beacons()) {
    for (const Beacon& beacon : filter_->beacons()) add(beacon);
    return places;
  }
  const std::vector<Beacon>& listed = filter_->memory()->beacons();
  for (const RadioKnowledge& radio : filter_->memory()->radios()) {
    Beacon beacon;
    beacon.id = radio.id;
    beacon.is_planar = true;
    for (const Beacon& other : listed) {
      if (other.id == radio.id) beacon = other;
    }
    for (const RadioPlace& fits : radio.places) {
      beacon.position.head<2>() = fits.position;
      PlacedBeacon& place = add(beacon);
      place.covariance = fits.covariance;
      place.probability = fits.probability;
    }
  }
  return places;
}

void BeaconMclPipeline::publish_map_if_due(ros::Time stamp) {
  if (!own_sinks_.beacon_map || !finds_beacons() || !is_due(kFoundPeriod, stamp, &last_map_))
    return;
  BeaconMap map;
  map.header.stamp = stamp;
  map.header.frame_id = options_.frames.map;
  for (const PlacedBeacon& place : places()) {
    BeaconPlace message;
    const Eigen::Vector3d& there = place.beacon.position;
    message.id = place.beacon.id;
    message.position =
        make_point(there.x(), there.y(),
                   place.beacon.is_planar ? std::numeric_limits<double>::quiet_NaN() : there.z());
    message.covariance = {place.covariance(0, 0), place.covariance(0, 1), place.covariance(1, 0),
                          place.covariance(1, 1)};
    message.probability = place.probability;
    map.places.push_back(message);
  }
  own_sinks_.beacon_map(map);
}

visualization_msgs::MarkerArray BeaconMclPipeline::markers(ros::Time stamp) {
  const MarkerFrame frame = {options_.frames.map, stamp};
  const std::vector<PlacedBeacon> places = this->places();
  const double extent = extent_of(places);
  const double line = 0.002 * extent;
  visualization_msgs::MarkerArray markers;
  if (is_due(finds_beacons() ? kFoundPeriod : kBeaconMarkerPeriod, stamp, &last_beacons_)) {
    append(beacon_markers(frame, places, 0.025 * extent, finds_beacons() ? kFoundLifetime : 0.0),
           &markers);
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const int id = places[i].beacon.id;
    const auto latest = latest_ranges_.find(id);
    if (latest == latest_ranges_.end()) continue;
    const double age = (stamp - latest->second.stamp).toSec();
    if (age > options_.ring_lifetime) continue;
    const double distance = filter_->corrected_range(id, latest->second.range);
    markers.markers.push_back(range_ring_marker(frame, places[i], static_cast<int>(i), distance,
                                                latest->second.antenna_height,
                                                options_.ring_lifetime - age, line));
  }
  if (const auto belief = estimate()) {
    append(pose_ellipse_markers(frame, *belief, 1.5 * line), &markers);
  }
  return markers;
}

void BeaconMclPipeline::fill_in(FilterStatus* status) const {
  const BeaconMclStatus& filter = filter_->status();
  status->observation = filter.observation;
  status->innovation = filter.innovation;
  status->innovation_sigma = filter.innovation_sigma;
  for (const CalibrationEstimate& estimate : filter_->calibration()) {
    CalibrationStatus radio;
    radio.beacon = estimate.beacon;
    radio.scale = estimate.scale;
    radio.scale_sigma = estimate.scale_sigma;
    radio.bias = estimate.bias;
    radio.bias_sigma = estimate.bias_sigma;
    status->calibration.push_back(radio);
  }
  status->yaw_rate_bias = yaw_rate_bias_.mean;
  status->yaw_rate_bias_sigma = yaw_rate_bias_.sigma;
  const RangeMemory* memory = filter_->memory();
  if (memory != nullptr && filter_->is_drawn_from_memory()) {
    const RangeMemory::Newest newest = memory->newest(memory->modes().front());
    const auto add = [&](const char* name, CommonUnknown::Index of, double offset, double factor) {
      const int at = KeyframeUnknown::count + of;
      status->systematic_errors.push_back(
          to_systematic_error(name, factor * (offset + newest.mean[at]),
                              std::abs(factor) * std::sqrt(newest.covariance(at, at))));
    };
    const OdometryFactors& factors = memory->odometry_factors();
    add("distance_scale", CommonUnknown::distance_scale, 1.0, factors.distance);
    add("turn_scale", CommonUnknown::turn_scale, 1.0, factors.turn);
    add("antenna_x", CommonUnknown::lever_x, 0.0, 1.0);
    add("antenna_y", CommonUnknown::lever_y, 0.0, 1.0);
    add("antenna_z", CommonUnknown::lever_z, 0.0, 1.0);
  }
  if (!finds_beacons()) return;
  std::string ambiguous;
  for (const RadioKnowledge& radio : filter_->memory()->radios()) {
    if (radio.places.size() < 2) continue;
    ambiguous += (ambiguous.empty() ? "" : ", ") + std::to_string(radio.id);
  }
  if (ambiguous.empty()) return;
  status->health_text +=
      " More than one place fits beacon " + ambiguous + ": drive a turn near it.";
}

std::vector<Finding> BeaconMclPipeline::findings() const {
  std::vector<Finding> findings;
  for (const auto& [id, finding] : findings_) findings.push_back(finding);
  for (const Finding& finding : odometry_findings_) findings.push_back(finding);
  return findings;
}

// The ranges bring the path to where odometry alone does not lead. Noise makes true over measured
// look small in one regression and large in the other: a scale that is wrong shows in both.
void BeaconMclPipeline::note_odometry_scales(ros::Time stamp, const RangeMemory& memory) {
  const RangeGraph& graph = memory.graph();
  if (memory.modes().empty() || graph.keyframes() < kFewestKeyframes) return;
  const std::vector<KeyframeState>& keyframes = memory.modes().front().estimate.keyframes;
  Eigen::Array2d measured = Eigen::Array2d::Zero(), both = measured, estimated = measured;
  for (std::size_t i = 0; i + 1 < keyframes.size(); ++i) {
    const Pose2& odometry = graph.motions[i].mean;
    const Pose2 moved = relative(pose_of(keyframes[i]), pose_of(keyframes[i + 1]));
    const double along = odometry.x * moved.x + odometry.y * moved.y;
    measured += Eigen::Array2d(std::pow(odometry.x, 2) + std::pow(odometry.y, 2),
                               std::pow(odometry.heading, 2));
    estimated +=
        Eigen::Array2d(std::pow(moved.x, 2) + std::pow(moved.y, 2), std::pow(moved.heading, 2));
    both += Eigen::Array2d(along, odometry.heading * moved.heading);
  }
  const OdometryFactors& factors = memory.odometry_factors();
  measured *= Eigen::Array2d(std::pow(factors.distance, 2), std::pow(factors.turn, 2));
  both *= Eigen::Array2d(factors.distance, factors.turn);
  for (int k = 0; k < 2; ++k) {
    const double least = both[k] / measured[k] - 1.0;
    const double most = estimated[k] / both[k] - 1.0;
    const bool is_gross = std::abs(least) >= kGrossScale && std::abs(most) >= kGrossScale;
    if (!is_gross || (least > 0.0) != (most > 0.0)) continue;
    Finding finding;
    finding.kind = k == 1 ? FindingKind::odometry_turns_wrong : FindingKind::odometry_counts_wrong;
    finding.begin = stamp.toSec() - memory.time();
    finding.end = stamp.toSec();
    finding.place = keyframes.back().head<2>();
    finding.size = std::copysign(std::sqrt(measured[k] / estimated[k]), both[k]);
    finding.probability = 1.0;
    finding.is_open = true;
    odometry_findings_.push_back(finding);
  }
}

// Its place or bias is free in the memory: the pose does not suffer.
void BeaconMclPipeline::note_findings(ros::Time stamp) {
  const RangeMemory* memory = filter_->memory();
  odometry_findings_.clear();
  if (memory == nullptr) return findings_.clear();
  note_odometry_scales(stamp, *memory);
  for (const RangeSlip& slip : memory->slips()) {
    Finding finding;
    finding.kind = FindingKind::wheels_slipped;
    finding.begin = stamp.toSec() - memory->time() + slip.begin;
    finding.end = stamp.toSec() - memory->time() + slip.end;
    finding.place = {slip.pose.x, slip.pose.y};
    finding.size = slip.size;
    finding.probability = 1.0;
    odometry_findings_.push_back(finding);
  }
  for (const RadioKnowledge& radio : memory->radios()) {
    const std::string remark = remark_on(radio, filter_->beacons());
    if (remark.empty()) {
      findings_.erase(radio.id);
      continue;
    }
    const auto [found, is_new] = findings_.try_emplace(radio.id);
    Finding& finding = found->second;
    if (is_new) finding.begin = stamp.toSec();
    finding.id = radio.id;
    finding.end = stamp.toSec();
    finding.probability = radio.fault;
    finding.words = remark;
    for (const Beacon& beacon : filter_->beacons()) {
      if (beacon.id == radio.id) finding.place = beacon.position.head<2>();
    }
    if (radio.account == RadioAccount::biased) {
      finding.kind = FindingKind::beacon_biased;
      finding.size = radio.calibration.bias;
      finding.sigma = radio.bias_sigma;
      continue;
    }
    if (radio.repeats) {
      finding.kind = FindingKind::beacon_repeats;
      continue;
    }
    const RadioPlace& place = radio.places.front();
    finding.kind = radio.in_place_of >= 0 ? FindingKind::beacon_swapped : FindingKind::beacon_moved;
    finding.size = (place.position - finding.place).norm();
    finding.sigma = std::sqrt(0.5 * place.covariance.trace());
    finding.place = place.position;
  }
}

std::string BeaconMclPipeline::waits_for() const {
  if (!filter_) return "the beacons";
  return belief_ ? "odometry" : "ranges to start from";
}

bool BeaconMclPipeline::BeaconHealth::is_silent(ros::Time now) const {
  return period > 0.0 && (now - last).toSec() > kBeaconSilence + kSilentPeriods * period;
}

void BeaconMclPipeline::add_health(HealthInputs* inputs) const {
  if (const RangeMemory* memory = filter_->memory()) {
    // A place that is taken for its mirror bends the path, and a beacon that is not as listed.
    const bool is_known = finds_beacons() ? !memory->is_ambiguous() &&
                                                filter_->found_beacons().size() >= kFewestBeacons
                                          : memory->are_judged();
    if (!is_known) inputs->position_unknown = 1.0;
    inputs->is_contradicted = memory->has_slipped();
    // Another one may explain the ranges of the next seconds better.
    const bool is_new = std::any_of(findings_.begin(), findings_.end(), [&](const auto& finding) {
      return last_observation_.toSec() - finding.second.begin < kNewFinding;
    });
    if (memory->is_torn() || is_new) {
      inputs->misfit = "the ranges of a beacon, it is not clear of which,";
    }
  }
  for (const auto& [id, health] : beacon_health_) {
    if (does_not_fit(health)) inputs->misfit = "the ranges of a beacon";
  }
}

// One that fails shows beside the others; when all do not fit, it is the belief that is wrong.
void BeaconMclPipeline::add_diagnostics(ros::Time stamp, diagnostic_msgs::DiagnosticArray* array) {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus status = make_diagnostic(options_.name + ": beacons");
  if (!filter_) worsen(DiagnosticStatus::WARN, "none yet", &status);
  const bool is_lost = lost_.probability() > kLikelyLost;
  for (const auto& [id, health] : beacon_health_) {
    const std::string beacon = "beacon " + std::to_string(id);
    const double silence = (stamp - health.last).toSec();
    const bool others_are_heard = (stamp - last_observation_).toSec() < kBeaconSilence;
    if (others_are_heard && health.is_silent(stamp)) {
      worsen(DiagnosticStatus::WARN,
             beacon + " has not been heard for " + number_text(silence) + " s", &status);
    }
    if (!is_lost && does_not_fit(health)) {
      worsen(DiagnosticStatus::WARN,
             "the ranges of " + beacon + " do not fit: moved, reflected, or faulty?", &status);
    }
    add_value(beacon + ": ranges beyond 3 sigma [%]", number_text(100.0 * health.misfit_share),
              &status);
    add_value(beacon + ": last range [s ago]", number_text(silence), &status);
  }
  if (status.message.empty()) status.message = "fine";
  array->status.push_back(status);
}

}  // namespace pf_resampling
