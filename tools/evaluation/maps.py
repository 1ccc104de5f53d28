"""Errors of maps of point landmarks against the true ones."""
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .paths import CHI_SQUARE_95, Error, align_points, normalized_squared, rotation

LEAST_GATE = 0.5  # m
MOST_ROUNDS = 20  # of matching and aligning in turn


@dataclass
class Map:
    id: np.ndarray
    position: np.ndarray  # m
    covariance: np.ndarray  # m^2; zero: none is stated

    def __len__(self):
        return len(self.id)


def moved(landmarks, by):
    turn = rotation(by[2])
    return Map(landmarks.id, landmarks.position @ turn.T + by[:2], turn @ landmarks.covariance @ turn.T)


def usual_gate(truth):
    """Half of the median distance from a landmark to its nearest neighbour, at least 0.5 m: what is farther off might as well
    be its neighbour."""
    if len(truth) < 2:
        return LEAST_GATE
    return max(LEAST_GATE, 0.5 * np.median(cKDTree(truth.position).query(truth.position, 2)[0][:, 1]))


# Which landmark is which true one: rows (place in the estimated map, place in the true one).
def match_by_id(estimated, truth):
    """Each true landmark once, by the first estimate with its id."""
    pairs = np.column_stack(np.intersect1d(estimated.id, truth.id, return_indices=True)[1:])
    return pairs[np.argsort(pairs[:, 0])]


def match_by_nearest(estimated, truth, gate):
    """The nearest first, each at most once, none farther apart than the gate."""
    near = cKDTree(truth.position).query_ball_point(estimated.position, gate, return_sorted=True)
    pairs = np.array([(i, j) for i, places in enumerate(near) for j in places], int).reshape(-1, 2)
    distances = distances_of(estimated, truth, pairs)
    matches, taken = {}, set()
    for i, j in pairs[np.argsort(distances, kind="stable")].tolist():
        if i not in matches and j not in taken:
            matches[i] = j
            taken.add(j)
    return np.array(sorted(matches.items()), int).reshape(-1, 2)


def alignment_of(estimated, truth, matches):
    return align_points(estimated.position[matches[:, 0]], truth.position[matches[:, 1]])


def distances_of(estimated, truth, matches):
    return np.linalg.norm(estimated.position[matches[:, 0]] - truth.position[matches[:, 1]], axis=1)


def ids_make_sense(estimated, truth, gate):
    """Whether at least half of the landmarks have the id of a true one and, of these, half are near it after alignment."""
    matches = match_by_id(estimated, truth)
    if not len(matches) or 2 * len(matches) < len(estimated):
        return False
    there = moved(estimated, alignment_of(estimated, truth, matches))
    return 2 * np.count_nonzero(distances_of(there, truth, matches) <= gate) >= len(matches)


def match_and_align(estimated, truth, gate, alignment):
    """Matches by nearest in the first frame, aligns the matched, and again until nothing changes."""
    matches = match_by_nearest(moved(estimated, alignment), truth, gate)
    for _ in range(MOST_ROUNDS):
        if len(matches) < 2:
            break
        after = match_by_nearest(moved(estimated, alignment_of(estimated, truth, matches)), truth, gate)
        if len(after) < len(matches) or np.array_equal(after, matches):
            break
        matches = after
    return matches


def evaluate_map(estimated, truth, matching, first_alignment):
    """The figures, the matches, and what brings the map to the truth (None below two matches). `matching`: id, nearest or
    auto, by id if ids make sense; `first_alignment` brings the map near the truth, as the alignment of the path does."""
    if not len(truth):
        raise Error("the true map has no landmarks: there is nothing to compare with")
    gate = usual_gate(truth)
    if matching == "auto":
        matching = "id" if ids_make_sense(estimated, truth, gate) else "nearest"
    matches = match_by_id(estimated, truth) if matching == "id" else match_and_align(estimated, truth, gate, first_alignment)
    figures = {"landmarks": len(estimated), "matched": len(matches), "false_landmarks": len(estimated) - len(matches),
               "missed": len(truth) - len(matches), "matched_by": matching, "gate": gate}
    figures.update(dict.fromkeys(("rms", "rms_aligned", "coverage95", "normalized_error")))
    alignment = None
    if len(matches):
        figures["rms"] = np.sqrt(np.mean(distances_of(estimated, truth, matches)**2))
        figures.update(consistency(estimated, truth, matches))
    if len(matches) >= 2:
        alignment = alignment_of(estimated, truth, matches)
        figures["rms_aligned"] = np.sqrt(np.mean(distances_of(moved(estimated, alignment), truth, matches)**2))
    return figures, matches, alignment


def consistency(estimated, truth, matches):
    """Of matched landmarks as they are, if covariances are stated: the share inside the 95 % ellipses, and the mean squared
    error in standard deviations, 2 if consistent."""
    mine, others = matches.T
    if not np.any(np.trace(estimated.covariance[mine], axis1=1, axis2=2) > 0):
        return {}
    squared = normalized_squared(estimated.covariance[mine] + truth.covariance[others],
                                 estimated.position[mine] - truth.position[others])
    return {"coverage95": np.mean(squared <= CHI_SQUARE_95[2]), "normalized_error": np.mean(squared)}
