"""Draws what evaluate_bag found: paths, beacons and landmarks, and the errors over time with their 3-sigma bands.

The data are those of evaluation/report.py: metres, radians, seconds.
"""
import os

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import EllipseCollection  # noqa: E402

TRUTH, ESTIMATE, DEAD_RECKONING, BEACON = "#222222", "#1667b7", "#c9662b", "#8a2be2"
LANDMARK, ALIGNED = "#0a8f5b", "#c2185b"


def numbers(values):
    """A list with nulls as an array with NaNs."""
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def window(values, margin=0.06):
    """Limits that hold the values with a margin."""
    low, high = np.min(values), np.max(values)
    margin *= max(high - low, 1e-3)
    return low - margin, high + margin


def draw_landmarks(axes, data):
    """True landmarks, estimated ones, their 2-sigma ellipses, and which is which. Many are drawn small."""
    true_ones, estimated = data["true_landmarks"], data["landmarks"]
    size = 1.0 if max(len(true_ones), len(estimated)) < 80 else 0.5
    if true_ones:
        axes.plot([mark["x"] for mark in true_ones], [mark["y"] for mark in true_ones], "x", color=TRUTH,
                  ms=8 * size, mew=1.5 * size, label="true landmarks", zorder=6)
    if not estimated:
        return
    for mine, true_one in data.get("map", {}).get("matches", []):
        ends = estimated[mine], true_ones[true_one]
        axes.plot([end["x"] for end in ends], [end["y"] for end in ends], color=LANDMARK, lw=0.9 * size, ls=":", zorder=4)
    squared, directions = np.linalg.eigh([[[xx, xy], [xy, yy]] for xx, xy, yy in (mark["covariance"] for mark in estimated)])
    short, long = 4.0 * np.sqrt(np.maximum(squared, 0.0)).T
    ellipses = EllipseCollection(
        long, short, np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1])), units="xy", transOffset=axes.transData,
        offsets=[(mark["x"], mark["y"]) for mark in estimated], facecolors=LANDMARK + "33",
        edgecolors=LANDMARK, linewidths=1.0, zorder=5)
    axes.add_collection(ellipses)
    axes.plot([mark["x"] for mark in estimated], [mark["y"] for mark in estimated], "o", color=LANDMARK,
              ms=3 if size == 1.0 else 2, mec="none", label="map, 2σ ellipses", zorder=7)
    if len(estimated) < 30:
        write_ids(axes, estimated, LANDMARK)


def draw_beacons(axes, beacons):
    if not beacons:
        return
    axes.plot([beacon["x"] for beacon in beacons], [beacon["y"] for beacon in beacons], "^", color=BEACON, ms=9,
              mec="white", label="beacons", zorder=6)
    write_ids(axes, beacons, BEACON)


def write_ids(axes, marks, color):
    for mark in marks:
        axes.annotate(str(mark["id"]), (mark["x"], mark["y"]), xytext=(7, 4), textcoords="offset points", color=color,
                      fontsize=9, zorder=6)


def set_window(axes, data, main, estimate):
    """Limits that hold the main path, the estimate and all marks. Dead reckoning may leave the picture: it does not set
    the scale."""
    marks = data["beacons"] + data["true_landmarks"] + data["landmarks"]
    x = np.concatenate([main["x"], estimate["x"], [mark["x"] for mark in marks]])
    y = np.concatenate([main["y"], estimate["y"], [mark["y"] for mark in marks]])
    x, y = x[np.isfinite(x)], y[np.isfinite(y)]
    dead_reckoning = data["dead_reckoning"]
    if dead_reckoning["x"]:
        # At most so much of the extent more to each side: a map is the subject where there is one.
        more = (0.1 if data["is_slam"] else 0.5) * max(np.ptp(x), np.ptp(y))
        x = np.append(x, np.clip(dead_reckoning["x"], x.min() - more, x.max() + more))
        y = np.append(y, np.clip(dead_reckoning["y"], y.min() - more, y.max() + more))
    axes.set_xlim(window(x))
    axes.set_ylim(window(y))


