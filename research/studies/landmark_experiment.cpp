// FastSLAM and EKF-SLAM in a simulated world, by the measures of Kwak (2008, section 4).
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/statistics.hpp"
#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "research/studies/ekf_slam.hpp"
#include "research/studies/study_trials.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling {
namespace {

constexpr double kChiSquare95TwoDof = 5.991;
constexpr double kSameTime = 1e-6;  // s: multiples of periods are not exact
// s around the closing of a loop over which a course is averaged, before and after.
constexpr double kAroundClosure = 1.0;

/// What a filter is given at a scan, and the truth it is judged by.
struct Step {
  double time = 0.0;
  OdometryIncrement odometry;
  std::vector<RangeBearingObservation> observations;
  Pose2 truth;           ///< in the frame of the start, as the filter's map
  Pose2 dead_reckoning;  ///< likewise
};

struct Drive {
  std::vector<Step> steps;
  std::map<std::string, double> closures;  ///< name, s
};

/// When each loop closes: on the way to the way-point that marks it, the first scan that sees a
/// landmark again that was out of view for long, which is half as long as any other there.
std::map<std::string, double> closing_times(const std::vector<Step>& steps,
                                            const std::map<std::string, double>& waypoints) {
  struct Return {
    double time = 0.0;
    double absence = 0.0;  // s
  };
  std::vector<Return> returns;
  std::map<int, double> seen;
  for (const Step& step : steps) {
    for (const RangeBearingObservation& observation : step.observations) {
      const auto before = seen.find(observation.id);
      if (before != seen.end()) returns.push_back({step.time, step.time - before->second});
      seen[observation.id] = step.time;
    }
  }
  std::map<std::string, double> closures;
  for (const auto& [name, marked] : waypoints) {
    double begin = 0.0;  // of the way to it: the way-point before
    for (const auto& other : waypoints) {
      if (other.second < marked) begin = std::max(begin, other.second);
    }
    const auto is_on_way = [begin, end = marked](const Return& each) {
      return each.time > begin && each.time <= end;
    };
    double longest = 0.0;
    for (const Return& each : returns) {
      if (is_on_way(each)) longest = std::max(longest, each.absence);
    }
    const auto first = std::find_if(returns.begin(), returns.end(), [&](const Return& each) {
      return is_on_way(each) && each.absence >= 0.5 * longest;
    });
    closures[name] = first == returns.end() ? marked : first->time;
  }
  return closures;
}

Drive make_drive(const World& world, const OdometryNoise& noise, std::uint64_t seed) {
  const SimulatedDrive simulated = simulate(world, seed);
  Drive drive;
  std::size_t next = 1;
  for (const SimulatedDrive::Scan& scan : simulated.scans) {
    Step step;
    step.time = scan.time;
    for (; next < simulated.odometry.size(); ++next) {
      const SimulatedDrive::Odometry& before = simulated.odometry[next - 1];
      const SimulatedDrive::Odometry& now = simulated.odometry[next];
      if (now.time > scan.time + kSameTime) break;
      append(noise, relative(before.pose, now.pose), now.time - before.time, &step.odometry);
    }
    const SimulatedDrive::Odometry& now = simulated.odometry[next - 1];
    if (std::abs(now.time - scan.time) > kSameTime) {
      throw Error("world " + world.name +
                  ": a scan falls between two odometry messages; the study needs a period of scans "
                  "that is a multiple of the period of odometry");
    }
    step.truth = relative(world.start, now.truth);
    step.dead_reckoning = now.pose;
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      // Noise leaves nothing of the range to a landmark under the robot's feet: not to be used.
      if (seen.range <= 0.0) continue;
      step.observations.push_back({seen.id, seen.range, seen.bearing});
    }
    drive.steps.push_back(step);
  }
  if (drive.steps.empty()) throw Error("world " + world.name + " ends before the first scan");
  drive.closures = closing_times(drive.steps, simulated.closures);
  return drive;
}

