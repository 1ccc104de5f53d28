#pragma once

#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/strategy/strategy.hpp"

namespace py = pybind11;
using namespace pybind11::literals;

/// What the parts of the Python module share: numpy arrays go in without a copy, and what comes out
/// belongs to the caller.
namespace pf_resampling {

using OptionalArray = std::optional<Eigen::ArrayXd>;
using OptionalIds = std::optional<Eigen::ArrayXi>;
using InPlace = const MutableArray&;

/// Sets parameters by their names behind `prefix`. The values are Python's or text.
inline void set_from(const py::dict& given, const std::string& prefix,
                     const ParameterList& parameters) {
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

inline void check_sizes(const char* what, Eigen::Index expected,
                        std::initializer_list<Eigen::Index> sizes) {
  for (const Eigen::Index size : sizes) {
    if (size == expected) continue;
    throw Error(std::string(what) + " have " + std::to_string(expected) + " and " +
                std::to_string(size) + " elements; give arrays of one size");
  }
}

/// A function (weights, size, stream) -> counts as a scheme of the library's; None: none.
inline OwnScheme scheme_of(const py::object& function) {
  if (function.is_none()) return nullptr;
  return
      [function](ConstArray weights, int size, const RandomStream& stream, MutableIndices counts) {
        // A copy, since the function may keep it.
        const auto taken = function(Eigen::ArrayXd(weights), size, stream).cast<Eigen::ArrayXi>();
        check_sizes("weights and counts of the scheme", counts.size(), {taken.size()});
        counts = taken;
      };
}

inline Pose2 pose_of(const Eigen::Vector3d& pose) {
  return {pose[0], pose[1], pose[2]};
}
inline Eigen::Vector3d array_of(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

/// An array of `count` rows, each as `row` gives it.
template <int kColumns, typename Row>
auto rows_of(std::size_t count, const Row& row) {
  Eigen::Array<double, Eigen::Dynamic, kColumns, Eigen::RowMajor> rows(count, kColumns);
  for (std::size_t k = 0; k < count; ++k)
    rows.row(static_cast<Eigen::Index>(k)) = row(k).transpose();
  return rows;
}

/// A scan of a simulated drive, what was driven since the one before, and the truth.
struct SimulatedStep {
  double time = 0.0;
  OdometryIncrement odometry;
  std::vector<RangeBearingObservation> seen;
  Pose2 truth, dead_reckoning;
};

void add_resampling(py::module* module);
void add_simulation(py::module* module);
void add_filters(py::module* module);

}  // namespace pf_resampling
