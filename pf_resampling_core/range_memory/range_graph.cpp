#include "pf_resampling_core/range_memory/range_graph.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using Radio = RadioUnknown;
constexpr int kState = KeyframeUnknown::count;

// Beside stated covariances: odometry that claims to be perfect would leave poses no freedom.
constexpr double kLeastSigma = 1e-4;         // m, rad
constexpr double kLeastYawRateSigma = 1e-7;  // rad/s
constexpr double kLeastDistance = 1e-3;      // m
constexpr double kFirstDamping = 1e-3;
constexpr double kLargestDamping = 1e6;
constexpr double kMostGain = 3.0;  // of all steps to come, over that which the next is to bring
// Wheels slip: a motion's errors are of Student's distribution, with this number less 3 degrees of
// freedom.
constexpr double kMotionTail = 10.0;
constexpr double kFloor = 0.05 / 200.0;  // 1/m: one range in twenty is anywhere within 200 m

// Of A (size, 4) from the lower triangle of `matrix`: A · Aᵀ.
PF_RESAMPLING_VECTOR_CLONES
void subtract_square(const double* __restrict a, int size, double* __restrict matrix) {
  for (int column = 0; column < size; ++column) {
    const double* first = a + column;
    const double by[] = {first[0], first[size], first[2 * size], first[3 * size]};
    double* __restrict below = matrix + static_cast<std::ptrdiff_t>(column) * size;
    for (int row = column; row < size; ++row) {
      below[row] -= by[0] * a[row] + by[1] * a[size + row] + by[2] * a[2 * size + row] +
                    by[3] * a[3 * size + row];
    }
  }
}

/// Keyframes eliminated one after the other, to be gone back through; from those of a past on, if
/// there is one.
class Elimination {
 public:
  Elimination(const RangeGraph& graph, const RangePrior& prior, const RangeNoise& noise,
              const std::optional<RangePast>& past)
      : graph_(graph), prior_(prior), noise_(noise), loss_(noise), past_(past) {
    size_ = kState + static_cast<int>(prior.constants.size());
    first_ = past ? past->keyframe : 0;
    info_.resize(size_, size_);
    gradient_.resize(size_);
    steps_.resize(static_cast<std::size_t>(graph.keyframes() - 1 - first_));
    for (Step& step : steps_) step.coupling.resize(size_, kState);
  }

  /// False if what the data and the damping say is not positive definite. `kept`, if any: gets what
  /// the data before its keyframe say.
  bool run(const RangeEstimate& estimate, double damping, RangePast* kept = nullptr) {
    begin(estimate);
    const int last = graph_.keyframes() - 1;
    for (int k = first_; k <= last; ++k) {
      if (kept != nullptr && kept->keyframe == k) {
        kept->state = estimate.keyframes[static_cast<std::size_t>(k)];
        kept->constants = estimate.constants;
        kept->information = info_;
        kept->gradient = gradient_;
        kept->log_evidence = log_evidence();
      }
      add_ranges(k, estimate);
      if (k < last && !eliminate(k, estimate, damping)) return false;
    }
    for (int i = kState; i < size_; ++i) {
      const double sigma = prior_.constants_sigma[i - kState];
      const double information = 1.0 / (sigma * sigma);
      info_(i, i) += information;
      const double off = estimate.constants[i - kState] - prior_.constants[i - kState];
      gradient_[i] += information * off;
      cost_ += 0.5 * information * off * off;
      log_normalizers_ -= std::log(sigma);
    }
    info_.diagonal() *= 1.0 + damping;
    last_.compute(info_);
    if (last_.info() != Eigen::Success) return false;
    log_determinant_ += 2.0 * last_.matrixLLT().diagonal().array().log().sum();
    step_ = last_.solve(-gradient_);
    expected_gain_ -= 0.5 * step_.dot(gradient_);
    return std::isfinite(log_determinant_) && std::isfinite(cost_);
  }

  /// Moves the estimate by the step that solves the equations.
  void move(RangeEstimate* estimate) const {
    Eigen::VectorXd step = step_;
    estimate->constants += step.tail(size_ - kState);
    for (int k = graph_.keyframes() - 1;; --k) {
      KeyframeState& state = estimate->keyframes[static_cast<std::size_t>(k)];
      state += step.head<kState>();
      state[2] = wrap_angle(state[2]);
      if (k == first_) break;
      const Step& before = steps_[static_cast<std::size_t>(k - 1 - first_)];
      const Eigen::Vector4d right = before.gradient + before.coupling.transpose() * step;
      step.head<kState>() = -before.root.triangularView<Eigen::Lower>().transpose().solve(right);
    }
  }