std::vector<PointLandmark> true_map(const World& world) {
  std::vector<PointLandmark> map;
  for (std::size_t id = 0; id < world.landmarks.size(); ++id) {
    const Pose2 place =
        relative(world.start, {world.landmarks[id].x(), world.landmarks[id].y(), 0.0});
    PointLandmark landmark;
    landmark.id = static_cast<std::int32_t>(id);
    landmark.position << place.x, place.y;
    map.push_back(landmark);
  }
  return map;
}

/// What is judged at a scan, of whatever estimates it.
struct Belief {
  PoseEstimate pose;
  std::vector<PointLandmark> map;
  /// Root mean square errors of what the particles hold, unweighted, m (Kwak eqs. 5 and 6): of the
  /// landmarks, each of each particle counting the same, and of the positions. The spread of the
  /// particles is part of them, so whatever shrinks the cloud lowers them.
  double feature_error = kNoFigure;
  double position_error = 0.0;
  double effective_sample_size = kNoFigure;
  double distinct = kNoFigure;
  double calls = kNoFigure;
};

Belief belief_of(const Step& step, const std::vector<PointLandmark>& truth, FastSlam* filter) {
  Belief belief;
  belief.pose = filter->estimate();
  const FastSlamParticles& particles = filter->particles();
  double squares = 0.0;
  int count = 0;
  for (const LandmarkEstimate& landmark : filter->map()) {
    belief.map.push_back(
        {static_cast<std::int32_t>(landmark.id), landmark.mean, landmark.covariance});
  }
  for (const int row : filter->rows()) {
    const LandmarkRow landmark = filter->store().row(row);
    const Eigen::Vector2d& place = truth[static_cast<std::size_t>(filter->id_of(row))].position;
    for (Eigen::Index k = 0; k < particles.size(); ++k) {
      if (landmark.held != nullptr && landmark.held[k] == 0) continue;
      const double dx = landmark.x[k] - place.x();
      const double dy = landmark.y[k] - place.y();
      squares += dx * dx + dy * dy;
      ++count;
    }
  }
  if (count > 0) belief.feature_error = std::sqrt(squares / count);
  belief.position_error = std::sqrt(
      ((particles.x - step.truth.x).square() + (particles.y - step.truth.y).square()).mean());
  const FastSlamStatus& status = filter->status();
  belief.effective_sample_size = status.effective_sample_size;
  belief.distinct = status.distinct_ancestors_since_start;
  belief.calls = static_cast<double>(status.renewals);
  return belief;
}

/// Eqs. 5 and 6 of a Gaussian are those of a single particle at its mean.
Belief belief_of(const Step& step, const std::vector<PointLandmark>& truth, const EkfSlam& filter) {
  Belief belief;
  belief.pose = filter.estimate();
  double squares = 0.0;
  for (const auto& [id, row] : filter.rows()) {
    PointLandmark landmark;
    landmark.id = id;
    landmark.position = filter.state().segment<2>(row);
    landmark.covariance = filter.covariance().block<2, 2>(row, row);
    squares += (landmark.position - truth[static_cast<std::size_t>(id)].position).squaredNorm();
    belief.map.push_back(landmark);
  }
  if (!belief.map.empty()) {
    belief.feature_error = std::sqrt(squares / static_cast<double>(belief.map.size()));
  }
  belief.position_error =
      std::hypot(belief.pose.mean.x - step.truth.x, belief.pose.mean.y - step.truth.y);
  return belief;
}

/// Infinite where the covariance is singular, as of particles that are all copies of one.
double squared_mahalanobis(const Eigen::Vector2d& error, const Eigen::Matrix2d& covariance) {
  if (!(covariance.determinant() > 0.0)) return std::numeric_limits<double>::infinity();
  return error.dot(covariance.inverse() * error);
}

/// Mean of the values that there are.
double mean_of_known(const std::vector<double>& values) {
  double sum = 0.0;
  int count = 0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value;
    ++count;
  }
  return count > 0 ? sum / count : kNoFigure;
}

