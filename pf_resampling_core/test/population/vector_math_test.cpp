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

TEST(ExpLikelihoodVector, IsWithinTheErrorItStates) {
  double worst = 0.0;
  for (const double low : {-700.0, -40.0, -1.0}) {
    for (const double x : arguments(low, 0.0, 300000)) {
      const double exact = std::exp(x);
      worst = std::max(worst, std::abs(exp_likelihood_vector(x) - exact) / exact);
    }
  }
  EXPECT_LT(worst, 2e-10);
  for (const double x : {-701.0, -1e300, -kInfinity}) {
    EXPECT_EQ(exp_likelihood_vector(x), 0.0);
  }
}

TEST(InverseSqrtVector, IsWithinTheErrorItStates) {
  double worst = 0.0;
  for (const double exponent : arguments(-1021.0, 1023.0, 300000)) {
    const double x = std::exp2(exponent);
    worst = std::max(worst, std::abs(inverse_sqrt_vector(x) * std::sqrt(x) - 1.0));
  }
  EXPECT_LT(worst, 3e-12);
  EXPECT_TRUE(std::isfinite(inverse_sqrt_vector(0.0)));
}

// The ends of the uniform and of the angle, the edges of the quadrants, and what is in between.
TEST(SingleNormalPairVector, IsBoxMullerWithinTheErrorItStates) {
  double worst = 0.0;
  const auto look = [&worst](std::uint64_t bits) {
    const double uniform = (static_cast<double>(bits >> 33) + 0.5) * 0x1p-31;
    const double radius = std::sqrt(-2.0 * std::log(uniform));
    const double angle = 2.0 * M_PI * 0x1p-32 * static_cast<double>(bits & 0xffffffffu);
    float first, second;
    single_normal_pair_vector(bits, &first, &second);
    worst = std::max(worst, std::abs(double{first} - radius * std::cos(angle)));
    worst = std::max(worst, std::abs(double{second} - radius * std::sin(angle)));
  };
  for (const std::uint64_t uniform : {0x0u, 0x1u, 0x2u, 0x5a82799au, 0x80000000u, 0xb504f333u}) {
    for (const std::uint64_t angle :
         {0x0u, 0x1u, 0x1fffffffu, 0x20000000u, 0x60000000u, 0x80000000u, 0xa0000000u, 0xdfffffffu,
          0xe0000000u, 0xffffffffu}) {
      look((uniform << 32) | angle);
    }
  }
  for (const double u : arguments(0.0, 0.999, 300000)) {
    const std::uint64_t bits = to_bits(1.0 + u);
    look(((bits << 12) & 0xffffffff00000000u) | ((bits * 0x9e3779b97f4a7c15u) >> 32));
  }
  EXPECT_LT(worst, 2e-6);
  RecordProperty("worst", std::to_string(worst));
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
