#include "pf_resampling_core/population/particle_columns.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace pf_resampling {
namespace {

/// A number per particle, and several.
struct Particles {
  Eigen::ArrayXd x;
  Eigen::ArrayXXd several;

  Eigen::Index size() const { return x.size(); }

  template <typename Self, typename Visit>
  static void for_each_column(Self& self, const Visit& visit) {
    visit("x", ColumnKind::number, self.x);
    visit("several", ColumnKind::number, self.several);
  }
};

Particles three_particles() {
  Particles particles;
  particles.x.resize(3);
  particles.x << 1.0, 2.0, 3.0;
  particles.several.resize(3, 2);
  particles.several << 10.0, 100.0, 20.0, 200.0, 30.0, 300.0;
  return particles;
}

void expect(const Particles& particles, const Eigen::ArrayXd& x) {
  ASSERT_EQ(particles.size(), x.size());
  EXPECT_TRUE((particles.x == x).all()) << particles.x.transpose();
  ASSERT_EQ(particles.several.rows(), x.size());
  ASSERT_EQ(particles.several.cols(), 2);
  EXPECT_TRUE((particles.several.col(0) == 10.0 * x).all()) << particles.several;
  EXPECT_TRUE((particles.several.col(1) == 100.0 * x).all()) << particles.several;
}

TEST(ResizeColumns, FillsNewRowsWithCopiesInTurn) {
  Particles particles = three_particles();
  resize_columns(8, &particles);
  expect(particles, (Eigen::ArrayXd(8) << 1, 2, 3, 1, 2, 3, 1, 2).finished());
  resize_columns(2, &particles);
  expect(particles, (Eigen::ArrayXd(2) << 1, 2).finished());
}

// Beacon MCL carries numbers per radio, and there may be no radio yet. What was wrong was seen by
// the sanitizer of undefined behaviour: an offset to a null pointer.
TEST(ResizeColumns, GivesRowsToAColumnWithoutNumbers) {
  Particles particles = three_particles();
  particles.several.resize(3, 0);
  resize_columns(5, &particles);
  EXPECT_EQ(particles.size(), 5);
  EXPECT_EQ(particles.several.rows(), 5);
  EXPECT_EQ(particles.several.cols(), 0);
}

TEST(SelectColumns, CopiesTheAncestors) {
  Particles particles = three_particles();
  select_columns((Eigen::ArrayXi(3) << 0, 2, 2).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(3) << 1, 3, 3).finished());
}

TEST(SelectColumns, MakesAPopulationLargerAndSmaller) {
  Particles particles = three_particles();
  select_columns((Eigen::ArrayXi(5) << 0, 1, 2, 1, 1).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(5) << 1, 2, 3, 2, 2).finished());
  select_columns((Eigen::ArrayXi(2) << 0, 2).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(2) << 1, 3).finished());
}

TEST(FaultOfColumns, NamesTheColumn) {
  Particles particles = three_particles();
  EXPECT_EQ(fault_of_columns(particles, 2), "");
  EXPECT_EQ(fault_of_columns(particles, 3), "a particle has 2 numbers several instead of 3");
  particles.x[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fault_of_columns(particles, 2), "the x of a particle is not finite");
  particles.x.resize(4);
  EXPECT_EQ(fault_of_columns(particles, 2), "the particles' columns are not equally long: several");
  particles.x.resize(0);
  EXPECT_EQ(fault_of_columns(particles, 2), "there are no particles");
}

}  // namespace
}  // namespace pf_resampling