double median_of(const std::vector<double>& values) {
  return values.empty() ? kNoFigure : median(values);
}

/// The course of one run, scan by scan; kNoFigure where there is nothing to measure.
class Judge {
 public:
  explicit Judge(const std::vector<PointLandmark>& truth) : truth_(truth) {}

  void judge(const Step& step, const Belief& belief) {
    times_.push_back(step.time);
    // The sample sizes are those after an observation.
    const bool saw = !step.observations.empty();
    effective_sample_size_.push_back(belief.effective_sample_size);
    distinct_.push_back(belief.distinct);
    seen_effective_.push_back(saw ? belief.effective_sample_size : kNoFigure);
    seen_distinct_.push_back(saw ? belief.distinct : kNoFigure);
    calls_.push_back(belief.calls);
    position_error_.push_back(belief.position_error);
    const Eigen::Vector2d offset(belief.pose.mean.x - step.truth.x,
                                 belief.pose.mean.y - step.truth.y);
    pose_error_.push_back(offset.norm());
    const double squared =
        squared_mahalanobis(offset, belief.pose.covariance.topLeftCorner<2, 2>());
    pose_inside_.push_back(squared <= kChiSquare95TwoDof ? 1.0 : 0.0);
    pose_nees_.push_back(squared);
    judge_map(belief);
  }

  Trial trial(const std::map<std::string, double>& closures) const {
    Trial trial;
    trial.figures = {calls_.back(),
                     mean_of_known(seen_effective_),
                     mean_of_known(seen_distinct_),
                     distinct_.back(),
                     mean_of_known(feature_error_),
                     feature_error_.back(),
                     mean_of_known(position_error_),
                     mean_of_known(map_error_),
                     mean_of_known(map_error_aligned_),
                     map_error_.back(),
                     mean_of_known(pose_error_),
                     mean_of_known(map_inside_),
                     mean_of_known(pose_inside_),
                     median_of(map_nees_),
                     median_of(pose_nees_)};
    for (const auto& closure : closures) {
      for (const std::vector<double>* course :
           {&feature_error_, &position_error_, &effective_sample_size_}) {
        trial.figures.push_back(drop_at(closure.second, *course));
      }
    }
    trial.curves = {feature_error_,         position_error_, map_error_, distinct_,
                    effective_sample_size_, map_inside_,     calls_};
    return trial;
  }

  static std::vector<std::string> figures(const std::map<std::string, double>& closures) {
    std::vector<std::string> names = {"calls",
                                      "effective_sample_size",
                                      "distinct",
                                      "distinct_end",
                                      "feature_error",
                                      "feature_error_end",
                                      "position_error",
                                      "map_error",
                                      "map_error_aligned",
                                      "map_error_end",
                                      "pose_error",
                                      "map_inside",
                                      "pose_inside",
                                      "map_nees",
                                      "pose_nees"};
    for (const auto& closure : closures) {
      for (const char* course : {"feature_error", "position_error", "effective_sample_size"}) {
        names.push_back(std::string(course) + "_drop_at_" + closure.first);
      }
    }
    return names;
  }
  static std::vector<std::string> curves() {
    return {"feature_error",         "position_error", "map_error", "distinct",
            "effective_sample_size", "map_inside",     "calls"};
  }

 private:
  void judge_map(const Belief& belief) {
    feature_error_.push_back(belief.feature_error);
    map_error_.push_back(kNoFigure);
    map_error_aligned_.push_back(kNoFigure);
    map_inside_.push_back(kNoFigure);
    if (belief.map.empty()) return;
    MapErrorOptions options;
    options.matching = LandmarkMatching::id;
    const MapErrors errors = evaluate_map(belief.map, truth_, options);
    map_error_.back() = errors.rms.value_or(kNoFigure);
    map_error_aligned_.back() = errors.rms_aligned.value_or(kNoFigure);
    map_inside_.back() = errors.coverage95.value_or(kNoFigure);
    for (const LandmarkMatch& match : errors.matches) {
      const PointLandmark& landmark = belief.map[match.estimated];
      map_nees_.push_back(squared_mahalanobis(landmark.position - truth_[match.truth].position,
                                              landmark.covariance));
    }
  }

