"""Weights, ancestors and means of a population."""

WEIGHTS = ("weights_test",)
ANCESTRY = ("ancestry_test", "resampling_test")

BUGS = [
    # Weights.
    ("weights: the effective sample size without the square of the sum", "weights.cpp",
     "const double effective = sum * sum / sum_of_lanes(sums.squares);",
     "const double effective = sum / sum_of_lanes(sums.squares);", WEIGHTS),
    ("weights: not shifted by the largest, so that small ones underflow", "weights.cpp",
     "const double value = log_weights[i] - shift;", "const double value = log_weights[i] - 0.0 * shift;", WEIGHTS),
    ("weights: the last, fewer than eight, are left out", "weights.cpp",
     "if (whole < count) {", "if (whole > count) {", WEIGHTS),
    ("weights: the entropy of weights that are not normalized", "weights.cpp",
     "const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs) / sum;",
     "const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs);", WEIGHTS),
    ("tempering: all that the observations say is taken up", "weights.cpp",
     "before + share * (log_weights - before)", "before + (log_weights - before)", WEIGHTS),
    ("tempering: the likelihood that is stated is that of the share", "weights.cpp",
     "return all - log_of_sum(log_weights);", "return 0.0;", WEIGHTS),
    # Who comes from whom.
    ("survivors do not keep their own slots", "ancestry.cpp",
     "for (int i = 0; i < pairs; ++i) out[free_slots.items[i]] = copies.items[i];",
     "for (int i = 0; i < pairs; ++i) out[free_slots.items[i]] = copies.items[pairs - 1 - i];", ANCESTRY),
    # Means.
    ("pose statistics: the mean heading of numbers, not of directions", "pose_statistics.cpp",
     "std::atan2(first[4], first[3])};", "first[4]};", ("pose_statistics_test",)),
]
