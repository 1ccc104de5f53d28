"""What FastSLAM remembers of the drive, and of what its sightings are where landmarks have no ids."""

ACCOUNTS = ("accounts_test",)
LEFT_OUT = ("left_out_test",)
LOCAL_GRAPH = ("local_graph_test",)
REASSOCIATION = ("reassociation_test",)

BUGS = [
    (
        "associations: what was seen since an arrival is never decided anew",
        "memory/accounts.cpp",
        "if (decide_anew(undecided_, visit, account)) break;",
        "(void)visit;",
        ACCOUNTS,
    ),
    (
        "associations: visits of the past stay as they are",
        "memory/accounts.cpp",
        "if (all.size() < 2) return;",
        "if (all.size() < 99999) return;",
        ACCOUNTS,
    ),
    (
        "associations: a landmark that was seen beside its double, once by mistake, stays",
        "memory/accounts.cpp",
        "if (do_without(candidate, account)) return true;",
        "",
        ACCOUNTS,
    ),
    (
        "associations: neighbours become one, whatever was seen",
        "memory/accounts.cpp",
        "if (!(growth(statistics_.redundancy) < kSureLogOdds) || !(growth(1.0) < kMostAgainst)) {",
        "if (!(growth(statistics_.redundancy) < 1e9)) {",
        ACCOUNTS,
    ),
    (
        "associations: a landmark goes however many sightings speak for it",
        "memory/accounts.cpp",
        "|| !(growth(1.0) < kMostAgainst)",
        "",
        ACCOUNTS,
    ),
    (
        "associations: clutter is tried as landmarks without bound",
        "memory/accounts.cpp",
        "if (landmark >= options_.most_landmarks) break;",
        "",
        ACCOUNTS,
    ),
    (
        "associations: a landmark that particles give up is forgotten, however often it was seen",
        "memory/accounts.cpp",
        "if (!account->is_dormant[l] || sightings[l] >= kOftenSeen) continue;",
        "if (!account->is_dormant[l]) continue;",
        ACCOUNTS,
    ),
    (
        "associations: a dormant landmark that is seen again stays dormant",
        "memory/accounts.cpp",
        "if (!account->is_dormant[second]) account->is_dormant[first] = false;",
        "",
        ACCOUNTS,
    ),
    (
        "associations: the evidence favours whoever has more landmarks",
        "memory/reassociation.cpp",
        "0.5 * log_determinant -",
        "0.0 * log_determinant -",
        REASSOCIATION,
    ),
    (
        "associations: a scan sees a landmark twice",
        "memory/reassociation.cpp",
        "std::find(taken.begin(), taken.end(), match.landmark) != taken.end()",
        "false",
        REASSOCIATION,
    ),
    (
        "associations: landmarks that were seen side by side become one",
        "memory/reassociation.cpp",
        "if (!is_asked || together(older, newer)) continue;",
        "if (!is_asked) continue;",
        REASSOCIATION,
    ),
    (
        "associations: landmarks in a belief that become one forget that they were apart",
        "memory/segment_equations.cpp",
        "add_to_diagonal(blocks[a], (block + block.transpose()).eval());",
        "",
        REASSOCIATION,
    ),
    (
        "local graph: what came before pulls nowhere",
        "memory/local_graph.cpp",
        "-(given.information[DataKind::given] * moved);",
        "0.0 * moved;",
        LOCAL_GRAPH,
    ),
    (
        "left out: what is to be predicted is not left out",
        "memory/left_out.cpp",
        "equations.add(graph, s, rest.segment, 1.0);",
        "equations.add(graph, s, *graph.segments[s], 1.0);",
        LEFT_OUT,
    ),
]
