"""FastSLAM."""

FASTSLAM = ("fastslam_test",)
STORE = ("landmark_store_test",)
BACKGROUND = ("background_redraw_test",)
PLACE = ("place_test",)
CHANGES = ("landmark_changes_test",)
FASTSLAM_FILTER = FASTSLAM + ("odd_observations_test", "saved_map_test", "redraw_test")

BUGS = [
    # Its kernels.
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
    # Its population and its map.
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
        FASTSLAM_FILTER + ("odometry_errors_test",),
    ),
    (
        "tempering: FastSLAM tempers under a redraw alone",
        "fastslam.cpp",
        "is_kept ? options_.strategy.redraw.tempering : options_.strategy.tempering;",
        "is_kept ? options_.strategy.redraw.tempering : 1.0;",
        FASTSLAM,
    ),
    (
        "association: the gate for new landmarks is ignored",
        "association.cpp",
        "if (distances[k](particle, c) < options.new_landmark_gate) {",
        "if (distances[k](particle, c) < 1e300) {",
        FASTSLAM_FILTER,
    ),
    (
        "schedule: FastSLAM renews by the sample size of the entropy",
        "fastslam.cpp",
        "status_.effective_sample_size, requested_size_, false,",
        "status_.entropy_sample_size, requested_size_, false,",
        FASTSLAM_FILTER,
    ),
    # Where it keeps its landmarks.
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
    (
        "landmark store: a copy without what is in the log",
        "landmark_store.cpp",
        "while (from.oldest != kNone && from.at(from.oldest).version < from.log.now()) {",
        "while (false) {",
        STORE,
    ),
    # Redraws beside it.
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
    # Where the robot is in its map, and what a redraw knows.
    (
        "place: landmarks' own errors are left out",
        "fastslam/place.cpp",
        "left.matrix() + of_maps;",
        "left.matrix();",
        PLACE,
    ),
    (
        "place: a map is shifted, and not turned",
        "fastslam/place.cpp",
        "share * Eigen::Matrix2d::Identity() + lever * by_landmark.row(2);",
        "share * Eigen::Matrix2d::Identity();",
        PLACE,
    ),
    (
        "redraw: what no particle holds any more is forgotten",
        "fastslam/association.cpp",
        "memory_.give_up_landmark(store_.birth(row));",
        "memory_.forget_landmark(store_.birth(row));",
        ("redraw_test",),
    ),
    (
        "memory: odometry that may slip counts like any other",
        "smoothing/residuals.cpp",
        "      motion.slip_covariance;",
        "      0.0 * motion.slip_covariance;",
        ("residuals_test",),
    ),
    (
        "memory: what does not fit is a slip, never a wrong id",
        "memory/doubts.cpp",
        "(believed.is_solved && believed.cost <= cost)",
        "believed.is_solved",
        ("memory/memory_test",),
    ),
    (
        "memory: odometry of any scale is taken as it is",
        "memory/odometry_scales.cpp",
        "std::abs(error) > kGross",
        "std::abs(error) > 1e3 * kGross",
        ("memory/memory_test",),
    ),
    # What has changed.
    (
        "changes: a landmark is elsewhere although others do not fit either",
        "fastslam/landmark_changes.cpp",
        "place->is_confirmed = after >= kFewestOthers && fitting >= kFitting * others;",
        "place->is_confirmed = others >= 0 && fitting >= 0 && after >= 0;",
        CHANGES,
    ),
    (
        "changes: what was seen again is still gone",
        "fastslam/landmark_changes.cpp",
        "landmark.missed = 0; } if (place.sightings++ == 0)",
        "} if (place.sightings++ == 0)",
        CHANGES,
    ),
]
