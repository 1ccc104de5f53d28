#include "src/odometry/learnt_motion.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace pf_resampling {
namespace {

// What a step may differ by from the expected one whatever the robot: noise, late stamps. Jumps are
// to be seen from twice that on.
constexpr double kSlack = 0.25;      // m
constexpr double kTurnSlack = 0.25;  // rad
// A turn that begins and ends between two messages is no jump.
constexpr double kTurnRate = 2.0;  // rad/s
// What a robot of which little is known may have.
constexpr double kAcceleration = 4.0;  // m/s^2
// How much of the past counts, and how many of it are exceptions.
constexpr std::size_t kSteps = 200;
constexpr std::size_t kExceptions = 4;
// A robot is known when it has been seen moving for so long, in so many steps.
constexpr double kLongEnough = 10.0;  // s
constexpr std::int64_t kEnoughMoves = 20;
// By what factors it may surpass what was seen of it.
constexpr double kMoreDeparture = 3.0;
constexpr double kMoreSpeed = 1.25;
// From what speed on wheels may be slipping, and for how long: after that the robot drives so.
constexpr double kSlipSpeed = 1.1;    // of the highest so far, ...
constexpr double kSlipSlack = 0.05;   // and so many m/s more, ...
constexpr double kGradually = 0.5;    // unless that rises by so many m/s^2
constexpr double kLongestSlip = 5.0;  // s
// Longer than so many usual steps: messages were lost.
constexpr double kLost = 1.5;

/// How far a step is from that of a velocity, m, and by how much it turns otherwise, rad.
std::pair<double, double> difference(const Pose2& step, double duration, const Velocity& expected) {
  const Velocity made = velocity_of(step, duration);
  const double turn = wrap_angle(step.heading - duration * expected.turn);
  return {duration * std::hypot(made.forward - expected.forward, made.left - expected.left),
          std::abs(turn)};
}

}  // namespace

// The chord of an arc lies half its turn ahead of its start.
Velocity velocity_of(const Pose2& motion, double duration) {
  const double turn = wrap_angle(motion.heading);
  const double cosine = std::cos(0.5 * turn);
  const double sine = std::sin(0.5 * turn);
  return {(cosine * motion.x + sine * motion.y) / duration,
          (cosine * motion.y - sine * motion.x) / duration, turn / duration};
}

Pose2 motion_of(const Velocity& velocity, double duration) {
  const double turn = velocity.turn * duration;
  const double cosine = std::cos(0.5 * turn);
  const double sine = std::sin(0.5 * turn);
  return {duration * (cosine * velocity.forward - sine * velocity.left),
          duration * (sine * velocity.forward + cosine * velocity.left), turn};
}

Velocity mixed(const Velocity& first, const Velocity& second, double share) {
  const auto between = [&](double a, double b) { return a + share * (b - a); };
  return {between(first.forward, second.forward), between(first.left, second.left),
          between(first.turn, second.turn)};
}

void LearntMotion::add_step(const Pose2& step, double duration, const Velocity& before) {
  steps_.push_back({duration, difference(step, duration, before).first});
  if (steps_.size() > kSteps) steps_.pop_front();
}

void LearntMotion::add_velocity(const Velocity& velocity) {
  top_.forward = std::max(top_.forward, velocity.speed());
  top_.turn = std::max(top_.turn, std::abs(velocity.turn));
  const double duration = steps_.empty() ? 0.0 : steps_.back().duration;
  bool surpasses = is_known() && velocity.speed() > kSlipSpeed * speed_.driven + kSlipSlack;
  if (surpasses && speed_.slipping >= kLongestSlip) {
    speed_.driven = velocity.speed();
    surpasses = false;
  }
  speed_.slipping = surpasses ? speed_.slipping + duration : 0.0;
  const double most = is_known() ? speed_.driven + kGradually * duration : velocity.speed();
  if (!may_slip()) speed_.driven = std::max(speed_.driven, std::min(velocity.speed(), most));
  if (!velocity.is_moving()) return;
  ++speed_.moves;
  speed_.moving += duration;
}

bool LearntMotion::is_known() const {
  return speed_.moves >= kEnoughMoves && speed_.moving >= kLongEnough;
}

double LearntMotion::usual_departure() const {
  if (steps_.size() <= kExceptions) return 0.0;
  std::vector<double> departures;
  for (const Step& step : steps_) departures.push_back(step.departure);
  std::nth_element(departures.begin(), departures.begin() + kExceptions, departures.end(),
                   std::greater<>());
  return departures[kExceptions];
}

double LearntMotion::usual_duration() const {
  if (steps_.empty()) return 0.0;
  std::vector<double> durations;
  for (const Step& step : steps_) durations.push_back(step.duration);
  const auto middle = durations.begin() + static_cast<std::ptrdiff_t>(durations.size() / 2);
  std::nth_element(durations.begin(), middle, durations.end());
  return *middle;
}

bool LearntMotion::allows(const Pose2& step, double duration, const Velocity& before) const {
  const auto [departure, turn] = difference(step, duration, before);
  const double turn_rate = std::max(kTurnRate, kMoreSpeed * top_.turn);
  if (turn > kTurnSlack + turn_rate * duration) return false;
  const double acceleration = is_known() ? 0.0 : 0.5 * kAcceleration * duration * duration;
  const double slack = kSlack + acceleration;
  const bool is_expected =
      departure <= slack || departure <= slack + kMoreDeparture * usual_departure();
  if (!is_known()) return is_expected;
  if (!reaches(std::hypot(step.x, step.y), duration)) return false;
  return is_expected || duration > kLost * usual_duration();
}

bool LearntMotion::is_between(const Pose2& step, double duration, const Velocity& before,
                              const Velocity& after) {
  constexpr int kParts = 8;
  for (int part = 0; part <= kParts; ++part) {
    const auto [departure, turn] =
        difference(step, duration, mixed(before, after, static_cast<double>(part) / kParts));
    if (departure <= kSlack && turn <= kTurnSlack) return true;
  }
  return false;
}

bool LearntMotion::reaches(double distance, double duration) const {
  const double most = kMoreSpeed * top_.forward * duration + kSlack;
  return !is_known() || distance <= most || distance <= most + usual_departure();
}

void LearntMotion::resume(const DrivenSpeed& speed) {
  speed_ = speed;
  top_.forward = std::max(top_.forward, speed_.driven);
}

}  // namespace pf_resampling