  /// Of each keyframe from the first on, given all data.
  std::vector<Eigen::Matrix2d> position_covariances() const {
    std::vector<Eigen::Matrix2d> all;
    Eigen::MatrixXd next = covariance();
    for (auto step = steps_.rbegin();; ++step) {
      all.emplace_back(next.topLeftCorner<2, 2>());
      if (step == steps_.rend()) break;
      const Eigen::Matrix4d root =
          step->root.triangularView<Eigen::Lower>().solve(Eigen::Matrix4d::Identity());
      const auto gain = (step->coupling * root).eval();
      const auto cross = (next.selfadjointView<Eigen::Lower>() * gain).eval();
      next.topLeftCorner<kState, kState>() = root.transpose() * root + gain.transpose() * cross;
      next.bottomLeftCorner(size_ - kState, kState) = -cross.bottomRows(size_ - kState);
    }
    std::reverse(all.begin(), all.end());
    return all;
  }

  /// Half the sum of squares, robust, where the estimate was.
  double cost() const { return cost_; }
  /// By which move() makes it smaller, were it quadratic.
  double expected_gain() const { return expected_gain_; }
  double log_evidence() const { return log_normalizers_ - cost_ - 0.5 * log_determinant_; }
  Eigen::MatrixXd covariance() const {
    return last_.solve(Eigen::MatrixXd::Identity(size_, size_));
  }

 private:
  struct Step {
    Eigen::Matrix4d root;  // L of the keyframe's information
    /// Of the next keyframe and the constants to this one, times L⁻ᵀ.
    Eigen::Matrix<double, Eigen::Dynamic, kState> coupling;
    Eigen::Vector4d gradient;  // L⁻¹ · gradient
  };

  void begin(const RangeEstimate& estimate) {
    log_determinant_ = expected_gain_ = 0.0;
    // How long a motion was is taken as scale-free before it was measured: were it uniform in
    // metres, each motion would be a reason to believe in longer ones, and thousands of them would
    // outweigh what the ranges say.
    log_normalizer_of_motion_ = 2.0 * std::log1p(estimate.constants[Common::distance_scale]) +
                                std::log(std::abs(1.0 + estimate.constants[Common::turn_scale])) -
                                2.0 * std::log(noise_.translation) - std::log(noise_.heading);
    if (past_) {
      info_ = past_->information;
      Eigen::VectorXd off(size_);
      off << estimate.keyframes[static_cast<std::size_t>(first_)] - past_->state,
          estimate.constants - past_->constants;
      off[2] = wrap_angle(off[2]);
      gradient_ = past_->gradient + info_.selfadjointView<Eigen::Lower>() * off;
      cost_ = 0.5 * off.dot(past_->gradient + gradient_);
      log_normalizers_ = past_->log_evidence;
      return;
    }
    info_.setZero();
    gradient_.setZero();
    cost_ = log_normalizers_ = 0.0;
    KeyframeState off = estimate.keyframes.front() - prior_.first;
    off[2] = wrap_angle(off[2]);
    for (int i = 0; i < kState; ++i) {
      const double information = 1.0 / (prior_.first_sigma[i] * prior_.first_sigma[i]);
      info_(i, i) = information;
      gradient_[i] = information * off[i];
      cost_ += 0.5 * information * off[i] * off[i];
    }
  }

  void add_ranges(int k, const RangeEstimate& estimate) {
    const auto at = static_cast<std::size_t>(k);
    constexpr int kWidth = kState + Common::count;
    for (const HeldRange& range : graph_.ranges[at]) {
      if (!estimate.takes_part[static_cast<std::size_t>(range.radio)]) continue;
      const HeldRangeResidual residual =
          residual_of(range, noise_, estimate.keyframes[at], estimate.constants);
      const auto [cost, weight] = loss_.at(residual.value, range.variance);
      cost_ += cost;
      log_normalizers_ += loss_.log_peak() - 0.5 * std::log(range.variance);
      Eigen::Matrix<double, kWidth, 1> front;
      front << residual.by_keyframe.transpose(), residual.by_common.transpose();
      const Eigen::Matrix<double, Radio::count, 1> own = residual.by_radio.transpose();
      const int radio = kState + radio_at(range.radio);
      for (int column = 0; column < kWidth; ++column) {
        const double factor = weight * front[column];
        info_.col(column).head<kWidth>() += factor * front;
        info_.col(column).segment<Radio::count>(radio) += factor * own;
      }
      for (int column = 0; column < Radio::count; ++column) {
        info_.col(radio + column).segment<Radio::count>(radio) += weight * own[column] * own;
      }
      gradient_.head<kWidth>() += weight * residual.value * front;
      gradient_.segment<Radio::count>(radio) += weight * residual.value * own;
    }
  }

