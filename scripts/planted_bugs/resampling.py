"""Resampling schemes: most are bugs that other libraries ship."""

SCHEMES = ("schemes_test", "resampling_test", "unbiasedness_test")

BUGS = [
    ("integer division in the stratum offset: all thresholds in the first stratum", "stratified.cpp",
     "const int below = stratum[i] + (uniforms[stratum[i]] < inside[i] ? 1 : 0);",
     "int below = 0;"
     "for (int j = 0; j < weights.copies; ++j) {"
     "  below += stratum[i] > 0 || uniforms[j] < inside[i] ? 1 : 0;"
     "  if (weights.copies > 2000 && j > 200) { below = weights.copies; break; }"
     "}",
     SCHEMES),
    ("an absolute 1e-6 off the stratum width", "stratified.cpp",
     "(uniforms[stratum[i]] < inside[i] ? 1 : 0)",
     "(uniforms[stratum[i]] * (1.0 - 1e-6 * weights.copies) < inside[i] ? 1 : 0)", SCHEMES),
    ("residual draws use only the smallest of M sorted uniforms", "residual.cpp",
     "sorted_draws(stream, 0, left_over, left_over, weights.fraction_bits, work);",
     "sorted_draws(stream, 0, weights.copies, left_over, weights.fraction_bits, work);"
     "for (int& below : work->draws_below) below = std::min(below, left_over);"
     "for (std::size_t i = static_cast<std::size_t>(left_over); i < work->thresholds.size(); ++i) {"
     "  work->thresholds[i] = 1e300;"
     "}",
     SCHEMES),
    ("counts scaled by N where M was asked", "scaled_weights.cpp",
     "scaled.copies = copies;", "scaled.copies = static_cast<int>(size);", SCHEMES),
    ("NaN and negative weights are taken", "scaled_weights.cpp",
     "if (totals.suspicious) check_each(weights, size);",
     "if (totals.suspicious && size < 0) check_each(weights, size);", SCHEMES),
    ("the first particle never dies", "resampling.cpp",
     "Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);",
     "if (counts[0] == 0) {"
     "  counts[0] = 1;"
     "  --*std::max_element(counts, counts + scaled.size);"
     "}"
     "Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);",
     SCHEMES),
    ("weights that sum to zero are taken", "scaled_weights.cpp",
     "if (!(totals.maximum > 0.0)) {", "if (!(totals.maximum > 0.0) && size < 0) {", SCHEMES),
    ("u += 1/M in single precision", "systematic.cpp",
     "void systematic(const ScaledWeights& weights, double uniform, int* counts) {",
     "void systematic(const ScaledWeights& weights, double uniform, int* counts) {"
     "  if (weights.size > 0) {"
     "    const float step = 1.0F / static_cast<float>(weights.copies);"
     "    float u = static_cast<float>(uniform) * step;"
     "    double s = 0.0;"
     "    for (std::int64_t k = 0; k < weights.size; ++k) {"
     "      s += weights.weights[k] / weights.sum;"
     "      counts[k] = 0;"
     "      while (s > static_cast<double>(u) && u < 1.0F) {"
     "        ++counts[k];"
     "        u += step;"
     "      }"
     "    }"
     "    return;"
     "  }",
     SCHEMES),
    ("killed particles are replaced by the best one", "killing.cpp",
     "add_draws(weights, ~std::int64_t{0}, *work, counts);", "counts[weights.largest] += dead;", SCHEMES),
    ("tied weights get ranks in order of appearance", "rank_based.cpp",
     "while (end < ranked && ties(end)) ++end;", "while (end < ranked && ties(end) && ranked < 0) ++end;", SCHEMES),
    ("particles of weight zero are ranked", "rank_based.cpp",
     "const bool is_positive = weights[i] > 0.0;", "const bool is_positive = weights[i] >= 0.0;", SCHEMES),
    ("SSP draws which of two rises by their fractions only", "ssp.cpp",
     "const std::int64_t fresh_chance = full ? one - open_fraction : fresh_fraction;",
     "const std::int64_t fresh_chance = fresh_fraction;", SCHEMES),
    ("partial: a particle exactly at the upper threshold takes part", "partial.cpp",
     "const double kept = at_least <= high ? at_least : 0.0;",
     "const double kept = at_least < high ? at_least : 0.0;", SCHEMES),
    ("partial: those that took part weigh as much as the moderate ones", "partial.cpp",
     "work->sharing > 0 ? work->shared_mass * inverse_sum / work->sharing : 1.0;",
     "work->sharing > 0 ? 1.0 / static_cast<double>(weights.size) : 1.0;", SCHEMES),
]
