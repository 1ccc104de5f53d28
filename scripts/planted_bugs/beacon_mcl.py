"""Localization by ranges."""

RANGES = ("kernels_test", "learning_test")
MCL = ("beacon_mcl_test",)
RENEWAL = ("renewal_test",)

BUGS = [
    # Its kernels.
    ("beacon_mcl: the antenna's height is left out", "beacon_mcl/kernels.cpp",
     "const double dz = range.beacon[2] - range.antenna[2];",
     "const double dz = 0.0 * (range.beacon[2] - range.antenna[2]);", RANGES),
    ("beacon_mcl: the drawn turn does not teach the yaw-rate bias", "beacon_mcl/kernels.cpp",
     "yaw_rate_bias[i] -= gain * (turn + m.sensitivity[2] * yaw_rate_bias[i]);",
     "yaw_rate_bias[i] -= 0.0 * gain * turn;", RANGES),
    ("beacon_mcl: outliers teach the calibration as much as the others", "beacon_mcl/kernels.cpp",
     "const double gain = taken_in * difference;", "const double gain = inverse * difference;", RANGES),
    # Its population.
    ("compensation: the calibration of the ranges is not blended", "renewal.cpp",
     "blend_means(pairs, p.scale);", "", RENEWAL),
    ("compensation: covariances are matched to means that are blended already", "renewal.cpp",
     "blend_covariances(pairs, treatment, p.yaw_rate_bias, p.yaw_rate_bias, p.yaw_rate_bias_variance);"
     "blend_means(pairs, p.yaw_rate_bias);",
     "blend_means(pairs, p.yaw_rate_bias);"
     "blend_covariances(pairs, treatment, p.yaw_rate_bias, p.yaw_rate_bias, p.yaw_rate_bias_variance);",
     RENEWAL),
    ("tempering: the beacon filter does not", "beacon_mcl/kernels.cpp",
     "log_weight[i] += tempering * log_vector(likelihood[i]);", "log_weight[i] += log_vector(likelihood[i]);", MCL),
    ("schedule: beacon_mcl renews by the sample size of the entropy", "renewal.cpp",
     "status_.effective_sample_size, options_.particles, recovery_is_due(),",
     "status_.entropy_sample_size, options_.particles, recovery_is_due(),", RENEWAL),
]