  // Of info_ the lower triangle counts.
  bool eliminate(int k, const RangeEstimate& estimate, double damping) {
    const auto at = static_cast<std::size_t>(k);
    HeldMotionResidual motion =
        residual_of(graph_.motions[at], noise_, prior_.yaw_rate_walk, estimate.keyframes[at],
                    estimate.keyframes[at + 1], estimate.constants);
    const double slip = motion.value.head<3>().squaredNorm() / kMotionTail;
    cost_ += 0.5 * (kMotionTail * std::log1p(slip) + motion.value[3] * motion.value[3]);
    log_normalizers_ += log_normalizer_of_motion_ - motion.log_slip;
    const double root_weight = 1.0 / std::sqrt(1.0 + slip);
    motion.value.head<3>() *= root_weight;
    motion.by_from.topRows<3>() *= root_weight;
    motion.by_to.topRows<3>() *= root_weight;
    motion.by_scales.topRows<3>() *= root_weight;
    constexpr int kScales = kState + Common::distance_scale;
    Step& step = steps_[static_cast<std::size_t>(k - first_)];
    Eigen::Matrix4d own = motion.by_from.transpose() * motion.by_from;
    own += info_.topLeftCorner<kState, kState>().selfadjointView<Eigen::Lower>();
    own.diagonal() *= 1.0 + damping;
    const Eigen::LLT<Eigen::Matrix4d> root(own);
    if (root.info() != Eigen::Success) return false;
    step.root = root.matrixL();
    log_determinant_ += 2.0 * step.root.diagonal().array().log().sum();

    auto& coupling = step.coupling;
    coupling.bottomRows(size_ - kState) = info_.bottomLeftCorner(size_ - kState, kState);
    coupling.topRows<kState>() = motion.by_to.transpose() * motion.by_from;
    coupling.middleRows<2>(kScales) += motion.by_scales.transpose() * motion.by_from;
    step.gradient = gradient_.head<kState>() + motion.by_from.transpose() * motion.value;
    root.matrixL().solveInPlace(step.gradient);
    expected_gain_ += 0.5 * step.gradient.squaredNorm();
    for (int column = 0; column < kState; ++column) {
      for (int before = 0; before < column; ++before) {
        coupling.col(column) -= step.root(column, before) * coupling.col(before);
      }
      coupling.col(column) /= step.root(column, column);
    }

    info_.topLeftCorner<kState, kState>() = motion.by_to.transpose() * motion.by_to;
    info_.bottomLeftCorner(size_ - kState, kState).setZero();
    info_.block<2, kState>(kScales, 0) = motion.by_scales.transpose() * motion.by_to;
    info_.block<2, 2>(kScales, kScales) += motion.by_scales.transpose() * motion.by_scales;
    gradient_.head<kState>() = motion.by_to.transpose() * motion.value;
    gradient_.segment<2>(kScales) += motion.by_scales.transpose() * motion.value;
    subtract_square(coupling.data(), size_, info_.data());
    gradient_.noalias() -= coupling * step.gradient;
    return true;
  }

  const RangeGraph& graph_;
  const RangePrior& prior_;
  const RangeNoise& noise_;
  const RangeLoss loss_;
  const std::optional<RangePast>& past_;
  int size_ = 0;
  int first_ = 0;         // keyframe
  Eigen::MatrixXd info_;  // of a keyframe and the constants, given all before
  Eigen::VectorXd gradient_;
  std::vector<Step> steps_;
  Eigen::LLT<Eigen::MatrixXd> last_;
  Eigen::VectorXd step_;  // of the newest keyframe and the constants
  double cost_ = 0.0;
  double expected_gain_ = 0.0;
  double log_normalizers_ = 0.0;
  double log_normalizer_of_motion_ = 0.0;
  double log_determinant_ = 0.0;
};

}  // namespace

