"""Draws what the studies found: compensation over the drive and error against belief; the time that smoothing takes."""
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
    from matplotlib import patheffects
except ImportError as error:
    sys.exit(f"{error.name} is missing: sudo apt-get install python3-matplotlib")

# Of the courses: name in the study, label, colour, line.
COURSES = [
    ("NR", "no renewal (NR)", "#8c8c8c", "-"),
    ("RSR", "resampling (RSR)", "#222222", "-"),
    ("RBR", "rank-based resampling (RBR)", "#0a8f5b", "-"),
    ("compensation 20 %", "compensation, ratio 20 %", "#1667b7", "-"),
    ("compensation", "compensation, ratio 100 % (Kwak)", "#c9362b", "-"),
    ("compensation T_N=1", "the same after every observation", "#c9362b", ":"),
]
# Of the trade-off: what a name begins with, label, colour, marker; the first that fits.
FAMILIES = [
    ("compensation", "compensation", "#c9362b", "o"),
    ("RBR", "rank-based resampling", "#0a8f5b", "s"),
    ("NR", "no renewal", "#8c8c8c", "X"),
    ("RSR M=500", "500 particles", "#1667b7", "D"),
    ("", "resampling", "#222222", "s"),
]
# Those with a name: label, and where it stands, in points, left and right.
LABELLED = {
    "NR": ("NR", (9, -3), (9, -3)),
    "RSR": ("RSR", (9, 5), (-9, 9)),
    "RBR": ("RBR", (7, 7), (9, -4)),
    "compensation": ("100 %", (-12, 18), (9, -5)),
    "compensation 50 %": ("50 %", (9, 3), (9, -4)),
    "compensation 20 %": ("20 %", (7, -13), (9, -4)),
    "compensation 10 %": ("10 %", (9, -4), (9, -4)),
    "compensation T_N=1": ("100 %, after\nevery observation", (9, -10), (-10, 10)),
    "compensation T_N=0.25": ("100 %, $T_N$ = 0.25", (-62, -22), (9, -4)),
    "RSR M=500": ("RSR, 500 particles", (-60, 27), (9, -4)),
}
SHOWN_GROUPS = ("Resampling schemes", "Compensation: pairing and ratio")


def draw_courses(study):
    """Eq. 5, the map, diversity and honesty over the drive, averaged over the drives."""
    filters = {row["filter"]: row for row in study["summary"]}
    panels = [
        ("feature_error", "eq. 5 (m): error of the map\nand spread of the particles"),
        ("map_error", "error of the weighted-mean\nmap (m)"),
        ("distinct", "distinct particles"),
        ("map_inside", "landmarks inside their\n95 % ellipse"),
    ]
    figure, axes = plt.subplots(2, 2, figsize=(13.0, 7.6), sharex=True, constrained_layout=True)
    time = np.array(study["times"])
    for panel, (key, label) in zip(axes.flat, panels):
        for name, title, colour, line in COURSES:
            if name not in filters or (key == "distinct" and name not in ("NR", "RSR", "RBR")):
                continue
            panel.plot(time, filters[name]["curves"][key], color=colour, ls=line, lw=1.7, label=title)
        for closure, when in study["closures"].items():
            panel.axvline(when, color="0.55", lw=0.9, ls="--", zorder=0)
            panel.annotate(closure, (when, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3),
                           textcoords="offset points", color="0.35", fontsize=10, ha="center")
        panel.set_ylabel(label)
        panel.set_xlim(0.0, time[-1])
        panel.set_ylim(bottom=0.0)
        panel.grid(alpha=0.3)
    axes[1, 0].set_yscale("log")
    axes[1, 0].set_ylim(0.9, 130)
    axes[1, 0].set_yticks([1, 10, 100])
    axes[1, 0].set_yticklabels(["1", "10", "100"])
    axes[1, 0].text(0.985, 0.86, "compensation rejects none:\nthe count says nothing of it",
                    transform=axes[1, 0].transAxes, ha="right", va="top", fontsize=9, color="0.35")
    axes[1, 1].axhline(0.95, color="0.55", lw=0.9)
    axes[1, 1].text(time[-1] * 0.99, 0.955, "honest", ha="right", va="bottom", fontsize=9, color="0.35")
    axes[1, 1].set_ylim(0.0, 1.03)
    for panel in axes[1]:
        panel.set_xlabel("time (s); loops close at B and C")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3, fontsize=10, frameon=False)
    return figure


