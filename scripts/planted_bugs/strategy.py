"""When a population is renewed, and how, but for the schemes."""

COMPENSATION = ("compensation_test",)
EXCITATION = ("excitation_test",)
STRATEGY = ("strategy_test",)

BUGS = [
    # When.
    ("strategy: due when the effective sample size is high", "strategy.cpp",
     "effective_sample_size < options_.threshold * size;", "effective_sample_size > options_.threshold * size;", STRATEGY),
    ("strategy: every n-th observation, one too late", "strategy.cpp",
     "return observations_since_renewal_ >= options_.every_n;",
     "return observations_since_renewal_ > options_.every_n;", STRATEGY),
    ("strategy: a scheme that keeps the size is asked for another one", "strategy.cpp",
     "resizes && keeps_size(options_.resampling) ? resizer_ : resampler_;",
     "resizes && !keeps_size(options_.resampling) ? resizer_ : resampler_;", STRATEGY),
    # Compensation.
    ("compensation: the weak one keeps the strong one's share", "compensation.cpp",
     "weak + strong > 0.0 ? weak / (weak + strong) : 0.5",
     "weak + strong > 0.0 ? strong / (weak + strong) : 0.5", COMPENSATION),
    ("compensation: headings are blended as numbers, not on the circle", "compensation.cpp",
     "low = wrap_angle(pair.total * (low + towards * wrap_angle(heading[pair.high] - low)));",
     "low = wrap_angle(pair.total * (low + towards * (heading[pair.high] - low)));", COMPENSATION),
    ("compensation: the worst is paired with the middle, not with the best", "compensation.cpp",
     "ranks[i] = slots.size() - 1 - i;", "ranks[i] = weak + i;", COMPENSATION),
    ("compensation: the wheel is spun over the weak ones too", "compensation.cpp",
     "wheel[i] = sum += weights[slots[weak + i]];", "wheel[i] = sum += weights[slots[i]];", COMPENSATION),
    ("compensation: a weak particle may stand in two pairs", "compensation.cpp",
     "role_of_low != 0 ||", "role_of_low > 2 ||", COMPENSATION),
    ("compensation: a strong one with several weak ones counts itself once per pair", "compensation.cpp",
     "members[pair.high] += 1.0;", "members[pair.high] = 2.0;", COMPENSATION),
    ("compensation: literal pairs are divided by the sum of their weights", "compensation.cpp",
     "return {low, high, weak / sum, (weak + strong) / sum};",
     "return {low, high, weak / (weak + strong), 1.0};", COMPENSATION),
    ("compensation: a ratio of zero blends a pair", "compensation.cpp",
     "options.ratio > 0.0 ? 1 : 0", "1", COMPENSATION),
    # Excitation.
    ("excitation: roughening by N^(-1/2) for N^(-1/3)", "excitation.cpp",
     "std::pow(static_cast<double>(poses.x.size()), -1.0 / kDimensions);",
     "std::pow(static_cast<double>(poses.x.size()), -1.0 / 2.0);", EXCITATION),
    ("excitation: the range of headings across pi is a full circle", "excitation.cpp",
     "const double offset = wrap_angle(poses.heading[i] - poses.heading[0]);",
     "const double offset = poses.heading[i] - poses.heading[0];", EXCITATION),
    ("excitation: noise of y without the part that goes with x", "excitation.cpp",
     "y[i] += root[1] * z0[i] + root[2] * z1[i];", "y[i] += root[2] * z1[i];", EXCITATION),
]