RangeLoss::RangeLoss(const RangeNoise& noise)
    : width_squared_(noise.robust_width * noise.robust_width),
      log_peak_(std::lgamma(0.5 * width_squared_) - std::lgamma(0.5 * (width_squared_ - 1.0)) -
                std::log(noise.range * noise.robust_width)),
      floor_(kFloor * std::sqrt(kPi) * std::exp(-log_peak_)) {}

RangeLoss::Value RangeLoss::at(double residual, double variance) const {
  const double square = residual * residual / width_squared_;
  const double student = std::exp(-0.5 * width_squared_ * std::log1p(square));
  const double floor = floor_ * std::sqrt(variance);
  return {std::log((1.0 + floor) / (student + floor)),
          student / (student + floor) / (1.0 + square)};
}

RangePast without_radio(int radio, const RangePrior& prior, RangePast past) {
  const Eigen::Index at = kState + radio_at(radio);
  using Own = Eigen::Matrix<double, Radio::count, 1>;
  const Own precision =
      prior.constants_sigma.segment<Radio::count>(radio_at(radio)).cwiseAbs2().cwiseInverse();
  const Own off = (past.constants - prior.constants).segment<Radio::count>(radio_at(radio));
  Eigen::MatrixXd information = past.information.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd coupling = information.middleCols<Radio::count>(at);
  Eigen::Matrix<double, Radio::count, Radio::count> own = coupling.middleRows<Radio::count>(at);
  own += precision.asDiagonal();
  const Own gradient = past.gradient.segment<Radio::count>(at) + precision.cwiseProduct(off);
  const Eigen::LDLT<Eigen::Matrix<double, Radio::count, Radio::count>> root(own);
  information -= coupling * root.solve(coupling.transpose());
  past.gradient -= coupling * root.solve(gradient);
  past.log_evidence +=
      0.5 * (precision.array().log().sum() - root.vectorD().array().log().sum() +
             gradient.dot(root.solve(gradient)) - off.dot(precision.cwiseProduct(off)));
  information.middleCols<Radio::count>(at).setZero();
  information.middleRows<Radio::count>(at).setZero();
  past.gradient.segment<Radio::count>(at).setZero();
  past.information = information;
  return past;
}

std::vector<Eigen::Matrix2d> position_covariances(const RangeGraph& graph, const RangePrior& prior,
                                                  const RangeNoise& noise,
                                                  const std::optional<RangePast>& past,
                                                  const RangeEstimate& estimate) {
  Elimination elimination(graph, prior, noise, past);
  if (!elimination.run(estimate, 0.0)) return {};
  return elimination.position_covariances();
}

RangeBelief solve(const RangeGraph& graph, const RangePrior& prior, const RangeNoise& noise,
                  int iterations, double tolerance, const std::optional<RangePast>& past,
                  RangeEstimate* estimate, RangePast* kept, double least_evidence) {
  Elimination elimination(graph, prior, noise, past);
  RangeBelief belief;
  belief.cost = std::numeric_limits<double>::infinity();
  RangeEstimate best;
  double damping = 0.0;
  double gain = 0.0;  // of a step after what is eliminated
  bool is_eliminated = false;
  for (int i = 0; damping < kLargestDamping; ++i) {
    is_eliminated =
        elimination.run(*estimate, damping, kept) && elimination.cost() <= belief.cost + tolerance;
    if (!is_eliminated) {
      if (std::isfinite(belief.cost)) *estimate = best;
      if (i >= iterations) break;
      damping = std::max(kFirstDamping, 10.0 * damping);
      continue;
    }
    const bool is_moved = elimination.cost() < belief.cost;
    belief.cost = elimination.cost();
    if (elimination.log_evidence() + kMostGain * elimination.expected_gain() < least_evidence) {
      return belief;
    }
    if (i >= iterations) break;
    if (elimination.expected_gain() < tolerance) {
      gain = elimination.expected_gain();
      elimination.move(estimate);
      break;
    }
    best = *estimate;
    elimination.move(estimate);
    if (is_moved) damping = damping > kFirstDamping ? 0.1 * damping : 0.0;
  }
  if (!is_eliminated || damping > 0.0) {
    gain = 0.0;
    if (!elimination.run(*estimate, 0.0, kept)) return belief;
  }
  belief.cost = elimination.cost() - gain;
  belief.log_evidence = elimination.log_evidence() + gain;
  belief.covariance = elimination.covariance();
  if (prior.metre > 0.0) {
    constexpr int kMetre = kState + Common::distance_scale;
    const Eigen::VectorXd by_metre =
        prior.metre / belief.covariance(kMetre, kMetre) * belief.covariance.col(kMetre);
    belief.covariance += by_metre * by_metre.transpose();
  }
  belief.is_usable = belief.covariance.allFinite();
  return belief;
}

