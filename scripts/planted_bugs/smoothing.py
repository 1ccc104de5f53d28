"""Least squares over all data."""

RANGES = ("range_graph_test",)
RADIOS = ("range_memory_test",)
PLACES = ("radio_places_test",)
CROSS_VALIDATION = ("cross_validation_test",)
FACTOR = ("multifrontal_cholesky_test",)

BUGS = [
    # Among radios.
    ("what is wild pulls like any other range", "range_memory/range_graph.cpp",
     "student / (student + floor) / (1.0 + square)", "1.0 / (1.0 + square)", RANGES),
    ("data that have left the memory are no evidence any more", "range_memory/range_graph.cpp",
     "log_normalizers_ = past_->log_evidence;", "log_normalizers_ = 0.0;", RANGES),
    ("six places are enough for all that may be wrong", "range_memory/range_modes.cpp",
     "kMostPlaces = 20;", "kMostPlaces = 6;", RADIOS),
    ("fewer ranges are evidence against more", "range_memory/range_modes.cpp",
     "modes_.erase(std::remove_if(modes_.begin() + 1, modes_.end(),", "modes_.erase(std::remove_if(modes_.end(), modes_.end(),",
     PLACES),
    ("odometry that counts several times stays as it is", "range_memory/range_memory.cpp",
     "join(without_factors(odometry), &pending_);", "join(odometry, &pending_);", RADIOS),
    ("what a radio said before it was moved counts on", "range_memory/range_modes.cpp",
     "if (const std::optional<Change> change = newest_change()) forget_before(*change);", "", RADIOS),
    # How noisy the data are.
    ("cross-validation: chance passes for noise", "cross_validation.cpp",
     "return squares.both / kMeanSquareOfTwo / (1.0 + standard_error(blocks));",
     "return squares.both / kMeanSquareOfTwo + 0.0 * standard_error(blocks);", CROSS_VALIDATION),
    ("factor: a block that stands twice in a term forgets what is between", "smoothing/multifrontal_cholesky.cpp",
     "for (std::size_t a = 0; a < rows.size(); ++a) {", "for (std::size_t a = b; a < rows.size(); ++a) {", FACTOR),
]
