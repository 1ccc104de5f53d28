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
    estimate, clip = found.figures["estimate"], given.clip
    path = path_from(solution["path"], run.place)
    radios = solution["ranges"]

    def alignment_of(path):
        """The frame of the beacons is the truth's."""
        wanted = "start" if found.frame == "given" else found.frame
        return np.zeros(3) if radios else choose_frame(wanted, run, path, clip)[1]

    alignment = alignment_of(path)
    fit, aligned = evaluate_aligned_path(run.truth, path, clip)
    batch = {name: solution[name] for name in ("distance_scale", "yaw_scale", "observations", "outliers", "ranges")}
    batch.update(ids=drive["ids"], cartesian=evaluate_path(run.truth, moved(path, alignment), clip).figures["cartesian"],
                 cartesian_aligned=aligned, map=None, map_ratio=None,
                 online_ratio=ratio(estimate["cartesian_aligned"]["mean"], aligned["mean"]))
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
        path = path_from(online["path"], run.place)
        errors = evaluate_path(run.truth, moved(path, alignment_of(path)), clip).figures["cartesian"]
        aligned = evaluate_aligned_path(run.truth, path, clip)[1]
        batch["online"] = {"cartesian": errors, "cartesian_aligned": aligned, "solutions": online["solutions"],
                           "refused": online["refused"], "ratio": ratio(estimate["cartesian"]["mean"], errors["mean"]),
                           "aligned_ratio": ratio(estimate["cartesian_aligned"]["mean"], aligned["mean"])}
    return batch
