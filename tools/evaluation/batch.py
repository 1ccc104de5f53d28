"""The least-squares solution of the same data (solve_drive), judged as the estimate is."""
import numpy as np
from command_line import answer_of
from filter_setup import words_of

from .maps import Map, evaluate_map
from .maps import moved as moved_map
from .paths import Path, compose, evaluate_aligned_path, evaluate_path, inverse, moved, path_of_place


def solution_of(given, *options):
    """What solve_drive finds in the data of the bag. `given`: with topics and configuration."""
    roles = [role for role in ("odom", "landmarks", "ranges", "sensor_ranges", "beacons") if hasattr(given, role)]
    topics = [word for role in roles for word in (f"--{role.replace('_', '-')}", getattr(given, role))]
    return answer_of("solve_drive", [given.bag, *topics, *words_of(given.config, given.set), *options])


def path_from(rows, place):
    rows = np.array(rows)
    return path_of_place(Path(rows[:, 0], rows[:, 1:]), place)


def map_from(rows):
    """Of solve_drive: id, x, y, and the covariance xx, xy, yy, each."""
    rows = np.array(rows, float).reshape(-1, 6)
    return Map(rows[:, 0].astype(int), rows[:, 1:3], rows[:, [3, 4, 4, 5]].reshape(-1, 2, 2))


def ratio(value, by):
    return value / by if value is not None and by else None


def compare(given, run, found, truth_of_path, choose_frame):
    """Figures; `found` of the estimate, `truth_of_path` the truth at the stamps of the path as it was believed at the end."""
    solution = solution_of(given, *["--by-ranges"] * given.by_ranges, *["--online"] * given.batch_online)
    estimate, clip, radios = found.figures["estimate"], given.clip, solution["ranges"]

    def judged(rows):
        """A path, what brings it to the truth's frame, which is that of the beacons, what fits it best, and its errors."""
        path, wanted = path_from(rows, run.place), "start" if found.frame == "given" else found.frame
        alignment = np.zeros(3) if radios else choose_frame(wanted, run, path, clip)[1]
        fit, aligned = evaluate_aligned_path(run.truth, path, clip)
        errors = evaluate_path(run.truth, moved(path, alignment), clip).figures["cartesian"]
        return path, alignment, fit, {"cartesian": errors, "cartesian_aligned": aligned}

    path, alignment, fit, errors = judged(solution["path"])
    names = "distance_scale", "yaw_scale", "observations", "outliers", "ranges", "ids", "left_out"
    batch = {name: solution[name] for name in names}
    batch.update(errors, map=None, map_ratio=None,
                 online_ratio=ratio(estimate["cartesian_aligned"]["mean"], errors["cartesian_aligned"]["mean"]))
    batch["path_ratio"] = batch["online_ratio"]
    if truth_of_path is not None and not radios:
        there = evaluate_aligned_path(truth_of_path, path, clip)[1]
        batch["path_ratio"] = ratio(estimate["path_aligned"]["mean"], there["mean"])
    if run.true_map is not None and not radios:
        places = moved_map(map_from(solution["landmarks"]), alignment)
        batch["map"] = evaluate_map(places, run.true_map, "nearest" if batch["ids"] == "filter" else "id",
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
