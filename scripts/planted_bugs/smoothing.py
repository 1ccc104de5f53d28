"""Least squares over all poses and landmarks."""

SMOOTHING = ("smoother_test", "normal_equations_test", "residuals_test")
CROSS_VALIDATION = ("cross_validation_test",)

BUGS = [
    # The equations.
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
    # How noisy the data are.
    (
        "cross-validation: chance passes for noise",
        "cross_validation.cpp",
        "return squares.both / kMeanSquareOfTwo / (1.0 + standard_error(blocks));",
        "return squares.both / kMeanSquareOfTwo + 0.0 * standard_error(blocks);",
        CROSS_VALIDATION,
    ),
]
