"""Bugs that the tests of the core have to catch: the table of scripts/check_tests_catch_bugs.

Each is (name, file, right, wrong, tests). `right` is a fragment of the source that occurs once in the
file, or, should the file have another name by now, once in the core; white space does not count.
`tests`: the test programs that should notice.
"""

SCHEMES = ("core_schemes_test", "core_resampling_test", "core_unbiasedness_test")
COMPENSATION = ("core_compensation_test",)
EXCITATION = ("core_excitation_test",)
STRATEGY = ("core_strategy_test",)
WEIGHTS = ("core_weights_test",)
MOTION = ("core_odometry_motion_test",)
LOST = ("core_lost_detector_test",)
FASTSLAM = ("core_fastslam_test",)
RANGES = ("core_kernels_test", "core_learning_test")
STORE = ("core_landmark_store_test",)
BACKGROUND = ("core_background_redraw_test",)
REASSOCIATION = ("core_reassociation_test",)
SMOOTHING = ("core_smoother_test", "core_normal_equations_test", "core_residuals_test")
SMOOTHED_PAST = ("core_smoothed_past_test",)
CROSS_VALIDATION = ("core_cross_validation_test",)
ANCESTRY = ("core_ancestry_test", "core_resampling_test")
MCL = ("core_beacon_mcl_test",)
FASTSLAM_FILTER = FASTSLAM + ("core_odd_observations_test", "core_saved_map_test", "core_redraw_test")