def width_of(path):
    """Of the lines of a drive that crosses itself often, as a share of the usual: they would hide one another."""
    x, y = path["x"][np.isfinite(path["x"])], path["y"][np.isfinite(path["y"])]
    extent = max(np.ptp(x), np.ptp(y), 1e-6) if len(x) else 1.0
    return np.clip(15.0 * extent / max(np.sum(np.hypot(np.diff(x), np.diff(y))), 1e-6), 0.35, 1.0)


def draw_paths(axes, data):
    truth, estimate, dead_reckoning = data["truth"], data["estimate"], data["dead_reckoning"]
    truth = {"x": numbers(truth["x"]), "y": numbers(truth["y"])}
    has_truth = len(truth["x"]) > 0
    estimate = {"x": numbers(estimate["x"]), "y": numbers(estimate["y"])}
    width = width_of(estimate)
    if dead_reckoning["x"]:
        axes.plot(dead_reckoning["x"], dead_reckoning["y"], color=DEAD_RECKONING, lw=width, alpha=0.5,
                  label="dead reckoning", zorder=1)
    if has_truth:
        axes.plot(truth["x"], truth["y"], color=TRUTH, lw=2.4 * width, alpha=0.55, label="truth", zorder=2)
    # Until the filter has had its time to converge, the estimate is only hinted at.
    errors = data.get("errors", {"time": [], "clipped": []})
    clipped = max([time for time, is_clipped in zip(errors["time"], errors["clipped"]) if is_clipped], default=-np.inf)
    begin = max(np.count_nonzero(np.array(data["estimate"]["time"]) <= clipped) - 1, 0)
    # The errors beside are drawn in the same colors, of the path as it was given out and laid on the truth.
    color = ALIGNED if data.get("aligned_errors") else ESTIMATE
    axes.plot(estimate["x"][: begin + 1], estimate["y"][: begin + 1], color=color, lw=0.9, ls=":", zorder=3)
    axes.plot(estimate["x"][begin:], estimate["y"][begin:], color=color, lw=1.2 * width, zorder=3,
              label="estimate, laid on the truth" if data["is_aligned"] else "estimate")
    main = truth if has_truth else estimate
    known = np.flatnonzero(np.isfinite(main["x"]))
    axes.plot(main["x"][known[0]], main["y"][known[0]], "o", color="white", mec=TRUTH, ms=7, label="start", zorder=8)
    axes.plot(main["x"][known[-1]], main["y"][known[-1]], "s", color=TRUTH, mec="white", ms=7, label="end", zorder=8)
    draw_beacons(axes, data["beacons"])
    draw_landmarks(axes, data)
    set_window(axes, data, main, {name: values[begin:] for name, values in estimate.items()})
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
    clipped = np.array(errors["clipped"], dtype=bool)
    if clipped.any() and not clipped.all():
        end = np.array(errors["time"])[~clipped][0]
        axes.axvspan(errors["time"][0], end, color="0.5", alpha=0.12, lw=0, zorder=0)


def limit_of(errors, error, band):
    """Half the height of a panel: the errors after the clipped part, and most of the band."""
    kept = ~np.array(errors["clipped"], dtype=bool)
    error, band = np.abs(error[kept]), band[kept]
    known = error[np.isfinite(error)]
    # A reference that is far off for a moment, as that of a satellite receiver, would hide the rest.
    largest = min(np.max(known), 3.0 * np.percentile(known, 99)) if len(known) else 0.0
    return 1.25 * max(largest, np.nanpercentile(band, 95) if len(band) else 0.0, 1e-3)


