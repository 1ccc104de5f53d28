"""What FastSLAM remembers of the drive, and of what its sightings are where landmarks have no ids."""

ACCOUNTS = ("accounts_test",)
LEFT_OUT = ("left_out_test",)
LOCAL_GRAPH = ("local_graph_test",)
REASSOCIATION = ("reassociation_test",)

BUGS = [
    ("associations: what was seen since an arrival is never decided anew", "memory/accounts.cpp",
     "if (decide_anew(visit, undecided_, kSureLogOdds, account)) break;", "(void)visit;", ACCOUNTS),
    ("associations: a visit of the past is never decided anew", "memory/accounts.cpp",
     "if (visit) decide_anew(*visit, *account, kSureElsewhere, account);", "(void)visit;", ACCOUNTS),
    ("associations: what a robot that is elsewhere should have seen does not matter", "memory/accounts.cpp",
     "return -std::log(share) * std::max(0, after.missed - before.missed);", "return 0.0 * share;", ACCOUNTS),
    ("associations: a landmark that is missed altogether is one that is hardly seen", "memory/scans.cpp",
     "++passages.missed;", "++passages.hardly_seen;", ACCOUNTS),
    ("view: what a wild reading widens is never narrowed", "memory/sensor_view.cpp",
     "(1.0 - kNarrows) * quantile", "quantile", ("sensor_view_test",)),
    ("memory: after a checkpoint nobody looks for what is missed", "memory/memory.cpp",
     "if (state_.decided > 0) look_for_missed();", "", ACCOUNTS),
    ("associations: tracks of one landmark say where the robot is", "memory/reassociation.cpp",
     "|| !is_near(c)) continue;", ") continue;", REASSOCIATION),
    ("associations: a landmark that was seen beside its double, once by mistake, stays", "memory/accounts.cpp",
     "return do_without(candidate, account);", "return candidate.cost > 1e9;", ACCOUNTS),
    ("associations: neighbours become one, whatever was seen", "memory/accounts.cpp",
     "if (!(growth(statistics_.redundancy) < kSureLogOdds) || !(growth(1.0) < kMostAgainst)) {",
     "if (!(growth(statistics_.redundancy) < 1e9)) {", ACCOUNTS),
    ("associations: a landmark goes however many sightings speak for it", "memory/accounts.cpp",
     "|| !(growth(1.0) < kMostAgainst)", "", ACCOUNTS),
    ("associations: clutter is tried as landmarks without bound", "memory/accounts.cpp",
     "if (landmark >= options_.most_landmarks) break;", "", ACCOUNTS),
    ("associations: a landmark that particles give up is forgotten, however often it was seen", "memory/accounts.cpp",
     "if (!account->landmarks[l].is_dormant || sightings[l] >= kOftenSeen) continue;",
     "if (!account->landmarks[l].is_dormant) continue;", ACCOUNTS),
    ("associations: a dormant landmark that is seen again stays dormant", "memory/accounts.cpp",
     "first.is_dormant = first.is_dormant && second.is_dormant;", "", ACCOUNTS),
    ("associations: the evidence favours whoever has more landmarks", "memory/reassociation.cpp",
     "0.5 * log_determinant -", "0.0 * log_determinant -", REASSOCIATION),
    ("associations: a scan sees a landmark twice", "memory/reassociation.cpp",
     "|| has(taken, landmark)", "", REASSOCIATION),
    ("associations: landmarks that were seen side by side become one", "memory/reassociation.cpp",
     "if (!is_asked || together(older, newer)) continue;", "if (!is_asked) continue;", REASSOCIATION),
    ("local graph: what came before pulls nowhere", "memory/local_graph.cpp",
     "given.condensed = condensed_belief(information, gradient);",
     "given.condensed = condensed_belief(information, 0.0 * gradient);", LOCAL_GRAPH),
    ("left out: what is to be predicted is not left out", "memory/left_out.cpp",
     "equations.add(graph, s, rest.segment, 1.0);", "equations.add(graph, s, *graph.segments[s], 1.0);", LEFT_OUT),
]
