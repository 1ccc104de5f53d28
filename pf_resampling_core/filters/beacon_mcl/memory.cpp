// What the filter takes from the memory of all ranges: calibration, errors of the odometry, which
// radio is wrong, and a population that is drawn anew.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <future>
#include <optional>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
constexpr double kSolutionPeriod = 5.0;  // s
constexpr double kDrawingPeriod = 0.25;  // s, where the population is drawn from it alone
constexpr double kLeastProbability = 0.01;
constexpr double kLargestSigma = 3.0;  // m: a population that is less sure is not drawn
constexpr double kLargestTurn = 0.5;   // rad, likewise
constexpr double kWrong = 0.5;         // probability of a fault
constexpr double kFixed = 1e-4;

// What the particles carry of a radio: rows scale and bias, of the newest state.
Eigen::MatrixXd radio_rows(std::optional<int> radio, Eigen::Index size) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, size);
  rows(0, KeyframeUnknown::count + Common::scale) = 1.0;
  rows(1, KeyframeUnknown::count + Common::bias) = 1.0;
  if (!radio) return rows;
  const int at = KeyframeUnknown::count + radio_at(*radio);
  rows(0, at + RadioUnknown::scale) = 1.0;
  rows(1, at + RadioUnknown::bias) = 1.0;
  return rows;
}

}  // namespace

// What was found before stays known. `first`: where the robot is, if it was put there.
void BeaconMcl::start_memory(const std::optional<PoseEstimate>& first) {
  start_memory(found_beacons(), first);
}

void BeaconMcl::start_memory(const std::vector<Beacon>& beacons,
                             const std::optional<PoseEstimate>& first) {
  memory_.reset();
  if (solution_) solution_->is_obsolete = true;
  next_solution_ = time_;
  if (options_.strategy.renewal != Renewal::redraw) {
    known_.reset();
    return;
  }
  RangeMemoryOptions options;
  options.sigma = options_.ranges.sigma;
  const bool calibrates = options_.calibration.estimation != CalibrationEstimation::off;
  options.scale = calibrates ? std::max(kFixed, options_.calibration.scale_sigma) : kFixed;
  options.bias = calibrates ? std::max(kFixed, options_.calibration.bias_sigma) : kFixed;
  if (!calibrates) options.own_scale = options.own_bias = kFixed;
  options.yaw_rate =
      options_.yaw_rate_bias.estimate ? std::max(1e-6, options_.yaw_rate_bias.sigma) : 1e-6;
  std::vector<std::pair<int, RangeCalibration>> calibration = calibration_;
  for (std::size_t b = 0; b < beacons_.size(); ++b) {
    calibration.emplace_back(beacons_[b].id, nominal_[b]);
  }
  if (!nominal_.empty()) calibration.emplace_back(-1, nominal_.front());
  memory_.emplace(options, beacons, calibration, first);
}

std::vector<Beacon> BeaconMcl::found_beacons() const {
  return finds_beacons() && memory_ ? memory_->found() : beacons_;
}

// The population says where the robot is; what is expected of ranges, the memory.
void BeaconMcl::update_from_memory() {
  status_.innovation_sigma = 0.0;
  if (const auto innovation = memory_->innovation()) {
    status_.observation = innovation->radio;
    status_.innovation = innovation->value;
    status_.innovation_sigma = innovation->sigma;
  }
  ++status_.updates;
  if (solution_ || time_ >= next_solution_) solve_memory();
}

OdometryIncrement BeaconMcl::without_known_errors(OdometryIncrement odometry) const {
  odometry.covariance += odometry.slip_covariance;
  if (!known_) return odometry;
  const double stretch = 1.0 / (1.0 + known_->distance_scale);
  const Eigen::Vector3d error =
      odometry.turn_scale_sensitivity * (known_->turn_scale / (1.0 + known_->turn_scale));
  odometry.mean = {stretch * (odometry.mean.x - error[0]), stretch * (odometry.mean.y - error[1]),
                   wrap_angle(odometry.mean.heading - error[2])};
  return odometry;
}

bool BeaconMcl::leaves_out(int beacon) const {
  if (!known_) return false;
  for (std::size_t b = 0; b < beacons_.size(); ++b) {
    if (beacons_[b].id == beacon) return known_->is_wrong[b];
  }
  return false;
}

void BeaconMcl::solve_memory() {
  const bool is_taken = take_solution();
  if (!is_taken && time_ < next_solution_) return;
  next_solution_ = time_ + (finds_beacons() ? kDrawingPeriod : kSolutionPeriod);
  if (!solutions_are_deferred_) {
    memory_->solve();
  } else {
    if (!is_taken && !solution_ && memory_->is_due()) begin_solution();
    memory_->follow();
  }
  if (memory_->modes().empty()) return;
  if (!memory_->explains_newest()) {
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
    const bool is_sure = variance < kLargestSigma * kLargestSigma &&
                         newest.covariance(2, 2) < kLargestTurn * kLargestTurn;
    if (!newest.covariance.allFinite() || !is_sure) return;
    shares.push_back(mode.probability);
    modes.push_back(newest);
  }
  take_calibration(modes.front());
  if (finds_beacons() && particles_.size() != requested_size_) {
    resize_columns(requested_size_, &particles_);
    start_yaw_rate_bias();
    start_calibration();
  }
  redraw(shares, modes);
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
  if (!solution_ || solution_->memory.wait_for(seconds(0)) == std::future_status::timeout) {
    return false;
  }
  Solution solution = std::move(*solution_);
  solution_.reset();
  if (solution.is_obsolete) return false;
  memory_ = solution.memory.get();
  for (const auto& [odometry, ranges] : solution.since) memory_->add(odometry, ranges);
  return true;
}