def draw_cartesian(axes, errors, dead_reckoning, aligned):
    time = np.array(errors["time"])
    error = numbers(errors["cartesian"])
    band = 3.0 * numbers(errors["position_sigma"])
    axes.fill_between(time, 0.0, band, color=ESTIMATE, alpha=0.18, lw=0, label="3σ of the filter")
    if dead_reckoning:
        axes.plot(dead_reckoning["time"], numbers(dead_reckoning["cartesian"]), color=DEAD_RECKONING,
                  lw=1.0, label="dead reckoning")
    axes.plot(time, error, color=ESTIMATE, lw=1.1, label="estimate as given" if aligned else "estimate")
    if aligned:
        axes.plot(aligned["time"], numbers(aligned["cartesian"]), color=ALIGNED, lw=1.1,
                  label="estimate, laid on the truth")
    top = limit_of(errors, error, band)
    axes.set_ylim(0.0, top)
    if errors["lost_error"] < top and not aligned:
        axes.axhline(errors["lost_error"], color="0.35", lw=0.9, ls=":", label="bound of being lost")
    axes.set_ylabel("Cartesian (m)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, fontsize=8, ncol=5, frameon=False)


def draw_signed(axes, errors, name, label, scale=1.0):
    time = np.array(errors["time"])
    error = scale * numbers(errors[name])
    band = 3.0 * scale * numbers(errors[name + "_sigma"])
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set_ylabel(label)
    if not np.isfinite(error).any():
        axes.text(0.5, 0.5, "not known: the truth has no heading", transform=axes.transAxes,
                  ha="center", va="center", color="0.4", fontsize=9)
        axes.set_yticks([])
        return
    axes.fill_between(time, -band, band, color=ESTIMATE, alpha=0.18, lw=0)
    axes.plot(time, error, color=ESTIMATE, lw=1.0)
    limit = limit_of(errors, error, band)
    axes.set_ylim(-limit, limit)


def summary(data):
    errors, dead_reckoning = data["errors"], data.get("dead_reckoning_errors")
    aligned, landmarks = data.get("aligned_errors"), data.get("map")
    text = f"mean Cartesian error {errors['mean']:.3g} m"
    if aligned:
        text += f", laid on the truth {aligned['mean']:.3g} m"
    elif data["is_aligned"]:
        text += ", laid on the truth"
    if dead_reckoning:
        text += f" (dead reckoning {dead_reckoning['mean']:.3g} m)"
    if landmarks and landmarks["rms_aligned"] is not None:
        text += f"   ·   map RMS {landmarks['rms']:.3g} m, laid on the truth {landmarks['rms_aligned']:.3g} m"
    if errors["coverage95"] is not None:
        text += f"   ·   truth in the 95 % region {100 * errors['coverage95']:.0f} % of the time"
    if data["is_aligned"]:
        return text
    if errors["lost"]:
        text += "   ·   LOST"
    elif errors["converged_after"] is not None:
        text += f"   ·   converged after {errors['converged_after']:.1f} s"
    return text


def draw(data):
    errors, dead_reckoning = data.get("errors"), data.get("dead_reckoning_errors")
    title = os.path.basename(data["title"])
    if not errors:
        figure = plt.figure(figsize=(8.5, 8.0), constrained_layout=True)
        axes, below = path_axes(figure, figure.add_gridspec(1, 1)[0])
        axes.grid(alpha=0.3)
        draw_paths(axes, data)
        draw_legend(axes, below)
        figure.suptitle(title + ": no ground truth", fontsize=12)
        return figure
    figure = plt.figure(figsize=(15.0, 8.0), constrained_layout=True)
    grid = figure.add_gridspec(4, 2, width_ratios=[1.0, 1.05], height_ratios=[1.5, 1.0, 1.0, 1.0])
    paths, below = path_axes(figure, grid[:, 0])
    panels = [figure.add_subplot(grid[0, 1])]
    panels += [figure.add_subplot(grid[row, 1], sharex=panels[0]) for row in (1, 2, 3)]
    draw_paths(paths, data)
    draw_legend(paths, below)
    draw_cartesian(panels[0], errors, dead_reckoning, data.get("aligned_errors"))
    draw_signed(panels[1], errors, "cross_track", "cross-track (m)")
    draw_signed(panels[2], errors, "along_track", "along-track (m)")
    draw_signed(panels[3], errors, "heading", "heading (°)", np.degrees(1.0))
    for axes in panels:
        shade_clipped(axes, errors)
        axes.tick_params(labelbottom=axes is panels[-1])
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time (s); shaded grey: left out of the figures" if any(errors["clipped"])
                          else "time (s)")
    for axes in [paths] + panels:
        axes.grid(alpha=0.3)
    figure.align_ylabels(panels)
    figure.suptitle(f"{title}\n{summary(data)}", fontsize=11)
    return figure
