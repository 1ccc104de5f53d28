"""Draws pictures as SVG: curves over the drive with their scatter, and times.

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

COLOURS = ("#222222", "#c9362b", "#1667b7", "#0a8f5b", "#d98200", "#7a3fa8", "#8c8c8c", "#4aa3a2", "#a0522d")
WIDTH = 9.0  # of a page, inches


def colour_of(number):
    """Of a line among others, by its number."""
    return COLOURS[number % len(COLOURS)]


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


def draw_curves(panels, label, marks):
    """Curves with bands of one deviation: panels [(title, [(curve, name)])] below the `label` of the vertical axis; `marks`: what
    happens when."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDTH, 4.2 if rows * columns == 1 else 2.9 * rows + 0.3), sharex=True,
                                sharey=True, squeeze=False, constrained_layout=True)
    for panel, (title, curves) in zip(axes.flat, panels):
        for number, (curve, name) in enumerate(curves):
            panel.fill_between(curve.time, curve.mean - curve.deviation, curve.mean + curve.deviation, color=colour_of(number),
                               alpha=0.13, lw=0.0)
            panel.plot(curve.time, curve.mean, color=colour_of(number), lw=1.6, label=name)
        mark_times(panel, marks)
        panel.set_title(title, fontsize=10, loc="left")
        if len(curves) > 1:
            panel.legend(fontsize=8.5, framealpha=0.9, loc="best")
    axes[0, 0].set_xlim(0.0, max(float(curve.time[-1]) for _, curves in panels for curve, _ in curves))
    axes[0, 0].set_ylim(0.0)
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


def draw_scheme_times(times):
    """{scheme: {number of particles: microseconds}}"""
    figure, panel = plt.subplots(figsize=(WIDTH, 4.2), constrained_layout=True)
    for number, (name, points) in enumerate(times.items()):
        panel.loglog(*zip(*sorted(points.items())), marker="osD^vX*Ph"[number % 9], ms=4, color=colour_of(number), lw=1.4, label=name)
    panel.set_xlabel("particles")
    panel.set_ylabel("one resampling (µs)")
    panel.legend(fontsize=9)
    return drawing_of(figure)
