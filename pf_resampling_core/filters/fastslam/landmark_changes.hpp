#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"
#include "pf_resampling_core/filters/fastslam/memory/sensor_view.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/health/finding.hpp"

namespace pf_resampling {

/// A landmark of the map that a scan saw.
struct MapSighting {
  std::int64_t id = 0;
  Eigen::Vector2d seen = Eigen::Vector2d::Zero();  ///< m, map frame, by the belief
  /// m, where the filter has it now; nothing: where it was at the start.
  std::optional<Eigen::Vector2d> mapped;
  double sigma = 0.1;       ///< m, of what is seen: the observation's
  bool is_believed = true;  ///< by the filter, to be of that landmark
  bool is_started = false;  ///< which the filter started there
};

/// What a scan saw of the map.
struct MapScan {
  double time = 0.0;     ///< s
  std::size_t step = 0;  ///< of the path: where `robot` is
  Pose2 robot;           ///< map frame, by the belief, as ...
  Pose2 eye;             ///< ... the sensor
  double sigma = 0.0;    ///< m, of its place in the map
  std::vector<MapSighting> sightings;
};

/// Which landmarks are not where the map has them, are there twice, or are gone: what the filter
/// did not believe, time and again at one place, while what it saw of others fitted; and what was
/// in view and was not seen.
class LandmarkChanges {
 public:
  /// The map to compare with, at the beginning; its landmarks need not have been seen.
  void start(const std::vector<LandmarkEstimate>& map);
  /// The same map as it is believed now: all data were solved for anew.
  void follow(const std::vector<LandmarkEstimate>& map);
  void add(const MapScan& scan);
  /// For retrace(), if no map was given: before add(), or instead of it if the belief may be wrong.
  void remember(const MapScan& scan);
  /// The belief was wrong: what does not fit it says nothing of landmarks.
  void forget_latest();
  /// All scans remembered anew, from where the whole drive, solved for anew, has the robot at each
  /// step; with the map as it is then. False if the path has begun anew since start(), or there
  /// were more than 300000 sightings.
  bool retrace(const std::vector<Pose2>& path, const std::vector<LandmarkEstimate>& map);

  /// By id.
  std::vector<Finding> findings() const;
  /// Whether most landmarks that came into view lately were not where the map has them: it is not
  /// the map of this place, or its ids are not those of the landmarks.
  bool map_misfits() const;

 private:
  struct Place {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();
    double sigma = 0.0;      // m, of what was seen last, ...
    double eye_sigma = 0.0;  // ... and of where from
    int sightings = 0, visits = 0;
    double others_off = 0.0;         // m, by how much others seemed to be elsewhere than before
    double opinions = 0.0;           // sightings in a row share their errors
    double first = 0.0, last = 0.0;  // s
    bool is_confirmed = false;       // what was seen of others fitted
    bool is_believed = false;        // the filter has it there by now
  };
  // From about where it was seen before, from the side, from behind: tags have a back.
  enum Side : std::uint8_t { before, aside, behind, sides };
  struct Visit {
    double first = 0.0, last = 0.0;  // s, in view
    std::array<int, sides> looks = {};
  };
  using Counts = std::array<int, sides>;
  struct Landmark {
    Place& home() { return places.front(); }
    const Place& home() const { return places.front(); }
    std::vector<Place> places = {Place()};  // that of the map, and others
    // Directions that it was seen from: in earlier visits, and last.
    Eigen::Vector2d seen_from = Eigen::Vector2d::Zero(), seen_last_from = Eigen::Vector2d::Zero();
    // m, mean of what was believed to be at home: by how much it was not
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    int believed = 0;
    Visit visit;
    bool is_given = false;     // at the start, ...
    double given_sigma = 0.0;  // ... to that, in m
    double known_since = 0.0;  // s, else
    double last_seen = -1.0;   // s, anywhere
    Counts missed = {};        // visits in a row, in which it was not seen at home
    double missed_first = 0.0, missed_last = 0.0;
  };
  struct Outcome {
    double time;
    std::int64_t id;
    bool is_believed;
    bool is_old;          // a landmark that was there before
    Eigen::Vector2d off;  // m
  };

  void take(double time, const MapSighting& sighting, const Eigen::Vector2d& eye, double eye_sigma);
  void look(double time, const Pose2& eye);
  bool belief_fits(double time) const;
  void end_visit(double time, Landmark* landmark);
  void confirm(std::int64_t id, bool is_far, Place* place) const;
  bool is_many(const Place& place) const;
  double probability_of(const Place& place) const;
  double sigma_between(const Landmark& landmark, const Place& place) const;
  bool is_off(const Landmark& landmark) const;
  double error_around(const Landmark& landmark) const;
  double probability_gone(const Landmark& landmark) const;

  std::map<std::int64_t, Landmark> landmarks_;
  LandmarkIndex index_;
  std::vector<std::int64_t> ids_;   // by row of the index
  std::set<std::int64_t> pending_;  // in view, or seen where nothing has confirmed it
  std::deque<Outcome> latest_;
  std::deque<bool> arrivals_;  // of given landmarks that came into view: where they should be?
  SensorView view_;
  double now_ = 0.0;
  int believed_ = 0, not_believed_ = 0;  // sightings
  Counts visits_ = {}, missed_ = {};
  int looks_ = 0, overlooked_ = 0;  // at landmarks in sight
  std::vector<MapScan> scans_;
  std::size_t remembered_ = 0;  // sightings of these
  bool is_traceable_ = true;
};

}  // namespace pf_resampling
