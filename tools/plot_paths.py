"""Draws what evaluate_bag found: paths, beacons and landmarks, and the errors over time with their 3-sigma bands; `picture` is a
Picture of evaluation/report.py."""
import matplotlib
import numpy as np
from evaluation.paths import usual_gap

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import EllipseCollection  # noqa: E402

TRUTH, ESTIMATE, DEAD_RECKONING, BEACON = "#222222", "#1667b7", "#c9662b", "#8a2be2"
LANDMARK, ALIGNED = "#0a8f5b", "#c2185b"


MOST_POINTS = 20000  # that can be told apart in a picture


def every_of(count):
    return slice(None, None, 1 + count // MOST_POINTS)


def line_of(path, longest_gap=np.inf):
    """Rows x, y, time; a reference with gaps is a line with gaps."""
    if path is None:
        return np.zeros((3, 0))
    every = every_of(len(path))
    gaps = np.flatnonzero(np.append(0.0, np.diff(path.time))[every] > longest_gap)
    return np.insert(np.column_stack([path.pose[:, :2], path.time])[every], gaps, np.nan, axis=0).T


def series_of(errors, start):
    """The samples that are drawn, in seconds since the start."""
    every = every_of(len(errors.samples["time"]))
    series = {name: values[every] for name, values in errors.samples.items()}
    return dict(series, time=series["time"] - start)


def window(values, margin=0.06):
    """Limits that hold the values with a margin."""
    low, high = np.min(values), np.max(values)
    margin *= max(high - low, 1e-3)
    return low - margin, high + margin


def draw_landmarks(axes, picture):
    """True landmarks, estimated ones, their 2-sigma ellipses, and which is which. Many are drawn small."""
    true_ones, estimated = picture.run.true_map, picture.run.map
    size = 1.0 if max(len(true_ones or ()), len(estimated or ())) < 80 else 0.5
    if true_ones:
        axes.plot(*true_ones.position.T, "x", color=TRUTH, ms=8 * size, mew=1.5 * size, label="true landmarks", zorder=6)
    if not estimated:
        return
    for mine, true_one in picture.found.map[1] if picture.found and picture.found.map else ():
        axes.plot(*np.transpose([estimated.position[mine], true_ones.position[true_one]]), color=LANDMARK, lw=0.9 * size, ls=":",
                  zorder=4)
    squared, directions = np.linalg.eigh(estimated.covariance)
    short, long = 4.0 * np.sqrt(np.maximum(squared, 0.0)).T
    ellipses = EllipseCollection(
        long, short, np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1])), units="xy", transOffset=axes.transData,
        offsets=estimated.position, facecolors=LANDMARK + "33", edgecolors=LANDMARK, linewidths=1.0, zorder=5)
    axes.add_collection(ellipses)
    axes.plot(*estimated.position.T, "o", color=LANDMARK, ms=3 if size == 1.0 else 2, mec="none", label="map, 2σ ellipses", zorder=7)
    if len(estimated) < 30:
        write_ids(axes, estimated, LANDMARK)


def draw_beacons(axes, beacons):
    if len(beacons):
        axes.plot(*beacons.position.T, "^", color=BEACON, ms=9, mec="white", label="beacons", zorder=6)
        write_ids(axes, beacons, BEACON)


def write_ids(axes, marks, color):
    for number, place in zip(marks.id, marks.position):
        axes.annotate(str(number), place, xytext=(7, 4), textcoords="offset points", color=color, fontsize=9, zorder=6)


def set_window(axes, picture, main, estimate):
    """Limits that hold the main path, the estimate and all marks. Dead reckoning may leave the picture: it does not set
    the scale."""
    marks = [marks.position.T for marks in (picture.run.beacons, picture.run.true_map, picture.run.map) if marks]
    points = np.hstack([main[:2], estimate[:2], *marks])
    points = points[:, np.isfinite(points).all(axis=0)]
    if picture.run.dead_reckoning is not None:
        # At most so much of the extent more to each side: a map is the subject where there is one.
        more = (0.1 if picture.is_slam else 0.5) * np.ptp(points, axis=1).max()
        low, high = points.min(axis=1) - more, points.max(axis=1) + more
        points = np.hstack([points, np.clip(line_of(picture.run.dead_reckoning)[:2].T, low, high).T])
    axes.set_xlim(window(points[0]))
    axes.set_ylim(window(points[1]))


