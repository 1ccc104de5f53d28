"""Draws pictures as SVG: curves over the drive with their scatter, and times.

The same figures give the same bytes: no dates, and names of parts that follow from what is drawn.
"""
import io
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import matplotlib.ticker  # noqa: E402

matplotlib.rcParams.update({"svg.hashsalt": "pf_resampling", "svg.fonttype": "path", "font.size": 10.0,
                            "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True,
                            "path.simplify_threshold": 0.3, "font.family": "DejaVu Sans"})

COLOURS = ("#222222", "#c9362b", "#1667b7", "#0a8f5b", "#d98200", "#7a3fa8", "#8c8c8c", "#4aa3a2", "#a0522d")
WIDTH = 9.0  # of a page, inches


def drawing_of(figure):
    """The picture as text, without what changes from run to run or loads something (comments, type, metadata), to 0.01 points."""
    file = io.StringIO()
    figure.savefig(file, format="svg", bbox_inches="tight")
    plt.close(figure)
    text = file.getvalue()
    for pattern in (r"<\?xml.*?\?>\s*", r"<!DOCTYPE.*?>\s*", r"\s*<metadata>.*?</metadata>", r"\s*<!--.*?-->"):
        text = re.sub(pattern, "", text, flags=re.DOTALL)
    text = re.sub(r"(scale\([^)]*\))|(\d\.\d\d)\d+", lambda match: match[1] or match[2], text)  # letters are scaled
    return "\n".join(line.strip() for line in text.splitlines()) + "\n"


def draw_curves(panels, label, marks):
    """Curves with bands of one deviation: panels [(title, [(curve, name)])] below the `label` of the vertical axis; `marks`: upright
    lines where something happens, {name: time in s}."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(WIDTH, 4.2 if rows * columns == 1 else 2.9 * rows + 0.3), sharex=True,
                                sharey=True, squeeze=False, constrained_layout=True)
    for panel, (title, curves) in zip(axes.flat, panels):
        for number, (curve, name) in enumerate(curves):
            panel.fill_between(curve.time, curve.mean - curve.deviation, curve.mean + curve.deviation, color=COLOURS[number % 9],
                               alpha=0.13, lw=0.0)
            panel.plot(curve.time, curve.mean, color=COLOURS[number % 9], lw=1.6, label=name)
        for name, when in marks.items():
            panel.axvline(when, color="0.55", lw=0.9, ls="--", zorder=0)
            panel.annotate(name, (when, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 3), textcoords="offset points",
                           color="0.35", ha="center", fontweight="bold")
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
    """{filter: [(number of particles, time in ms, mean, standard error)]}: means against the number and against the time, each if there
    are several; None if neither are."""
    against = [(column, text) for column, text in enumerate(("particles", "processor time of a drive (ms)"))
               if len({points[column] for of in lines.values() for points in of if points[column] > 0.0}) > 1]
    if not against:
        return None
    figure, panels = plt.subplots(1, len(against), figsize=(WIDTH, 3.4), sharey=True, squeeze=False, constrained_layout=True)
    for panel, (column, text) in zip(panels[0], against):
        for i, (name, points) in enumerate(lines.items()):
            *places, means, errors = zip(*sorted(points))
            panel.errorbar(places[column], means, errors, lw=1.4, color=COLOURS[i % 9], marker="osD^vX*Ph"[i % 9], ms=4.5, capsize=2.5,
                           label=name)
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:g}"))
        panel.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        panel.set_xlabel(text)
    panels[0, 0].set_ylabel(label)
    figure.legend(*panel.get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, fontsize=9, frameon=False)
    return drawing_of(figure)


def draw_scheme_times(times):
    """{scheme: {number of particles: microseconds}}"""
    figure, panel = plt.subplots(figsize=(WIDTH, 4.2), constrained_layout=True)
    for number, (name, points) in enumerate(times.items()):
        panel.loglog(*zip(*sorted(points.items())), marker="osD^vX*Ph"[number % 9], ms=4, color=COLOURS[number % 9], lw=1.4, label=name)
    panel.set_xlabel("particles")
    panel.set_ylabel("one resampling (µs)")
    panel.legend(fontsize=9)
    return drawing_of(figure)