def draw_tradeoff(study):
    """Error against honesty: left as a user sees the map, right as eq. 5 of Kwak does."""
    figure, axes = plt.subplots(1, 2, figsize=(13.0, 5.6), sharex=True, constrained_layout=True)
    panels = ((axes[0], "map_error", "error of the weighted-mean map minus RSR's (m)", 1),
              (axes[1], "feature_error", "eq. 5 minus RSR's (m)", 2))
    for panel, key, label, place in panels:
        named = set()
        panel.axhline(0.0, color="0.55", lw=0.9, zorder=0)
        for row in study["summary"]:
            name = row["filter"]
            if row["group"] not in SHOWN_GROUPS and name not in LABELLED:
                continue
            _, title, colour, marker = next(each for each in FAMILIES if name.startswith(each[0]))
            inside = row["map_inside"]
            difference = row.get(f"{key}_minus_RSR", {"mean": 0.0, "standard_error": 0.0})  # RSR itself: none
            mean, error = difference["mean"], difference["standard_error"]
            is_labelled = name in LABELLED
            panel.errorbar(inside["mean"], mean, xerr=inside["standard_error"], yerr=error, color=colour,
                           marker=marker, ms=8 if is_labelled else 6, lw=1.1, mec="white", mew=0.6,
                           label=None if title in named or not is_labelled else title,
                           alpha=1.0 if is_labelled else 0.3, zorder=4 if is_labelled else 3)
            if is_labelled:
                named.add(title)
                panel.annotate(LABELLED[name][0], (inside["mean"], mean), xytext=LABELLED[name][place],
                               textcoords="offset points", fontsize=9.5, color=colour, zorder=2,
                               path_effects=[patheffects.withStroke(linewidth=3, foreground="white")])
        panel.axvline(0.95, color="0.55", lw=0.9)
        panel.annotate("honest", (0.95, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -5),
                       textcoords="offset points", rotation=90, ha="left", va="top", color="0.35", fontsize=9)
        panel.set_xlabel("share of the landmarks inside their 95 % ellipse")
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    axes[0].set_xlim(0.2, 1.0)
    axes[0].set_title("what a user gets")
    axes[1].set_title("what Kwak measures: the spread of the particles counts as error")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=5, fontsize=10, frameon=False)
    return figure


def draw_smoothing(study):
    """Time of a solution over the poses, a panel for each number of landmarks."""
    sizes = sorted({row["landmarks"] for row in study["rows"]})
    figure, axes = plt.subplots(1, len(sizes), figsize=(13.0, 4.6), sharey=True, constrained_layout=True)
    lines = [("solution", "ours, with the joint covariance", "#c9362b", "-", "o"),
             ("Ceres, SuiteSparse, cov.", "Ceres, SuiteSparse, with the joint covariance", "#1667b7", "-", "s"),
             ("Ceres, SuiteSparse", "Ceres, SuiteSparse, solution alone", "#1667b7", ":", "s"),
             ("Ceres, Eigen", "Ceres, Eigen, solution alone", "#0a8f5b", ":", "D")]
    for panel, landmarks in zip(axes, sizes):
        rows = sorted((row for row in study["rows"] if row["landmarks"] == landmarks), key=lambda row: row["poses"])
        for name, label, colour, line, marker in lines:
            panel.loglog([row["poses"] for row in rows], [row[name] for row in rows], color=colour, ls=line,
                         marker=marker, ms=5, lw=1.7, label=label)
        panel.set_title(f"{landmarks} landmarks")
        panel.set_xlabel("poses")
        panel.set_xticks([row["poses"] for row in rows])
        panel.set_xticklabels([str(row["poses"]) for row in rows])
        panel.minorticks_off()
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("ms of processor time")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, fontsize=10, frameon=False)
    return figure


def save(figure, picture):
    part = f"{picture}.part{os.getpid()}"
    try:
        figure.savefig(part, dpi=100, bbox_inches="tight", format=os.path.splitext(picture)[1][1:])
        os.replace(part, picture)
    except OSError as error:
        sys.exit(f"{picture}: cannot be written: {error.strerror}")
    finally:
        if os.path.exists(part):
            os.remove(part)


def draw_all(data, folder):
    """The pictures of the documents from the figures in doc/data."""
    save(draw_courses(data["compensation"]["drives_100"]), str(folder / "compensation_courses.png"))
    save(draw_tradeoff(data["compensation"]["drives_1000"]), str(folder / "compensation_tradeoff.png"))
    save(draw_smoothing(data["smoothing"]), str(folder / "smoothing_scaling.png"))