Pose2 corrected_motion(const CorrectableMotion& motion, const KeyframeState& from,
                       const Eigen::VectorXd& constants) {
  const double bias = from[KeyframeUnknown::yaw_rate_bias];
  const double turn = constants[Common::turn_scale];
  const Eigen::Vector3d error =
      motion.yaw_rate_sensitivity * bias + motion.turn_scale_sensitivity * (turn / (1.0 + turn));
  const double stretch = 1.0 / (1.0 + constants[Common::distance_scale]);
  return {stretch * (motion.mean.x - error[0]), stretch * (motion.mean.y - error[1]),
          wrap_angle(motion.mean.heading - error[2])};
}

KeyframeState moved(const KeyframeState& from, const OdometryIncrement& motion,
                    const Eigen::VectorXd& constants) {
  const Pose2 pose = compose(pose_of(from), corrected_motion(motion, from, constants));
  return {pose.x, pose.y, pose.heading, from[KeyframeUnknown::yaw_rate_bias]};
}

std::vector<KeyframeState> driven_by_odometry(const RangeGraph& graph, const KeyframeState& first,
                                              const Eigen::VectorXd& constants) {
  std::vector<KeyframeState> driven = {first};
  for (const OdometryIncrement& motion : graph.motions) {
    driven.push_back(moved(driven.back(), motion, constants));
  }
  return driven;
}

HeldRangeResidual residual_of(const HeldRange& range, const RangeNoise& noise,
                              const KeyframeState& keyframe, const Eigen::VectorXd& constants) {
  const int radio = radio_at(range.radio);
  const Pose2 moved = corrected_motion(range.since, keyframe, constants);
  const double cosine = std::cos(keyframe[2]);
  const double sine = std::sin(keyframe[2]);
  Eigen::Matrix2d turn;
  turn << cosine, -sine, sine, cosine;
  const double turn_cosine = std::cos(moved.heading);
  const double turn_sine = std::sin(moved.heading);
  const Eigen::Vector2d lever = range.antenna + constants.segment<2>(Common::lever_x);
  // The antenna in the frame of the keyframe, and its derivative by a turn of the robot.
  const Eigen::Vector2d arm(turn_cosine * lever.x() - turn_sine * lever.y(),
                            turn_sine * lever.x() + turn_cosine * lever.y());
  const Eigen::Vector2d place = Eigen::Vector2d(moved.x, moved.y) + arm;
  const Eigen::Vector2d from_radio =
      keyframe.head<2>() + turn * place - constants.segment<2>(radio + Radio::x);
  const double height =
      range.height.value_or(0.0) - (range.height ? constants[Common::lever_z] : 0.0);
  const double squared = from_radio.squaredNorm() + height * height +
                         constants[radio + Radio::height] +
                         (range.height ? 0.0 : constants[Common::height]);
  const double distance = std::sqrt(std::max(kLeastDistance * kLeastDistance, squared));
  const double stretch = 1.0 + constants[Common::scale] + constants[radio + Radio::scale];
  const double scale = 1.0 / (noise.range * std::sqrt(range.variance));
  HeldRangeResidual residual;
  residual.value = scale * (stretch * distance + constants[Common::bias] +
                            constants[radio + Radio::bias] - range.range);

  const Eigen::RowVector2d by_place = scale * stretch / distance * from_radio.transpose();
  const Eigen::RowVector2d by_body = by_place * turn;
  const Eigen::Vector2d across(-arm.y(), arm.x());
  const double distance_stretch = 1.0 / (1.0 + constants[Common::distance_scale]);
  const Eigen::Vector3d& by_bias = range.since.yaw_rate_sensitivity;
  const Eigen::Vector3d& by_turn = range.since.turn_scale_sensitivity;
  const auto by_error = [&](const Eigen::Vector3d& error) {
    return -(by_body * (distance_stretch * error.head<2>() + error[2] * across)).value();
  };
  residual.by_keyframe.head<2>() = by_place;
  residual.by_keyframe[2] = (by_body * Eigen::Vector2d(-place.y(), place.x())).value();
  residual.by_keyframe[3] = by_error(by_bias);
  residual.by_common[Common::scale] = scale * distance;
  residual.by_common[Common::bias] = scale;
  residual.by_common[Common::distance_scale] =
      -distance_stretch * (by_body * Eigen::Vector2d(moved.x, moved.y)).value();
  const double turn_stretch = 1.0 + constants[Common::turn_scale];
  residual.by_common[Common::turn_scale] = by_error(by_turn) / (turn_stretch * turn_stretch);
  residual.by_common[Common::lever_x] = (by_body * Eigen::Vector2d(turn_cosine, turn_sine)).value();
  residual.by_common[Common::lever_y] =
      (by_body * Eigen::Vector2d(-turn_sine, turn_cosine)).value();
  residual.by_common[Common::lever_z] = -scale * stretch / distance * height;
  const double by_height = scale * stretch / (2.0 * distance);
  residual.by_common[Common::height] = range.height ? 0.0 : by_height;
  residual.by_radio << -by_place, scale * distance, scale, by_height;
  return residual;
}

