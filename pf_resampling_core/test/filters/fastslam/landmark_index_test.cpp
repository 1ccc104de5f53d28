#include "pf_resampling_core/filters/fastslam/memory/landmark_index.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

// Against looking at every landmark: for radii of less than a cell, of many cells, and of so many
// that going through the cells would never end.
TEST(LandmarkIndex, FindsWhatLookingAtAllFinds) {
  const RandomStream stream(1, RandomPurpose::test, 0);
  LandmarkIndex index;
  std::vector<Eigen::Vector2d> places;
  const auto draw = [&](std::uint64_t k) {
    return Eigen::Vector2d(100.0 * stream.uniform(2 * k) - 50.0,
                           100.0 * stream.uniform(2 * k + 1) - 50.0);
  };
  for (std::uint64_t k = 0; k < 300; ++k) {
    places.push_back(draw(k));
    index.place(static_cast<int>(k), places.back());
  }
  for (std::uint64_t k = 0; k < 300; k += 3) {  // some move, some go
    places[k] = draw(1000 + k);
    index.place(static_cast<int>(k), places[k]);
  }
  for (int k = 0; k < 300; k += 7) index.remove(k);
  for (const double radius : {0.5, 3.0, 20.0, 60.0, 200.0, 1e5, 1e12}) {
    for (std::uint64_t k = 0; k < 20; ++k) {
      const Eigen::Vector2d from = draw(2000 + k);
      std::vector<int> expected, found = {-1};
      for (int row = 0; row < 300; ++row) {
        if (row % 7 != 0 && (places[static_cast<std::size_t>(row)] - from).norm() <= radius) {
          expected.push_back(row);
        }
      }
      index.near(from, radius, &found);
      ASSERT_EQ(found.front(), -1);  // appended
      found.erase(found.begin());
      EXPECT_EQ(found, expected) << "radius " << radius;
    }
  }
}

// Beyond what integers can count cells of: a filter that was told nonsense goes there.
TEST(LandmarkIndex, FindsWhatIsBeyondAllCells) {
  for (const double far : {1e10, 1e18, 3.7e19, 2.3e78, 1e300}) {
    for (const double sign : {-1.0, 1.0}) {
      SCOPED_TRACE(sign * far);
      LandmarkIndex index;
      const Eigen::Vector2d place(sign * far, -sign * far);
      index.place(0, {1.0, 2.0});
      index.place(1, place);
      index.place(2, {sign * far, sign * far});
      std::vector<int> found;
      index.near(place, 5.0, &found);
      EXPECT_EQ(found, std::vector<int>{1});
      found.clear();
      index.near({0.0, 0.0}, 5.0, &found);
      EXPECT_EQ(found, std::vector<int>{0});
      index.place(1, {0.0, 0.0});
      index.remove(2);
      found.clear();
      index.near({0.0, 0.0}, 10.0 * far, &found);
      EXPECT_EQ(found, (std::vector<int>{0, 1}));
      found.clear();
      index.near(place, 5.0, &found);
      EXPECT_TRUE(found.empty());
    }
  }
}

}  // namespace
}  // namespace pf_resampling
