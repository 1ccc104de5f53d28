"""The least-squares solution of the same data (solve_drive), judged as the estimate is."""
import numpy as np
from filter_setup import Setup

from .drive import drive_of, solution_of
from .maps import Map, evaluate_map
from .maps import moved as moved_map
from .paths import Path, compose, evaluate_aligned_path, evaluate_path, inverse, moved, path_of_place
from .recorded_run import RecordedBag


def path_from(columns, place):
    pose = np.column_stack([columns[name] for name in ("x", "y", "heading")])
    return path_of_place(Path(np.array(columns["time"]), pose), place)


def ratio(value, by):
    return value / by if value is not None and by else None


def compare(given, run, found, truth_of_path, choose_frame):
    """Figures; `found` of the estimate, `truth_of_path` the truth at the stamps of the path as it was believed at the end."""
    drive = drive_of(RecordedBag(given.bag), given, Setup())
    solution = solution_of(drive, given.batch_online)
    estimate, clip, radios = found.figures["estimate"], given.clip, solution["ranges"]

    def judged(columns):
        """A path, what brings it to the truth's frame, which is that of the beacons, what fits it best, and its errors."""
        path, wanted = path_from(columns, run.place), "start" if found.frame == "given" else found.frame
        alignment = np.zeros(3) if radios else choose_frame(wanted, run, path, clip)[1]
        fit, aligned = evaluate_aligned_path(run.truth, path, clip)
        errors = evaluate_path(run.truth, moved(path, alignment), clip).figures["cartesian"]
        return path, alignment, fit, {"cartesian": errors, "cartesian_aligned": aligned}

    path, alignment, fit, errors = judged(solution["path"])
    batch = {name: solution[name] for name in ("distance_scale", "yaw_scale", "observations", "outliers", "ranges")}
    batch.update(errors, ids=drive["ids"], map=None, map_ratio=None,
                 online_ratio=ratio(estimate["cartesian_aligned"]["mean"], errors["cartesian_aligned"]["mean"]))
    batch["path_ratio"] = batch["online_ratio"]
    if truth_of_path is not None and not radios:
        there = evaluate_aligned_path(truth_of_path, path, clip)[1]
        batch["path_ratio"] = ratio(estimate["path_aligned"]["mean"], there["mean"])
    if run.true_map is not None and not radios:
        landmarks = np.array(solution["landmarks"]).reshape(-1, 3)
        places = Map(landmarks[:, 0].astype(int), landmarks[:, 1:], np.zeros((len(landmarks), 2, 2)))
        batch["map"] = evaluate_map(moved_map(places, alignment), run.true_map, "nearest" if batch["ids"] == "filter" else "id",
                                    compose(fit, inverse(alignment)))[0]
        if found.map:
            batch["map_ratio"] = ratio(found.map[0]["rms_aligned"], batch["map"]["rms_aligned"])
    if given.batch_online:
        online = solution["online"]
        *_, errors = judged(online["path"])
        batch["online"] = {**errors, "solutions": online["solutions"], "refused": online["refused"],
                           "ratio": ratio(estimate["cartesian"]["mean"], errors["cartesian"]["mean"]),
                           "aligned_ratio": ratio(estimate["cartesian_aligned"]["mean"], errors["cartesian_aligned"]["mean"])}
    return batch
