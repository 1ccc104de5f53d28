#pragma once

#include <Eigen/Core>
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

/// Which landmarks are not where the map has them, are there twice, or are gone: what the filter
/// did not believe, time and again at one place, while what it saw of others fitted; and what was
/// in view and was not seen.
class LandmarkChanges {
 public:
  /// The map to compare with, at the beginning; its landmarks need not have been seen.
  void start(const std::vector<LandmarkEstimate>& map);
  /// The same map as it is believed now: all data were solved for anew.
  void follow(const std::vector<LandmarkEstimate>& map);
  /// A scan at `time` (s), by a sensor at `eye` (map frame). `sigma`: m, of its place in the map.
  void add(double time, const Pose2& eye, double sigma, const std::vector<MapSighting>& sightings);
  /// The belief was wrong: what does not fit it says nothing of landmarks.
  void forget_latest();

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
    int sightings = 0;
    double opinions = 0.0;           // sightings in a row share their errors
    double first = 0.0, last = 0.0;  // s
    bool is_confirmed = false;       // what was seen of others fitted
    bool is_believed = false;        // the filter has it there by now
  };
  struct Visit {
    double first = 0.0, last = 0.0;  // s, in view
    int looks = 0;
  };
  struct Landmark {
    Place& home() { return places.front(); }
    const Place& home() const { return places.front(); }
    std::vector<Place> places = {Place()};  // that of the map, and others
    Eigen::Vector2d seen_from = Eigen::Vector2d::Zero();
    // m, mean of what was believed to be at home: by how much it was not
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    int believed = 0;
    Visit visit;
    bool is_given = false;     // at the start, ...
    double given_sigma = 0.0;  // ... to that, in m
    double known_since = 0.0;  // s, else
    double last_seen = -1.0;   // s, anywhere
    int missed = 0;            // visits in a row, in which it was not seen at home
    double missed_first = 0.0, missed_last = 0.0;
  };
  struct Outcome {
    double time;
    std::int64_t id;
    bool is_believed;
    bool is_old;  // a landmark that was there before
  };

  void take(double time, const MapSighting& sighting, const Eigen::Vector2d& eye, double eye_sigma);
  void look(double time, const Pose2& eye);
  bool belief_fits(double time) const;
  void end_visit(double time, Landmark* landmark);
  void confirm(std::int64_t id, bool is_far, Place* place) const;
  bool is_many(const Place& place) const;
  double probability_of(const Place& place) const;
  bool is_off(const Landmark& landmark) const;
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
  int visits_ = 0, missed_ = 0;
};

}  // namespace pf_resampling
