#include "research/studies/fault_study.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "beacon_mcl_node/beacon_mcl_pipeline.hpp"
#include "fastslam_node/fastslam_pipeline.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"
#include "src/messages/conversions.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

// Seconds before a fault whose diagnostics are the usual ones.
constexpr double kUsual = 30.0;
constexpr double kSamplePeriod = 1.0;
// Seconds before a fault in which a map's frame is laid on the truth's, and samples that takes.
constexpr double kFramePeriod = 120.0;
constexpr std::size_t kFewestForFrame = 10;
constexpr std::size_t kFewestLandmarksForFrame = 3;
// Nothing and kidnapping, which come first, are always wanted.
constexpr int kAlwaysWanted = 2;

// "12 messages rejected" and "13 messages rejected" are the same alarm.
std::string without_numbers(const std::string& text) {
  std::string result;
  for (const char character : text) {
    const bool is_digit = character >= '0' && character <= '9';
    if (is_digit && !result.empty() && result.back() == 'N') continue;
    if (character == '.' && !result.empty() && result.back() == 'N') continue;
    result += is_digit ? 'N' : character;
  }
  return result;
}

/// Watches a pipeline.
class Recorder {
 public:
  Recorder(const Fault& fault, FaultRun* run)
      : fault_(fault), run_(run), max_gap_(usual_max_gap(fault.drive.truth)) {}

  void connect(PipelineSinks* sinks, std::function<double()> lost,
               std::function<bool()> is_healthy) {
    lost_ = std::move(lost);
    is_healthy_ = std::move(is_healthy);
    sinks->estimate = [this](ros::Time stamp, const PoseEstimate& estimate) {
      take(stamp.toSec() - clock_error_, estimate);
    };
    sinks->diagnostics = [this](const auto& array) { take(array); };
  }

  /// The map of this moment, if a sample is due: it is what the robot knows its place in.
  void watch_map(FastSlam* filter, double time) {
    // Ids of landmarks that were told apart by their places are none of the true ones.
    if (filter->association() != DataAssociation::known) return;
    if (fault_.drive.landmarks.empty() || std::abs(time - map_time_) < kSamplePeriod) return;
    map_time_ = time;
    std::vector<PointLandmark> map;
    for (const LandmarkEstimate& landmark : filter->map()) {
      map.push_back({static_cast<std::int32_t>(landmark.id), landmark.mean, landmark.covariance});
    }
    frame_ = map_to_truth(map, fault_.drive.landmarks);
    run_->is_in_map = run_->is_in_map || frame_.has_value();
  }

  /// The stamps of the next message, and of what comes of it, are wrong by so much, s.
  void set_clock_error(double error) { clock_error_ = error; }

  /// The errors, when the drive is over. Beacons give the frame; that of a map is the filter's own.
  void judge() {
    const bool is_own = fault_.drive.beacons.empty() && !estimated_.empty();
    const Pose2 before = is_own ? frame_before_fault() : Pose2();
    const std::optional<Pose2> of_start = is_own ? frame_of_start() : std::nullopt;
    for (std::size_t i = 0; i < estimated_.size(); ++i) {
      const Pose2 frame = is_own ? frames_[i].value_or(before) : Pose2();
      run_->samples[i].error = (moved(estimated_[i], frame) - true_[i]).norm();
      if (!of_start || i > 0)
        run_->samples[i].normalized_squared = normalized(i, of_start.value_or(frame));
    }
  }

 private:
  /// The squared error of a sample in standard deviations, with the estimate laid on the truth so.
  double normalized(std::size_t i, const Pose2& frame) const {
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(frame.heading).toRotationMatrix();
    return normalized_squared(turn * covariances_[i] * turn.transpose(),
                              moved(estimated_[i], frame) - true_[i]);
  }

  /// Lays the first sample on the truth, if that has a heading. A covariance says how far the robot
  /// may be from where it started, not from a map that is laid on the truth as it grows.
  std::optional<Pose2> frame_of_start() const {
    if (!first_heading_) return std::nullopt;
    return compose({true_.front().x(), true_.front().y(), *first_heading_},
                   relative(first_estimate_, {}));
  }

