"""What evaluate_bag found, as figures (JSON), as text, and as what plot_paths draws."""
import os
from dataclasses import dataclass, replace
from typing import Iterable, Optional

import numpy as np

from . import maps
from .paths import LOST_HEADING, THREE_SIGMA_SQUARED, PathErrors, evaluate_path, moved
from .recorded_run import RecordedRun


def plain(value):
    """Of what is in figures, without arrays; what is not finite is None."""
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(each) for each in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value


def health_of(said, errors):
    """What the filter said of its health, beside the truth: of the true poses that have an estimate, each with what was said
    last before; None if nothing was."""
    if not said:
        return None
    kept = ~errors.samples["clipped"]
    last = np.searchsorted([each[0] for each in said], errors.samples["time"][kept], side="right") - 1
    names = np.array([each[1] for each in said])[last]
    names = np.where(last < 0, "starting", names)
    places = np.where(last < 0, 0, np.array([each[2] for each in said])[last])
    is_wrong = ~(errors.samples["normalized_squared"][kept] <= THREE_SIGMA_SQUARED)[names == "healthy"]
    return {"shares": {str(name): np.mean(names == name) for name in np.unique(names)},
            # Of the time it said healthy: with the truth outside the 3-sigma ellipse of the position.
            "wrong_when_healthy": np.mean(is_wrong) if len(is_wrong) and errors.figures["coverage_3sigma"] is not None else None,
            "several_places": np.mean(places > 1)}


def number(value, decimals=3):
    return "-" if value is None else f"{value:.{decimals}f}"


def metres(value):
    return "-" if value is None else f"{value:.3f} m"


def percent(share):
    return "-" if share is None else f"{100 * share:.1f} %"


def heading_of(bag, figures, map_file):
    clip = f", the first {100 * figures['clip']:g} % left out" if figures["clip"] else ""
    text = f"{bag}: {figures['truth_poses']} true poses in {figures['duration']:.1f} s{clip}; errors are absolute values\n"
    if figures["frame"] != "given":
        how = "at the first true pose" if figures["frame"] == "start" else "by the best rigid fit"
        text += f"  (the filter has a frame of its own, aligned with the truth {how})\n"
    elif map_file:
        text += f"  (the frame is that of the loaded map, {map_file}; if that is not the truth's: --frame fit)\n"
    return text


def table_of(figures, is_slam):
    rows = [("cross-track (m)", "cross_track"), ("along-track (m)", "along_track"), ("Cartesian (m)", "cartesian"),
            ("heading (rad)", "heading")] + [("Cartesian, aligned (m)", "cartesian_aligned")] * is_slam
    parts = [each for each in (figures["estimate"], figures["dead_reckoning"]) if each]
    cells = [["", "estimate mean", "max", "std", "dead reckoning mean", "max", "std"][:1 + 3 * len(parts)]]
    cells += [[title] + [number(part[name][column]) for part in parts for column in ("mean", "max", "std")]
              for title, name in rows]
    widths = "<22", ">13", ">7", ">7", ">19", ">7", ">7"
    return "".join("  " + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths)) + "\n" for row in cells)


def belief_of(figures, is_slam):
    """(name, text) of whether the filter's own confidence is right, and how well it keeps to the truth."""
    estimate = figures["estimate"]
    yield ("truth inside the filter's own 95 % region:",
           f"{percent(estimate['coverage95'])} of the time (with heading: {percent(estimate['coverage95_pose'])})")
    yield "truth inside its 3-sigma region:", f"{percent(estimate['coverage_3sigma'])} of the time"
    # A map's own frame may lie askew, and before its first loop is closed a robot cannot know.
    if figures["frame"] == "given":
        after = estimate["converged_after"]
        yield ("time to converge:", ("never" if after is None else f"{after:.1f} s") +
               f" (errors stay below {figures['lost_error']:.2f} m and {np.degrees(LOST_HEADING):.0f} degrees)")
        yield ("lost:", f"{'yes' if estimate['lost'] else 'no'} "
               f"(error above that {percent(estimate['lost_share'])} of the time)")
    if estimate["uncovered"]:
        yield "true poses without an estimate:", f"{estimate['uncovered']} of {figures['truth_poses']}"
    if is_slam:
        yield ("median distance to the truth:", f"{metres(estimate['cartesian']['median'])}, "
               f"aligned {metres(estimate['cartesian_aligned']['median'])}")
    if "path_aligned" in estimate:
        path = estimate["path_aligned"]
        yield "the path as believed at the end, aligned:", f"mean {metres(path['mean'])}, max {metres(path['max'])}"


def map_lines(found):
    landmarks = f"{found['landmarks']} landmark" + "s" * (found["landmarks"] != 1)
    yield "", (f"map: {landmarks}, {found['matched']} of {found['matched'] + found['missed']} true ones found "
               f"(by {found['matched_by']}), {found['false_landmarks']} false")
    yield "map's RMS error:", f"{metres(found['rms'])}, aligned {metres(found['rms_aligned'])}"
    if found["coverage95"] is not None:
        yield ("true landmarks inside their 95 % ellipses:",
               f"{percent(found['coverage95'])} (NEES {number(found['normalized_error'], 1)}, 2 if consistent)")


