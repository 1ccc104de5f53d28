#!/usr/bin/python3
"""Draws what evaluate_bag found: paths and beacons, and the errors over time with their 3-sigma bands.

    plot_paths.py data.json picture.png

data.json is written by evaluate_bag (tools/common/plot_paths.cpp): metres, radians, seconds.
"""

import json
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
    from matplotlib.collections import EllipseCollection
except ImportError as error:
    sys.exit(f"{error.name} is missing: sudo apt-get install python3-matplotlib")

TRUTH, ESTIMATE, DEAD_RECKONING, BEACON = "#222222", "#1667b7", "#c9662b", "#8a2be2"
LANDMARK = "#0a8f5b"


def numbers(values):
    """A list with nulls as an array with NaNs."""
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def window(values, margin=0.06):
    """Limits that hold the values with a margin."""
    low, high = np.min(values), np.max(values)
    margin *= max(high - low, 1e-3)
    return low - margin, high + margin


def draw_landmarks(axes, data):
    """True landmarks, estimated ones and their 95 % ellipses. Many are drawn small."""
    true_ones, estimated = data["true_landmarks"], data["landmarks"]
    size = 1.0 if max(len(true_ones), len(estimated)) < 80 else 0.5
    if true_ones:
        axes.plot([mark["x"] for mark in true_ones], [mark["y"] for mark in true_ones], "+", color=TRUTH,
                  ms=11 * size, mew=1.6 * size, label="true landmarks", zorder=7)
    if not estimated:
        return
    ellipses = EllipseCollection(
        [2.0 * mark["long"] for mark in estimated], [2.0 * mark["short"] for mark in estimated],
        [np.degrees(mark["angle"]) for mark in estimated], units="xy", transOffset=axes.transData,
        offsets=[(mark["x"], mark["y"]) for mark in estimated], facecolors=LANDMARK + "33",
        edgecolors=LANDMARK, linewidths=1.0, zorder=4)
    axes.add_collection(ellipses)
    axes.plot([mark["x"] for mark in estimated], [mark["y"] for mark in estimated], "o", color=LANDMARK,
              ms=4 * size, mec="white", mew=0.4, label="map, 95 % ellipses", zorder=6)


def draw_paths(axes, data):
    """Paths and beacons. Dead reckoning may leave the picture: it does not set the scale."""
    truth, estimate, dead_reckoning = data["truth"], data["estimate"], data["dead_reckoning"]
    truth = {"x": numbers(truth["x"]), "y": numbers(truth["y"])}
    if dead_reckoning["x"]:
        axes.plot(dead_reckoning["x"], dead_reckoning["y"], color=DEAD_RECKONING, lw=1.0, alpha=0.65,
                  label="dead reckoning", zorder=1)
    if len(truth["x"]):
        axes.plot(truth["x"], truth["y"], color=TRUTH, lw=2.4, alpha=0.35, label="truth", zorder=2)
    # Until the filter has had its time to converge, the estimate is only hinted at.
    begin = max(data["clipped_points"] - 1, 0)
    axes.plot(estimate["x"][: begin + 1], estimate["y"][: begin + 1], color=ESTIMATE, lw=0.9, ls=":", zorder=3)
    axes.plot(estimate["x"][begin:], estimate["y"][begin:], color=ESTIMATE, lw=1.1, label="estimate", zorder=3)
    start = truth if len(truth["x"]) else estimate
    axes.plot(start["x"][0], start["y"][0], "o", color="white", mec=TRUTH, ms=7, label="start", zorder=5)
    if data["beacons"]:
        x = [beacon["x"] for beacon in data["beacons"]]
        y = [beacon["y"] for beacon in data["beacons"]]
        axes.plot(x, y, "^", color=BEACON, ms=9, mec="white", label="beacons", zorder=6)
        for beacon in data["beacons"]:
            axes.annotate(str(beacon["id"]), (beacon["x"], beacon["y"]), xytext=(7, 4),
                          textcoords="offset points", color=BEACON, fontsize=9, zorder=6)
    draw_landmarks(axes, data)
    inside = [start] if len(truth["x"]) else [estimate]
    marks = data["beacons"] + data["true_landmarks"]
    x = np.concatenate([path["x"] for path in inside] + [[mark["x"] for mark in marks]])
    y = np.concatenate([path["y"] for path in inside] + [[mark["y"] for mark in marks]])
    x, y = x[np.isfinite(x)], y[np.isfinite(y)]
    if dead_reckoning["x"]:
        # At most half as much again to each side for dead reckoning.
        half = 0.5 * max(np.ptp(x), np.ptp(y))
        x = np.append(x, np.clip(dead_reckoning["x"], x.min() - half, x.max() + half))
        y = np.append(y, np.clip(dead_reckoning["y"], y.min() - half, y.max() + half))
    axes.set_xlim(window(x))
    axes.set_ylim(window(y))
    axes.set_aspect("equal", adjustable="datalim" if not len(truth["x"]) else "box")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    if data["landmarks"] or data["true_landmarks"]:  # all over the picture: the legend goes above it
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.01), borderaxespad=0.0, fontsize=9, ncol=3)
    else:
        axes.legend(loc="best", fontsize=9, framealpha=0.9)


