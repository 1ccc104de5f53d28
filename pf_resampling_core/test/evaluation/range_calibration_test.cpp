#include "pf_resampling_core/evaluation/range_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/evaluation/stamped_path.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

constexpr double kScale = 1.07;
constexpr double kBias = -0.4;
constexpr double kSigma = 0.2;

// Distances evenly spread over [least, greatest].
std::vector<RangeSample> synthetic(int count, double least, double greatest, double sigma,
                                   std::uint32_t run = 0, int beacon = 1) {
  const RandomStream stream(11, RandomPurpose::test, run);
  std::vector<RangeSample> samples;
  for (int i = 0; i < count; ++i) {
    const double distance = least + (greatest - least) * i / (count - 1);
    const double noise = sigma * stream.normal(static_cast<std::uint64_t>(i));
    samples.push_back({beacon, distance, kScale * distance + kBias + noise});
  }
  return samples;
}

TEST(FitRanges, IsExactWithoutNoise) {
  const RangeFit fit = fit_ranges(synthetic(50, 2.0, 30.0, 0.0));
  EXPECT_NEAR(fit.calibration.scale, kScale, 1e-12);
  EXPECT_NEAR(fit.calibration.bias, kBias, 1e-11);
  EXPECT_NEAR(fit.calibration.sigma, 0.0, 1e-11);
  EXPECT_EQ(fit.outliers, 0);
  EXPECT_EQ(fit.samples, 50);
  EXPECT_DOUBLE_EQ(fit.least_distance, 2.0);
  EXPECT_DOUBLE_EQ(fit.greatest_distance, 30.0);
}

TEST(FitRanges, StandardErrorsAreTheClosedForm) {
  const int n = 400;
  const std::vector<RangeSample> samples = synthetic(n, 0.0, 20.0, kSigma);
  const RangeFit fit = fit_ranges(samples);
  // Evenly spread distances: spread = n (n + 1) / (12 (n - 1)) * length^2.
  const double spread = n * (n + 1.0) / (12.0 * (n - 1.0)) * 400.0;
  EXPECT_NEAR(fit.scale_error, fit.calibration.sigma / std::sqrt(spread), 1e-4 * fit.scale_error);
  EXPECT_NEAR(fit.bias_error, fit.calibration.sigma * std::sqrt(1.0 / n + 100.0 / spread),
              1e-4 * fit.bias_error);
}

TEST(FitRanges, ErrorsOfManyFitsAreAsStated) {
  const int runs = 200;
  double scale_square = 0.0, bias_square = 0.0, sigma_sum = 0.0;
  for (std::uint32_t run = 0; run < runs; ++run) {
    const RangeFit fit = fit_ranges(synthetic(300, 1.0, 25.0, kSigma, run));
    const double scale = (fit.calibration.scale - kScale) / fit.scale_error;
    const double bias = (fit.calibration.bias - kBias) / fit.bias_error;
    scale_square += scale * scale / runs;
    bias_square += bias * bias / runs;
    sigma_sum += fit.calibration.sigma / runs;
  }
  // Means of 200 squared standard normals: chi-square / 200, standard deviation 0.1; [0.55, 1.6]
  // leaves out less than 1e-6 (chi-square with 200 dof below 110 or above 320). Sigma of one fit is
  // known to sigma / sqrt(600), the mean of 200 to 0.3 %.
  EXPECT_GT(scale_square, 0.55);
  EXPECT_LT(scale_square, 1.6);
  EXPECT_GT(bias_square, 0.55);
  EXPECT_LT(bias_square, 1.6);
  EXPECT_NEAR(sigma_sum, kSigma, 5.0 * 0.003 * kSigma);
}

TEST(FitRanges, WithstandsAThirdOfOneSidedOutliers) {
  std::vector<RangeSample> samples = synthetic(900, 1.0, 25.0, kSigma);
  const RandomStream stream(12, RandomPurpose::test, 0);
  int outliers = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // Reflections: always too long, and worse the further away.
    if (stream.uniform(2 * i) > 1.0 / 3.0) continue;
    samples[i].range += 2.0 + (3.0 + 0.5 * samples[i].distance) * stream.uniform(2 * i + 1);
    ++outliers;
  }
  const RangeFit fit = fit_ranges(samples);
  // All of them are 10 standard deviations off or more. 600 good ranges: standard errors of about
  // 0.0012 and 0.017; five and a half of them, 4e-8. Good ones beyond 3.5 sigma: 0.3 expected, more
  // than 6 in 1e-7 of the cases.
  EXPECT_NEAR(fit.calibration.scale, kScale, 5.5 * 0.0012);
  EXPECT_NEAR(fit.calibration.bias, kBias, 5.5 * 0.017);
  EXPECT_NEAR(fit.calibration.sigma, kSigma, 5.5 * kSigma / std::sqrt(1200.0));
  EXPECT_GE(fit.outliers, outliers);
  EXPECT_LE(fit.outliers, outliers + 6);
}

TEST(FitRanges, FixesTheScaleWhereDistancesAreAlike) {
  const std::vector<RangeSample> samples = synthetic(100, 10.0, 10.5, kSigma);
  const RangeFit fit = fit_ranges(samples);
  EXPECT_TRUE(fit.scale_is_fixed);
  EXPECT_DOUBLE_EQ(fit.calibration.scale, 1.0);
  EXPECT_DOUBLE_EQ(fit.scale_error, 0.0);
  // The bias then takes all: 0.07 * 10.25 - 0.4 = 0.3175; standard error 0.02.
  EXPECT_NEAR(fit.calibration.bias, 0.3175, 5.0 * 0.02);
  EXPECT_NEAR(fit.bias_error, fit.calibration.sigma / 10.0, 1e-12);
  EXPECT_FALSE(fit_ranges(synthetic(100, 1.0, 10.0, kSigma)).scale_is_fixed);
  // A robot that stood still, with a noiseless radio.
  EXPECT_TRUE(fit_ranges(synthetic(100, 10.0, 10.0, 0.0)).scale_is_fixed);
}

