"""Motion by odometry, and whether the belief can be believed."""

MOTION = ("odometry_motion_test",)
LOST = ("lost_detector_test",)

BUGS = [
    # Motion.
    ("odometry: the noise of the heading does not swing the end of the step", "odometry_motion.cpp",
     "(across + heading * distance * distance / 3.0) * left * left.transpose();", "across * left * left.transpose();", MOTION),
    ("odometry: the uncertainty so far is not turned by the next step", "odometry_motion.cpp",
     "by_past(0, 2) = -(sine * motion.x + cosine * motion.y);", "by_past(0, 2) = 0.0;", MOTION),
    ("odometry: deviations added where variances are", "odometry_motion.cpp",
     "return deviation_per_root * deviation_per_root * amount;", "return deviation_per_root * amount;", MOTION),
    ("odometry: a yaw-rate error turns the whole step by all that it adds", "odometry_motion.cpp",
     "const Eigen::Vector3d step_sensitivity(-0.5 * duration * motion.y, 0.5 * duration * motion.x,",
     "const Eigen::Vector3d step_sensitivity(-duration * motion.y, duration * motion.x,", MOTION),
    # Whether the robot is lost.
    ("lost detector: the wider Gaussian is not lower", "lost_detector.cpp",
     "std::pow(spread, -dimensions) * std::exp(", "std::exp(", LOST),
    ("lost detector: nobody is lost by time alone", "lost_detector.cpp",
     "probability_ * (1.0 - recovers) + (1.0 - probability_) * loses;", "probability_ * (1.0 - recovers);", LOST),
    ("unknown place: either of two, added without what they share", "unknown_place.cpp",
     "return first + second - first * second;", "return first + second;", ("unknown_place_test",)),
    ("lost detector: the running mean is four times as fast", "lost_detector.cpp",
     "kInnovationRate * (squared_distance / dimensions - normalized_innovation_)",
     "4.0 * kInnovationRate * (squared_distance / dimensions - normalized_innovation_)", LOST),
    # Health.
    ("health: what does not fit passes for healthy", "health.cpp",
     "if (!inputs.misfit.empty()) {", "if (false) {", ("health_test",)),
    ("unknown place: noise is never doubted", "unknown_place.cpp",
     "std::pow(doubt, (f + 0.5) / factors)", "std::pow(1.0, (f + 0.5) / factors)", ("unknown_place_test",)),
    ("unknown place: a narrow belief counts as a round one", "unknown_place.cpp",
     "const double cosine = std::cos((d + 0.5) * kPi / kDirections);",
     "const double cosine = std::sqrt(0.5 + 0.0 * d);", ("unknown_place_test",)),
]