  /// Laid on the truth where the path fits best before the fault.
  Pose2 frame_before_fault() const {
    std::vector<Eigen::Vector2d> from, to;
    for (std::size_t i = 0; i < estimated_.size(); ++i) {
      const double before = fault_.begin - run_->samples[i].time;
      if (before < 0.0 || before > kFramePeriod) continue;
      from.push_back(estimated_[i]);
      to.push_back(true_[i]);
    }
    return from.size() < kFewestForFrame ? align_points(estimated_, true_) : align_points(from, to);
  }

  void take(double time, const PoseEstimate& estimate) {
    run_->all_finite =
        run_->all_finite && is_finite(estimate.mean) && estimate.covariance.allFinite();
    auto& samples = run_->samples;
    // A bag that loops: what was is no longer.
    while (!samples.empty() && samples.back().time > time) samples.pop_back();
    if (!samples.empty() && time - samples.back().time < kSamplePeriod) return;
    const auto truth = interpolate(fault_.drive.truth, time, max_gap_);
    if (!truth) return;
    if (samples.empty()) {
      first_estimate_ = estimate.mean;
      first_heading_ = truth->heading;
    }
    samples.push_back({time, 0.0, lost_(), std::nullopt, is_healthy_()});
    covariances_.resize(samples.size());
    covariances_.back() = estimate.covariance.topLeftCorner<2, 2>();
    estimated_.resize(samples.size());
    true_.resize(samples.size());
    frames_.resize(samples.size());
    estimated_.back() = {estimate.mean.x, estimate.mean.y};
    true_.back() = {truth->x, truth->y};
    frames_.back() = frame_;
  }

  void take(const diagnostic_msgs::DiagnosticArray& array) {
    const double time = array.header.stamp.toSec() - clock_error_;
    for (const auto& status : array.status) {
      if (status.level == diagnostic_msgs::DiagnosticStatus::OK) continue;
      const std::string text = status.name + ": " + without_numbers(status.message);
      if (time < fault_.begin) {
        if (time > fault_.begin - kUsual) usual_.insert(text);
      } else if (!run_->alarm && usual_.count(text) == 0) {
        run_->alarm = FaultRun::Alarm{time - fault_.begin, text};
      }
    }
  }

  const Fault& fault_;
  FaultRun* run_;
  double max_gap_;
  double clock_error_ = 0.0;
  std::function<double()> lost_;
  std::function<bool()> is_healthy_;
  std::vector<Eigen::Vector2d> estimated_, true_;  // places, of every sample
  std::vector<Eigen::Matrix2d> covariances_;       // as published
  std::vector<std::optional<Pose2>> frames_;       // of the map at every sample
  std::optional<Pose2> frame_;
  Pose2 first_estimate_;
  std::optional<double> first_heading_;  // the true one, rad
  double map_time_ = -std::numeric_limits<double>::infinity();
  std::set<std::string> usual_;
};

template <typename Pipeline, typename Sinks, typename Options, typename Other>
void run_pipeline(const Fault& fault, Options options, int seed, FaultRun* run) {
  options.seed = seed;
  Recorder recorder(fault, run);
  Sinks sinks;
  std::unique_ptr<Pipeline> pipeline;
  recorder.connect(
      &sinks, [&] { return pipeline->lost_probability(); },
      [&] { return pipeline->health().health == Health::healthy; });
  if constexpr (std::is_same_v<Sinks, FastSlamSinks>) {
    sinks.updated = [&](ros::Time stamp, FastSlam* filter) {
      recorder.watch_map(filter, stamp.toSec());
    };
  }
  pipeline = std::make_unique<Pipeline>(options, sinks);
  for (std::size_t i = 0; i < fault.drive.messages.size(); ++i) {
    recorder.set_clock_error(fault.clock_errors.empty() ? 0.0 : fault.clock_errors[i]);
    std::visit(
        [&](const auto& given) {
          using Given = std::decay_t<decltype(given)>;
          if constexpr (!std::is_same_v<Given, Other>) pipeline->handle(given);
        },
        fault.drive.messages[i]);
  }
  recorder.judge();
}

