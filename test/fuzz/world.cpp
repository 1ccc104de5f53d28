// World files: refused in one line, or driven through.
#include "pf_resampling_core/simulation/world.hpp"

#include "pf_resampling_core/error.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/fuzz/saved_text.hpp"
#include "tools/worlds/recording_to_bag.hpp"
#include "tools/worlds/simulated_recording.hpp"
#include "tools/worlds/world_file.hpp"

namespace pf_resampling::fuzz {
namespace {

// What is allowed may take minutes; what is found is found in seconds of driving.
bool is_short(const World& world) {
  const double longest = 20.0;
  return world.duration > 0.0 && world.duration <= longest && world.drive.control_period >= 0.02 &&
         world.ranges.rate <= 50.0 && world.landmarks.size() + world.beacons.size() < 100 &&
         (world.landmark_sensor.period <= 0.0 || world.landmark_sensor.period >= 0.02);
}

}  // namespace

void world(const std::uint8_t* bytes, std::size_t size) {
  try {
    const World read = parse_world(text_of(bytes, size), "input");
    check_world(read);
    if (!is_short(read)) return;
    write_recording(simulated_recording(read, 1), new_file("drive.bag"));
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace pf_resampling::fuzz
