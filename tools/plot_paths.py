"""Draws what evaluate_bag found: paths, beacons and landmarks, and the errors over time with their 3-sigma bands; `picture` is a
Picture of evaluation/report.py."""
import matplotlib
import numpy as np
from evaluation.paths import usual_gap

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import EllipseCollection  # noqa: E402

TRUTH, ESTIMATE, DEAD_RECKONING, BEACON, LANDMARK = "#222222", "#1667b7", "#c9662b", "#8a2be2", "#0a8f5b"
MOST_POINTS = 20000  # that can be told apart in a picture


def every_of(count):
    return slice(None, None, 1 + count // MOST_POINTS)


def line_of(path, longest_gap=np.inf):
    """Rows x, y, time; a reference with gaps is a line with gaps."""
    every = every_of(len(path))
    gaps = np.flatnonzero(np.append(0.0, np.diff(path.time))[every] > longest_gap)
    return np.insert(np.column_stack([path.pose[:, :2], path.time])[every], gaps, np.nan, axis=0).T


def series_of(errors, start):
    """The samples that are drawn, in seconds since the start."""
    every = every_of(len(errors.samples["time"]))
    series = {name: values[every] for name, values in errors.samples.items()}
    return dict(series, time=series["time"] - start)


def draw_landmarks(axes, picture):
    """True landmarks, estimated ones, their 2-sigma ellipses, and which is which."""
    true_ones, estimated = picture.run.true_map, picture.run.map
    if true_ones:
        axes.plot(*true_ones.position.T, "x", color=TRUTH, ms=6, mew=1.0, label="true landmarks", zorder=6)
    if not estimated:
        return
    for mine, true_one in picture.matches:
        axes.plot(*np.transpose([estimated.position[mine], true_ones.position[true_one]]), color=LANDMARK, lw=0.7, ls=":", zorder=4)
    squared, directions = np.linalg.eigh(estimated.covariance)
    short, long = 4.0 * np.sqrt(np.maximum(squared, 0.0)).T
    ellipses = EllipseCollection(
        long, short, np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1])), units="xy", transOffset=axes.transData,
        offsets=estimated.position, facecolors=LANDMARK + "33", edgecolors=LANDMARK, linewidths=1.0, zorder=5)
    axes.add_collection(ellipses, autolim=False)
    draw_marks(axes, estimated, "o", LANDMARK, 3, "map, 2σ ellipses")


def draw_marks(axes, marks, marker, color, size, label):
    axes.plot(*marks.position.T, marker, color=color, ms=size, mec="none", label=label, zorder=7)
    for number, place in zip(marks.id, marks.position) if len(marks) < 30 else ():
        axes.annotate(str(number), place, xytext=(7, 4), textcoords="offset points", color=color, fontsize=9, zorder=6)


def draw_paths(axes, picture, errors):
    run, estimate = picture.run, line_of(picture.run.estimate)
    if run.truth:
        axes.plot(*line_of(run.truth, usual_gap(run.truth))[:2], color=TRUTH, lw=2.0, alpha=0.55, label="truth", zorder=2)
    clipped = errors["time"][errors["clipped"]] if errors else []
    begin = max(np.count_nonzero(estimate[2] - picture.start() <= max(clipped, default=-np.inf)) - 1, 0)
    axes.plot(*estimate[:2, begin:], color=ESTIMATE, lw=0.9, zorder=3, label=picture.estimate)
    main = line_of(run.truth or run.estimate)
    axes.plot(*main[:2, 0], "o", color="white", mec=TRUTH, ms=7, label="start", zorder=8)
    axes.plot(*main[:2, -1], "s", color=TRUTH, mec="white", ms=7, label="end", zorder=8)
    if len(run.beacons):
        draw_marks(axes, run.beacons, "^", BEACON, 9, "beacons")
    draw_landmarks(axes, picture)
    axes.set_aspect("equal", adjustable="box" if run.truth else "datalim")
    axes.margins(0.2 if run.dead_reckoning else 0.06)
    axes.autoscale_view()
    axes.autoscale(False)  # what follows may leave the picture
    # Until the filter has had its time to converge, the estimate is only hinted at.
    axes.plot(*estimate[:2, :begin + 1], color=ESTIMATE, lw=0.9, ls=":", zorder=3)
    if run.dead_reckoning:
        axes.plot(*line_of(run.dead_reckoning)[:2], color=DEAD_RECKONING, lw=0.9, alpha=0.5, label="dead reckoning", zorder=1)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), fontsize=9, ncol=4, frameon=False)


