"""Draws the time that smoothing takes."""
import io
import os
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent / "tools"))
from new_file import WriteError, write_files  # noqa: E402

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit(f"{error.name} is missing: sudo apt-get install python3-matplotlib")


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
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=100, bbox_inches="tight", format=os.path.splitext(picture)[1][1:])
    try:
        write_files({picture: drawn.getvalue()})
    except WriteError as error:
        sys.exit(str(error))


def draw_all(data, folder):
    """The pictures of the documents from the figures in doc/data."""
    save(draw_smoothing(data["smoothing"]), str(folder / "smoothing_scaling.png"))
