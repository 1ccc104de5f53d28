"""Draws pictures as SVG: curves over the drive with their scatter, worlds and paths, and points.

The same figures give the same bytes: no dates, and names of parts that follow from what is drawn.
"""
import io
import re
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import matplotlib.ticker
    import numpy as np
except ImportError as error:
    sys.exit(f"{error.name} is missing: sudo apt-get install python3-matplotlib")

from report_document import Drawing

matplotlib.rcParams.update({"svg.hashsalt": "pf_resampling", "svg.fonttype": "path", "font.size": 10.0,
                            "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True,
                            "path.simplify_threshold": 0.3, "font.family": "DejaVu Sans"})

INK, GREY, BLUE, RED, GREEN, ORANGE, VIOLET = "#222222", "#8c8c8c", "#1667b7", "#c9362b", "#0a8f5b", "#d98200", "#7a3fa8"
WIDTH = 9.0  # of a page, inches


def colour_of(number):
    """Of a line among others, by its number."""
    colours = (INK, RED, BLUE, GREEN, ORANGE, VIOLET, GREY, "#4aa3a2", "#a0522d")
    return colours[number % len(colours)]


def drawing_of(figure):
    """The picture without what changes from run to run or loads something (comments, type, metadata), to 0.01 points."""
    def saved(form, **options):
        file = io.BytesIO()
        figure.savefig(file, format=form, bbox_inches="tight", **options)
        return file.getvalue()

    plt.close(figure)
    text = saved("svg").decode("utf-8")
    for pattern in (r"<\?xml.*?\?>\s*", r"<!DOCTYPE.*?>\s*", r"\s*<metadata>.*?</metadata>", r"\s*<!--.*?-->"):
        text = re.sub(pattern, "", text, flags=re.DOTALL)
    text = re.sub(r"(scale\([^)]*\))|(\d\.\d\d)\d+", lambda match: match[1] or match[2], text)  # letters are scaled
    return Drawing("\n".join(line.strip() for line in text.splitlines()).encode("utf-8") + b"\n",
                   lambda: saved("pdf", metadata={"CreationDate": None}))


def mark_times(panel, marks):
    """Upright lines where something happens: {name: time, s}."""
    for name, when in marks.items():
        panel.axvline(when, color="0.55", lw=0.9, ls="--", zorder=0)
        panel.annotate(name, (when, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3), textcoords="offset points",
                       color="0.35", ha="center", fontweight="bold")


def draw_curves(panels, label, marks, top=None, columns=2, level=None):
    """Curves with bands of one standard deviation over the trials.

    `panels` are [(title, [(curve, name, colour, line)])]; `label` is that of the vertical axis, `top` its end, `level` a
    line across: (value, name).
    """
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDTH, 4.2 if rows * columns == 1 else 2.9 * rows + 0.3), sharex=True,
                                sharey=True, squeeze=False, constrained_layout=True)
    for panel, (title, curves) in zip(axes.flat, panels):
        for curve, name, colour, line in curves:
            panel.fill_between(curve.time, curve.mean - curve.deviation, curve.mean + curve.deviation, color=colour,
                               alpha=0.13, lw=0.0)
            panel.plot(curve.time, curve.mean, color=colour, ls=line, lw=1.6, label=name)
        mark_times(panel, marks)
        if level:
            panel.axhline(level[0], color="0.4", lw=1.0)
            panel.annotate(level[1], (1.0, level[0]), xycoords=("axes fraction", "data"), xytext=(-3, 2),
                           textcoords="offset points", ha="right", va="bottom", color="0.35", fontsize=9)
        if title:
            panel.set_title(title, fontsize=10, loc="left")
        if len(curves) > 1:
            panel.legend(fontsize=8.5, framealpha=0.9, loc="best")
    longest = max(float(curve.time[-1]) for _, curves in panels for curve, *_ in curves)
    axes[0, 0].set_xlim(0.0, longest)
    axes[0, 0].set_ylim(0.0, top)
    for panel in axes[:, 0]:
        panel.set_ylabel(label)
    for panel in axes[-1]:
        panel.set_xlabel("time (s)")
    for panel in list(axes.flat)[len(panels):]:
        panel.set_visible(False)
    return drawing_of(figure)