def filter_lines(summary, findings):
    yield "", (f"{summary['particles']} particles: effective {summary['mean_effective_sample_size']:.1f} on average, distinct "
               f"ancestors {summary['mean_distinct_ancestors_of_renewal']:.1f} per renewal, "
               f"{summary['distinct_ancestors_since_start']} since the start")
    yield "updates / renewals of the population:", f"{summary['updates']} / {summary['renewals']}"
    for each in findings:
        yield "", f"found: {each['text']} ({percent(each['probability'])})"


def health_lines(health):
    shares = sorted(((share, name) for name, share in health["shares"].items()), reverse=True)
    yield "health as reported by the filter:", ", ".join(f"{name} {percent(share)}" for share, name in shares)
    if health["wrong_when_healthy"] is not None:
        yield "healthy, but truth outside 3-sigma region:", f"{percent(health['wrong_when_healthy'])} of that time"
    if health["several_places"] > 0:
        yield "several places fitted (status.hypotheses):", percent(health["several_places"])


def batch_lines(batch):
    found, radios = batch["map"], batch["ranges"]
    # Ranges say where the path lies; where landmarks have it is chance.
    where = f"{metres(batch['cartesian']['mean'])}, " if radios else ""
    yield ("batch solution of the same data:", f"path {where}aligned {metres(batch['cartesian_aligned']['mean'])}" +
           (f", map aligned {metres(found['rms_aligned'])}" if found else "") +
           ("; ids: those of the filter's landmarks" if batch["ids"] == "filter" else ""))
    yield ("filter error over batch error (aligned):", f"path {number(batch['path_ratio'], 2)}, poses as given "
           f"{number(batch['online_ratio'], 2)}" + (f", map {batch['map_ratio']:.2f}" if batch["map_ratio"] is not None else ""))
    if radios:
        each = "".join(f" {radio['beacon']}: {radio['scale']:.3f} d {radio['bias']:+.2f} m;" for radio in radios["radios"])
        yield "", (f"it found: ranges to {metres(radios['sigma'])}, odometry's noise x {radios['translation_factor']:.2f} "
                   f"(distance), x {radios['heading_factor']:.2f} (heading);{each} yaw rate {radios['yaw_rate_bias']:+.1e} rad/s, "
                   f"distance x {batch['distance_scale']:.3f}")
        for remark in radios["remarks"]:
            yield "", remark + "."
    for line in batch["left_out"]:
        yield "", line
    if "online" in batch:
        online = batch["online"]
        yield (f"on-line bound ({online['solutions']} solutions, {online['refused']} refused):",
               f"as given {metres(online['cartesian']['mean'])}, aligned {metres(online['cartesian_aligned']['mean'])}")
        yield ("filter error over the on-line bound:",
               f"as given {number(online['ratio'], 2)}, aligned {number(online['aligned_ratio'], 2)}")


def text_of(bag, figures, run):
    is_slam = run.map is not None
    lines = list(belief_of(figures, is_slam))
    for name, lines_of in (("map", map_lines), ("health", health_lines), ("batch", batch_lines)):
        if name == "health" and run.summary:
            lines += filter_lines(figures["filter"], figures["findings"])
        if name in figures:
            lines += lines_of(figures[name])
    return (heading_of(bag, figures, run.map_file) + "\n" + table_of(figures, is_slam) + "\n" +
            "".join(f"  {name:42} {text}\n" if name else f"  {text}\n" for name, text in lines))


@dataclass
class Picture:
    """What plot_paths draws: a run, and what evaluate_bag found of it."""
    title: str
    run: RecordedRun
    errors: Optional[PathErrors] = None  # None: there is no truth
    dead_reckoning: Optional[PathErrors] = None
    matches: Iterable = ()  # of the map, with the true one
    estimate: str = "estimate"  # what it is called

    def start(self):
        return (self.run.truth or self.run.estimate).time[0]


def picture_of(bag, run, found=None, clip=0.0):
    """Where there is no truth, of the paths alone."""
    picture = Picture(os.path.basename(os.fsencode(bag).decode("utf-8", "replace")), run)
    if not found:
        picture.title += ": no ground truth"
        return picture
    picture.errors, picture.dead_reckoning = found.errors, found.dead_reckoning
    if found.map:
        picture.matches = found.map[1]
    if run.map is not None and found.frame != "given":
        # Where the frame lies is chance: the shapes of path and map are what a picture can show. The map by its own
        # alignment: a path of poses as they were estimated at the time need not lie where the map has come to lie since.
        alignment = found.alignment if found.map is None or found.map[2] is None else found.map[2]
        picture.run = replace(run, estimate=moved(run.estimate, found.alignment), map=maps.moved(run.map, alignment))
        picture.errors, picture.estimate = evaluate_path(run.truth, picture.run.estimate, clip), "estimate, laid on the truth"
    errors = [(picture.estimate, picture.errors)] + [("dead reckoning", found.dead_reckoning)] * bool(found.dead_reckoning)
    picture.title += "\nmean Cartesian error: " + "; ".join(f"{name} {each.figures['cartesian']['mean']:.3g} m" for name, each in errors)
    return picture