TEST(FitRanges, RefusesWhatItCannotFit) {
  EXPECT_THROW(fit_ranges({}), Error);
  EXPECT_THROW(fit_ranges(synthetic(9, 1.0, 10.0, kSigma)), Error);
  std::vector<RangeSample> samples = synthetic(20, 1.0, 10.0, kSigma);
  samples[3].range = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fit_ranges(samples), Error);
  RangeFitOptions options;
  options.least_samples = 2;
  EXPECT_THROW(fit_ranges(synthetic(20, 1.0, 10.0, kSigma), options), Error);
  options = {};
  options.outlier_threshold = 1.0;
  EXPECT_THROW(fit_ranges(synthetic(20, 1.0, 10.0, kSigma), options), Error);
  options = {};
  options.scale_tolerance = 0.0;
  EXPECT_EQ(refusal([&] { fit_ranges(synthetic(20, 1.0, 10.0, kSigma), options); }),
            "scale_tolerance is 0.000000: it has to be > 0");
}

TEST(FitRangesPerBeacon, SeparatesBeaconsAndLendsTheSharedFitToRareOnes) {
  std::vector<RangeSample> samples = synthetic(200, 1.0, 20.0, 0.0, 0, 7);
  for (RangeSample sample : synthetic(200, 1.0, 20.0, 0.0, 1, 3)) {
    sample.range += 0.02;
    samples.push_back(sample);
  }
  samples.push_back({5, 4.0, 4.0});
  const std::vector<RangeFit> fits = fit_ranges_per_beacon(samples);
  ASSERT_EQ(fits.size(), 4u);
  EXPECT_EQ(fits[0].beacon, -1);
  EXPECT_EQ(fits[0].samples, 401);
  EXPECT_NEAR(fits[0].calibration.bias, kBias + 0.01, 1e-3);
  EXPECT_EQ(fits[1].beacon, 3);
  EXPECT_NEAR(fits[1].calibration.bias, kBias + 0.02, 1e-9);
  EXPECT_EQ(fits[2].beacon, 5);
  EXPECT_TRUE(fits[2].is_shared);
  EXPECT_EQ(fits[2].samples, 1);
  EXPECT_DOUBLE_EQ(fits[2].calibration.bias, fits[0].calibration.bias);
  EXPECT_EQ(fits[3].beacon, 7);
  EXPECT_NEAR(fits[3].calibration.bias, kBias, 1e-9);
}

// Rows of numbers of a data set's file; empty if there is none.
std::vector<std::vector<double>> read_csv(const std::string& name) {
  std::ifstream file(std::string(PF_RESAMPLING_DATASETS) + "/plaza2/" + name);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

TEST(FitRangesPerBeacon, AgreesWithNumpyOnPlaza2) {
  std::map<double, std::vector<double>> beacons;
  for (const auto& row : read_csv("plaza2_beacons.csv")) beacons[row[0]] = row;
  std::vector<TruePose> truth;
  for (const auto& row : read_csv("plaza2_gt.csv"))
    truth.push_back({row[0], row[1], row[2], row[3]});
  if (truth.empty() || beacons.empty()) {
    GTEST_SKIP() << "data set plaza2 is not in " << PF_RESAMPLING_DATASETS;
  }
  std::vector<RangeSample> samples;
  for (const auto& row : read_csv("plaza2_range.csv")) {
    const auto pose = interpolate(truth, row[0], 1.0);
    const std::vector<double>& beacon = beacons.at(row[1]);
    ASSERT_TRUE(pose);
    samples.push_back(
        {static_cast<int>(row[1]), std::hypot(pose->x - beacon[1], pose->y - beacon[2]), row[2]});
  }
  const std::vector<RangeFit> fits = fit_ranges_per_beacon(samples);
  ASSERT_EQ(fits.size(), 5u);
  // numpy.linalg.lstsq on the same files, with numpy.interp; its residuals have no outlier.
  EXPECT_EQ(fits[0].samples, 1816);
  EXPECT_EQ(fits[0].outliers, 0);
  EXPECT_NEAR(fits[0].calibration.scale, 1.0696057, 1e-6);
  EXPECT_NEAR(fits[0].calibration.bias, 0.00682773, 1e-5);
  EXPECT_NEAR(fits[0].calibration.sigma, 0.56123074, 1e-5);
  EXPECT_NEAR(fits[0].scale_error, 0.00062781, 1e-6);
  EXPECT_NEAR(fits[0].bias_error, 0.02950644, 1e-5);
  // Beacon 5, likewise.
  EXPECT_EQ(fits[3].beacon, 5);
  EXPECT_EQ(fits[3].samples, 488);
  EXPECT_NEAR(fits[3].calibration.scale, 1.06931892, 1e-6);
  EXPECT_NEAR(fits[3].calibration.bias, 0.03798762, 1e-5);
  EXPECT_NEAR(fits[3].calibration.sigma, 0.5673841, 1e-5);
}

}  // namespace
}  // namespace pf_resampling