def draw_measure(lines, label):
    """{filter: {number of particles: (values of the trials, time, ms)}}: means against that number, where there are several,
    and against time; below, boxes of all trials."""
    sizes = sorted({size for points in lines.values() for size in points if size})
    against = {"particles": lambda key, time: key} if len(sizes) > 1 else {}
    if all(time > 0.0 for points in lines.values() for _, time in points.values()):
        against["processor time of a drive (ms)"] = lambda key, time: time
    figure = plt.figure(figsize=(WIDTH, 6.2 if against else 3.4), constrained_layout=True)
    grid = figure.add_gridspec(2 if against else 1, max(1, len(against)))
    boxes = figure.add_subplot(grid[-1, :])
    panels = [figure.add_subplot(grid[0, column]) for column in range(len(against))]
    for i, (name, points) in enumerate(lines.items()):
        keys = sorted(points, key=lambda size: size or 0)
        samples = [points[key][0] for key in keys]
        errors = [np.std(each, ddof=1) / len(each) ** 0.5 if len(each) > 1 else 0.0 for each in samples]
        for panel, place_of in zip(panels, against.values()):
            panel.errorbar([place_of(key, points[key][1]) for key in keys], [np.mean(each) for each in samples], errors, lw=1.4,
                           color=colour_of(i), marker="osD^vX*Ph"[i % 9], ms=4.5, capsize=2.5)
        width = 0.8 / len(lines)
        places = [(sizes.index(key) if key else 0) + (i - 0.5 * (len(lines) - 1)) * width for key in keys]
        drawn = boxes.boxplot(samples, positions=places, widths=0.8 * width, patch_artist=True, manage_ticks=False,
                              flierprops={"marker": ".", "ms": 3, "mec": colour_of(i)}, medianprops={"color": "white"})
        for part in drawn["boxes"] + drawn["whiskers"] + drawn["caps"]:
            part.set_color(colour_of(i))
        drawn["boxes"][0].set_label(name)
    for panel, text in zip(panels, against):
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:g}"))
        panel.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        panel.set_xlabel(text)
    boxes.set_xticks(range(len(sizes)))
    boxes.set_xticklabels(sizes)
    boxes.set_xlabel("particles" if sizes else "")
    boxes.grid(axis="x", visible=False)
    for panel in (*panels[:1], boxes):
        panel.set_ylabel(label)
    figure.legend(*boxes.get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, fontsize=9,
                  frameon=False)
    return drawing_of(figure)


def draw_paths(panels, height=4.6):
    """Maps side by side: [(title, [(points, name, colour, line)], [(places, name, marker, colour)], [(name, x, y)])]."""
    figure, axes = plt.subplots(1, len(panels), figsize=(WIDTH, height), squeeze=False, constrained_layout=True)
    for panel, (title, paths, places, notes) in zip(axes[0], panels):
        for points, name, colour, line in paths:
            panel.plot(points[:, 1], points[:, 2], color=colour, ls=line, lw=1.1 if line == "-" else 1.0, label=name)
        for spots, name, marker, colour in places:
            if spots:
                panel.plot([x for _, x, _ in spots], [y for _, _, y in spots], marker, color=colour, ms=6, label=name)
        for name, x, y in notes:
            panel.plot([x], [y], "o", color=RED, ms=5)
            panel.annotate(name, (x, y), xytext=(6, 6), textcoords="offset points", fontweight="bold", color=RED)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(title, fontsize=10, loc="left")
        panel.set_xlabel("x (m)")
    axes[0, 0].set_ylabel("y (m)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, fontsize=9, frameon=False)
    return drawing_of(figure)


def draw_scheme_times(lines):
    """Mahmoud's Figure 8: [(name, particles, microseconds)]."""
    figure, panel = plt.subplots(figsize=(WIDTH, 4.2), constrained_layout=True)
    colours = (BLUE, RED, GREEN, ORANGE, INK, VIOLET, GREY, "#4aa3a2", "#a0522d")
    for (name, particles, times), colour, marker in zip(lines, colours, "osD^vX*Ph"):
        panel.plot(particles, times, marker=marker, ms=4, color=colour, lw=1.4, label=name)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlabel("particles")
    panel.set_ylabel("one resampling (µs)")
    panel.legend(fontsize=9)
    return drawing_of(figure)


def draw_points(points, labels, level):
    """Points with crosses of standard errors: [(x, x error, y, y error, name or None, colour, marker)]; names are written
    beside. `labels` are those of the axes, `level` an upright line (value, name)."""
    figure, panel = plt.subplots(figsize=(WIDTH, 5.4), constrained_layout=True)
    named = sorted((point for point in points if point[4]), key=lambda point: point[2])
    for x, x_error, y, y_error, name, colour, marker in points:
        panel.errorbar(x, y, xerr=x_error, yerr=y_error, color=colour, marker=marker, ms=6 if name else 4, lw=0.9, mec="white",
                       mew=0.5, alpha=1.0 if name else 0.35, zorder=4 if name else 3)
    low, high = panel.get_ylim()
    step = 0.036 * (high - low)  # height of a line of text
    right = max(point[0] for point in points)
    ends = {"left": -1e9, "right": -1e9}  # where the last label of each column ends
    for x, _, y, _, name, colour, _ in named:
        # To the left of its point in the right half, where there is no room at the other side.
        column = "right" if x > 0.5 * (right + min(point[0] for point in points)) else "left"
        at = max(y, ends[column] + step)
        ends[column] = at
        shift = -0.02 if column == "right" else 0.012
        panel.annotate(name, (x, y), xytext=(x + shift, at), textcoords="data", fontsize=8, color=colour, va="center",
                       ha=column, zorder=5, arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.5, "alpha": 0.6})
    panel.axvline(level[0], color="0.4", lw=1.0)
    panel.annotate(level[1], (level[0], 1.0), xycoords=("data", "axes fraction"), xytext=(3, -4), textcoords="offset points",
                   rotation=90, ha="left", va="top", color="0.35", fontsize=9)
    panel.set_xlabel(labels[0])
    panel.set_ylabel(labels[1])
    return drawing_of(figure)
