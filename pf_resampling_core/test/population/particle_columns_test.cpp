#include "pf_resampling_core/population/particle_columns.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

struct Columns {
  Eigen::ArrayXd x;
  Eigen::ArrayXd tenfold;

  Eigen::Index size() const { return x.size(); }

  template <typename Self, typename Visit>
  static void for_each_column(Self& self, const Visit& visit) {
    visit("x", self.x);
    visit("tenfold", self.tenfold);
  }
};

Columns three_particles() {
  Columns particles;
  particles.x.resize(3);
  particles.x << 1.0, 2.0, 3.0;
  particles.tenfold = 10.0 * particles.x;
  return particles;
}

void expect(const Columns& particles, const Eigen::ArrayXd& x) {
  ASSERT_EQ(particles.size(), x.size());
  EXPECT_TRUE((particles.x == x).all()) << particles.x.transpose();
  ASSERT_EQ(particles.tenfold.size(), x.size());
  EXPECT_TRUE((particles.tenfold == 10.0 * x).all()) << particles.tenfold.transpose();
}

TEST(ResizeColumns, FillsNewRowsWithCopiesInTurn) {
  Columns particles = three_particles();
  resize_columns(8, &particles);
  expect(particles, (Eigen::ArrayXd(8) << 1, 2, 3, 1, 2, 3, 1, 2).finished());
  resize_columns(2, &particles);
  expect(particles, (Eigen::ArrayXd(2) << 1, 2).finished());
}

TEST(SelectColumns, CopiesTheAncestors) {
  Columns particles = three_particles();
  select_columns((Eigen::ArrayXi(3) << 0, 2, 2).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(3) << 1, 3, 3).finished());
}

TEST(SelectColumns, MakesAPopulationLargerAndSmaller) {
  Columns particles = three_particles();
  select_columns((Eigen::ArrayXi(5) << 0, 1, 2, 1, 1).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(5) << 1, 2, 3, 2, 2).finished());
  select_columns((Eigen::ArrayXi(2) << 0, 2).finished(), &particles);
  expect(particles, (Eigen::ArrayXd(2) << 1, 3).finished());
}

}  // namespace
}  // namespace pf_resampling
