// What the filter takes from the memory of all ranges: errors of the odometry, which radio is
// wrong, and the population.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <optional>
#include <utility>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"

namespace pf_resampling {
namespace {

constexpr double kSolutionPeriod = 5.0;  // s, until the population is drawn from it
constexpr double kDrawingPeriod = 0.25;  // s
constexpr double kLeastProbability = 0.01;
constexpr double kLargestSigma = 3.0;  // m: a population that is less sure is not drawn
constexpr double kLargestTurn = 0.5;   // rad, likewise
constexpr double kWrong = 0.5;         // probability of a fault
constexpr double kFixed = 1e-4;

}  // namespace

// `first`: where the robot is, if it was put there. `known`: beacons whose place is; without it,
// what was found before stays known.
void BeaconMcl::start_memory(const std::optional<PoseEstimate>& first,
                             const std::optional<std::vector<Beacon>>& known) {
  const std::vector<Beacon> beacons = known ? *known : found_beacons();
  memory_.reset();
  if (solution_) solution_->is_obsolete = true;
  progress_.is_drawn_from_memory = false;
  progress_.next_solution = progress_.time;
  if (options_.strategy.renewal != Renewal::redraw) return;
  RangeMemoryOptions options;
  options.sigma = options_.ranges.sigma;
  options.scale = calibrates() ? std::max(kFixed, options_.calibration.scale_sigma) : kFixed;
  options.bias = calibrates() ? std::max(kFixed, options_.calibration.bias_sigma) : kFixed;
  if (!calibrates()) options.own_scale = options.own_bias = kFixed;
  options.yaw_rate =
      options_.yaw_rate_bias.estimate ? std::max(1e-6, options_.yaw_rate_bias.sigma) : 1e-6;
  RangeCalibrations calibration = calibration_;
  for (std::size_t b = 0; b < beacons_.size(); ++b) {
    calibration.emplace_back(beacons_[b].id, nominal_[b]);
  }
  if (!nominal_.empty()) calibration.emplace_back(kAllRadios, nominal_.front());
  memory_.emplace(options, beacons, calibration, first);
}

std::vector<Beacon> BeaconMcl::found_beacons() const {
  return finds_beacons() && memory_ ? memory_->found() : beacons_;
}

// The population says where the robot is; what is expected of ranges, the memory.
void BeaconMcl::note_innovation_of_memory() {
  const auto innovation = memory_->innovation();
  if (!innovation) return;
  status_.observation = innovation->radio;
  status_.innovation = innovation->value;
  status_.innovation_sigma = innovation->sigma;
}

OdometryIncrement BeaconMcl::without_known_errors(OdometryIncrement odometry) const {
  if (memory_) odometry = memory_->without_factors(std::move(odometry));
  odometry.covariance += odometry.slip_covariance;
  if (!progress_.is_drawn_from_memory) return odometry;
  // Each particle knows the bias of the yaw rate.
  odometry.mean = corrected_motion(odometry, KeyframeState::Zero(),
                                   memory_->modes().front().estimate.constants);
  return odometry;
}

bool BeaconMcl::is_not_as_listed(int beacon) const {
  if (!progress_.is_drawn_from_memory) return false;
  const std::vector<RadioKnowledge> radios = memory_->radios();
  return std::any_of(radios.begin(), radios.end(), [&](const RadioKnowledge& radio) {
    return radio.id == beacon && radio.fault > kWrong;
  });
}

void BeaconMcl::solve_memory() {
  const bool is_taken = take_solution();
  if (!is_taken && progress_.time < progress_.next_solution) return;
  progress_.next_solution = progress_.time + (finds_beacons() ? kDrawingPeriod : kSolutionPeriod);
  progress_.is_drawn_from_memory = false;
  bool is_of_all = is_taken;
  if (take_overs_ == nullptr) {
    is_of_all = memory_->solve();
  } else {
    if (!is_taken && !solution_ && memory_->is_due()) begin_solution();
    memory_->follow();
  }
  if (memory_->modes().empty()) return;
  if (is_of_all && !memory_->explains_newest()) {
    // Before beacons are known, nothing else says where the robot is.
    const bool is_all = finds_beacons() && is_initialized() && memory_->found().size() < 2;
    return is_all ? start_memory(estimate()) : start_memory();
  }
  std::vector<double> shares;
  std::vector<RangeMemory::Newest> modes;
  for (const RangeMode& mode : memory_->modes()) {
    if (mode.probability < kLeastProbability) continue;
    const RangeMemory::Newest newest = memory_->newest(mode);
    const double variance = newest.covariance.topLeftCorner<2, 2>().trace();
    // Wheels that slip may have turned the robot: its place is known.
    const bool is_turned = newest.covariance(2, 2) > kLargestTurn * kLargestTurn;
    const bool is_sure = finds_beacons() || (variance < kLargestSigma * kLargestSigma &&
                                             (!is_turned || memory_->has_slipped()));
    if (!newest.covariance.allFinite() || !is_sure) return;
    shares.push_back(mode.probability);
    modes.push_back(newest);
  }
  if (particles_.size() != options_.particles) {
    resize_columns(options_.particles, &particles_);
    start_yaw_rate_bias();
    start_calibration();
  }
  redraw(shares, modes);
  progress_.is_drawn_from_memory = true;
  progress_.next_solution = progress_.time + kDrawingPeriod;
}

// Where no thread can be had it is made when it is asked for.
void BeaconMcl::begin_solution() {
  solution_.emplace();
  solution_->memory = std::async([memory = *memory_]() mutable {
    memory.solve_all();
    return std::move(memory);
  });
}

// With all that has come since; false if there is none yet.
bool BeaconMcl::take_solution() {
  using std::chrono::seconds;
  const auto is_there = [&] {
    return solution_->memory.wait_for(seconds(0)) != std::future_status::timeout;
  };
  if (!solution_ || !take_overs_->is_due(is_there)) return false;
  Solution solution = std::move(*solution_);
  solution_.reset();
  if (solution.is_obsolete) return false;
  memory_ = solution.memory.get();
  for (const auto& [odometry, ranges] : solution.since) memory_->add(odometry, ranges);
  return true;
}

// From the Gaussian of each mode, in proportion to its probability. What the Kalman filters of the
// particles hold is the memory's, whatever the pose: it matters once that has lost the robot.
void BeaconMcl::redraw(const std::vector<double>& shares,
                       const std::vector<RangeMemory::Newest>& modes) {
  const Eigen::Index count = particles_.size();
  const RandomStream normals = stream(RandomPurpose::redraw);
  double sum = 0.0;
  Eigen::Index begin = 0;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    sum += shares[m];
    const Eigen::VectorXd& mean = modes[m].mean;
    const Eigen::MatrixXd& covariance = modes[m].covariance;
    const auto end = m + 1 == modes.size()
                         ? count
                         : static_cast<Eigen::Index>(std::lround(sum * static_cast<double>(count)));
    draw_poses({{mean[0], mean[1], mean[2]}, covariance.topLeftCorner<3, 3>()}, normals, begin, end,
               &particles_.x, &particles_.y, &particles_.heading);
    if (options_.yaw_rate_bias.estimate) {
      constexpr int kBias = KeyframeUnknown::yaw_rate_bias;
      particles_.yaw_rate_bias.segment(begin, end - begin) = mean[kBias];
      particles_.yaw_rate_bias_variance.segment(begin, end - begin) = covariance(kBias, kBias);
    }
    begin = end;
  }
  if (calibrates() && !beacons_.empty()) {
    const RadioKnowledge radio = memory_->radios().front();
    particles_.scale = radio.calibration.scale;
    particles_.bias = radio.calibration.bias;
    particles_.scale_variance = radio.scale_sigma * radio.scale_sigma;
    particles_.scale_bias_covariance = 0.0;
    particles_.bias_variance = radio.bias_sigma * radio.bias_sigma;
  }
  particles_.translation_factor.setConstant(memory_->noise().translation);
  particles_.heading_factor.setConstant(memory_->noise().heading);
  const double factor = memory_->noise().range_deviation();
  progress_.range_squares = factor * factor * progress_.range_count;
  progress_.calibration_time = progress_.time;
  reset_weights();
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
  start_ancestry();
  ++status_.redraws;
}

}  // namespace pf_resampling