def width_of(line):
    """Of the lines of a drive that crosses itself often, as a share of the usual: they would hide one another."""
    x, y = line[:2, np.isfinite(line[0])]
    extent = max(np.ptp(x), np.ptp(y), 1e-6) if len(x) else 1.0
    return np.clip(15.0 * extent / max(np.sum(np.hypot(np.diff(x), np.diff(y))), 1e-6), 0.35, 1.0)


def draw_paths(axes, picture, errors, color):
    run, estimate = picture.run, line_of(picture.run.estimate)
    has_truth = run.truth is not None
    truth = line_of(run.truth, usual_gap(run.truth) if has_truth else np.inf)
    width = width_of(estimate)
    if run.dead_reckoning is not None:
        axes.plot(*line_of(run.dead_reckoning)[:2], color=DEAD_RECKONING, lw=width, alpha=0.5, label="dead reckoning", zorder=1)
    if has_truth:
        axes.plot(*truth[:2], color=TRUTH, lw=2.4 * width, alpha=0.55, label="truth", zorder=2)
    # Until the filter has had its time to converge, the estimate is only hinted at.
    clipped = errors["time"][errors["clipped"]] if errors else []
    begin = max(np.count_nonzero(estimate[2] - picture.start() <= max(clipped, default=-np.inf)) - 1, 0)
    axes.plot(*estimate[:2, :begin + 1], color=color, lw=0.9, ls=":", zorder=3)
    axes.plot(*estimate[:2, begin:], color=color, lw=1.2 * width, zorder=3,
              label="estimate, laid on the truth" if picture.is_aligned else "estimate")
    main = truth if has_truth else estimate
    known = np.flatnonzero(np.isfinite(main[0]))
    axes.plot(*main[:2, known[0]], "o", color="white", mec=TRUTH, ms=7, label="start", zorder=8)
    axes.plot(*main[:2, known[-1]], "s", color=TRUTH, mec="white", ms=7, label="end", zorder=8)
    draw_beacons(axes, run.beacons)
    draw_landmarks(axes, picture)
    set_window(axes, picture, main, estimate[:, begin:])
    axes.set_aspect("equal", adjustable="box" if has_truth else "datalim")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def path_axes(figure, place):
    """Axes for the paths, and axes below that take the legend, so that it covers nothing."""
    parts = place.subgridspec(2, 1, height_ratios=[12.0, 1.0])
    below = figure.add_subplot(parts[1])
    below.axis("off")
    return figure.add_subplot(parts[0]), below


def draw_legend(axes, below):
    legend = below.legend(*axes.get_legend_handles_labels(), loc="center", fontsize=9, ncol=4, frameon=False)
    legend.set_in_layout(False)  # a wide one would make the paths narrow


def shade_clipped(axes, errors):
    clipped = errors["clipped"]
    if clipped.any() and not clipped.all():
        axes.axvspan(errors["time"][0], errors["time"][~clipped][0], color="0.5", alpha=0.12, lw=0, zorder=0)


def limit_of(errors, error, band):
    """Half the height of a panel: the errors after the clipped part, and most of the band."""
    error, band = np.abs(error[~errors["clipped"]]), band[~errors["clipped"]]
    known = error[np.isfinite(error)]
    # A reference that is far off for a moment, as that of a satellite receiver, would hide the rest.
    largest = min(np.max(known), 3.0 * np.percentile(known, 99)) if len(known) else 0.0
    return 1.25 * max(largest, np.nanpercentile(band, 95) if len(band) else 0.0, 1e-3)


