#pragma once

#include <vector>

#include "pf_resampling_core/models/beacon_range.hpp"

namespace pf_resampling {

/// A range beside the true distance between antenna and beacon at its time.
struct RangeSample {
  int beacon = 0;         ///< id
  double distance = 0.0;  ///< m, true
  double range = 0.0;     ///< m, measured
};

struct RangeFitOptions {
  /// Residuals above this many standard deviations are outliers, > 1. Of Gaussian noise, 0.05 %
  /// are.
  double outlier_threshold = 3.5;
  /// A scale that the data determine worse than this is fixed at 1: radios are known that well
  /// without any data. > 0.
  double scale_tolerance = 0.05;
  /// A beacon with fewer ranges gets the values that all share. >= 3.
  int least_samples = 10;
};

/// range = scale * distance + bias + noise, as fitted to ranges with known distances.
struct RangeFit {
  int beacon = -1;               ///< id; -1: of all beacons together
  RangeCalibration calibration;  ///< sigma of the noise without its outliers
  double scale_error = 0.0;      ///< standard error; 0 where the scale is fixed
  double bias_error = 0.0;       ///< m, standard error
  int samples = 0;
  int outliers = 0;             ///< of the samples: not used
  double least_distance = 0.0;  ///< m, shortest of the true distances
  double greatest_distance = 0.0;
  bool scale_is_fixed = false;  ///< the distances are too alike to tell scale from bias
  bool is_shared = false;       ///< too few samples: calibration and errors are those of all
};

/// Fit over all samples, whatever their beacon. Robust: starts from the repeated median line, which
/// withstands close to half of outliers (Siegel 1982), scale of the noise by the median absolute
/// deviation, then least squares without the outliers until they no longer change; sigma corrected
/// for what the cut takes off a Gaussian. Without outliers it is ordinary least squares. No
/// randomness. Standard errors take the residuals as independent. Throws Error if there are fewer
/// than least_samples, if any is not finite or negative, and for options outside their ranges.
RangeFit fit_ranges(const std::vector<RangeSample>& samples, const RangeFitOptions& options = {});

/// First the fit of all beacons together (beacon -1), then one per beacon, by id.
std::vector<RangeFit> fit_ranges_per_beacon(const std::vector<RangeSample>& samples,
                                            const RangeFitOptions& options = {});

}  // namespace pf_resampling
