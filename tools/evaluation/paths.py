"""Errors of paths against the ground truth, as in Mahmoud (2012), section IV.

Metres, radians, seconds. Poses are rows (x, y, heading); an unknown heading of the truth is NaN.
"""
import math
from dataclasses import dataclass
from typing import Optional

import numpy as np
from command_line import Error

CHI_SQUARE_95 = {2: 5.991464547107979, 3: 7.814727903251179}  # by degrees of freedom
THREE_SIGMA_SQUARED = 9.0  # of the position: 98.9 % if Gaussian
LOST_HEADING = np.pi / 6  # a robot whose heading is further off is lost
CONVERGED_FOR = 10.0  # s
TIME_TO_CONVERGE = 0.2  # share of the time that never counts as lost
MOST_LOST = 0.1  # share of the rest that may
SHARE_OF_EXTENT = 0.02  # of the diagonal: length of the chords that give a direction of travel
SHARE_OF_PATH = 0.1  # that tells how the frame of dead reckoning is turned


@dataclass
class Path:
    """Poses in order of time."""
    time: np.ndarray
    pose: np.ndarray
    covariance: Optional[np.ndarray] = None  # 3 x 3 each

    def __len__(self):
        return len(self.time)

    def part(self, which):
        return Path(self.time[which], self.pose[which], None if self.covariance is None else self.covariance[which])


