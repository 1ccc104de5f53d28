#include "beacon_mcl_node/beacon_file.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "pf_resampling_core/range_memory/radio_remark.hpp"

namespace pf_resampling {
namespace {

std::string number(double value, int decimals) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.*f", decimals, value);
  return text;
}

std::string line_of(const Beacon& beacon) {
  const Eigen::Vector3d& place = beacon.position;
  std::string line = "  - {id: " + std::to_string(beacon.id) + ", x: " + number(place.x(), 3) +
                     ", y: " + number(place.y(), 3);
  if (!beacon.is_planar) line += ", z: " + number(place.z(), 3);
  if (beacon.sigma > 0.0) line += ", sigma: " + number(beacon.sigma, 3);
  return line + "}\n";
}

}  // namespace

std::string beacon_file(const std::string& source, const RangeMemory& memory) {
  std::string beacons = std::string("# ") + kBeaconFile.format + ", from " + source +
                        ". Places and standard deviations in m.\nbeacons:\n";
  std::string calibration =
      "# range = scale * distance + bias + noise of standard deviation sigma (m).\ncalibration:\n";
  const std::vector<Beacon> found = memory.found();
  for (const RadioKnowledge& radio : memory.radios()) {
    const auto place = std::find_if(found.begin(), found.end(),
                                    [&](const Beacon& beacon) { return beacon.id == radio.id; });
    beacons += place != found.end() ? line_of(*place) : "  # " + place_in_words(radio) + "\n";
    if (radio.ranges == 0) continue;
    calibration += "  - {beacon: " + std::to_string(radio.id) +
                   ", scale: " + number(radio.calibration.scale, 6) +
                   ", bias: " + number(radio.calibration.bias, 5) +
                   ", sigma: " + number(radio.calibration.sigma, 5) + "}\n";
  }
  return beacons + calibration;
}

}  // namespace pf_resampling
