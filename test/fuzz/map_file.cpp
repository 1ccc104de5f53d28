// Map files: what is read can be written, read again and used.
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {
namespace {

void use(const SavedMap& map, bool frozen) {
  FastSlamOptions options;
  options.particles = 20;
  options.map.frozen = frozen;
  options.association.method = map.association;
  FastSlam filter(options, 1);
  try {
    filter.load(map);
  } catch (const Error&) {
    return;
  }
  OdometryIncrement odometry;
  odometry.mean = {0.1, 0.0, 0.01};
  odometry.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  odometry.duration = 0.1;
  RangeBearingObservation seen;
  const bool has_id = map.association == DataAssociation::known && !map.landmarks.empty() &&
                      map.landmarks.front().estimate.id < 1000000;
  seen.id = has_id ? static_cast<int>(map.landmarks.front().estimate.id) : 0;
  seen.range = 2.0;
  for (int i = 0; i < 3; ++i) {
    try {
      filter.update(odometry, {seen});
    } catch (const Error&) {
    }
  }
  const PoseEstimate belief = filter.estimate();
  require(std::isfinite(belief.mean.x + belief.mean.y + belief.mean.heading) &&
              belief.covariance.allFinite(),
          "a map that was taken makes a belief that is not finite");
  require(std::abs(filter.particles().weight.sum() - 1.0) < 1e-6, "weights do not sum to one");
  for (const LandmarkEstimate& landmark : filter.map()) {
    require(landmark.mean.allFinite() && landmark.covariance.allFinite(),
            "a map that was taken makes a landmark that is not finite");
  }
}

void read_and_use(const std::string& text) {
  SavedMap map;
  try {
    map = read_map_file(file_of(text));
  } catch (const Error& error) {
    require_one_line(error);
    return;
  }
  const std::string copy = new_file("copy");
  write_map_file(copy, map);
  const SavedMap again = read_map_file(copy);
  require(again.landmarks.size() == map.landmarks.size() &&
              again.particles.size() == map.particles.size(),
          "a map that was read and written is another");
  use(map, false);
  use(map, true);
}

}  // namespace

void map_file(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  read_and_use(text);
  try {
    write_map_file(new_file("surveyed"), read_landmark_list(file_of(text), "map"));
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace pf_resampling::fuzz