def wrapped(angle):
    return np.where(np.abs(angle) <= np.pi, angle, angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def compose(first, second):
    """The pose `second`, given in the frame of `first`, where `first` is given; either may be rows."""
    cosine, sine = np.cos(first[..., 2]), np.sin(first[..., 2])
    return np.stack([first[..., 0] + cosine * second[..., 0] - sine * second[..., 1],
                     first[..., 1] + sine * second[..., 0] + cosine * second[..., 1],
                     wrapped(first[..., 2] + second[..., 2])], axis=-1)


def inverse(pose):
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    return np.array([-cosine * pose[0] - sine * pose[1], sine * pose[0] - cosine * pose[1], -pose[2]])


def rotation(heading, size=2):
    matrix = np.eye(size)
    matrix[:2, :2] = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    return matrix


def moved(path, by):
    """The path, turned and shifted with its covariances."""
    turn = rotation(by[2], 3)
    return Path(path.time, compose(by, path.pose), None if path.covariance is None else turn @ path.covariance @ turn.T)


def path_of_place(path, place):
    """The path of what sits at `place` on the robot, with its covariances."""
    pose = compose(path.pose, place)
    covariance = path.covariance
    if covariance is not None:
        lever = np.tile(np.eye(3), (len(path), 1, 1))
        lever[:, 0, 2] = path.pose[:, 1] - pose[:, 1]
        lever[:, 1, 2] = pose[:, 0] - path.pose[:, 0]
        covariance = lever @ covariance @ lever.transpose(0, 2, 1)
    return Path(path.time, pose, covariance)


def usual_gap(path):
    """The longest gap, s, that interpolation bridges: three times the median interval, at least 1 s."""
    intervals = np.sort(np.diff(path.time))
    return max(1.0, 3.0 * intervals[len(intervals) // 2]) if len(intervals) else 1.0


def interpolate(path, times, longest_gap=np.inf):
    """The path at these times: all but the heading linear, that along the shorter arc. Returns which of the times it covers,
    and the poses at those."""
    after = np.searchsorted(path.time, times, side="right")
    before, after = np.maximum(after - 1, 0), np.minimum(after, len(path) - 1)
    duration = path.time[after] - path.time[before]
    is_there = path.time[before] == times
    is_known = is_there | ((path.time[before] <= times) & (times <= path.time[after]) & (duration <= longest_gap))
    before, after, duration = before[is_known], after[is_known], duration[is_known]
    share = ((times[is_known] - path.time[before]) / np.where(duration > 0, duration, 1.0))[:, None]
    change = path.pose[after] - path.pose[before]
    change[:, 2] = wrapped(change[:, 2])
    pose = path.pose[before] + np.where(share > 0.0, share * change, 0.0)
    pose[:, 2] = wrapped(pose[:, 2])
    covariance = path.covariance
    if covariance is not None:
        covariance = covariance[before] + share[:, :, None] * (covariance[after] - covariance[before])
    return is_known, Path(times[is_known], pose, covariance)


def extent_of(path):
    """Diagonal of the area."""
    return np.hypot(*np.ptp(path.pose[:, :2], axis=0))


def key_poses(poses, length):
    """Indices of poses that are each at least `length` from the one before: the path without standing."""
    keys, places = [0], poses[:, :2].tolist()
    for i, (x, y) in enumerate(places):
        if math.hypot(x - places[keys[-1]][0], y - places[keys[-1]][1]) >= length:
            keys.append(i)
    return np.array(keys)


def travel_directions(path):
    """Direction of travel at every pose; NaN if the path never moves. One for each chord, valid in its middle; between two
    middles along the arc, unless the robot turned back between them."""
    length = SHARE_OF_EXTENT * extent_of(path)
    keys = key_poses(path.pose, length) if length > 0 else [0]
    if len(keys) < 2:
        return np.full(len(path), np.nan)
    steps = np.diff(path.pose[keys, :2], axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    middles = 0.5 * (path.time[keys[:-1]] + path.time[keys[1:]])
    chord = np.minimum(np.searchsorted(keys, np.arange(len(path)), side="right") - 1, len(directions) - 1)
    first = np.where(path.time >= middles[chord], chord, chord - 1)
    is_between = (first >= 0) & (first + 1 < len(directions))
    first = np.where(is_between, first, 0)
    second = np.minimum(first + 1, len(directions) - 1)
    turn, duration = wrapped(directions[second] - directions[first]), middles[second] - middles[first]
    is_between &= (duration > 0) & (np.abs(turn) < 0.5 * np.pi)
    share = (path.time - middles[first]) / np.where(duration > 0, duration, 1.0)
    return np.where(is_between, wrapped(directions[first] + turn * share), directions[chord])


def track_directions(truth):
    """What splits an error into along-track and cross-track: the true heading where it is known, else the direction of
    travel. The latter comes from chords, so that noise of a reference that stands does not turn it, and is held while the
    robot stands; in reverse it only flips its sign, which no absolute error sees."""
    is_unknown = np.isnan(truth.pose[:, 2])
    return np.where(is_unknown, travel_directions(truth), truth.pose[:, 2]) if is_unknown.any() else truth.pose[:, 2]


def rotation_of_first_part(odometry, truth):
    """From the frame of the odometry, about the first true pose, to the truth's: best fit over the first tenth of the path."""
    length = SHARE_OF_EXTENT * extent_of(truth)
    if not length > 0:
        return 0.0
    keys = key_poses(truth.pose, length)
    travelled = np.cumsum(np.hypot(*np.diff(truth.pose[keys, :2], axis=0).T))
    within = max(np.count_nonzero(travelled <= SHARE_OF_PATH * travelled[-1]), 2) if len(travelled) else 0
    keys = np.concatenate([keys[:1], keys[1:1 + within]])
    is_known, there = interpolate(odometry, truth.time[keys], usual_gap(odometry))
    mine, others = truth.pose[keys[is_known], :2] - truth.pose[0, :2], there.pose[:, :2] - there.pose[0, :2]
    return angle_between(others, mine)


def angle_between(first, second):
    """By which the first vectors are to be turned so that the sum of their products with the second is largest."""
    cross = np.sum(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    return np.arctan2(cross, np.sum(first * second))


def align_points(points, others):
    """The pose that brings points nearest to their others."""
    middle, other_middle = points.mean(axis=0), others.mean(axis=0)
    heading = angle_between(points - middle, others - other_middle)
    return np.append(other_middle - rotation(heading) @ middle, heading)


def align_at_start(odometry, truth):
    """What brings a path to the truth, so that they agree at the first true pose that it covers: in position, and in heading,
    or, where the truth has none, by the turn that fits the first tenth of the way best."""
    is_known, _ = interpolate(odometry, truth.time, usual_gap(odometry))
    if not is_known.any():
        raise Error(f"odometry ({odometry.time[0]:.6f} to {odometry.time[-1]:.6f} s) covers no pose of the ground truth "
                    f"({truth.time[0]:.6f} to {truth.time[-1]:.6f} s): their clocks have to agree")
    rest = truth.part(slice(int(np.argmax(is_known)), None))
    start = interpolate(odometry, rest.time[:1])[1].pose[0]
    heading = rest.pose[0, 2]
    if np.isnan(heading):
        heading = start[2] + rotation_of_first_part(odometry, rest)
    return compose(np.append(rest.pose[0, :2], heading), inverse(start))


def absolute_errors(errors):
    """Of the absolute values, as in Tables 1 to 3 of Mahmoud: all true poses count the same; NaN: there is none."""
    sizes = np.abs(errors[~np.isnan(errors)])
    if not len(sizes):
        return {"mean": None, "max": None, "std": None, "rms": None, "median": None, "count": 0}
    return {"mean": sizes.mean(), "max": sizes.max(), "std": sizes.std(), "rms": np.sqrt(np.mean(sizes**2)),
            "median": np.median(sizes), "count": len(sizes)}


def normalized_squared(covariance, error):
    """Squared lengths of errors in standard deviations; infinite where a covariance is not positive definite."""
    variances, axes = np.linalg.eigh(covariance)
    along_axes = np.einsum("nji,nj->ni", axes, error)
    with np.errstate(all="ignore"):
        return np.where(np.all(variances > 0, axis=1), np.sum(along_axes**2 / variances, axis=1), np.inf)


@dataclass
class PathErrors:
    """How far a path is from the truth, at the stamps of the truth."""
    figures: dict  # see evaluate_path()
    samples: dict  # arrays, one entry for each true pose that the estimate covers


def samples_of(truth, directions, estimate):
    """The errors, estimate minus truth, at true poses, with the standard deviations that the estimate states."""
    error = estimate.pose[:, :2] - truth.pose[:, :2]
    covariance = np.zeros((len(truth), 3, 3)) if estimate.covariance is None else estimate.covariance
    place = covariance[:, :2, :2]
    samples = {"time": truth.time, "cartesian": np.hypot(*error.T)}
    ahead = np.stack([np.cos(directions), np.sin(directions)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    for name, axis in (("along_track", ahead), ("cross_track", left)):
        samples[name] = np.sum(axis * error, axis=1)
        variance = np.einsum("ni,nij,nj->n", axis, place, axis)
        samples[name + "_sigma"] = np.sqrt(np.maximum(0.0, np.nan_to_num(variance)))
    samples["heading"] = wrapped(estimate.pose[:, 2] - truth.pose[:, 2])
    samples["heading_sigma"] = np.sqrt(np.maximum(0.0, covariance[:, 2, 2]))
    samples["position_sigma"] = np.sqrt(np.maximum(0.0, np.linalg.eigvalsh(place)[:, 1]))
    samples["normalized_squared"] = normalized_squared(place, error)
    pose_error = np.column_stack([error, samples["heading"]])
    has_heading = ~np.isnan(truth.pose[:, 2])
    samples["normalized_squared_pose"] = np.where(has_heading, normalized_squared(covariance, pose_error), np.nan)
    return samples


def consistency(samples, kept):
    """Shares of the true poses in the estimate's own regions, and the mean squared error in standard deviations, 2 if
    consistent; None: no covariance is stated. A singular one contains nothing."""
    names = "coverage95", "coverage95_pose", "coverage_3sigma", "normalized_error"
    if not np.any(samples["position_sigma"] > 0):
        return dict.fromkeys(names)
    squared, pose = samples["normalized_squared"][kept], samples["normalized_squared_pose"][kept]
    pose = pose[~np.isnan(pose)]
    return dict(zip(names, (np.mean(squared <= CHI_SQUARE_95[2]), np.mean(pose <= CHI_SQUARE_95[3]) if len(pose) else None,
                            np.mean(squared <= THREE_SIGMA_SQUARED), np.mean(squared))))


def converged_after(time, is_known):
    """From the start, s, until position and heading are known for 10 s or, later than that, to the end; None: never."""
    ends = np.concatenate([[-1], np.flatnonzero(~is_known), [len(time)]])
    for begin, end in zip(ends[:-1] + 1, ends[1:]):
        if begin < end and (time[end - 1] - time[begin] >= CONVERGED_FOR or end == len(time)):
            return time[begin] - time[0]
    return None


def evaluate_path(truth, estimate, clip, longest_gap=None):
    """The errors of the estimate, interpolated at every true pose. `clip`: the share of the time that is left out at the
    start. A robot is lost where the Cartesian error is above lost_error, or there is no estimate; a run is if that holds for
    more than a tenth of its time, never counting the first fifth."""
    duration = truth.time[-1] - truth.time[0]
    begin = truth.time[0] + clip * duration
    lost_error = 0.2 + 0.03 * extent_of(truth)  # noise of radios; see pf_resampling_core/models/lost_error.hpp
    is_known, there = interpolate(estimate, truth.time, usual_gap(estimate) if longest_gap is None else longest_gap)
    is_kept = truth.time >= begin
    uncovered = np.count_nonzero(is_kept & ~is_known)
    if uncovered == np.count_nonzero(is_kept):
        raise Error(f"the estimate ({estimate.time[0]:.6f} to {estimate.time[-1]:.6f} s) covers none of the {uncovered} poses "
                    f"of the ground truth ({begin:.6f} to {truth.time[-1]:.6f} s): their clocks have to agree")
    samples = samples_of(truth.part(is_known), track_directions(truth)[is_known], there)
    kept = is_kept[is_known]
    samples["clipped"] = ~kept
    is_lost, knows = np.ones(len(truth), bool), np.zeros(len(truth), bool)
    is_lost[is_known] = ~(samples["cartesian"] <= lost_error)
    knows[is_known] = ~is_lost[is_known] & (np.abs(np.nan_to_num(samples["heading"])) <= LOST_HEADING)
    judged = truth.time >= truth.time[0] + max(clip, TIME_TO_CONVERGE) * duration
    figures = {name: absolute_errors(samples[name][kept]) for name in ("cross_track", "along_track", "cartesian", "heading")}
    figures.update(
        consistency(samples, kept), uncovered=uncovered, lost_error=lost_error, duration=duration,
        truth_poses=np.count_nonzero(is_kept), converged_after=converged_after(truth.time, knows),
        lost_share=np.mean(is_lost[is_kept]), lost=bool(np.any(judged) and np.mean(is_lost[judged]) > MOST_LOST))
    return PathErrors(figures, samples)


def evaluate_aligned_path(truth, estimate, clip, longest_gap=None):
    """The shape alone, whatever the frame: what brings the whole path nearest to the truth, and the Cartesian errors then."""
    truth = truth.part(truth.time >= truth.time[0] + clip * (truth.time[-1] - truth.time[0]))
    is_known, there = interpolate(estimate, truth.time, usual_gap(estimate) if longest_gap is None else longest_gap)
    if not is_known.any():
        raise Error("the estimate covers no pose of the ground truth")
    alignment = align_points(there.pose[:, :2], truth.pose[is_known, :2])
    off = compose(alignment, there.pose)[:, :2] - truth.pose[is_known, :2]
    return alignment, absolute_errors(np.hypot(*off.T))
