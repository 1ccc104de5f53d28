#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"

#include <algorithm>

#include "beacon_mcl_node/beacon_checks.hpp"
#include "beacon_mcl_node/beacon_file.hpp"
#include "beacon_mcl_node/beacon_markers.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/new_file.hpp"
#include "src/messages/conversions.hpp"
#include "src/odometry/input_checks.hpp"
#include "src/pipeline/filter_pipeline_impl.hpp"

namespace pf_resampling {

template class FilterPipeline<BeaconMclTypes>;

namespace {

// Weight of a new range in the running means of a beacon: of its period, and of the share of its
// ranges beyond three sigma.
constexpr double kPeriodRate = 0.1;
constexpr double kMisfitRate = 0.05;
constexpr double kThreeSigmaSquared = 9.0;
// Share of a beacon's latest ranges beyond three sigma, more than of other beacons' ranges. Seven
// in a row make it so; where one in eight or more are wild, it is three standard deviations off.
constexpr double kMisfitShare = 0.3;
// Were all ranges taken to be wild, no filter would ever be lost.
constexpr double kMostOutliers = 0.3;

bool same_beacons(const std::vector<Beacon>& first, const std::vector<Beacon>& second) {
  return std::equal(first.begin(), first.end(), second.begin(), second.end(),
                    [](const Beacon& a, const Beacon& b) {
                      return a.id == b.id && a.is_planar == b.is_planar && a.position == b.position;
                    });
}

}  // namespace

BeaconMclPipeline::BeaconMclPipeline(const BeaconMclPipelineOptions& options,
                                     const BeaconMclSinks& sinks)
    : FilterPipeline(options, sinks), names_(names_of(options)), own_sinks_(sinks) {
  for (const auto& [frame, place] : options_.antennas) {
    frames_.add(options_.frames.base, frame, place);
  }
  if (options_.beacons.size() > static_cast<std::size_t>(options_.max_beacons)) {
    throw Error("there are " + std::to_string(options_.beacons.size()) +
                " beacons in the configuration, more than the limit of " +
                std::to_string(options_.max_beacons) + "; give fewer");
  }
  if (!options_.beacons.empty() || finds_beacons()) start(make_filter(options_.beacons));
}

std::unique_ptr<BeaconMcl> BeaconMclPipeline::make_filter(const std::vector<Beacon>& beacons) {
  const std::vector<std::pair<int, RangeCalibration>> calibration(options_.calibration.begin(),
                                                                  options_.calibration.end());
  auto filter = std::make_unique<BeaconMcl>(options_.filter, beacons,
                                            static_cast<std::uint64_t>(options_.seed), calibration);
  if (options_.deferred) filter->set_deferred_solutions(&take_overs_);
  return filter;
}

// ---- messages in ------------------------------------------------------------------------------

void BeaconMclPipeline::handle(const sensor_msgs::Range& message) {
  const RangeReading reading = read_range(message, names_);
  if (reading.rejection) return reject("sensor_ranges", *reading.rejection);
  if (reading.range) handle(*reading.range);
}

void BeaconMclPipeline::handle(const BeaconArray& message) {
  if (const auto rejection = check(message, options_.frames, options_.max_beacons)) {
    return reject("beacons", *rejection);
  }
  const std::vector<Beacon> beacons = to_beacons(message);
  if (filter_ && same_beacons(beacons, filter_->beacons())) return;
  if (!options_.beacons.empty()) {
    return reject("beacons",
                  {RejectReason::ignored, "they differ from those of the configuration"});
  }
  if (filter_) log(LogLevel::warning, "the beacons changed: the filter is reset");
  try {
    start(make_filter(beacons));
  } catch (const Error& error) {
    return reject("beacons", {RejectReason::filter_error, error.what()});
  }
  process_ready();
}

void BeaconMclPipeline::global_localization() {
  if (!filter_) return;
  filter_->global_localization();
  take_new_belief();
}

std::string BeaconMclPipeline::save_beacons(const std::string& path) const {
  if (!filter_ || filter_->memory() == nullptr) {
    throw Error("nothing is known of beacons beside the list; use population/renewal redraw");
  }
  const RangeMemory& memory = *filter_->memory();
  NewFile file(path, kBeaconFile.name);
  file.write(beacon_file(options_.name, memory));
  file.finish();
  return std::to_string(memory.found().size()) + " beacons written to " + path;
}

std::optional<Rejection> BeaconMclPipeline::fault_in(const BeaconRange& range) const {
  if (auto rejection = check(range)) return rejection;
  return check_beacon(range.beacon);
}

std::optional<Rejection> BeaconMclPipeline::check_beacon(int id) const {
  if (!filter_ || finds_beacons()) return std::nullopt;
  std::string known;
  for (const Beacon& beacon : filter_->beacons()) {
    if (beacon.id == id) return std::nullopt;
    known += (known.empty() ? "" : ", ") + std::to_string(beacon.id);
  }
  return Rejection{RejectReason::unknown_beacon,
                   "beacon " + std::to_string(id) + " is unknown; known are " + known};
}

// ---- the filter -------------------------------------------------------------------------------

std::optional<std::vector<RangeObservation>> BeaconMclPipeline::to_observations(
    const std::vector<BeaconRange>& group) {
  std::vector<RangeObservation> observations;
  for (const BeaconRange& range : group) {
    if (const auto observation = to_observation(range)) observations.push_back(*observation);
  }
  if (observations.empty()) return std::nullopt;
  return observations;
}

std::optional<RangeObservation> BeaconMclPipeline::to_observation(const BeaconRange& range) {
  if (const auto rejection = check_beacon(range.beacon)) {
    reject(*rejection);
    return std::nullopt;
  }
  const auto antenna = frames_.pose(options_.frames.base, without_slash(range.header.frame_id));
  if (!antenna) {
    reject({RejectReason::unknown_frame,
            "where '" + range.header.frame_id + "' is on '" + options_.frames.base +
                "' is not known: give it on /tf_static, or in the list `antennas` of the "
                "configuration"});
    return std::nullopt;
  }
  const std::string frame = without_slash(range.header.frame_id);
  const auto listed = options_.antennas.find(frame);
  const bool is_stated =
      !frame.empty() && frame != options_.frames.base &&
      (listed == options_.antennas.end() || listed->second.head<2>().squaredNorm() > 0.0);
  return RangeObservation{range.beacon, range.range, range.variance, antenna->translation(),
                          is_stated};
}

void BeaconMclPipeline::update_filter(const OdometryIncrement& odometry, const Observations& used) {
  filter_->update(odometry, used);
}

void BeaconMclPipeline::note_observations(ros::Time stamp, const Observations& used,
                                          double duration) {
  if (own_sinks_.ranges) own_sinks_.ranges(stamp, used);
  for (const RangeObservation& observation : used) {
    latest_ranges_[observation.beacon] = {stamp, observation.range, observation.antenna.z()};
    if (!filter_->is_not_as_listed(observation.beacon)) continue;
    // It is heard; what is wrong with it is said as a finding.
    beacon_health_[observation.beacon] = BeaconHealth{};
    beacon_health_[observation.beacon].last = stamp;
  }
  note_findings(stamp);
  const BeaconMclStatus& status = filter_->status();
  if (!(status.innovation_sigma > 0.0)) return;
  const double ratio = status.innovation / status.innovation_sigma;
  lost_.observe(ratio * ratio, 1, duration, std::max(usual_misfit_share(), kOutlierShare));
  note_health(stamp, status.observation, ratio * ratio);
}

// The lower median over beacons: as many wild ranges as nobody is to blame for.
double BeaconMclPipeline::usual_misfit_share() const {
  std::vector<double> shares;
  for (const auto& [id, health] : beacon_health_) {
    if (!health.is_silent(last_observation_)) shares.push_back(health.misfit_share);
  }
  if (shares.empty()) return 0.0;
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>((shares.size() - 1) / 2);
  std::nth_element(shares.begin(), middle, shares.end());
  return std::min(*middle, kMostOutliers);
}

bool BeaconMclPipeline::does_not_fit(const BeaconHealth& health) const {
  return health.misfit_share > usual_misfit_share() + kMisfitShare &&
         !health.is_silent(last_observation_);
}

void BeaconMclPipeline::note_health(ros::Time stamp, int beacon, double squared_innovation) {
  BeaconHealth& health = beacon_health_[beacon];
  const double misfit = squared_innovation > kThreeSigmaSquared ? 1.0 : 0.0;
  health.misfit_share += kMisfitRate * (misfit - health.misfit_share);
  if (!health.last.isZero() && stamp > health.last) {
    const double period = (stamp - health.last).toSec();
    health.period =
        health.period == 0.0 ? period : health.period + kPeriodRate * (period - health.period);
  }
  health.last = stamp;
}

void BeaconMclPipeline::forget_observations() {
  latest_ranges_.clear();
  beacon_health_.clear();
}

void BeaconMclPipeline::put_robot(const PoseEstimate& there) {
  filter_->initialize_gaussian(there.mean, there.covariance);
}

std::optional<PoseEstimate> BeaconMclPipeline::belief_of_filter() {
  if (!filter_->is_initialized()) return std::nullopt;
  yaw_rate_bias_ = filter_->yaw_rate_bias();
  return filter_->estimate();
}

OdometryIncrement BeaconMclPipeline::motion_since_update() const {
  return without_yaw_rate_bias(filter_->without_known_errors(odometry_.since()),
                               yaw_rate_bias_.mean, yaw_rate_bias_.sigma);
}

double BeaconMclPipeline::extent(const PoseEstimate& /*belief*/) const {
  return extent_of(places());
}

void BeaconMclPipeline::save_filter(BeaconMclCheckpoint* checkpoint) {
  checkpoint->filter = filter_->saved();
  for (const auto& [id, finding] : findings_) {
    checkpoint->found.push_back(id);
    checkpoint->found_since.push_back(finding.begin);
  }
}

void BeaconMclPipeline::load_filter(const BeaconMclCheckpoint& checkpoint) {
  std::unique_ptr<BeaconMcl> filter =
      make_filter(options_.beacons.empty() ? checkpoint.filter.beacons : options_.beacons);
  filter->load(checkpoint.filter);
  filter_ = std::move(filter);
  findings_.clear();
  for (std::size_t i = 0; i < checkpoint.found.size(); ++i) {
    findings_[checkpoint.found[i]].begin = checkpoint.found_since[i];
  }
  note_findings(checkpoint.progress.last_observation);  // what they are, before any range
}

}  // namespace pf_resampling
