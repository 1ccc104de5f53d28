"""The MATLAB files of the CMU range-only data sets (Djugash, Hamner, Roth, "Navigating with ranging radios", FSR 2009; Kurth,
CMU-RI-TR-04-29, has the same layout with ranges in feet):
  DR [t distance dheading]  steps of dead reckoning, each from the row before to t,
  TD [t antenna beacon range], TL [beacon x y (z)], GT [t x y (heading)]; TL and GT may miss.

The steps are integrated with the mid-point rule, as the path DRp of the files is. (On Plaza 2 the truth cannot tell it from the rule
"heading before": 1.73 and 1.72 m mean error with the yaw-rate bias taken out.) Distances of DR are without sign: driving in
reverse does not show in them.
"""
import math

import numpy as np
from command_line import Error, UsageError
from evaluation.paths import wrapped

from .files import MatFile
from .recording import METRES_PER, RANGE_UNIT, Beacon, Frame, Range, Recording, Truth, start_of_steps, wrap_angle

LINE = "MATLAB files of the CMU range-only data sets (Plaza, Gesling, Kurth)"
HELP = """Makes a bag of a MATLAB file with the variables DR [t distance dheading], TD
[t antenna beacon range], TL [beacon x y] and GT [t x y heading]."""
INPUT = "FILE.mat"
OPTIONS = {**RANGE_UNIT,
           "--antenna": {"metavar": "[N:]x,y,z", "action": "append", "default": [],
                         "help": "where the antenna (with number N) sits on the robot, in m; may be repeated"}}
EXAMPLES = ("plaza Plaza2.mat plaza2.bag", "plaza kurth.mat kurth.bag --range-unit ft --antenna 0.2,0,0.5")

LEAST_STEP = 0.02  # m, in which the direction of travel can be seen
LEAST_STEPS = 10
START_WITHIN = 5.0  # intervals of the odometry that truth may begin before its first step ends


def read(path, range_unit="m", antenna=()):
    """`antenna`: places as the option takes them."""
    places = dict(antenna_of(text) for text in antenna)
    file, recording = MatFile(path), Recording()
    read_truth(file, recording)
    read_odometry(file, recording)
    read_beacons(file, recording)
    read_ranges(file, METRES_PER[range_unit], recording)
    recording.note_unit()
    place_antennas(places, recording)
    return recording


def antenna_of(text):
    """Of "N:x,y,z" the number of the antenna and its place; -1, for all antennas, without a number."""
    number, _, where = text.rpartition(":")
    try:
        x, y, z = map(float, where.split(","))
        return int(number or -1), (x, y, z)
    except ValueError:
        raise UsageError(f"--antenna {text}: give [N:]x,y,z, numbers separated by commas") from None


def usable_rows(rows, columns, name, recording):
    """Rows whose first `columns` are finite, in order of time."""
    usable = [row for row in rows if all(map(math.isfinite, row[:columns]))]
    if len(usable) < len(rows):
        recording.notes.append(f"{name}: {len(rows) - len(usable)} rows that are not finite dropped")
    return recording.in_order(name, usable)


def read_truth(file, recording):
    """If the heading is nearer the opposite of the direction of travel than to it, as in Plaza 2, it is turned by pi."""
    matrix = file.matrix("GT", 3) or []
    recording.truth_has_heading = bool(matrix) and len(matrix[0]) >= 4
    rows = usable_rows(matrix, 4 if recording.truth_has_heading else 3, "GT", recording)
    recording.truth = [Truth(row[0], (row[1], row[2], wrap_angle(row[3]) if recording.truth_has_heading else 0.0))
                       for row in rows]
    offset = mean_travel_minus_heading(recording.truth) if recording.truth_has_heading else None
    if offset is None or abs(offset) <= 0.1:
        return
    backwards = abs(offset) > 0.5 * math.pi
    recording.notes.append(f"GT: the direction of travel differs by {offset:.3f} rad from the heading on average; "
                           f"heading {'turned by pi' if backwards else 'left as it is'}")
    if backwards:
        recording.truth = [Truth(time, (x, y, wrap_angle(heading + math.pi))) for time, (x, y, heading) in recording.truth]


def mean_travel_minus_heading(truth):
    """Circular mean (rad) of the direction of travel minus the heading; None if the robot hardly moves."""
    poses = np.array([pose for _, pose in truth]).reshape(-1, 3)
    dx, dy, turns = np.diff(poses, axis=0).T
    angles = np.arctan2(dy, dx) - poses[:-1, 2] - 0.5 * wrapped(turns)
    directions = np.exp(1j * angles[np.hypot(dx, dy) >= LEAST_STEP])
    return np.angle(directions.sum()) if len(directions) >= LEAST_STEPS else None


def read_odometry(file, recording):
    steps = file.matrix("DR", 3)
    if steps is None:
        raise Error(f"{file.path}: has no variable DR [t distance dheading]; it has {file.names()}")
    steps = usable_rows(steps, 3, "DR", recording)
    if not steps:
        return
    first = steps[0][0]
    start = start_of_steps([step[0] for step in steps])
    # The truth knows when the drive began, if it began just before the first step ended.
    if recording.truth and first - START_WITHIN * (first - start) <= recording.truth[0].time < first:
        start = recording.truth[0].time
    recording.add_steps(start, steps)


def read_beacons(file, recording):
    matrix = file.matrix("TL", 3)
    if matrix is None:
        recording.notes.append("no variable TL: the places of the beacons are not known")
    recording.beacons = [Beacon(int(row[0]), row[1], row[2], row[3] if len(row) >= 4 else None) for row in matrix or []]


def read_ranges(file, metres, recording):
    matrix = file.matrix("TD", 4)
    if matrix is None:
        raise Error(f"{file.path}: has no variable TD [t antenna beacon range]; it has {file.names()}")
    rows = usable_rows(matrix, 4, "TD", recording)
    good = [row for row in rows if row[3] >= 0]
    if len(good) < len(rows):
        recording.notes.append(f"TD: {len(rows) - len(good)} negative ranges dropped")
    several = len({antenna for _, antenna, *_ in good}) > 1
    recording.ranges = [Range(time, int(beacon), metres * distance, 0.0, f"antenna_{antenna:.0f}" if several else "antenna")
                        for time, antenna, beacon, distance, *_ in good]


def place_antennas(places, recording):
    """Places the antennas that the ranges name, as far as the options know them."""
    by_name = {f"antenna_{number}": place for number, place in places.items()}
    for name in sorted({heard.frame for heard in recording.ranges}):
        place = by_name.get(name, places.get(-1))
        if place is None and name == "antenna" and len(places) == 1:
            place = next(iter(places.values()))
        if place is not None:
            recording.frames.append(Frame(name, *place, 0.0))
