#include "research/studies/compensation_study.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/evaluation/particle_errors.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "research/studies/for_each_index.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

constexpr double kChiSquare95TwoDof = 5.991;
constexpr double kSameTime = 1e-6;  // s: multiples of periods are not exact

/// What the filter is given at a scan, and the truth it is judged by.
struct Step {
  double time = 0.0;
  OdometryIncrement odometry;
  std::vector<RangeBearingObservation> observations;
  Pose2 truth;  ///< in the frame of the start, as the filter's map
};

struct Drive {
  std::vector<Step> steps;
  std::map<std::string, double> closures;
};

Drive make_drive(const World& world, const OdometryNoise& noise, std::uint64_t seed) {
  const SimulatedDrive simulated = simulate(world, seed);
  Drive drive;
  drive.closures = simulated.closures;
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
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      // Noise leaves nothing of the range to a landmark under the robot's feet: not to be used.
      if (seen.range <= 0.0) continue;
      RangeBearingObservation observation;
      observation.id = seen.id;
      observation.range = seen.range;
      observation.bearing = seen.bearing;
      step.observations.push_back(observation);
    }
    drive.steps.push_back(step);
  }
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

std::vector<PointLandmark> estimated_map(FastSlam* filter) {
  std::vector<PointLandmark> map;
  for (const auto& landmark : filter->map()) {
    map.push_back({static_cast<std::int32_t>(landmark.id), landmark.mean, landmark.covariance});
  }
  return map;
}

double feature_error(const std::vector<PointLandmark>& truth, FastSlam* filter) {
  FeatureError error;
  for (const int row : filter->rows()) {
    const LandmarkRow landmark = filter->store().row(row);
    error.add(truth[static_cast<std::size_t>(filter->id_of(row))].position, landmark.x, landmark.y,
              landmark.held, static_cast<int>(filter->particles().size()));
  }
  return error.rms();
}

/// Infinite where the covariance is singular, as of particles that are all copies of one.
double squared_mahalanobis(const Eigen::Vector2d& error, const Eigen::Matrix2d& covariance) {
  if (!(covariance.determinant() > 0.0)) return std::numeric_limits<double>::infinity();
  return error.dot(covariance.inverse() * error);
}