HeldMotionResidual residual_of(const OdometryIncrement& motion, const RangeNoise& noise,
                               double yaw_rate_walk, const KeyframeState& from,
                               const KeyframeState& to, const Eigen::VectorXd& constants) {
  const Pose2 moved = relative(pose_of(from), pose_of(to));
  const double stretch = 1.0 + constants[Common::distance_scale];
  const double turn_scale = constants[Common::turn_scale];
  const double missing = wrap_angle(moved.heading - motion.mean.heading);
  const double turned = motion.turn_scale_sensitivity[2] + missing;
  const Eigen::Vector3d& by_bias = motion.yaw_rate_sensitivity;
  const Eigen::Vector3d by_turn_scale(motion.turn_scale_sensitivity[0],
                                      motion.turn_scale_sensitivity[1], turned);
  // Predicted less measured.
  const Eigen::Vector3d difference(
      stretch * moved.x + by_bias[0] * from[3] + by_turn_scale[0] * turn_scale - motion.mean.x,
      stretch * moved.y + by_bias[1] * from[3] + by_turn_scale[1] * turn_scale - motion.mean.y,
      missing + turn_scale * turned + by_bias[2] * from[3]);
  const double cosine = std::cos(from[2]);
  const double sine = std::sin(from[2]);
  Eigen::Matrix3d by_from, by_to;
  by_from << -stretch * cosine, -stretch * sine, stretch * moved.y,  //
      stretch * sine, -stretch * cosine, -stretch * moved.x,         //
      0.0, 0.0, -(1.0 + turn_scale);
  by_to << stretch * cosine, stretch * sine, 0.0,  //
      -stretch * sine, stretch * cosine, 0.0,      //
      0.0, 0.0, 1.0 + turn_scale;
  const Eigen::Vector3d factors(noise.translation, noise.translation, noise.heading);
  const Eigen::Matrix3d sound =
      factors.asDiagonal() *
      (motion.covariance + kLeastSigma * kLeastSigma * Eigen::Matrix3d::Identity()) *
      factors.asDiagonal();
  const Eigen::LLT<Eigen::Matrix3d> root(sound + motion.slip_covariance);
  const auto whitened = [&](auto matrix) {
    root.matrixL().solveInPlace(matrix);
    return matrix;
  };
  HeldMotionResidual residual;
  if (!motion.slip_covariance.isZero()) {
    residual.log_slip =
        std::log(root.matrixLLT().diagonal().prod()) - 0.5 * std::log(sound.determinant());
  }
  residual.value.head<3>() = whitened(difference);
  residual.by_from.setZero();
  residual.by_to.setZero();
  residual.by_scales.setZero();
  residual.by_from.topLeftCorner<3, 3>() = whitened(by_from);
  residual.by_to.topLeftCorner<3, 3>() = whitened(by_to);
  residual.by_from.block<3, 1>(0, 3) = whitened(by_bias);
  residual.by_scales.block<3, 1>(0, 0) = whitened(Eigen::Vector3d(moved.x, moved.y, 0.0));
  residual.by_scales.block<3, 1>(0, 1) = whitened(by_turn_scale);
  const double walk =
      1.0 / std::hypot(kLeastYawRateSigma, yaw_rate_walk * std::sqrt(motion.duration));
  residual.value[3] = walk * (to[3] - from[3]);
  residual.by_from(3, 3) = -walk;
  residual.by_to(3, 3) = walk;
  return residual;
}

}  // namespace pf_resampling
