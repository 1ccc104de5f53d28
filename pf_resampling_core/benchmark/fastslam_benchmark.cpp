#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "pf_resampling_core/benchmark/measure.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

/// One whole update of FastSLAM 2.0 with 100 particles, by the size of the map: eight landmarks are
/// seen, and the population is renewed every time. The robot drives round a ring that is lined by
/// all of the map, two metres from landmark to landmark, half a metre per update, so one landmark
/// in four updates is new to it; the map is loaded, so that the drive does not drift however long.
namespace pf_resampling {
namespace {

constexpr int kParticles = 100;
constexpr int kSeen = 8;
constexpr double kSpacing = 2.0;   // m, along the ring
constexpr double kAdvance = 0.5;   // m per update
constexpr double kAside = 1.0;     // m from the ring, inside and outside in turn
constexpr double kDuration = 0.2;  // s per update

enum class Kind { nothing, selection, keep, moment_matched };

FastSlamOptions options_for(Kind kind, DataAssociation association) {
  FastSlamOptions options;
  options.particles = kParticles;
  options.map.max_landmarks = 100000;
  options.association.method = association;
  options.strategy.schedule = kind == Kind::nothing ? Schedule::never : Schedule::always;
  options.strategy.renewal = kind == Kind::keep || kind == Kind::moment_matched
                                 ? Renewal::compensation
                                 : Renewal::resampling;
  options.strategy.compensation.covariance = kind == Kind::moment_matched
                                                 ? CovarianceTreatment::moment_matched
                                                 : CovarianceTreatment::keep;
  return options;
}

class Drive {
 public:
  Drive(Kind kind, DataAssociation association, int landmarks)
      : options_(options_for(kind, association)),
        filter_(options_, 1),
        landmarks_(landmarks),
        radius_(landmarks * kSpacing / (2.0 * kPi)) {
    std::vector<SurveyedLandmark> map;
    for (int i = 0; i < landmarks; ++i) {
      SurveyedLandmark landmark;
      landmark.id = i;
      landmark.position = position(i);
      landmark.sigma = 0.1;
      map.push_back(landmark);
    }
    filter_.load(surveyed_map(map, "map"));
    PoseEstimate start;
    start.mean = pose_at(0.0);
    start.covariance = Eigen::Vector3d(0.01, 0.01, 0.0004).asDiagonal();
    filter_.set_poses(start);
  }

  void step() {
    const Pose2 before = pose_at(travelled_);
    travelled_ += kAdvance;
    const Pose2 now = pose_at(travelled_);
    OdometryIncrement odometry;
    append(options_.odometry, relative(before, now), kDuration, &odometry);
    // The first is at least one and a half spacings ahead.
    const int first = static_cast<int>(std::ceil(travelled_ / kSpacing + 1.0));
    observations_.clear();
    for (int i = first; i < first + kSeen; ++i) {
      const Eigen::Vector2d seen = seen_from(now, position(i % landmarks_));
      RangeBearingObservation observation;
      observation.id = options_.association.method == DataAssociation::known ? i % landmarks_ : -1;
      observation.range = std::hypot(seen.x(), seen.y()) + 0.1 * normal_(random_);
      observation.bearing = std::atan2(seen.y(), seen.x()) + 0.0175 * normal_(random_);
      observations_.push_back(observation);
    }
    filter_.update(odometry, observations_);
  }

 private:
  Pose2 pose_at(double travelled) const {
    const double angle = travelled / radius_;
    return {radius_ * std::cos(angle), radius_ * std::sin(angle), wrap_angle(angle + 0.5 * kPi)};
  }
  Eigen::Vector2d position(int landmark) const {
    const double angle = landmark * kSpacing / radius_;
    const double from_centre = radius_ + (landmark % 2 == 0 ? kAside : -kAside);
    return {from_centre * std::cos(angle), from_centre * std::sin(angle)};
  }

  FastSlamOptions options_;
  FastSlam filter_;
  int landmarks_;
  double radius_;
  double travelled_ = 0.0;
  std::vector<RangeBearingObservation> observations_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

// `steps_before`, not measured: the store lags as it ever will. Made when it is its turn, and
// unmade when another is: the maps are large.
void measure_updates(const std::string& section, const std::string& row, Kind kind,
                     DataAssociation association, int landmarks, int steps_before) {
  static std::shared_ptr<Drive> current;
  static int next_id = 0;
  static int current_id = -1;
  const int id = next_id++;
  const auto prepare = [=] {
    if (current_id == id) return;
    current.reset();
    current = std::make_shared<Drive>(kind, association, landmarks);
    current_id = id;
    for (int i = 0; i < steps_before; ++i) current->step();
  };
  measure(
      section, row, "ours", landmarks, [] { current->step(); }, false, prepare);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  using namespace pf_resampling;
  for (const auto& [kind, name] :
       {std::make_pair(Kind::nothing, "no renewal"), std::make_pair(Kind::selection, "resampling"),
        std::make_pair(Kind::keep, "compensation, keep"),
        std::make_pair(Kind::moment_matched, "compensation, matched")}) {
    for (const auto& [association, row] :
         {std::make_pair(DataAssociation::known, "known ids"),
          std::make_pair(DataAssociation::mutual_exclusion, "unknown ids")}) {
      for (const int landmarks : {35, 1000, 10000, 100000}) {
        // Once round, or as long as it takes to get round 10,000 landmarks; a compensation leaves
        // nothing for later.
        const bool is_selection = kind == Kind::nothing || kind == Kind::selection;
        const int round = static_cast<int>(std::min(landmarks, 10000) * kSpacing / kAdvance);
        measure_updates(name, row, kind, association, landmarks, is_selection ? round : 200);
      }
    }
  }
  return pf_resampling::run_all(argc, argv);
}