  /// By how much what is measured falls when a loop is closed.
  double drop_at(double closure, const std::vector<double>& course) const {
    std::vector<double> before, after;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      const double since = times_[i] - closure;
      if (since < -kSameTime && since >= -kAroundClosure - kSameTime) {
        before.push_back(course[i]);
      }
      if (since >= -kSameTime && since < kAroundClosure - kSameTime) {
        after.push_back(course[i]);
      }
    }
    return mean_of_known(before) - mean_of_known(after);
  }

  const std::vector<PointLandmark>& truth_;
  std::vector<double> times_, effective_sample_size_, distinct_, seen_effective_, seen_distinct_,
      calls_, feature_error_, position_error_, map_error_, map_error_aligned_, map_inside_,
      pose_error_, pose_inside_;
  std::vector<double> map_nees_, pose_nees_;  // of all landmarks of all scans, and all poses
};

/// Runs `filter` over the drive without measuring anything else, which would make it read its whole
/// map at every step; ms of processor time.
template <typename Filter>
double milliseconds(const Drive& drive, Filter filter) {
  const double begin = processor_seconds();
  for (const Step& step : drive.steps) filter.update(step.odometry, step.observations);
  return 1e3 * (processor_seconds() - begin);
}

std::map<std::string, std::string> values_of(OdometryNoise noise) {
  ParameterList parameters;
  add_parameters(&noise, &parameters);
  std::map<std::string, std::string> values;
  for (const Parameter& parameter : parameters) values[parameter.name] = parameter.get();
  return values;
}

std::vector<FastSlamOptions> options_of(const StudyDefinition& study) {
  std::vector<FastSlamOptions> all;
  for (const StudyFilter& filter : study.filters) {
    FastSlamOptions options =
        study.preset.empty() ? FastSlamOptions() : fastslam_options_of(study.preset);
    try {
      set_parameters(parameters_of(&options), study.settings);
      set_parameters(parameters_of(&options), filter.settings);
      validate(options);
    } catch (const Error& error) {
      throw Error("filter " + filter.name + ": " + error.what());
    }
    if (options.association.method != DataAssociation::known) {
      throw Error("filter " + filter.name + ": association/method is " +
                  to_string(options.association.method) +
                  ": the study needs known, because eq. 5 of Kwak (2008) compares landmark by "
                  "landmark");
    }
    all.push_back(options);
    if (!(values_of(options.odometry) == values_of(all.front().odometry))) {
      throw Error(
          "filter " + filter.name +
          ": its odometry/... differ from those of other filters; all of a study in a world "
          "are given the same odometry, so set them for the study");
    }
  }
  return all;
}

/// Of an estimator that has no map to be judged.
Trial no_trial(std::size_t figures, std::size_t curves, std::size_t times) {
  Trial trial;
  trial.figures.assign(figures, kNoFigure);
  trial.curves.assign(curves, std::vector<double>(times, kNoFigure));
  return trial;
}

DrawnPath path_of(const Drive& drive, const Pose2& start, const std::string& name,
                  Pose2 Step::*pose) {
  DrawnPath path{name, {}};
  for (const Step& step : drive.steps) {
    path.poses.push_back({step.time, compose(start, step.*pose), Eigen::Matrix3d::Zero()});
  }
  return path;
}

}  // namespace

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