def draw_cartesian(axes, picture, errors):
    aligned = picture.aligned_errors
    band = 3.0 * errors["position_sigma"]
    axes.fill_between(errors["time"], 0.0, band, color=ESTIMATE, alpha=0.18, lw=0, label="3σ of the filter")
    lines = [(picture.found.dead_reckoning, DEAD_RECKONING, 1.0, "dead reckoning"),
             (picture.found.errors, ESTIMATE, 1.1, "estimate as given" if aligned else "estimate"),
             (aligned, ALIGNED, 1.1, "estimate, laid on the truth")]
    for of_line, color, width, label in lines:
        if of_line:
            series = series_of(of_line, picture.start())
            axes.plot(series["time"], series["cartesian"], color=color, lw=width, label=label)
    top, lost_error = limit_of(errors, errors["cartesian"], band), picture.found.errors.figures["lost_error"]
    axes.set_ylim(0.0, top)
    if lost_error < top and not aligned:
        axes.axhline(lost_error, color="0.35", lw=0.9, ls=":", label="bound of being lost")
    axes.set_ylabel("Cartesian (m)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, fontsize=8, ncol=5, frameon=False)


def draw_signed(axes, errors, name, label, scale=1.0):
    error, band = scale * errors[name], 3.0 * scale * errors[name + "_sigma"]
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set_ylabel(label)
    if not np.isfinite(error).any():
        axes.text(0.5, 0.5, "not known: the truth has no heading", transform=axes.transAxes,
                  ha="center", va="center", color="0.4", fontsize=9)
        axes.set_yticks([])
        return
    axes.fill_between(errors["time"], -band, band, color=ESTIMATE, alpha=0.18, lw=0)
    axes.plot(errors["time"], error, color=ESTIMATE, lw=1.0)
    limit = limit_of(errors, error, band)
    axes.set_ylim(-limit, limit)


def summary(picture):
    def mean(errors):
        return f"{errors.figures['cartesian']['mean']:.3g} m"

    found, figures = picture.found, picture.found.errors.figures
    text = f"mean Cartesian error {mean(found.errors)}"
    if picture.aligned_errors:
        text += f", laid on the truth {mean(picture.aligned_errors)}"
    elif picture.is_aligned:
        text += ", laid on the truth"
    if found.dead_reckoning:
        text += f" (dead reckoning {mean(found.dead_reckoning)})"
    if found.map and found.map[0]["rms_aligned"] is not None:
        text += f"   ·   map RMS {found.map[0]['rms']:.3g} m, laid on the truth {found.map[0]['rms_aligned']:.3g} m"
    if figures["coverage95"] is not None:
        text += f"   ·   truth in the 95 % region {100 * figures['coverage95']:.0f} % of the time"
    if picture.is_aligned:
        return text
    if figures["lost"]:
        text += "   ·   LOST"
    elif figures["converged_after"] is not None:
        text += f"   ·   converged after {figures['converged_after']:.1f} s"
    return text


def draw(picture):
    if not picture.found:
        figure = plt.figure(figsize=(8.5, 8.0), constrained_layout=True)
        axes, below = path_axes(figure, figure.add_gridspec(1, 1)[0])
        axes.grid(alpha=0.3)
        draw_paths(axes, picture, None, ESTIMATE)
        draw_legend(axes, below)
        figure.suptitle(picture.title + ": no ground truth", fontsize=12)
        return figure
    errors = series_of(picture.found.errors, picture.start())
    figure = plt.figure(figsize=(15.0, 8.0), constrained_layout=True)
    grid = figure.add_gridspec(4, 2, width_ratios=[1.0, 1.05], height_ratios=[1.5, 1.0, 1.0, 1.0])
    paths, below = path_axes(figure, grid[:, 0])
    panels = [figure.add_subplot(grid[0, 1])]
    panels += [figure.add_subplot(grid[row, 1], sharex=panels[0]) for row in (1, 2, 3)]
    # The errors beside are drawn in the same colors, of the path as it was given out and laid on the truth.
    draw_paths(paths, picture, errors, ALIGNED if picture.aligned_errors else ESTIMATE)
    draw_legend(paths, below)
    draw_cartesian(panels[0], picture, errors)
    draw_signed(panels[1], errors, "cross_track", "cross-track (m)")
    draw_signed(panels[2], errors, "along_track", "along-track (m)")
    draw_signed(panels[3], errors, "heading", "heading (°)", np.degrees(1.0))
    for axes in panels:
        shade_clipped(axes, errors)
        axes.tick_params(labelbottom=axes is panels[-1])
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time (s); shaded grey: left out of the figures" if any(errors["clipped"]) else "time (s)")
    for axes in [paths] + panels:
        axes.grid(alpha=0.3)
    figure.align_ylabels(panels)
    figure.suptitle(f"{picture.title}\n{summary(picture)}", fontsize=11)
    return figure