void BeaconMcl::take_calibration(const RangeMemory::Newest& newest) {
  KnownRangeErrors known;
  const Eigen::VectorXd constants = newest.mean.tail(newest.mean.size() - KeyframeUnknown::count);
  known.distance_scale = constants[Common::distance_scale];
  known.turn_scale = constants[Common::turn_scale];
  known.lever = constants.segment<2>(Common::lever_x);
  const std::vector<RadioKnowledge> radios = memory_->radios();
  for (std::size_t b = 0; b < beacons_.size(); ++b) {
    RangeCalibration radio = radios[b].calibration;
    radio.sigma = nominal_[b].sigma;
    known.radios.push_back(radio);
    known.is_wrong.push_back(radios[b].fault > kWrong);
  }
  known_ = std::move(known);
  const double factor = memory_->noise().range_deviation();
  range_squares_ = factor * factor * range_count_;
}

// From the Gaussian of each mode, in proportion to its probability; given the pose, what is linear
// is that of the Gaussian too (as in SavedBeaconMcl, a Kalman filter of each particle).
void BeaconMcl::redraw(const std::vector<double>& shares,
                       const std::vector<RangeMemory::Newest>& modes) {
  const Eigen::Index count = particles_.size();
  const RandomStream normals = stream(RandomPurpose::redraw);
  const Eigen::Index radios = particles_.scale.cols();
  double sum = 0.0;
  Eigen::Index begin = 0;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    sum += shares[m];
    const Eigen::VectorXd& mean = modes[m].mean;
    const Eigen::MatrixXd& covariance = modes[m].covariance;
    const Eigen::Index size = mean.size();
    const Eigen::Matrix3d of_pose = covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d root = lower_root(of_pose);
    // Yaw-rate bias, then scale and bias of each column, by the pose.
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(1 + 2 * radios, size);
    rows(0, KeyframeUnknown::yaw_rate_bias) = 1.0;
    for (Eigen::Index radio = 0; radio < radios; ++radio) {
      const std::optional<int> number =
          memory_->number_of(beacons_[static_cast<std::size_t>(radio)].id);
      rows.middleRows<2>(1 + 2 * radio) = radio_rows(number, size);
    }
    const Eigen::MatrixXd with_pose = rows * covariance.leftCols<3>();
    const Eigen::MatrixXd gain = of_pose.ldlt().solve(with_pose.transpose()).transpose();
    const Eigen::MatrixXd rest =
        rows * covariance * rows.transpose() - gain * with_pose.transpose();
    Eigen::VectorXd known = rows * mean;
    for (Eigen::Index radio = 0; radio < radios; ++radio) {
      // One that was not heard differs from the others as is said.
      const auto beacon = static_cast<std::size_t>(radio);
      if (memory_->number_of(beacons_[beacon].id)) continue;
      known[1 + 2 * radio] += nominal_[beacon].scale - nominal_.front().scale;
      known[2 + 2 * radio] += nominal_[beacon].bias - nominal_.front().bias;
    }
    const auto end = m + 1 == modes.size()
                         ? count
                         : static_cast<Eigen::Index>(std::lround(sum * static_cast<double>(count)));
    for (Eigen::Index i = begin; i < end; ++i) {
      const std::uint64_t index = 4 * static_cast<std::uint64_t>(i);
      const Eigen::Vector3d off =
          root * Eigen::Vector3d(normals.normal(index), normals.normal(index + 1),
                                 normals.normal(index + 2));
      particles_.x[i] = mean[0] + off[0];
      particles_.y[i] = mean[1] + off[1];
      particles_.heading[i] = wrap_angle(mean[2] + off[2]);
      const Eigen::VectorXd linear = known + gain * off;
      if (options_.yaw_rate_bias.estimate) {
        particles_.yaw_rate_bias[i] = linear[0];
        particles_.yaw_rate_bias_variance[i] = std::max(0.0, rest(0, 0));
      }
      for (Eigen::Index radio = 0; radio < radios; ++radio) {
        const Eigen::Index at = 1 + 2 * radio;
        particles_.scale(i, radio) = 1.0 + linear[at];
        particles_.bias(i, radio) = linear[at + 1];
        particles_.scale_variance(i, radio) = std::max(0.0, rest(at, at));
        particles_.scale_bias_covariance(i, radio) = rest(at, at + 1);
        particles_.bias_variance(i, radio) = std::max(0.0, rest(at + 1, at + 1));
      }
    }
    begin = end;
  }
  particles_.translation_factor.setConstant(memory_->noise().translation);
  particles_.heading_factor.setConstant(memory_->noise().heading);
  for (double& time : calibration_time_) time = time_;
  reset_weights();
  particles_.ancestor = Eigen::ArrayXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
  start_ancestry();
  ++status_.redraws;
}

}  // namespace pf_resampling
