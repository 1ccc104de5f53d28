// The library as a Python module: numpy arrays go in without a copy, and what comes out belongs to
// the caller. Errors of the library are pf_resampling_core.Error, a ValueError.
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cmath>
#include <ctime>
#include <limits>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/simulation/simulate.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace py = pybind11;
using namespace pybind11::literals;

namespace pf_resampling {
namespace {

using OptionalArray = std::optional<Eigen::ArrayXd>;
using OptionalIds = std::optional<Eigen::ArrayXi>;
using InPlace = const MutableArray&;

// Sets parameters by their names behind `prefix`. The values are Python's or text.
void set_from(const py::dict& given, const std::string& prefix, const ParameterList& parameters) {
  for (const auto& [name, value] : given) {
    std::string text = py::str(value);
    if (py::isinstance<py::bool_>(value)) text = value.cast<bool>() ? "true" : "false";
    set_parameter(parameters, prefix + std::string(py::str(name)), text);
  }
}

template <typename Options>
Options options_from(const py::kwargs& given, const std::string& prefix) {
  Options options;
  ParameterList parameters;
  add_parameters(&options, &parameters);
  set_from(given, prefix, parameters);
  return options;
}

void check_sizes(const char* what, Eigen::Index expected,
                 std::initializer_list<Eigen::Index> sizes) {
  for (const Eigen::Index size : sizes) {
    if (size == expected) continue;
    throw Error(std::string(what) + " have " + std::to_string(expected) + " and " +
                std::to_string(size) + " elements; give arrays of one size");
  }
}

// A function (weights, size, stream) -> counts as a scheme of the library's; None: none.
OwnScheme scheme_of(const py::object& function) {
  if (function.is_none()) return nullptr;
  return
      [function](ConstArray weights, int size, const RandomStream& stream, MutableIndices counts) {
        // A copy, since the function may keep it.
        const auto taken = function(Eigen::ArrayXd(weights), size, stream).cast<Eigen::ArrayXi>();
        check_sizes("weights and counts of the scheme", counts.size(), {taken.size()});
        counts = taken;
      };
}

struct Resampled {
  Eigen::ArrayXi ancestors;
  Eigen::ArrayXi counts;
  Eigen::ArrayXd log_weights;
};

Pose2 pose_of(const Eigen::Vector3d& pose) {
  return {pose[0], pose[1], pose[2]};
}
Eigen::Vector3d array_of(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

// An array of `count` rows, each as `row` gives it.
template <int kColumns, typename Row>
auto rows_of(std::size_t count, const Row& row) {
  Eigen::Array<double, Eigen::Dynamic, kColumns, Eigen::RowMajor> rows(count, kColumns);
  for (std::size_t k = 0; k < count; ++k)
    rows.row(static_cast<Eigen::Index>(k)) = row(k).transpose();
  return rows;
}

// A filter with the odometry since its last update.
template <typename Filter>
struct Driven {
  Filter filter;
  OdometryIncrement odometry = {};
};
using DrivenFastSlam = Driven<FastSlam>;
using DrivenBeaconMcl = Driven<BeaconMcl>;

// Calls `update`, then forgets the odometry: unless the filter refused what it was given and has
// not moved, as it has when a scheme throws.
template <typename Filter, typename Update>
void take_odometry(Driven<Filter>* driven, const Update& update) {
  const auto updates = driven->filter.status().updates;
  try {
    update(&driven->filter, driven->odometry);
  } catch (...) {
    if (driven->filter.status().updates != updates) driven->odometry = {};
    throw;
  }
  driven->odometry = {};
}

template <typename Options>
Options filter_options(const py::dict& given, const py::object& scheme,
                       Options (*preset)(const std::string&)) {
  py::dict parameters(given.attr("copy")());
  Options options = preset(py::str(parameters.attr("pop")("preset", "balanced")));
  set_from(parameters, "", parameters_of(&options));
  options.strategy.resampling.own_scheme = scheme_of(scheme);
  return options;
}

template <typename Observations>
void set_variances(const OptionalArray& variances, double Observations::value_type::*field,
                   Observations* observations) {
  if (!variances) return;
  check_sizes("observations and variances", static_cast<Eigen::Index>(observations->size()),
              {variances->size()});
  for (std::size_t k = 0; k < observations->size(); ++k) {
    (*observations)[k].*field = (*variances)[static_cast<Eigen::Index>(k)];
  }
}

// What both filters have.
template <typename Filter>
py::class_<Driven<Filter>> filter_class(const py::module& module, const char* name,
                                        const char* documentation) {
  using Self = Driven<Filter>;
  return py::class_<Self>(module, name, documentation)
      .def(
          "predict",
          [](Self& self, const Eigen::Vector3d& motion, double duration) {
            OdometryIncrement odometry = self.odometry;
            append(self.filter.options().odometry, pose_of(motion), duration, &odometry);
            if (!(duration >= 0.0 && std::isfinite(odometry.duration)) ||
                !array_of(odometry.mean).allFinite() || !odometry.covariance.allFinite()) {
              throw Error("odometry (" + std::to_string(motion[0]) + " m, " +
                          std::to_string(motion[1]) + " m, " + std::to_string(motion[2]) +
                          " rad) over " + std::to_string(duration) +
                          " s: give finite numbers and no negative time");
            }
            self.odometry = odometry;
          },
          "motion"_a, "duration"_a,
          "The robot moved by `motion` (x and y in m, heading in rad, in its frame before) in "
          "`duration` s. Takes effect with the next update().")
      .def(
          "estimate",
          [](const Self& self) {
            if (self.filter.particles().size() == 0) {
              throw Error("there is no population yet: update the filter with more observations");
            }
            const PoseEstimate estimate = self.filter.estimate();
            return py::make_tuple(array_of(estimate.mean), estimate.covariance);
          },
          "Mean (x, y, heading; m and rad) and 3 x 3 covariance of the pose at the last update().")
      .def(
          "particles",
          [](const Self& self) {
            py::dict columns;
            self.filter.particles().for_each_column(
                self.filter.particles(),
                [&](const char* column, const auto& values) { columns[column] = values; });
            return columns;
          },
          "All that particles carry, an array for each name: x, y, heading, log_weight, weight, "
          "ancestor and so on.")
      .def(
          "parameters",
          [](const Self& self) {
            auto options = self.filter.options();
            py::dict values;
            for (const Parameter& parameter : parameters_of(&options)) {
              values[parameter.name.c_str()] = parameter.get();
            }
            return values;
          },
          "All parameters by their names, as text.")
      .def(
          "set_parameters",
          [](Self& self, const py::dict& given) {
            auto options = self.filter.options();
            set_from(given, "", parameters_of(&options));
            self.filter.set_options(options);
          },
          "parameters"_a, "Changes some parameters; the particles stay as they are.")
      .def(
          "status",
          [](const Self& self) {
            const auto& status = self.filter.status();
            return py::dict(
                "updates"_a = status.updates, "renewals"_a = status.renewals,
                "redraws"_a = status.redraws, "renewed"_a = status.renewed,
                "effective_sample_size"_a = status.effective_sample_size,
                "distinct_ancestors_since_start"_a = status.distinct_ancestors_since_start,
                "log_likelihood"_a = status.log_likelihood);
          },
          "Counts since the start, and what the weights of the last update() said.");
}

void add_resampling(py::module* module) {
  py::class_<RandomStream>(*module, "RandomStream",
                           "Random numbers that depend on seed and step alone. Each has an index "
                           "and can be drawn in any order.")
      .def(py::init([](std::uint64_t seed, std::uint32_t step) {
             return RandomStream(seed, RandomPurpose::resampling, step);
           }),
           "seed"_a, "step"_a = 0)
      .def(
          "uniform",
          [](const RandomStream& self, std::uint32_t count, std::uint64_t first) {
            Eigen::ArrayXd numbers(count);
            self.fill_uniform(first, count, numbers.data());
            return numbers;
          },
          "count"_a, "first"_a = 0, "Uniform in (0, 1).")
      .def(
          "normal",
          [](const RandomStream& self, std::uint32_t count, std::uint64_t first) {
            Eigen::ArrayXd numbers(count);
            self.fill_normal(first, count, numbers.data());
            return numbers;
          },
          "count"_a, "first"_a = 0, "Standard normal.");

  py::class_<Resampled>(*module, "Resampled", "What a resampling has drawn.")
      .def_readonly("ancestors", &Resampled::ancestors,
                    "Of each slot, the particle that it copies; survivors keep their own slots.")
      .def_readonly("counts", &Resampled::counts, "Of each particle, how often it was taken.")
      .def_readonly("log_weights", &Resampled::log_weights, "Of each slot, normalised.");
  py::class_<Resampler>(
      *module, "Resampler",
      "A resampling scheme. Keywords are the parameters below population/resampling/: "
      "Resampler(scheme='partial', partial_high=2.0). Or with a scheme in Python, a function "
      "(weights, size, stream) that returns how often each particle is taken: "
      "Resampler(own_scheme=function).")
      .def(py::init([](const py::object& own_scheme, const py::kwargs& given) {
             auto options = options_from<ResamplingOptions>(given, "population/resampling/");
             if (!own_scheme.is_none()) options.own_scheme = scheme_of(own_scheme);
             return Resampler(options);
           }),
           "own_scheme"_a = py::none())
      .def(
          "resample",
          [](Resampler& self, ConstArray weights, const RandomStream& stream,
             std::optional<int> size) {
            const ResamplingResult drawn =
                self.resample(weights, size.value_or(static_cast<int>(weights.size())), stream);
            return Resampled{drawn.ancestors, drawn.counts, drawn.log_weights};
          },
          "weights"_a, "stream"_a, "size"_a = py::none(),
          "Draws `size` ancestors, as many as there are weights unless it is given. The weights "
          "need not add up to 1.");
  module->def(
      "resampling_seconds",
      [](const std::string& scheme, ConstArray weights, std::uint32_t repetitions,
         std::uint32_t first) {
        ResamplingOptions options;
        options.scheme = from_string<ResamplingScheme>(scheme);
        Resampler resampler(options);
        const std::clock_t begin = std::clock();
        for (std::uint32_t i = 0; i < repetitions; ++i) {
          resampler.resample(weights, static_cast<int>(weights.size()),
                             RandomStream(1, RandomPurpose::resampling, first + i));
        }
        return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / repetitions;
      },
      "scheme"_a, "weights"_a, "repetitions"_a, "first"_a = 0,
      "Processor time of one resampling, without what a call from Python takes.");
  module->def(
      "resampling_schemes",
      [] {
        std::vector<std::string> names;
        for (const auto scheme : all_values<ResamplingScheme>()) names.push_back(to_string(scheme));
        return names;
      },
      "The names of all schemes.");
  module->def(
      "normalize",
      [](InPlace log_weights) {
        Eigen::ArrayXd weights(log_weights.size());
        normalize(log_weights, weights);
        return weights;
      },
      "log_weights"_a, "Normalises the log-weights in place and returns the linear weights.");
  module->def(
      "effective_sample_size", [](ConstArray weights) { return effective_sample_size(weights); },
      "weights"_a, "Of normalised linear weights: 1 / sum of squares.");

  py::class_<CompensationResult>(*module, "Compensation", "Which particles are to be blended.")
      .def_readonly("log_weights", &CompensationResult::log_weights, "Afterwards, normalised.")
      .def_property_readonly(
          "pairs",
          [](const CompensationResult& self) {
            return rows_of<3>(self.pairs.size(), [&](std::size_t k) {
              const BlendPair& pair = self.pairs[k];
              return Eigen::Array3d(pair.low, pair.high, pair.share);
            });
          },
          "A row for each weak particle: it, its strong one, and its own share of the blend.")
      .def(
          "blend_poses",
          [](const CompensationResult& self, InPlace x, InPlace y, InPlace heading) {
            check_sizes("poses", self.log_weights.size(), {x.size(), y.size(), heading.size()});
            blend_poses(self.pairs, x, y, heading);
          },
          "x"_a, "y"_a, "heading"_a, "Blends poses in place.");
  module->def(
      "compensate",
      [](ConstArray weights, const RandomStream& stream, const py::kwargs& given) {
        return compensate(options_from<CompensationOptions>(given, "population/compensation/"),
                          weights, stream);
      },
      "weights"_a, "stream"_a,
      "Compensation in place of resampling. Keywords are the parameters below "
      "population/compensation/.");
  module->def(
      "excite",
      [](ConstArray weights, const RandomStream& stream, InPlace x, InPlace y, InPlace heading,
         const py::kwargs& given) {
        check_sizes("weights and poses", weights.size(), {x.size(), y.size(), heading.size()});
        ExcitationWorkspace workspace;
        excite(options_from<ExcitationOptions>(given, "excitation/"), weights, stream,
               {x, y, heading}, &workspace);
      },
      "weights"_a, "stream"_a, "x"_a, "y"_a, "heading"_a,
      "Adds noise to the poses, in place. Keywords are the parameters below excitation/.");
}

// A scan of a simulated drive, what was driven since the one before, and the truth.
struct SimulatedStep {
  double time = 0.0;
  OdometryIncrement odometry;
  std::vector<RangeBearingObservation> seen;
  Pose2 truth, dead_reckoning;
};

constexpr double kSameTime = 1e-6;  // s: multiples of periods are not exact

std::vector<SimulatedStep> steps_of(const World& world, const SimulatedDrive& drive,
                                    const OdometryNoise& noise) {
  std::vector<SimulatedStep> steps;
  std::size_t next = 1;
  for (const SimulatedDrive::Scan& scan : drive.scans) {
    SimulatedStep step;
    step.time = scan.time;
    for (; next < drive.odometry.size(); ++next) {
      const SimulatedDrive::Odometry& before = drive.odometry[next - 1];
      const SimulatedDrive::Odometry& now = drive.odometry[next];
      if (now.time > scan.time + kSameTime) break;
      append(noise, relative(before.pose, now.pose), now.time - before.time, &step.odometry);
    }
    const SimulatedDrive::Odometry& now = drive.odometry[next - 1];
    if (std::abs(now.time - scan.time) > kSameTime) {
      throw Error(
          "a scan falls between two odometry messages: the period of scans has to be a "
          "multiple of that of odometry");
    }
    step.truth = relative(world.start, now.truth);
    step.dead_reckoning = now.pose;
    for (const SimulatedLandmarkObservation& seen : scan.observations) {
      // Noise leaves nothing of the range to a landmark under the robot's feet: not to be used.
      if (seen.range > 0.0) step.seen.push_back({seen.id, seen.range, seen.bearing});
    }
    steps.push_back(step);
  }
  return steps;
}

void add_simulation(py::module* module) {
  py::class_<SimulatedStep>(*module, "SimulatedStep",
                            "A scan of a simulated drive among landmarks; poses from the start.")
      .def_readonly("time", &SimulatedStep::time)
      .def_property_readonly("truth",
                             [](const SimulatedStep& self) { return array_of(self.truth); })
      .def_property_readonly(
          "dead_reckoning", [](const SimulatedStep& self) { return array_of(self.dead_reckoning); })
      .def_property_readonly(
          "motion", [](const SimulatedStep& self) { return array_of(self.odometry.mean); },
          "By the odometry since the step before.")
      .def_property_readonly("motion_covariance",
                             [](const SimulatedStep& self) { return self.odometry.covariance; })
      .def_property_readonly(
          "seen",
          [](const SimulatedStep& self) {
            std::vector<std::tuple<int, double, double>> seen;
            for (const auto& each : self.seen) seen.emplace_back(each.id, each.range, each.bearing);
            return seen;
          },
          "[(id, range, bearing)]; ids are places in the list of the landmarks.");
  module->def(
      "simulate",
      [](const std::map<std::string, double>& numbers,
         const std::vector<Eigen::Vector2d>& waypoints,
         const std::vector<Eigen::Vector2d>& landmarks, const std::map<std::string, int>& closures,
         bool repeat, std::uint64_t seed, const py::dict& odometry) {
        World world;
        const auto known = numbers_of(&world);
        for (const auto& [name, value] : numbers) {
          if (known.count(name) == 0) throw Error(name + " is no number of a world");
          *known.at(name) = value;
        }
        world.waypoints = waypoints;
        world.landmarks = landmarks;
        world.closures = closures;
        world.repeat = repeat;
        OdometryNoise noise;
        ParameterList parameters;
        add_parameters(&noise, &parameters);
        set_from(odometry, "odometry/", parameters);
        const SimulatedDrive drive = simulate(world, seed);
        return py::make_tuple(steps_of(world, drive, noise), drive.closures);
      },
      "numbers"_a, "waypoints"_a, "landmarks"_a, "closures"_a, "repeat"_a, "seed"_a, "odometry"_a,
      "A drive through a world, whose keys are those of config/worlds: its steps, and when each "
      "closure's way-point was reached (s). `odometry`: its noise as the filter is told, by the "
      "parameters below odometry/.");
}

// The landmarks of the weighted-mean map, a row each.
py::dict landmarks_of(const std::vector<LandmarkEstimate>& map) {
  const auto count = static_cast<Eigen::Index>(map.size());
  Eigen::Array<std::int64_t, Eigen::Dynamic, 1> ids(count);
  Eigen::ArrayXd held(count);
  py::array_t<double> covariances({count, Eigen::Index{2}, Eigen::Index{2}});
  for (Eigen::Index k = 0; k < count; ++k) {
    const LandmarkEstimate& landmark = map[static_cast<std::size_t>(k)];
    ids[k] = landmark.id;
    held[k] = landmark.held;
    Eigen::Map<Eigen::Matrix2d>(covariances.mutable_data(k)) = landmark.covariance;
  }
  const auto means = rows_of<2>(map.size(), [&](std::size_t k) { return map[k].mean.array(); });
  return py::dict("id"_a = ids, "mean"_a = means, "covariance"_a = covariances, "held"_a = held);
}

void add_fastslam(const py::module& module) {
  filter_class<FastSlam>(
      module, "FastSlam",
      "FastSLAM. `parameters`: by the names of doc/parameters.md, `preset` among them. "
      "`own_scheme`: see Resampler.")
      .def(py::init([](const py::dict& parameters, std::uint64_t seed, const py::object& scheme) {
             return DrivenFastSlam{
                 FastSlam(filter_options(parameters, scheme, fastslam_options_of), seed)};
           }),
           "parameters"_a = py::dict(), "seed"_a = 0, "own_scheme"_a = py::none())
      .def(
          "update",
          [](DrivenFastSlam& self, ConstArray ranges, ConstArray bearings, const OptionalIds& ids,
             const Eigen::Vector3d& sensor, const OptionalArray& range_variances,
             const OptionalArray& bearing_variances) {
            check_sizes("ranges and bearings", ranges.size(), {bearings.size()});
            if (ids) check_sizes("ranges and ids", ranges.size(), {ids->size()});
            std::vector<RangeBearingObservation> seen;
            for (Eigen::Index k = 0; k < ranges.size(); ++k) {
              seen.push_back({ids ? (*ids)[k] : -1, ranges[k], bearings[k]});
            }
            set_variances(range_variances, &RangeBearingObservation::range_variance, &seen);
            set_variances(bearing_variances, &RangeBearingObservation::bearing_variance, &seen);
            take_odometry(&self, [&](FastSlam* filter, const OdometryIncrement& odometry) {
              filter->update(odometry, seen, pose_of(sensor));
            });
          },
          "ranges"_a, "bearings"_a, "ids"_a = py::none(),
          "sensor"_a = Eigen::Vector3d::Zero().eval(), "range_variances"_a = py::none(),
          "bearing_variances"_a = py::none(),
          "One scan (m, rad) at the end of the odometry, by a sensor at `sensor` on the robot.")
      .def(
          "landmarks", [](DrivenFastSlam& self) { return landmarks_of(self.filter.map()); },
          "The weighted-mean map: id, mean (m), covariance, and the share of the weight that holds "
          "each landmark.")
      .def(
          "take",
          [](DrivenFastSlam& self, const SimulatedStep& step) {
            self.filter.update(step.odometry, step.seen);
          },
          "step"_a, "One step of simulate(), in place of predict() and update().")
      .def(
          "landmarks_of_particles",
          [](DrivenFastSlam& self) {
            LandmarkStore& store = self.filter.store();
            const auto particles = static_cast<Eigen::Index>(store.particles());
            py::dict places;
            for (const int row : self.filter.rows()) {
              const LandmarkRow landmark = store.row(row);
              Eigen::ArrayX2d place(particles, 2);
              for (Eigen::Index i = 0; i < particles; ++i) {
                constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
                const bool is_held = landmark.held == nullptr || landmark.held[i] != 0;
                place(i, 0) = is_held ? landmark.x[i] : kNone;
                place(i, 1) = is_held ? landmark.y[i] : kNone;
              }
              places[py::int_(self.filter.id_of(row))] = place;
            }
            return places;
          },
          "Where each particle has each landmark (m), by id; NaN where it has none.")
      .def(
          "set_pose",
          [](DrivenFastSlam& self, const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance) {
            self.filter.set_poses({pose_of(mean), covariance});
          },
          "mean"_a, "covariance"_a, "Draws every particle's pose from a Gaussian.")
      .def(
          "save_map",
          [](DrivenFastSlam& self, const std::string& path) {
            write_map_file(path, saved_map(&self.filter, self.filter.options().particles));
          },
          "path"_a, "As the service save_map of the node does.")
      .def(
          "load_map",
          [](DrivenFastSlam& self, const std::string& path) {
            self.filter.load(read_map(path, "map"));
          },
          "path"_a, "Goes on from a saved map, or a list of landmarks.")
      .def(
          "smooth", [](DrivenFastSlam& self) { return self.filter.smooth(); },
          "Draws the particles from the memory of all data now. False if it has no solution, or if "
          "the renewal is not redraw.")
      .def(
          "path",
          [](const DrivenFastSlam& self) {
            const std::vector<Pose2> path = self.filter.path();
            return rows_of<3>(path.size(), [&](std::size_t k) { return array_of(path[k]); });
          },
          "The path as it is believed now, a pose for each update().")
      .def(
          "noise",
          [](const DrivenFastSlam& self) {
            const NoiseScales& noise = self.filter.noise();
            return py::dict("range"_a = noise.range, "bearing"_a = noise.bearing,
                            "motion"_a = noise.motion);
          },
          "Factors of the standard deviations as stated that the memory has found.");
}

std::vector<Beacon> beacons_from(const std::map<int, std::vector<double>>& places) {
  std::vector<Beacon> beacons;
  for (const auto& [id, place] : places) {
    if (place.size() != 2 && place.size() != 3) {
      throw Error("beacon " + std::to_string(id) + " has " + std::to_string(place.size()) +
                  " coordinates; give (x, y) or (x, y, z)");
    }
    const bool is_planar = place.size() == 2;
    beacons.push_back({id, {place[0], place[1], is_planar ? 0.0 : place[2]}, is_planar});
  }
  return beacons;
}

void add_beacon_mcl(const py::module& module) {
  filter_class<BeaconMcl>(module, "BeaconMcl",
                          "Localization by ranges. `beacons`: {id: (x, y)} or {id: (x, y, z)}, m. "
                          "`parameters`: by the names of doc/parameters.md, `preset` among them. "
                          "`own_scheme`: see Resampler.")
      .def(py::init([](const std::map<int, std::vector<double>>& beacons,
                       const py::dict& parameters, std::uint64_t seed, const py::object& scheme) {
             return DrivenBeaconMcl{
                 BeaconMcl(filter_options(parameters, scheme, beacon_mcl_options_of),
                           beacons_from(beacons), seed)};
           }),
           "beacons"_a, "parameters"_a = py::dict(), "seed"_a = 0, "own_scheme"_a = py::none())
      .def(
          "update",
          [](DrivenBeaconMcl& self, ConstArray ranges, const Eigen::ArrayXi& ids,
             const OptionalArray& variances, const std::optional<Eigen::Vector3d>& antenna) {
            check_sizes("ranges and ids", ranges.size(), {ids.size()});
            std::vector<RangeObservation> measured;
            for (Eigen::Index k = 0; k < ranges.size(); ++k) {
              measured.push_back({ids[k], ranges[k], 0.0, antenna.value_or(Eigen::Vector3d::Zero()),
                                  antenna.has_value()});
            }
            set_variances(variances, &RangeObservation::variance, &measured);
            take_odometry(&self, [&](BeaconMcl* filter, const OdometryIncrement& odometry) {
              filter->update(odometry, measured);
            });
          },
          "ranges"_a, "ids"_a, "variances"_a = py::none(), "antenna"_a = py::none(),
          "Ranges (m) to beacons at the end of the odometry. `antenna`: where it is on the robot, "
          "if that is known.")
      .def(
          "set_pose",
          [](DrivenBeaconMcl& self, const Eigen::Vector3d& mean,
             const Eigen::Matrix3d& covariance) {
            self.filter.initialize_gaussian(pose_of(mean), covariance);
          },
          "mean"_a, "covariance"_a, "Starts anew about a pose.")
      .def(
          "radios",
          [](const DrivenBeaconMcl& self) {
            py::list radios;
            if (self.filter.memory() == nullptr) return radios;
            for (const RadioKnowledge& radio : self.filter.memory()->radios()) {
              py::list places;
              for (const RadioPlace& place : radio.places) {
                places.append(py::make_tuple(place.position, place.covariance, place.probability));
              }
              radios.append(py::dict(
                  "id"_a = radio.id, "as_listed"_a = !self.filter.is_not_as_listed(radio.id),
                  "ranges"_a = radio.ranges, "fault"_a = radio.fault, "places"_a = places,
                  "scale"_a = radio.calibration.scale, "bias"_a = radio.calibration.bias,
                  "sigma"_a = radio.calibration.sigma));
            }
            return radios;
          },
          "What the memory of all ranges says of each radio: whether it is as listed, probability "
          "of a fault, places (position, covariance, probability), scale, bias and sigma of its "
          "ranges (m). Empty unless the renewal is redraw.");
}

}  // namespace

PYBIND11_MODULE(pf_resampling_core, module) {
  module.doc() =
      "Particle filters for localization and SLAM, with every resampling scheme. Metres, radians, "
      "seconds.";
  py::register_exception<Error>(module, "Error", PyExc_ValueError);
  add_resampling(&module);
  add_simulation(&module);
  add_fastslam(module);
  add_beacon_mcl(module);
}

}  // namespace pf_resampling