/// A mean that values are added to.
class Average {
 public:
  void add(double value) {
    sum_ += value;
    ++count_;
  }
  /// 0 of no values.
  double value() const { return count_ > 0 ? sum_ / count_ : 0.0; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

/// One run: its figures, and their course over the scans.
class Run {
 public:
  explicit Run(const std::vector<PointLandmark>& truth) : truth_(truth) {}

  void measure(const Pose2& true_pose, bool has_observations, FastSlam* filter) {
    const FastSlamStatus& status = filter->status();
    if (has_observations) {
      effective_sample_size_.add(status.effective_sample_size);
      distinct_.add(status.distinct_ancestors_since_start);
    }
    const Eigen::Vector2d place(true_pose.x, true_pose.y);
    position_error_.add(position_error(place, filter->particles().x, filter->particles().y));
    const PoseEstimate pose = filter->estimate();
    const Eigen::Vector2d offset(pose.mean.x - place.x(), pose.mean.y - place.y());
    pose_error_.add(offset.norm());
    const double squared = squared_mahalanobis(offset, pose.covariance.topLeftCorner<2, 2>());
    pose_inside_.add(squared <= kChiSquare95TwoDof ? 1.0 : 0.0);
    pose_nees_.push_back(squared);

    curves_.effective_sample_size.push_back(status.effective_sample_size);
    curves_.distinct.push_back(status.distinct_ancestors_since_start);
    measure_map(filter);
  }

  CompensationFigures figures(const FastSlamStatus& status) const {
    CompensationFigures figures;
    figures.calls = static_cast<double>(status.renewals);
    figures.effective_sample_size = effective_sample_size_.value();
    figures.distinct = distinct_.value();
    figures.distinct_end = status.distinct_ancestors_since_start;
    figures.feature_error = feature_error_.value();
    figures.feature_error_end = curves_.feature_error.back();
    figures.position_error = position_error_.value();
    figures.map_error = map_error_.value();
    figures.map_error_aligned = map_error_aligned_.value();
    figures.map_error_end = curves_.map_error.back();
    figures.pose_error = pose_error_.value();
    figures.map_inside = map_inside_.value();
    figures.pose_inside = pose_inside_.value();
    figures.map_nees = map_nees_.empty() ? 0.0 : median(map_nees_);
    figures.pose_nees = median(pose_nees_);
    return figures;
  }
  const CompensationCurves& curves() const { return curves_; }

 private:
  // Nothing to add to the averages as long as there is no map; the curves begin at zero.
  void measure_map(FastSlam* filter) {
    const std::vector<PointLandmark> map = estimated_map(filter);
    double eq5 = 0.0;
    double rms = 0.0;
    double inside = 0.0;
    if (!map.empty()) {
      MapErrorOptions options;
      options.matching = LandmarkMatching::id;
      const MapErrors errors = evaluate_map(map, truth_, options);
      eq5 = feature_error(truth_, filter);
      rms = errors.rms.value_or(0.0);
      inside = errors.coverage95.value_or(0.0);
      feature_error_.add(eq5);
      map_error_.add(rms);
      map_inside_.add(inside);
      if (errors.rms_aligned) map_error_aligned_.add(*errors.rms_aligned);
      for (const LandmarkMatch& match : errors.matches) {
        const PointLandmark& landmark = map[match.estimated];
        map_nees_.push_back(squared_mahalanobis(landmark.position - truth_[match.truth].position,
                                                landmark.covariance));
      }
    }
    curves_.feature_error.push_back(eq5);
    curves_.map_error.push_back(rms);
    curves_.map_inside.push_back(inside);
  }

  const std::vector<PointLandmark>& truth_;
  Average effective_sample_size_, distinct_, feature_error_, position_error_, map_error_,
      map_error_aligned_, pose_error_, map_inside_, pose_inside_;
  std::vector<double> map_nees_, pose_nees_;
  CompensationCurves curves_;
};

/// A figure and its name in JSON and CSV.
struct CompensationFigure {
  const char* name;
  double CompensationFigures::*value;
  bool by_the_clock = false;
};

const std::vector<CompensationFigure>& compensation_figures() {
  using Figures = CompensationFigures;
  static const std::vector<CompensationFigure> all = {
      {"calls", &Figures::calls},
      {"effective_sample_size", &Figures::effective_sample_size},
      {"distinct", &Figures::distinct},
      {"distinct_end", &Figures::distinct_end},
      {"feature_error", &Figures::feature_error},
      {"feature_error_end", &Figures::feature_error_end},
      {"position_error", &Figures::position_error},
      {"map_error", &Figures::map_error},
      {"map_error_aligned", &Figures::map_error_aligned},
      {"map_error_end", &Figures::map_error_end},
      {"pose_error", &Figures::pose_error},
      {"map_inside", &Figures::map_inside},
      {"pose_inside", &Figures::pose_inside},
      {"map_nees", &Figures::map_nees},
      {"pose_nees", &Figures::pose_nees},
      {"processor_ms", &Figures::processor_ms, true}};
  return all;
}

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Without measuring anything else, which would make the filter read its whole map at every step.
double filter_milliseconds(const Drive& drive, const FastSlamOptions& options, std::uint64_t seed) {
  FastSlam filter(options, seed);
  const double begin = processor_seconds();
  for (const Step& step : drive.steps) filter.update(step.odometry, step.observations);
  return 1e3 * (processor_seconds() - begin);
}

void check(const World& world, const CompensationStudyOptions& options) {
  if (options.drives < 2) {
    throw Error("seeds is " + std::to_string(options.drives) +
                ": it has to be at least 2, because standard errors need two runs");
  }
  if (options.jobs < 1) {
    throw Error("jobs is " + std::to_string(options.jobs) + ": it has to be at least 1");
  }
  if (options.variants.empty()) throw Error("a study needs at least one variant");
  if (world.landmarks.empty() || world.landmark_sensor.period <= 0.0) {
    throw Error("world " + world.name +
                " has no landmarks, or no sensor that sees them; indoor_two_loops has both");
  }
  if (options.base.association.method != DataAssociation::known) {
    throw Error(
        "association/method is " + to_string(options.base.association.method) +
        ": the study needs known, because eq. 5 of Kwak (2008) compares landmark by landmark");
  }
}

void add_curves(const CompensationCurves& more, double share, CompensationCurves* sum) {
  const auto add = [&](const std::vector<double>& from, std::vector<double>* to) {
    to->resize(from.size(), 0.0);
    for (std::size_t i = 0; i < from.size(); ++i) (*to)[i] += share * from[i];
  };
  add(more.feature_error, &sum->feature_error);
  add(more.map_error, &sum->map_error);
  add(more.distinct, &sum->distinct);
  add(more.effective_sample_size, &sum->effective_sample_size);
  add(more.map_inside, &sum->map_inside);
}

}  // namespace

std::vector<double> CompensationCell::values(double CompensationFigures::*figure) const {
  std::vector<double> values;
  for (const CompensationFigures& run : runs) values.push_back(run.*figure);
  return values;
}

const CompensationCell* CompensationStudy::find(const std::string& name) const {
  const auto found = std::find_if(cells.begin(), cells.end(), [&](const CompensationCell& cell) {
    return cell.variant.name == name;
  });
  return found == cells.end() ? nullptr : &*found;
}

CompensationStudy run_compensation_study(const World& world,
                                         const CompensationStudyOptions& options,
                                         const std::function<void(std::uint64_t)>& progress) {
  check(world, options);
  CompensationStudy study;
  study.world = world.name;
  study.options = options;
  const std::size_t drives = static_cast<std::size_t>(options.drives);
  std::vector<FastSlamOptions> filters;
  for (const CompensationVariant& variant : options.variants) {
    FastSlamOptions filter = options_of(variant, options.base);
    validate(filter);
    filters.push_back(filter);
    CompensationCell cell;
    cell.variant = variant;
    cell.runs.resize(drives);
    study.cells.push_back(cell);
  }

  const std::vector<PointLandmark> truth = true_map(world);
  std::vector<std::vector<CompensationCurves>> curves(drives);
  const auto drive_all = [&](std::size_t i) {
    const std::uint64_t seed = i + 1;
    // No variant changes the odometry's noise.
    const Drive drive = make_drive(world, options.base.odometry, seed);
    if (drive.steps.empty()) throw Error("world " + world.name + " ends before the first scan");
    if (i == 0) {
      for (const Step& step : drive.steps) study.times.push_back(step.time);
      study.closures = drive.closures;
    }
    for (std::size_t v = 0; v < filters.size(); ++v) {
      Run run(truth);
      FastSlam filter(filters[v], seed);
      for (const Step& step : drive.steps) {
        filter.update(step.odometry, step.observations);
        run.measure(step.truth, !step.observations.empty(), &filter);
      }
      CompensationFigures& figures = study.cells[v].runs[i];
      figures = run.figures(filter.status());
      figures.processor_ms = filter_milliseconds(drive, filters[v], seed);
      curves[i].push_back(run.curves());
    }
  };
  for_each_index(drives, options.jobs, drive_all, progress);
  // In order of the drives, whichever was done first.
  for (const std::vector<CompensationCurves>& of_drive : curves) {
    for (std::size_t v = 0; v < of_drive.size(); ++v) {
      add_curves(of_drive[v], 1.0 / static_cast<double>(drives), &study.cells[v].curves);
    }
  }
  return study;
}

StudyReport report_of(const CompensationStudy& study) {
  FastSlamOptions given = study.options.base;
  FastSlamOptions kwak = kwak2008_options();
  StudyReport report;
  report.about = {
      {"study", "compensation"},
      {"world", study.world},
      {"drives", study.options.drives},
      {"duration", study.times.empty() ? 0.0 : study.times.back()},
      {"closures", study.closures},
      {"settings", changed_parameters(parameters_of(&given), parameters_of(&kwak), {"threads"})}};
  report.columns = {{"filter", "filter"},
                    {"calls", "calls", 1},
                    {"effective_sample_size", "N_eff", 1},
                    {"distinct", "distinct", 1},
                    {"feature_error", "eq. 5 (m)"},
                    {"position_error", "eq. 6 (m)"},
                    {"map_error", "map (m)"},
                    {"map_error_minus_RSR", "minus RSR's"},
                    {"map_error_end", "map, end (m)"},
                    {"map_inside", "landmarks inside"},
                    {"pose_inside", "poses inside"},
                    {"processor_ms", "processor (ms)", 2}};
  report.figures_of_run = {"filter", "seed"};
  // The same with the same seed, so without what the clock says.
  for (const CompensationFigure& figure : compensation_figures()) {
    if (!figure.by_the_clock) report.figures_of_run.emplace_back(figure.name);
  }
  const CompensationCell* reference = study.find("RSR");
  for (const CompensationCell& cell : study.cells) {
    json row = {{"filter", cell.variant.name},
                {"group", cell.variant.group},
                {"settings", cell.variant.settings},
                {"curves",
                 {{"time", study.times},
                  {"feature_error", cell.curves.feature_error},
                  {"map_error", cell.curves.map_error},
                  {"distinct", cell.curves.distinct},
                  {"effective_sample_size", cell.curves.effective_sample_size},
                  {"map_inside", cell.curves.map_inside}}}};
    for (const CompensationFigure& figure : compensation_figures()) {
      const std::vector<double> values = cell.values(figure.value);
      row[figure.name] = to_json(mean_of(values));
      if (reference != nullptr && reference != &cell && !figure.by_the_clock) {
        row[std::string(figure.name) + "_minus_RSR"] =
            to_json(paired_difference(values, reference->values(figure.value)));
      }
    }
    report.summary.push_back(row);
    for (std::size_t i = 0; i < cell.runs.size(); ++i) {
      json run = {{"filter", cell.variant.name}, {"seed", i + 1}};
      for (const CompensationFigure& figure : compensation_figures()) {
        if (!figure.by_the_clock) run[figure.name] = cell.runs[i].*figure.value;
      }
      report.runs.push_back(run);
    }
  }
  return report;
}

}  // namespace pf_resampling