def limit_of(errors, error, band):
    """Half the height of a panel: the errors after the clipped part, and most of the band."""
    error, band = np.abs(error[~errors["clipped"]]), band[~errors["clipped"]]
    known = error[np.isfinite(error)]
    # A reference that is far off for a moment, as that of a satellite receiver, would hide the rest.
    largest = min(np.max(known), 3.0 * np.percentile(known, 99)) if len(known) else 0.0
    return 1.25 * max(largest, np.nanpercentile(band, 95) if len(band) else 0.0, 1e-3)


def draw_cartesian(axes, picture, errors):
    band = 3.0 * errors["position_sigma"]
    axes.fill_between(errors["time"], 0.0, band, color=ESTIMATE, alpha=0.18, lw=0, label="3σ of the filter")
    if picture.dead_reckoning:
        series = series_of(picture.dead_reckoning, picture.start())
        axes.plot(series["time"], series["cartesian"], color=DEAD_RECKONING, lw=1.0, label="dead reckoning")
    axes.plot(errors["time"], errors["cartesian"], color=ESTIMATE, lw=1.1, label=picture.estimate)
    axes.set_ylim(0.0, limit_of(errors, errors["cartesian"], band))
    axes.set_ylabel("Cartesian (m)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, fontsize=8, ncol=3, frameon=False)


def draw_signed(axes, errors, name, label, scale=1.0):
    error, band = scale * errors[name], 3.0 * scale * errors[name + "_sigma"]
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set_ylabel(label)
    axes.fill_between(errors["time"], -band, band, color=ESTIMATE, alpha=0.18, lw=0)
    axes.plot(errors["time"], error, color=ESTIMATE, lw=1.0)  # nothing, where the truth has no heading
    limit = limit_of(errors, error, band)
    axes.set_ylim(-limit, limit)


def draw(picture):
    if not picture.errors:
        figure, paths = plt.subplots(figsize=(8.5, 8.0), constrained_layout=True)
        paths.grid(alpha=0.3)
        draw_paths(paths, picture, None)
        figure.suptitle(picture.title, fontsize=12)
        return figure
    errors = series_of(picture.errors, picture.start())
    figure = plt.figure(figsize=(15.0, 8.0), constrained_layout=True)
    grid = figure.add_gridspec(4, 2, width_ratios=[1.0, 1.05], height_ratios=[1.5, 1.0, 1.0, 1.0])
    paths, panels = figure.add_subplot(grid[:, 0]), [figure.add_subplot(grid[0, 1])]
    panels += [figure.add_subplot(grid[row, 1], sharex=panels[0]) for row in (1, 2, 3)]
    draw_paths(paths, picture, errors)
    draw_cartesian(panels[0], picture, errors)
    draw_signed(panels[1], errors, "cross_track", "cross-track (m)")
    draw_signed(panels[2], errors, "along_track", "along-track (m)")
    draw_signed(panels[3], errors, "heading", "heading (°)", np.degrees(1.0))
    clipped = errors["clipped"]
    for axes in panels:
        if clipped.any() and not clipped.all():
            axes.axvspan(errors["time"][0], errors["time"][~clipped][0], color="0.5", alpha=0.12, lw=0, zorder=0)
        axes.tick_params(labelbottom=axes is panels[-1])
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time (s); shaded grey: left out of the figures" if any(clipped) else "time (s)")
    for axes in [paths] + panels:
        axes.grid(alpha=0.3)
    figure.align_ylabels(panels)
    figure.suptitle(picture.title, fontsize=11)
    return figure
