#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace pf_resampling {

/// A radio beacon at a place that somebody measured.
struct Beacon {
  int id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map frame
  bool is_planar = false;  ///< whether its height is unknown and taken as the antenna's
  double sigma = 0.0;  ///< m, standard deviation of its place, along each axis; 0: as with a tape
};

/// A measured distance between the robot's antenna and a beacon.
struct RangeObservation {
  int beacon = 0;         ///< id
  double range = 0.0;     ///< m, as the radio gives it (scale and bias not taken out)
  double variance = 0.0;  ///< m^2; 0 means the model's own
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();  ///< m, where the antenna sits on the robot
  bool antenna_is_stated = false;  ///< whether somebody said so, be it at the robot's origin
};

/// Systematic errors of a radio: range = scale * distance + bias + noise.
struct RangeCalibration {
  double scale = 1.0;
  double bias = 0.0;   ///< m
  double sigma = 0.0;  ///< m, standard deviation of the noise; 0 means the model's own
};

/// By id; under -1, of all others. Later ones win.
using RangeCalibrations = std::vector<std::pair<int, RangeCalibration>>;
inline constexpr int kAllRadios = -1;
inline RangeCalibration calibration_of(int id, const RangeCalibrations& given) {
  RangeCalibration calibration;
  for (const int wanted : {kAllRadios, id}) {
    for (const auto& [of, known] : given) {
      if (of == wanted) calibration = known;
    }
  }
  return calibration;
}

}  // namespace pf_resampling
