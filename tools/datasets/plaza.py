"""The MATLAB files of the CMU range-only data sets (Djugash, Hamner, Roth, "Navigating with ranging radios", FSR 2009; Kurth,
CMU-RI-TR-04-29, has the same layout with ranges in feet):
  DR [t distance dheading]  steps of dead reckoning, each from the row before to t; without it
  DRp [t x y heading]       dead reckoning as a path,
  TD [t antenna beacon range], TL [beacon x y (z)], GT [t x y (heading)]; TL and GT may miss.

The steps are integrated with the mid-point rule, as DRp of the files is. (On Plaza 2 the truth cannot tell it from the rule
"heading before": 1.73 and 1.72 m mean error with the yaw-rate bias taken out.) Distances of DR are without sign: driving in
reverse does not show in them.
"""
import math

from command_line import Error, UsageError

from .files import MatFile, number_of
from .recording import (METRES_PER_FOOT, Beacon, Frame, Range, Recording, Truth, median_range_ratio, metres_per, start_of_steps,
                        unit_of, wrap_angle)

LINE = "MATLAB files of the CMU range-only data sets (Plaza, Gesling, Kurth)"
HELP = """Makes a bag of a MATLAB file with the variables DR [t distance dheading], TD
[t antenna beacon range], TL [beacon x y] and GT [t x y heading]."""
INPUT = "FILE.mat"
OPTIONS = (("range-unit", "m|ft|cm|mm", None, "unit of the ranges; by default found from the true distances"),
           ("antenna", "[N:]x,y,z", [], "where the antenna (with number N) sits on the robot, in m; may be repeated"))
EXAMPLES = ("plaza Plaza2.mat plaza2.bag", "plaza kurth.mat kurth.bag --range-unit ft --antenna 0.2,0,0.5")

LEAST_STEP = 0.02  # m, in which the direction of travel can be seen
LEAST_STEPS = 10
START_WITHIN = 5.0  # intervals of the odometry that truth may begin before its first step ends


def read(path, range_unit=None, antenna=()):
    """`range_unit`: "m" or "ft"; `antenna`: places as the option takes them."""
    metres = metres_per(range_unit) if range_unit else None
    places = dict(antenna_of(text) for text in antenna)
    file, recording = MatFile(path), Recording()
    read_truth(file, recording)
    read_odometry(file, recording)
    read_beacons(file, recording)
    read_ranges(file, recording)
    scale_ranges(metres, recording)
    place_antennas(places, recording)
    return recording


def antenna_of(text):
    """Of "N:x,y,z" the number of the antenna and its place; -1, for all antennas, without a number."""
    number, colon, where = text.rpartition(":")
    numbers = [number_of(word) for word in [number if colon else "-1"] + where.split(",")]
    if len(numbers) != 4 or any(value is None or not math.isfinite(value) for value in numbers):
        raise UsageError(f"--antenna {text}: give [N:]x,y,z, finite numbers separated by commas")
    return int(numbers[0]), numbers[1:]


def usable_rows(rows, columns, name, recording):
    """Rows whose first `columns` are finite, in order of time."""
    usable = [row for row in rows if all(map(math.isfinite, row[:columns]))]
    if len(usable) < len(rows):
        recording.notes.append(f"{name}: {len(rows) - len(usable)} rows that are not finite dropped")
    ordered = sorted(usable, key=lambda row: row[0])
    if ordered != usable:
        recording.notes.append(f"{name}: rows were not in order of time, sorted")
    return ordered


def id_of(value, path, variable):
    if not value.is_integer() or abs(value) > 1e9:
        raise Error(f"{path}: variable {variable}: {value:.3f} is not the number of a beacon or antenna")
    return int(value)


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
    cosine, sine, steps = 0.0, 0.0, 0
    for (_, before), (_, now) in zip(truth, truth[1:]):
        dx, dy = now[0] - before[0], now[1] - before[1]
        if math.hypot(dx, dy) < LEAST_STEP or not math.isfinite(dx + dy):
            continue
        angle = math.atan2(dy, dx) - (before[2] + 0.5 * wrap_angle(now[2] - before[2]))
        cosine, sine, steps = cosine + math.cos(angle), sine + math.sin(angle), steps + 1
    return math.atan2(sine, cosine) if steps >= LEAST_STEPS else None


def read_odometry(file, recording):
    steps = file.matrix("DR", 3)
    if steps is not None:
        integrate_steps(usable_rows(steps, 3, "DR", recording), recording)
        return
    poses = file.matrix("DRp", 4)
    if poses is None:
        raise Error(f"{file.path}: has no variable DR [t distance dheading] nor DRp; it has {file.names()}")
    rows = usable_rows(poses, 4, "DRp", recording)
    recording.add_poses(rows)
    recording.notes.append("no variable DR: odometry is DRp")


def integrate_steps(steps, recording):
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
    for i, row in enumerate(matrix or [], 1):
        if not all(map(math.isfinite, row[:4])):
            raise Error(f"{file.path}: variable TL: row {i} is not finite")
        recording.beacons.append(Beacon(id_of(row[0], file.path, "TL"), row[1], row[2], row[3] if len(row) >= 4 else None))


def read_ranges(file, recording):
    matrix = file.matrix("TD", 4)
    if matrix is None:
        raise Error(f"{file.path}: has no variable TD [t antenna beacon range]; it has {file.names()}")
    rows = usable_rows(matrix, 4, "TD", recording)
    good = [row for row in rows if row[3] >= 0]
    if len(good) < len(rows):
        recording.notes.append(f"TD: {len(rows) - len(good)} negative ranges dropped")
    antennas = [id_of(row[1], file.path, "TD") for row in good]
    several = len(set(antennas)) > 1
    recording.ranges = [Range(row[0], id_of(row[2], file.path, "TD"), row[3], 0.0, f"antenna_{antenna}" if several else "antenna")
                        for row, antenna in zip(good, antennas)]


def scale_ranges(metres, recording):
    """Brings ranges to metres; without `metres` per unit that is seen from the true distances."""
    ratio = median_range_ratio(recording)
    scale = metres or 1.0
    if metres and ratio and unit_of(ratio * metres) == "ft":
        recording.notes.append(f"ranges are {ratio * metres:.2f} times the true distances: are they in feet?")
    elif not metres and unit_of(ratio) == "ft":
        scale = METRES_PER_FOOT
        recording.notes.append(f"TD: ranges are {ratio:.2f} times the true distances: taken as feet")
    elif not metres and ratio is None:
        recording.notes.append("TD: the unit of the ranges is not known: metres are assumed (--range-unit ft for feet)")
    recording.ranges = [heard._replace(range=heard.range * scale) for heard in recording.ranges]


def place_antennas(places, recording):
    """Places the antennas that the ranges name, as far as the options know them."""
    by_name = {f"antenna_{number}": place for number, place in places.items()}
    for name in sorted({heard.frame for heard in recording.ranges}):
        place = by_name.get(name, places.get(-1))
        if place is None and name == "antenna" and len(places) == 1:
            place = next(iter(places.values()))
        if place is not None:
            recording.frames.append(Frame(name, *place, 0.0))