BUGS = [
    # Resampling: bugs that other libraries ship.
    (
        "integer division in the stratum offset: all thresholds in the first stratum",
        "stratified.cpp",
        "const int below = stratum[i] + (uniforms[stratum[i]] < inside[i] ? 1 : 0);",
        "int below = 0;"
        "for (int j = 0; j < weights.copies; ++j) {"
        "  below += stratum[i] > 0 || uniforms[j] < inside[i] ? 1 : 0;"
        "  if (weights.copies > 2000 && j > 200) { below = weights.copies; break; }"
        "}",
        SCHEMES,
    ),
    (
        "an absolute 1e-6 off the stratum width",
        "stratified.cpp",
        "(uniforms[stratum[i]] < inside[i] ? 1 : 0)",
        "(uniforms[stratum[i]] * (1.0 - 1e-6 * weights.copies) < inside[i] ? 1 : 0)",
        SCHEMES,
    ),
    (
        "residual draws use only the smallest of M sorted uniforms",
        "residual.cpp",
        "sorted_draws(stream, 0, left_over, left_over, weights.fraction_bits, work);",
        "sorted_draws(stream, 0, weights.copies, left_over, weights.fraction_bits, work);"
        "for (int& below : work->draws_below) below = std::min(below, left_over);"
        "for (std::size_t i = static_cast<std::size_t>(left_over); i < work->thresholds.size(); ++i) {"
        "  work->thresholds[i] = 1e300;"
        "}",
        SCHEMES,
    ),
    (
        "counts scaled by N where M was asked",
        "scaled_weights.cpp",
        "scaled.copies = copies;",
        "scaled.copies = static_cast<int>(size);",
        SCHEMES,
    ),
    (
        "NaN and negative weights are taken",
        "scaled_weights.cpp",
        "if (totals.suspicious) check_each(weights, size);",
        "if (totals.suspicious && size < 0) check_each(weights, size);",
        SCHEMES,
    ),
    (
        "the first particle never dies",
        "resampling.cpp",
        "Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);",
        "if (counts[0] == 0) {"
        "  counts[0] = 1;"
        "  --*std::max_element(counts, counts + scaled.size);"
        "}"
        "Eigen::Map<Eigen::ArrayXi> ancestors_map(ancestors, size);",
        SCHEMES,
    ),
    (
        "weights that sum to zero are taken",
        "scaled_weights.cpp",
        "if (!(totals.maximum > 0.0)) {",
        "if (!(totals.maximum > 0.0) && size < 0) {",
        SCHEMES,
    ),
    (
        "u += 1/M in single precision",
        "systematic.cpp",
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
        SCHEMES,
    ),
    (
        "a cast for the floor in Kwak's Table II",
        "residual_systematic.cpp",
        "counts[begin + i] = static_cast<int>(room >> bits);",
        "counts[begin + i] = static_cast<int>(room >> bits);"
        "if (counts[begin + i] == 0 && begin + i + 1 < weights.size) counts[begin + i] = 1;",
        SCHEMES,
    ),
    (
        "rounding for the missing floor in Mahmoud's section II.D",
        "residual_then_systematic.cpp",
        "const std::uint64_t whole = static_cast<std::uint64_t>(scaled[i]) >> bits;",
        "const std::uint64_t whole = static_cast<std::uint64_t>(scaled[i] + one / 2) >> bits;",
        SCHEMES,
    ),
    (
        "left-overs doubled for added in Mahmoud's section II.D (r = r + r)",
        "residual_then_systematic.cpp",
        "counts[begin + i] = static_cast<int>(whole + (after - before));",
        "counts[begin + i] = static_cast<int>(whole + whole + 0 * (after - before));",
        SCHEMES,
    ),
    (
        "killed particles are replaced by the best one",
        "killing.cpp",
        "add_draws(weights, ~std::int64_t{0}, *work, counts);",
        "counts[weights.largest] += dead;",
        SCHEMES,
    ),
    (
        "tied weights get ranks in order of appearance",
        "rank_based.cpp",
        "weights.weights[particle_of(words[end])] == weight) ++end;",
        "weights.weights[particle_of(words[end])] == weight && ranked < 0) ++end;",
        SCHEMES,
    ),
    (
        "particles of weight zero are ranked",
        "rank_based.cpp",
        "const bool is_positive = weights[i] > 0.0;",
        "const bool is_positive = weights[i] >= 0.0;",
        SCHEMES,
    ),
    (
        "SSP draws which of two rises by their fractions only",
        "ssp.cpp",
        "const std::int64_t fresh_chance = full ? one - open_fraction : fresh_fraction;",
        "const std::int64_t fresh_chance = fresh_fraction;",
        SCHEMES,
    ),
    (
        "partial: a particle exactly at the upper threshold takes part",
        "partial.cpp",
        "const double kept = at_least <= high ? at_least : 0.0;",
        "const double kept = at_least < high ? at_least : 0.0;",
        SCHEMES,
    ),
    (
        "partial: those that took part weigh as much as the moderate ones",
        "partial.cpp",
        "work->sharing > 0 ? work->shared_mass * inverse_sum / work->sharing : 1.0;",
        "work->sharing > 0 ? 1.0 / static_cast<double>(weights.size) : 1.0;",
        SCHEMES,
    ),
    (
        "the counts of an own scheme are written where the last result is",
        "resampling.cpp",
        "if (is_own) draw_own(options_.own_scheme, weights, size, stream, &work_);",
        "if (is_own) {"
        "  work_.own_counts.swap(counts_);"
        "  draw_own(options_.own_scheme, weights, size, stream, &work_);"
        "}",
        ("core_resampling_test",),
    ),
    (
        "survivors do not keep their own slots",
        "ancestry.cpp",
        "for (int i = 0; i < pairs; ++i) out[free_slots.items[i]] = copies.items[i];",
        "for (int i = 0; i < pairs; ++i) out[free_slots.items[i]] = copies.items[pairs - 1 - i];",
        ANCESTRY,
    ),
    # Compensation.
    (
        "compensation: the weak one keeps the strong one's share",
        "compensation.cpp",
        "weak + strong > 0.0 ? weak / (weak + strong) : 0.5",
        "weak + strong > 0.0 ? strong / (weak + strong) : 0.5",
        COMPENSATION,
    ),
    (
        "compensation: headings are blended as numbers, not on the circle",
        "compensation.cpp",
        "low = wrap_angle(pair.total * (low + towards * wrap_angle(heading[pair.high] - low)));",
        "low = wrap_angle(pair.total * (low + towards * (heading[pair.high] - low)));",
        COMPENSATION,
    ),
    (
        "compensation: the worst is paired with the middle, not with the best",
        "compensation.cpp",
        "ranks[i] = slots.size() - 1 - i;",
        "ranks[i] = weak + i;",
        COMPENSATION,
    ),
    (
        "compensation: the wheel is spun over the weak ones too",
        "compensation.cpp",
        "wheel[i] = sum += weights[slots[weak + i]];",
        "wheel[i] = sum += weights[slots[i]];",
        COMPENSATION,
    ),
    (
        "compensation: a weak particle may stand in two pairs",
        "compensation.cpp",
        "role_of_low != 0 ||",
        "role_of_low > 2 ||",
        COMPENSATION,
    ),
    (
        "compensation: a strong one with several weak ones counts itself once per pair",
        "compensation.cpp",
        "members[pair.high] += 1.0;",
        "members[pair.high] = 2.0;",
        COMPENSATION,
    ),
    # Excitation.
    (
        "excitation: regularized without West's pull to the mean",
        "excitation.cpp",
        "options.keep_variance ? 1.0 - std::sqrt(1.0 - bandwidth * bandwidth) : 0.0;",
        "options.keep_variance ? 0.0 : 0.0;",
        EXCITATION,
    ),
    (
        "excitation: roughening by N^(-1/2) for N^(-1/3)",
        "excitation.cpp",
        "std::pow(static_cast<double>(poses.x.size()), -1.0 / kDimensions);",
        "std::pow(static_cast<double>(poses.x.size()), -1.0 / 2.0);",
        EXCITATION,
    ),
    (
        "excitation: the range of headings across pi is a full circle",
        "excitation.cpp",
        "const double offset = wrap_angle(poses.heading[i] - poses.heading[0]);",
        "const double offset = poses.heading[i] - poses.heading[0];",
        EXCITATION,
    ),
    (
        "excitation: the first copy is moved too",
        "excitation.cpp",
        "workspace->moves[i] = 0.0;",
        "workspace->moves[i] = 1.0;",
        EXCITATION,
    ),
    (
        "excitation: noise of y without the part that goes with x",
        "excitation.cpp",
        "const double noise_y = root[1] * z0[i] + root[2] * z1[i];",
        "const double noise_y = root[2] * z1[i];",
        EXCITATION,
    ),
    # When a population is renewed, and how.
    (
        "strategy: due when the effective sample size is high",
        "strategy.cpp",
        "effective_sample_size < options_.threshold * size;",
        "effective_sample_size > options_.threshold * size;",
        STRATEGY,
    ),
    (
        "strategy: every n-th observation, one too late",
        "strategy.cpp",
        "return observations_since_renewal_ >= options_.every_n;",
        "return observations_since_renewal_ > options_.every_n;",
        STRATEGY,
    ),
    (
        "strategy: a scheme that keeps the size is asked for another one",
        "strategy.cpp",
        "resizes && keeps_size(options_.resampling) ? resizer_ : resampler_;",
        "resizes && !keeps_size(options_.resampling) ? resizer_ : resampler_;",
        STRATEGY,
    ),
    # Redraws beside the filter.
    (
        "background redraw: a copy of a filter that was changed is taken",
        "background_redraw.cpp",
        "if (is_running() && job_->interventions != filter->interventions()) give_up();",
        "",
        BACKGROUND,
    ),
    (
        "background redraw: a copy that has not seen all updates is taken",
        "background_redraw.cpp",
        "if (job->copy.step() != filter->step()) {",
        "if (job->copy.step() > filter->step()) {",
        BACKGROUND,
    ),
    (
        "background redraw: what was seen meanwhile is not replayed",
        "background_redraw.cpp",
        "copy->recover(observations, sensor, stamp, 0.0);",
        "",
        BACKGROUND,
    ),
    (
        "background redraw: the filter resamples before the copy is made",
        "background_redraw.cpp",
        "if (!job_ && refused_ != filter->interventions()) begin(*filter);",
        "filter->put_off_redraw();"
        "if (!job_ && refused_ != filter->interventions()) begin(*filter);",
        BACKGROUND,
    ),
    (
        "background redraw: a failure is not counted",
        "background_redraw.cpp",
        "refused_ = filter.interventions();",
        "",
        BACKGROUND,
    ),
    (
        "landmark store: a copy without what is in the log",
        "landmark_store.cpp",
        "while (from.oldest != kNone && from.at(from.oldest).version < from.log.now()) {",
        "while (false) {",
        STORE,
    ),
    # Weights.
    (
        "weights: the effective sample size without the square of the sum",
        "weights.cpp",
        "const double effective = sum * sum / sum_of_lanes(sums.squares);",
        "const double effective = sum / sum_of_lanes(sums.squares);",
        WEIGHTS,
    ),
    (
        "weights: not shifted by the largest, so that small ones underflow",
        "weights.cpp",
        "const double value = log_weights[i] - shift;",
        "const double value = log_weights[i] - 0.0 * shift;",
        WEIGHTS,
    ),
    (
        "weights: the last, fewer than eight, are left out",
        "weights.cpp",
        "if (whole < count) {",
        "if (whole > count) {",
        WEIGHTS,
    ),
    (
        "weights: the entropy of weights that are not normalized",
        "weights.cpp",
        "const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs) / sum;",
        "const double entropy = log_of_sum - sum_of_lanes(sums.weighted_logs);",
        WEIGHTS,
    ),
    # Motion by odometry.
    (
        "odometry: the noise of the heading does not swing the end of the step",
        "odometry_motion.cpp",
        "(across + heading * distance * distance / 3.0) * left * left.transpose();",
        "across * left * left.transpose();",
        MOTION,
    ),
    (
        "odometry: the uncertainty so far is not turned by the next step",
        "odometry_motion.cpp",
        "by_past(0, 2) = -(sine * motion.x + cosine * motion.y);",
        "by_past(0, 2) = 0.0;",
        MOTION,
    ),
    (
        "odometry: deviations added where variances are",
        "odometry_motion.cpp",
        "return deviation_per_root * deviation_per_root * amount;",
        "return deviation_per_root * amount;",
        MOTION,
    ),
    (
        "odometry: a yaw-rate error turns the whole step by all that it adds",
        "odometry_motion.cpp",
        "const Eigen::Vector3d step_sensitivity(-0.5 * duration * motion.y, 0.5 * duration * motion.x,",
        "const Eigen::Vector3d step_sensitivity(-duration * motion.y, duration * motion.x,",
        MOTION,
    ),
    # Whether the robot is lost.
    (
        "lost detector: the wider Gaussian is not lower",
        "lost_detector.cpp",
        "std::pow(spread, -dimensions) * std::exp(",
        "std::exp(",
        LOST,
    ),
    (
        "lost detector: nobody is lost by time alone",
        "lost_detector.cpp",
        "probability_ * (1.0 - recovers) + (1.0 - probability_) * loses;",
        "probability_ * (1.0 - recovers);",
        LOST,
    ),
    (
        "lost detector: either of two, added without what they share",
        "lost_detector.cpp",
        "return first + second - first * second;",
        "return first + second;",
        LOST,
    ),
    # FastSLAM's kernels.
    (
        "fastslam: the sensor's lever is turned the wrong way",
        "fastslam/kernels.cpp",
        "const double lever_x = cosine * z.sensor_x - sine * z.sensor_y;",
        "const double lever_x = cosine * z.sensor_x + sine * z.sensor_y;",
        FASTSLAM,
    ),
    (
        "fastslam: the difference of bearings is not wrapped",
        "fastslam/kernels.cpp",
        "g.bearing_error = wrap_angle_vector(z.bearing + z.sensor_yaw + heading - atan2_vector(dy, dx));",
        "g.bearing_error = z.bearing + z.sensor_yaw + heading - atan2_vector(dy, dx);",
        FASTSLAM,
    ),
    (
        "fastslam: the weight leaves out the size of the innovation's covariance",
        "fastslam/kernels.cpp",
        "return -0.5 * distance - 0.5 * log_vector(determinant) - kLogTwoPi;",
        "return -0.5 * distance - 0.0 * log_vector(determinant) - kLogTwoPi;",
        FASTSLAM,
    ),
    (
        "fastslam: an observation beyond the gate is believed",
        "fastslam/kernels.cpp",
        "const double applies = v.distance < gate ? takes[i] : 0.0;",
        "const double applies = takes[i];",
        FASTSLAM,
    ),
    (
        "fastslam: a landmark's covariance leaves out the noise of the bearing",
        "fastslam/kernels.cpp",
        "lxx[i] = a11 * m11 + a12 * m12 + z.range_variance * kr1 * kr1 + z.bearing_variance * kb1 * kb1;",
        "lxx[i] = a11 * m11 + a12 * m12 + z.range_variance * kr1 * kr1;",
        FASTSLAM,
    ),
    (
        "fastslam: a new landmark is as certain across as along the ray",
        "fastslam/kernels.cpp",
        "landmark.xy[i] = (z.range_variance - across) * cosine * sine;",
        "landmark.xy[i] = 0.0;",
        FASTSLAM,
    ),
    # Where FastSLAM keeps its landmarks.
    (
        "landmark store: an ancestor's landmark is taken from the slot itself",
        "landmark_rows.cpp",
        "for (int i = 0; i < size; ++i) out[i] = from[ancestors[i]];",
        "for (int i = 0; i < size; ++i) out[i] = from[i < 3 ? i : ancestors[i]];",
        STORE,
    ),
    (
        "landmark store: who holds a landmark is not selected along",
        "landmark_rows.cpp",
        "for (int i = 0; i < particles; ++i) held_out[i] = held[ancestors[i]];",
        "for (int i = 0; i < particles; ++i) held_out[i] = held[i];",
        STORE,
    ),
    (
        "landmark store: two selections composed in the wrong order",
        "landmark_rows.cpp",
        "for (int i = 0; i < size; ++i) out[i] = first[second[i]];",
        "for (int i = 0; i < size; ++i) out[i] = second[first[i] < size ? first[i] : 0];",
        STORE,
    ),
    (
        "landmark store: a blend spreads the covariance after the means have met",
        "landmark_rows.cpp",
        "const double dx = x[high] - x[low]; const double dy = y[high] - y[low];",
        "const double dx = 0.0; const double dy = 0.0;",
        STORE,
    ),
    (
        "landmark store: rows that lag are dropped with the log",
        "landmark_store.cpp",
        "log.drop_before(oldest == kNone ? log.now() : at(oldest).version);",
        "log.drop_before(log.now());",
        STORE,
    ),
    # Localization by ranges.
    (
        "beacon_mcl: the antenna's height is left out",
        "beacon_mcl/kernels.cpp",
        "return std::sqrt(dx * dx + dy * dy + dz * dz);",
        "return std::sqrt(dx * dx + dy * dy + 0.0 * dz);",
        RANGES,
    ),
    (
        "beacon_mcl: a range that is too short is taken for a reflected one",
        "beacon_mcl/kernels.cpp",
        "innovation > 0.0 ? range.tail_density * exp_vector(-range.tail_rate * excess) : 0.0;",
        "range.tail_density * exp_vector(-range.tail_rate * excess);",
        RANGES,
    ),
    (
        "beacon_mcl: the drawn turn does not teach the yaw-rate bias",
        "beacon_mcl/kernels.cpp",
        "yaw_rate_bias[i] -= gain * (turn + m.sensitivity[2] * yaw_rate_bias[i]);",
        "yaw_rate_bias[i] -= 0.0 * gain * turn;",
        RANGES,
    ),
    (
        "beacon_mcl: outliers teach the calibration as much as the others",
        "beacon_mcl/kernels.cpp",
        "const double gain = l.inlier * inverse * difference;",
        "const double gain = inverse * difference;",
        RANGES,
    ),
    (
        "pose statistics: the mean heading of numbers, not of directions",
        "pose_statistics.cpp",
        "std::atan2(total(first[4]), total(first[3]))};",
        "total(first[4])};",
        ("core_pose_statistics_test",),
    ),
    # Smoothing: what decides which landmark was seen, and how noisy the data are.
    (
        "reassociation: what was seen since an arrival is never decided anew",
        "smoothed_past.cpp",
        "if (undecided.decide_anew(options, reassociation, from, next_id, this, &solution)) break;",
        "(void)from;",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: a landmark that was seen beside its double, once by mistake, stays",
        "smoothed_past.cpp",
        "if (!simplify(options, reassociation, &solution)) break;",
        "break;",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: neighbours become one, whatever was seen",
        "smoothed_past.cpp",
        "if (!(after < before + kSureLogOdds)) return false;",
        "if (!(after < before + 1e9)) return false;",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: clutter is tried as landmarks without bound",
        "smoothed_past.cpp",
        "if (landmark >= options.most_landmarks) return true;",
        "",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: a landmark that particles give up is forgotten, however often it was seen",
        "smoothed_past.cpp",
        "if (seen < kOftenSeen) return forget_landmark(id);",
        "if (seen >= 0) return forget_landmark(id);",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: a dormant landmark that is seen again stays dormant",
        "smoothed_past.cpp",
        "if (!state_.is_dormant[static_cast<std::size_t>(newer)]) {",
        "if (false) {",
        SMOOTHED_PAST,
    ),
    (
        "reassociation: the evidence favours whoever has more landmarks",
        "reassociation.cpp",
        "association_cost(options, solution.cost, graph) + 0.5 * solution.log_determinant;",
        "association_cost(options, solution.cost, graph);",
        REASSOCIATION,
    ),
    (
        "reassociation: what is tracked anew may be what was seen before",
        "reassociation.cpp",
        "is_candidate.push_back(now - seen <= gap);",
        "is_candidate.push_back(now - seen <= gap || seen < 0.0);",
        REASSOCIATION,
    ),
    (
        "reassociation: a scan sees a landmark twice",
        "reassociation.cpp",
        "if (scan[match.sighting].landmark >= 0 || taken.count(match.landmark) > 0) continue;",
        "if (scan[match.sighting].landmark >= 0) continue;",
        REASSOCIATION,
    ),
    (
        "reassociation: landmarks that were seen side by side become one",
        "reassociation.cpp",
        "if (together[static_cast<std::size_t>(older)].count(newer) > 0) continue;",
        "",
        REASSOCIATION,
    ),
    (
        "reassociation: a prior about two landmarks that become one forgets that they were apart",
        "reassociation.cpp",
        "(prior->landmarks[first] - prior->landmarks[second]);",
        "(0.0 * (prior->landmarks[first] - prior->landmarks[second]));",
        REASSOCIATION,
    ),
    (
        "ranges stay with the number of the pose they had before the oldest were forgotten",
        "smoother.cpp",
        "for (RangeFactor& range : graph->ranges) range.pose -= poses;",
        "",
        SMOOTHING,
    ),
    (
        "the antenna turns the other way than the robot",
        "residuals.cpp",
        "away.dot(Eigen::Vector2d(-arm.y(), arm.x()))",
        "away.dot(Eigen::Vector2d(arm.y(), -arm.x()))",
        SMOOTHING,
    ),
    (
        "what radios of one make have in common is left out of their prior",
        "smoothing_graph.cpp",
        "const Eigen::Array2d shared = common / (own * (own + radios * common));",
        "const Eigen::Array2d shared = 0.0 * common;",
        SMOOTHING,
    ),
    (
        "the prior of what is left without a landmark forgets the radios",
        "smoothing_graph.cpp",
        "left.radios = prior.radios;",
        "",
        SMOOTHING,
    ),
    (
        "reassociation: a landmark that is taken out takes with it what it said of the others",
        "smoothing_graph.cpp",
        "left.information = part(kept, kept) - across.transpose() * root.solve(across);",
        "left.information = part(kept, kept);",
        REASSOCIATION,
    ),
    (
        "cross-validation: what is to be predicted is not left out",
        "cross_validation.cpp",
        "equations.linearize(graph, robust_width, block.sightings);",
        "equations.linearize(graph, robust_width);",
        CROSS_VALIDATION,
    ),
    (
        "cross-validation: chance passes for noise",
        "cross_validation.cpp",
        "return squares.both / kMeanSquareOfTwo / (1.0 + standard_error(blocks));",
        "return squares.both / kMeanSquareOfTwo + 0.0 * standard_error(blocks);",
        CROSS_VALIDATION,
    ),
    # What studies measure, and what compensation blends.
    (
        "map: its mean ignores the weights",
        "fastslam.cpp",
        "return total > 0.0 ? particles_.weight[i] / total : 1.0;",
        "return 1.0;",
        FASTSLAM_FILTER,
    ),
    (
        "map: its covariance leaves out how far the particles' landmarks are apart",
        "fastslam.cpp",
        "spread += share(i) * (covariance(i) - covariance(first) + deviation * deviation.transpose());",
        "spread += share(i) * (covariance(i) - covariance(first));",
        FASTSLAM_FILTER,
    ),
    (
        "fastslam_1 draws no noise of the motion",
        "fastslam.cpp",
        "if (options_.version == FastSlamVersion::fastslam_1) draw();",
        "",
        FASTSLAM_FILTER,
    ),
    (
        "compensation: FastSLAM's errors of the odometry are not blended",
        "fastslam.cpp",
        "odometry_errors_.blend(pairs);",
        "",
        FASTSLAM_FILTER + ("core_odometry_errors_test",),
    ),
    (
        "compensation: the calibration of the ranges is not blended",
        "renewal.cpp",
        "blend_means(pairs, p.scale.col(radio));",
        "",
        MCL,
    ),
    (
        "compensation: covariances are matched to means that are blended already",
        "renewal.cpp",
        "blend_covariances(pairs, treatment, p.yaw_rate_bias, p.yaw_rate_bias, p.yaw_rate_bias_variance);"
        "blend_means(pairs, p.yaw_rate_bias);",
        "blend_means(pairs, p.yaw_rate_bias);"
        "blend_covariances(pairs, treatment, p.yaw_rate_bias, p.yaw_rate_bias, p.yaw_rate_bias_variance);",
        MCL,
    ),
    (
        "compensation: literal pairs are divided by the sum of their weights",
        "compensation.cpp",
        "return {low, high, weak / sum, (weak + strong) / sum};",
        "return {low, high, weak / (weak + strong), 1.0};",
        COMPENSATION,
    ),
    (
        "compensation: a ratio of zero blends a pair",
        "compensation.cpp",
        "options.ratio > 0.0 ? 1 : 0",
        "1",
        COMPENSATION,
    ),
    (
        "tempering: all that the observations say is taken up",
        "weights.cpp",
        "before + share * (log_weights - before)",
        "before + (log_weights - before)",
        WEIGHTS,
    ),
    (
        "tempering: the likelihood that is stated is that of the share",
        "weights.cpp",
        "return all - log_of_sum(log_weights);",
        "return 0.0;",
        WEIGHTS,
    ),
    (
        "tempering: FastSLAM tempers under a redraw alone",
        "fastslam.cpp",
        "is_kept ? options_.strategy.redraw.tempering : options_.strategy.tempering;",
        "is_kept ? options_.strategy.redraw.tempering : 1.0;",
        FASTSLAM,
    ),
    (
        "tempering: the beacon filter does not",
        "beacon_mcl.cpp",
        "const double share = options_.strategy.tempering;",
        "const double share = 1.0;",
        MCL,
    ),
    (
        "association: the gate for new landmarks is ignored",
        "association.cpp",
        "if (distances[k](particle, c) < options.new_landmark_gate) {",
        "if (distances[k](particle, c) < 1e300) {",
        FASTSLAM_FILTER,
    ),
    (
        "lost detector: the running mean is four times as fast",
        "lost_detector.cpp",
        "kInnovationRate * (squared_distance / dimensions - normalized_innovation_)",
        "4.0 * kInnovationRate * (squared_distance / dimensions - normalized_innovation_)",
        LOST,
    ),
    (
        "schedule: FastSLAM renews by the sample size of the entropy",
        "fastslam.cpp",
        "status_.effective_sample_size, requested_size_, false,",
        "status_.entropy_sample_size, requested_size_, false,",
        FASTSLAM_FILTER,
    ),
    (
        "schedule: beacon_mcl renews by the sample size of the entropy",
        "renewal.cpp",
        "status_.effective_sample_size, requested_size_, recovery_is_due(),",
        "status_.entropy_sample_size, requested_size_, recovery_is_due(),",
        MCL,
    ),
    (
        "health: what does not fit passes for healthy",
        "health.cpp",
        "if (!inputs.misfit.empty()) {",
        "if (false) {",
        ("core_health_test",),
    ),
]

# A few from different rooms, each caught by the first of its tests, which is built and run in seconds.
QUICK = (
    "survivors do not keep their own slots",
    "compensation: headings are blended as numbers",
    "excitation: the first copy is moved too",
    "strategy: due when",
    "weights: the last, fewer than eight",
    "odometry: the uncertainty so far",
    "lost detector: the wider Gaussian",
)
# Rooms that these do not need, which take most of the time to build.
QUICK_WITHOUT = ("benchmark", "evaluation", "filters", "simulation", "smoothing")
