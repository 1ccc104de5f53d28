#include "pf_resampling_core/population/vector_math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "pf_resampling_core/population/random_stream.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Uniform in [low, high].
std::vector<double> arguments(double low, double high, std::int64_t count) {
  std::vector<double> values(static_cast<std::size_t>(count));
  RandomStream(8, RandomPurpose::test, 0).fill_uniform(0, count, values.data());
  for (double& value : values) value = low + value * (high - low);
  return values;
}

// Against long double, whose own error is a thousand times below.
TEST(ExpVector, IsWithinTheErrorItStates) {
  double worst = 0.0;
  for (const auto& [low, high] :
       std::vector<std::pair<double, double>>{{-708.0, 708.0}, {-40.0, 0.0}, {-1.0, 1.0}}) {
    for (const double x : arguments(low, high, 300000)) {
      const long double exact = std::exp(static_cast<long double>(x));
      worst = std::max(worst, static_cast<double>(std::abs(exp_vector(x) - exact) / exact));
    }
  }
  EXPECT_LT(worst, 5e-16);
  RecordProperty("worst", std::to_string(worst * 1e16) + "e-16");
}

TEST(ExpVector, HandlesTheEnds) {
  EXPECT_EQ(exp_vector(0.0), 1.0);
  EXPECT_EQ(exp_vector(-0.0), 1.0);
  EXPECT_EQ(exp_vector(-kInfinity), 0.0);
  EXPECT_EQ(exp_vector(-709.0), 0.0);
  EXPECT_EQ(exp_vector(-1e300), 0.0);
  EXPECT_EQ(exp_vector(kInfinity), kInfinity);
  EXPECT_EQ(exp_vector(1e300), kInfinity);
  EXPECT_TRUE(std::isfinite(exp_vector(708.0)));
  EXPECT_TRUE(std::isnan(exp_vector(std::numeric_limits<double>::quiet_NaN())));
}

TEST(LogVector, IsWithinTheErrorItStates) {
  double worst = 0.0;
  const auto check = [&](double x) {
    const long double exact = std::log(static_cast<long double>(x));
    if (exact == 0.0L) {
      EXPECT_EQ(log_vector(x), 0.0);
    } else {
      worst = std::max(worst, static_cast<double>(std::abs((log_vector(x) - exact) / exact)));
    }
  };
  for (const double x : arguments(0.0, 1.0, 300000)) check(x);
  for (const double x : arguments(0.9, 1.1, 300000)) check(x);
  for (const double x : arguments(-700.0, 700.0, 300000)) check(std::exp(x));
  // Next to one, where the logarithm is small; the seams of the range reduction; the ends.
  for (int i = 1; i < 60; ++i) {
    check(1.0 + std::ldexp(1.0, -i));
    check(1.0 - std::ldexp(1.0, -i));
  }
  for (const double x : {std::sqrt(0.5), std::sqrt(2.0), 0.70703125, 1.4140625, 0x1p-1022,
                         std::numeric_limits<double>::max(), 1.0 - 0x1p-53, 0x1p-53}) {
    check(x);
    check(std::nextafter(x, 0.5));
  }
  EXPECT_LT(worst, 1e-15);
  RecordProperty("worst", std::to_string(worst * 1e16) + "e-16");
}

TEST(LogAnyVector, GoesDownToTheSmallestNumbers) {
  for (const double x : {5e-324, 1e-320, 1e-310, 0x1p-1022, 1e-300, 0.3, 1.0, 2.0, 1e300}) {
    const double exact = static_cast<double>(std::log(static_cast<long double>(x)));
    EXPECT_NEAR(log_any_vector(x), exact, 1e-15 * std::abs(exact)) << x;
  }
  EXPECT_EQ(log_any_vector(0.0), -kInfinity);
}

TEST(SincosVector, IsWithinTheErrorItStates) {
  double worst = 0.0;
  for (const double limit : {1.0, 4.0, 7.0, 100.0, 1e5}) {
    for (const double x : arguments(-limit, limit, 200000)) {
      double sine;
      double cosine;
      sincos_vector(x, &sine, &cosine);
      const long double argument = x;
      worst = std::max(worst, static_cast<double>(std::abs(sine - std::sin(argument))));
      worst = std::max(worst, static_cast<double>(std::abs(cosine - std::cos(argument))));
    }
  }
  EXPECT_LT(worst, 3e-16);
  RecordProperty("worst", std::to_string(worst * 1e16) + "e-16");
}

TEST(SincosVector, IsExactWhereItMatters) {
  double sine;
  double cosine;
  sincos_vector(0.0, &sine, &cosine);
  EXPECT_EQ(sine, 0.0);
  EXPECT_EQ(cosine, 1.0);
}

TEST(WrapAngleVector, BringsAnglesToTheirPlace) {
  const long double pi = std::acos(-1.0L);
  for (const double limit : {4.0, 100.0, 1e6, 1e9}) {
    for (const double x : arguments(-limit, limit, 100000)) {
      const double wrapped = wrap_angle_vector(x);
      ASSERT_LE(std::abs(wrapped), 3.1415926535897936);
      // The same angle: the difference is a whole number of turns, to the rounding of x itself.
      const long double turns = (x - static_cast<long double>(wrapped)) / (2.0L * pi);
      ASSERT_NEAR(static_cast<double>(turns - std::round(turns)), 0.0, 1e-16 * (1.0 + std::abs(x)));
    }
  }
  EXPECT_EQ(wrap_angle_vector(0.5), 0.5);
  EXPECT_EQ(wrap_angle_vector(-3.0), -3.0);
}

TEST(OpenUnitInterval, IsOpen) {
  EXPECT_EQ(open_unit_interval(0), 0x1p-53);
  EXPECT_EQ(open_unit_interval(~std::uint64_t{0}), 1.0 - 0x1p-53);
}

}  // namespace
}  // namespace pf_resampling
