#include "pf_resampling_core/filters/fastslam/memory/sensor_view.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// A camera that sees 6 m far and 0.6 rad to both sides, landmarks anywhere in view; one reading in
// `wild_every` is from nowhere.
SensorView view_after(int sightings, int wild_every) {
  SensorView view;
  const RandomStream draws(1, RandomPurpose::test, 0);
  for (int k = 0; k < sightings; ++k) {
    const std::uint64_t first = 2 * static_cast<std::uint64_t>(k);
    if (wild_every > 0 && k % wild_every == wild_every - 1) {
      view.add(60.0, 3.0);
    } else {
      view.add(6.0 * std::sqrt(draws.uniform(first)), 1.2 * draws.uniform(first + 1) - 0.6);
    }
  }
  return view;
}

TEST(SensorView, ReachesAsFarAndWideAsTheSensorSees) {
  for (const int wild_every : {0, 300}) {
    const SensorView view = view_after(2000, wild_every);
    EXPECT_NEAR(view.range, 6.0, 0.6) << wild_every;
    EXPECT_NEAR(view.bearing, 0.6, 0.1) << wild_every;
  }
}

TEST(SensorView, CoversWhatIsWellWithin) {
  const SensorView view = {6.0, 0.6};
  EXPECT_TRUE(view.covers({5.0, 0.0}));
  EXPECT_FALSE(view.covers({5.9, 0.0}));
  EXPECT_TRUE(view.covers({5.0 * std::cos(0.5), -5.0 * std::sin(0.5)}));
  EXPECT_FALSE(view.covers({5.0 * std::cos(0.59), -5.0 * std::sin(0.59)}));
  EXPECT_FALSE(view.covers({-1.0, 0.0}));
  EXPECT_FALSE(view.covers({0.0, 0.0}));  // where the sensor is
}

}  // namespace
}  // namespace pf_resampling