def shade_clipped(axes, errors):
    clipped = np.array(errors["clipped"], dtype=bool)
    if clipped.any() and not clipped.all():
        end = np.array(errors["time"])[~clipped][0]
        axes.axvspan(errors["time"][0], end, color="0.5", alpha=0.12, lw=0, zorder=0)


def limit_of(errors, error, band):
    """Half the height of a panel: all errors after the clipped part, and most of the band."""
    kept = ~np.array(errors["clipped"], dtype=bool)
    error, band = np.abs(error[kept]), band[kept]
    largest = np.nanmax(error) if np.isfinite(error).any() else 0.0
    return 1.25 * max(largest, np.nanpercentile(band, 95) if len(band) else 0.0, 1e-3)


def draw_cartesian(axes, errors, dead_reckoning):
    time = np.array(errors["time"])
    error = numbers(errors["cartesian"])
    band = 3.0 * numbers(errors["position_sigma"])
    axes.fill_between(time, 0.0, band, color=ESTIMATE, alpha=0.18, lw=0, label="3σ of the filter")
    if dead_reckoning:
        axes.plot(dead_reckoning["time"], numbers(dead_reckoning["cartesian"]), color=DEAD_RECKONING,
                  lw=1.0, label="dead reckoning")
    axes.plot(time, error, color=ESTIMATE, lw=1.1, label="estimate")
    top = limit_of(errors, error, band)
    axes.set_ylim(0.0, top)
    if errors["lost_error"] < top:
        axes.axhline(errors["lost_error"], color="0.35", lw=0.9, ls=":", label="bound of being lost")
    axes.set_ylabel("Cartesian (m)")
    axes.legend(loc="upper right", fontsize=8, ncol=4, framealpha=0.9)


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


def summary(errors, dead_reckoning):
    text = f"mean Cartesian error {errors['mean']:.3g} m"
    if dead_reckoning:
        text += f" (dead reckoning {dead_reckoning['mean']:.3g} m)"
    if errors["coverage95"] is not None:
        text += f"   ·   truth in the 95 % region {100 * errors['coverage95']:.0f} % of the time"
    if errors["lost"]:
        text += "   ·   LOST"
    elif errors["converged_after"] is not None:
        text += f"   ·   converged after {errors['converged_after']:.1f} s"
    return text


def draw(data):
    errors, dead_reckoning = data.get("errors"), data.get("dead_reckoning_errors")
    title = os.path.basename(data["title"])
    if not errors:
        figure, axes = plt.subplots(figsize=(8.5, 8.0), constrained_layout=True)
        axes.grid(alpha=0.3)
        draw_paths(axes, data)
        axes.set_title(title + ": no ground truth")
        return figure
    figure = plt.figure(figsize=(15.0, 8.0), constrained_layout=True)
    grid = figure.add_gridspec(4, 2, width_ratios=[1.0, 1.05], height_ratios=[1.5, 1.0, 1.0, 1.0])
    paths = figure.add_subplot(grid[:, 0])
    panels = [figure.add_subplot(grid[0, 1])]
    panels += [figure.add_subplot(grid[row, 1], sharex=panels[0]) for row in (1, 2, 3)]
    draw_paths(paths, data)
    draw_cartesian(panels[0], errors, dead_reckoning)
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
    figure.suptitle(f"{title}\n{summary(errors, dead_reckoning)}", fontsize=12)
    return figure


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: plot_paths.py data.json picture.png")
    with open(sys.argv[1], encoding="utf-8") as file:
        data = json.load(file)
    picture = sys.argv[2]
    figure = draw(data)
    ending = os.path.splitext(picture)[1][1:]
    part = f"{picture}.part{os.getpid()}"
    try:
        figure.savefig(part, dpi=130, format=ending)
        os.replace(part, picture)
    except OSError as error:
        sys.exit(f"cannot be written: {error.strerror}")
    finally:
        if os.path.exists(part):
            os.remove(part)


if __name__ == "__main__":
    main()