// FastSLAM takes neither ranges nor beacons; they are not on a drive among landmarks.
struct NoBeaconsPipeline : FastSlamPipeline {
  using FastSlamPipeline::FastSlamPipeline;
  using FastSlamPipeline::handle;
  void handle(const BeaconRange& /*range*/) {}
  void handle(const BeaconArray& /*beacons*/) {}
};

void run_fault(const Fault& fault, const FaultStudyOptions& options, FaultRun* run) {
  if (!fault.drive.beacons.empty()) {
    run_pipeline<BeaconMclPipeline, BeaconMclSinks, BeaconMclPipelineOptions,
                 LandmarkObservationArray>(fault, options.beacon_mcl, options.seed, run);
  } else {
    run_pipeline<NoBeaconsPipeline, FastSlamSinks, FastSlamPipelineOptions, void>(
        fault, options.fastslam, options.seed, run);
  }
}

}  // namespace

std::optional<Pose2> map_to_truth(const std::vector<PointLandmark>& map,
                                  const std::vector<PointLandmark>& truth) {
  std::vector<Eigen::Vector2d> from, to;
  for (const LandmarkMatch& match : match_by_id(map, truth)) {
    from.push_back(map[match.estimated].position);
    to.push_back(truth[match.truth].position);
  }
  if (from.size() < kFewestLandmarksForFrame) return std::nullopt;
  return align_points(from, to);
}

FaultStudy run_fault_study(const std::string& recording, const RecordedDrive& drive,
                           const FaultStudyOptions& options) {
  if (!(options.share > 0.0 && options.share < 1.0)) {
    throw Error("share is " + std::to_string(options.share) + ": it has to be in (0, 1)");
  }
  FaultStudy study;
  study.recording = recording;
  study.options = options;
  study.lost_error = usual_lost_error(drive.truth);
  std::vector<Fault> faults =
      all_faults(drive, options.share, RandomStream(1, RandomPurpose::simulation_observation, 0));
  const auto is_unwanted = [&](const Fault& fault) {
    return fault.name.find(options.only) == std::string::npos;
  };
  const auto first = std::min(faults.begin() + kAlwaysWanted, faults.end());
  faults.erase(std::remove_if(first, faults.end(), is_unwanted), faults.end());
  if (!options.only.empty() && static_cast<int>(faults.size()) <= kAlwaysWanted) {
    throw Error("fault '" + options.only +
                "' is unknown; give a part of a name in the first "
                "column of doc/studies/faults.html");
  }
  for (const Fault& fault : faults) {
    study.results.push_back(
        {fault.name, fault.begin, fault.end, fault.drive.truth.back().time, {}});
    run_fault(fault, options, &study.results.back().run);
  }
  study.is_in_map = study.results.front().run.is_in_map;
  return study;
}

json to_json(const FaultStudy& study) {
  json faults = json::array();
  for (const FaultResult& result : study.results) {
    json samples = json::array();
    for (const FaultRun::Sample& sample : result.run.samples) {
      json is_inside;
      if (sample.normalized_squared) is_inside = *sample.normalized_squared <= kThreeSigmaSquared;
      samples.push_back({sample.time, sample.error, sample.lost, is_inside, sample.is_healthy});
    }
    json run = {{"samples", samples}, {"all_finite", result.run.all_finite}};
    if (const auto& alarm = result.run.alarm) {
      run.update({{"alarm_delay", alarm->delay}, {"alarm", alarm->text}});
    }
    faults.push_back({{"fault", result.name},
                      {"begin", result.begin},
                      {"end", result.end},
                      {"last", result.last},
                      {"run", run}});
  }
  return {{"recording", study.recording},
          {"lost_error", study.lost_error},
          {"is_in_map", study.is_in_map},
          {"faults", faults}};
}

}  // namespace pf_resampling