Settings parameters_of_all(const StudyDefinition& study) {
  Settings values;
  const auto take = [&](const ParameterList& parameters) {
    for (const Parameter& parameter : parameters) {
      const auto given = study.settings.find(parameter.name);
      if (given != study.settings.end()) set_parameter(parameters, given->first, given->second);
      values[parameter.name] = parameter.get();
    }
  };
  if (study.filter == StudiedFilter::fastslam) {
    FastSlamOptions options =
        study.preset.empty() ? FastSlamOptions() : fastslam_options_of(study.preset);
    take(parameters_of(&options));
  } else {
    BeaconMclOptions options =
        study.preset.empty() ? BeaconMclOptions() : beacon_mcl_options_of(study.preset);
    take(parameters_of(&options));
  }
  return values;
}

Experiment landmark_experiment(const StudyDefinition& study, const StudyProblem& problem) {
  World world = load_world(problem.world);
  if (problem.duration > 0.0) world.duration = problem.duration;
  if (world.landmarks.empty() || world.landmark_sensor.period <= 0.0) {
    throw Error("world " + world.name +
                " has no landmarks, or no sensor that sees them; indoor_two_loops has both");
  }
  const std::vector<FastSlamOptions> options = options_of(study);
  const Drive first = make_drive(world, options.front().odometry, 1);

  Experiment experiment;
  experiment.figures = Judge::figures(first.closures);
  experiment.curves = Judge::curves();
  for (const Step& step : first.steps) experiment.times.push_back(step.time);
  experiment.about = {{"duration", first.steps.back().time}, {"closures", first.closures}};
  for (std::size_t id = 0; id < world.landmarks.size(); ++id) {
    experiment.places.push_back(
        {"landmark", std::to_string(id), world.landmarks[id].x(), world.landmarks[id].y()});
  }
  for (const auto& [name, time] : first.closures) {
    const auto step = std::find_if(first.steps.begin(), first.steps.end(),
                                   [end = time](const Step& each) { return each.time >= end; });
    const Pose2 place = compose(world.start, step->truth);
    experiment.places.push_back({"closure", name, place.x, place.y});
  }
  experiment.run = [=, truth = true_map(world), filters = study.filters](
                       std::uint64_t seed, std::vector<DrawnPath>* paths) {
    // No filter of a study has odometry noise of its own: all are given the same increments.
    const Drive drive = make_drive(world, options.front().odometry, seed);
    if (paths != nullptr) {
      paths->push_back(path_of(drive, world.start, "truth", &Step::truth));
      paths->push_back(path_of(drive, world.start, "dead reckoning", &Step::dead_reckoning));
    }
    std::vector<Trial> trials;
    for (std::size_t f = 0; f < filters.size(); ++f) {
      if (filters[f].estimator == Estimator::dead_reckoning) {
        trials.push_back(no_trial(Judge::figures(drive.closures).size(), Judge::curves().size(),
                                  drive.steps.size()));
        continue;
      }
      Judge judge(truth);
      DrawnPath path{filters[f].name, {}};
      const auto run = [&](auto* filter, const auto& believed) {
        for (const Step& step : drive.steps) {
          filter->update(step.odometry, step.observations);
          const Belief belief = believed(step, filter);
          judge.judge(step, belief);
          if (paths == nullptr) continue;
          path.poses.push_back(
              {step.time, compose(world.start, belief.pose.mean), Eigen::Matrix3d::Zero()});
        }
      };
      double processor_ms = 0.0;
      if (filters[f].estimator == Estimator::ekf_slam) {
        EkfSlam filter(options[f].sensor);
        processor_ms = milliseconds(drive, filter);
        run(&filter, [&](const Step& step, EkfSlam* own) { return belief_of(step, truth, *own); });
      } else {
        FastSlam filter(options[f], seed);
        processor_ms = milliseconds(drive, FastSlam(options[f], seed));
        run(&filter, [&](const Step& step, FastSlam* own) { return belief_of(step, truth, own); });
      }
      trials.push_back(judge.trial(drive.closures));
      trials.back().processor_ms = processor_ms;
      if (paths != nullptr) paths->push_back(path);
    }
    return trials;
  };
  return experiment;
}

}  // namespace pf_resampling
