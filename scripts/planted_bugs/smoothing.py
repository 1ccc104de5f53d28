"""Least squares over all poses and landmarks."""

REASSOCIATION = ("reassociation_test",)
SMOOTHING = ("smoother_test", "normal_equations_test", "residuals_test")
SMOOTHED_PAST = ("smoothed_past_test",)
CROSS_VALIDATION = ("cross_validation_test",)

BUGS = [
    # Which landmark was seen.
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
        "reassociation: a landmark that is taken out takes with it what it said of the others",
        "smoothing_graph.cpp",
        "left.information = part(kept, kept) - across.transpose() * root.solve(across);",
        "left.information = part(kept, kept);",
        REASSOCIATION,
    ),
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
    (
        "the prior of what is left without a landmark forgets the radios",
        "smoothing_graph.cpp",
        "left.radios = prior.radios;",
        "",
        SMOOTHING,
    ),
    # How noisy the data are.
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
]
