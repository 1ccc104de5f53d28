// Both filters, with their memories.
#include <cmath>
#include <limits>

#include "pf_resampling_core/filters/beacon_mcl/beacon_mcl.hpp"
#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/presets.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "python/bindings.hpp"

namespace pf_resampling {
namespace {

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
  if (!scheme.is_none()) options.strategy.resampling.own_scheme = scheme_of(scheme);
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

void add_filters(py::module* module) {
  add_fastslam(*module);
  add_beacon_mcl(*module);
}

}  // namespace pf_resampling
