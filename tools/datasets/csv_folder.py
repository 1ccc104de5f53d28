"""A directory with any of odometry.csv, ranges.csv, beacons.csv, landmark_observations.csv, landmarks.csv, ground_truth.csv and
frames.csv (HELP says what is in them).

Odometry of the kind t,distance,dheading: distance driven and angle turned since the row above (mid-point rule); of the kind
t,v,omega: velocities that hold from t to the next row.
"""
import math
import os

from command_line import Error

from .files import lines_of, number_of, require_directory
from .recording import (Beacon, Frame, Landmark, Observation, Odometry, Range, Recording, Truth, compose,
                        median_range_ratio, metres_per, midpoint_motion, relative, start_of_steps, unit_of, wrap_angle)

LINE = "a directory with CSV files of your own"
HELP = """Makes a bag of a directory with any of
  odometry.csv               t,x,y,heading or t,distance,dheading or t,v,omega
  ranges.csv                 t,beacon,range[,variance]
  beacons.csv                beacon,x,y[,z]
  landmark_observations.csv  t,id,range,bearing[,range_variance,bearing_variance]
  landmarks.csv              id,x,y
  ground_truth.csv           t,x,y[,heading]
  frames.csv                 frame,x,y[,z][,yaw]: where antenna or sensor sits on the robot
The first line names the columns, in any order; # begins a comment. Seconds, metres and
radians; id -1: unknown; variance 0: unknown. distance and dheading are since the row
before; v and omega hold until the next row."""
INPUT = "DIRECTORY"
OPTIONS = (("range-unit", "m|ft|cm|mm", "m", "unit of the measured ranges"),)
EXAMPLES = ("csv my_recording my_recording.bag",)

FULL_TURN = 2 * math.pi  # an angle beyond it is one in degrees
FARTHEST = 1e9  # m
LATEST = 2**32 - 1  # s
MOST_COLUMNS = 1000


def trimmed(text):
    text = text.strip(" \t\r")
    return text[1:-1] if len(text) >= 2 and text[0] == text[-1] == '"' else text


class Table:
    """A CSV file: a line that names the columns, in any order, then a line of as many fields for each row. Comments (#), blank
    lines, spaces around fields, quotes around them, CR LF and a byte order mark are passed over. Every error is one line
    "FILE:LINE: column NAME: 'VALUE' ...". A column whose name begins with ? may be missing, one named t is in order of time."""

    def __init__(self, path, columns, recording):
        self.path, self.lines, self.rows = path, [], []
        for line, text in enumerate(lines_of(path), 1):
            text = text.split("#", 1)[0]
            if not trimmed(text):
                continue
            if not self.lines:
                self.names = self.header(line, text)
            elif text.count(",") + 1 != len(self.names):
                raise Error(f"{path}:{line}: {text.count(',') + 1} fields, where the header names {len(self.names)} columns")
            self.lines.append(line)
            self.rows.append(None if len(self.lines) == 1 else [trimmed(field) for field in text.split(",")])
        if not self.lines:
            raise Error(f"{path}: is empty; its first line has to name the columns")
        kinds = columns if isinstance(columns[0], tuple) else (columns,)
        self.kind = next((kind for kind in kinds if set(kind[1:]) <= set(self.names) or len(kinds) == 1), None)
        if self.kind is None:
            raise Error(f"{path}: columns {','.join(self.names)}; odometry has {' or '.join(map(','.join, kinds))}")
        for name in self.kind:
            if name[0] != "?" and name not in self.names:
                known = ",".join(f"[{name[1:]}]" if name[0] == "?" else name for name in self.kind)
                raise Error(f"{path}:{self.lines[0]}: column {name} is missing; the columns are {known}")
        self.lines, self.rows = self.lines[1:], self.rows[1:]
        self.file, self.notes = os.path.basename(path), recording.notes
        if "t" in self.kind:
            self.sort_by_time()
        self.ignored = [name for name in self.names if name not in self.kind and f"?{name}" not in self.kind]

    def header(self, line, text):
        place = f"{self.path}:{line}: "
        if text.count(",") >= MOST_COLUMNS:
            raise Error(f"{place}{text.count(',') + 1} columns, more than {MOST_COLUMNS}; is it the right file?")
        names = []
        for field in map(trimmed, text.split(",")):
            if number_of(field) is not None:
                raise Error(f"{place}'{field}' where the name of a column is expected; the first line has to name the columns")
            if ";" in field or "\t" in field:
                raise Error(f"{place}'{field}': columns have to be separated by commas")
            if field.lower() in names:
                raise Error(f"{place}column {field.lower()} is named twice")
            names.append(field.lower())
        return names

    def sort_by_time(self):
        times = [self.number(row, "t") for row in range(len(self.rows))]
        for row, time in enumerate(times):
            if abs(time) > LATEST:
                raise self.error(row, "t", "is beyond what ROS can hold; times are in seconds")
        order = sorted(range(len(times)), key=times.__getitem__)
        if order != list(range(len(order))):
            self.notes.append(f"{self.file}: rows put in order of time")
            self.lines, self.rows = [self.lines[row] for row in order], [self.rows[row] for row in order]

    def error(self, row, column, what):
        return Error(f"{self.path}:{self.lines[row]}: column {column}: '{self.rows[row][self.names.index(column)]}' {what}")

    def text(self, row, column):
        field = self.rows[row][self.names.index(column)]
        if not field:
            raise self.error(row, column, "is empty")
        return field

    def number(self, row, column, least=-math.inf):
        """Finite. With `least` (0) it may be missing, and is 0 then."""
        if column not in self.names:
            return 0.0
        value = number_of(self.text(row, column))
        if value is None:
            raise self.error(row, column, "is not a number")
        if not math.isfinite(value):
            raise self.error(row, column, "is not finite")
        if value < least:
            raise self.error(row, column, "is negative")
        return value

    def whole_number(self, row, column, least):
        """Of 32 bits."""
        value = self.number(row, column)
        if not value.is_integer() or value >= 2**31:
            raise self.error(row, column, "is not a whole number")
        if value < least:
            raise self.error(row, column, f"is less than {least}")
        return int(value)

    def once(self, row, column, value, known):
        if value in known:
            raise self.error(row, column, "is there twice")
        known.add(value)
        return value

    def numbers(self, row, *columns):
        return tuple(self.number(row, column) for column in columns)

    def note_degrees(self, column, turns=False):
        """Radians that go far from zero come in small steps (but `turns` stand each for themselves); degrees begin anywhere."""
        angles = [self.number(row, column) for row in range(len(self.rows))]
        steps = angles if turns else [b - a for a, b in zip([0.0] + angles, angles)]
        largest = max(map(abs, angles), default=0.0)
        if largest > FULL_TURN and max(map(abs, steps)) > FULL_TURN:
            self.notes.append(f"{self.file}: column '{column}' looks like degrees (it goes to {largest:.1f}); "
                              "angles have to be in radians")

    def note_ignored(self):
        self.notes += [f"{self.file}: column '{column}' is not used" for column in self.ignored]


def read(directory, range_unit="m"):
    unit, recording = metres_per(range_unit), Recording()
    require_directory(directory, "the CSV files")
    there = [(name, os.path.join(directory, name)) for name in READERS if os.path.exists(os.path.join(directory, name))]
    if not there:
        raise Error(f"{directory}: has none of {', '.join(READERS)}")
    for name, path in there:
        columns, add_rows = READERS[name]
        table = Table(path, columns, recording)
        add_rows(table, unit, recording)
        table.note_ignored()
    ratio = median_range_ratio(recording)
    if unit_of(ratio) not in (None, "m"):
        recording.notes.append(f"ranges are {ratio:.2f} times the true distances: are they in another unit? "
                               f"--range-unit {unit_of(ratio)} would make metres of them")
    return recording


def add_odometry(table, _, recording):
    rows = range(len(table.rows))
    times = [table.number(row, "t") for row in rows]
    poses = {"x": poses_of_poses, "distance": poses_of_steps, "v": poses_of_velocities}[table.kind[1]](table, times)
    if table.kind[1] == "distance" and times:
        recording.odometry.append(Odometry(start_of_steps(times), (0.0, 0.0, 0.0)))
    for time, pose in zip(times, poses):
        if recording.odometry and time <= recording.odometry[-1].time:  # one at the same time replaces the last
            recording.odometry.pop()
        recording.odometry.append(Odometry(time, pose))
    merged = len(times) + (table.kind[1] == "distance" and bool(times)) - len(recording.odometry)
    table.note_degrees(table.kind[-1], turns=table.kind[1] != "x")
    if merged:
        recording.notes.append(f"odometry.csv: {merged} rows merged with the row before, which has the same time")


def require_possible(table, row, column, pose):
    if not (abs(pose[0]) <= FARTHEST and abs(pose[1]) <= FARTHEST and math.isfinite(pose[2])):
        raise table.error(row, column, "takes the robot beyond 1e9 m")
    return pose


def poses_of_poses(table, _):
    """In a frame of their own, taken to begin at the origin."""
    poses = [require_possible(table, row, "x", table.numbers(row, "x", "y", "heading")) for row in range(len(table.rows))]
    return [relative(poses[0], pose) for pose in poses]


def poses_of_steps(table, times):
    pose = (0.0, 0.0, 0.0)
    for row in range(len(times)):
        pose = compose(pose, midpoint_motion(*table.numbers(row, "distance", "dheading")))
        yield require_possible(table, row, "distance", pose)


def poses_of_velocities(table, times):
    pose, velocities = (0.0, 0.0, 0.0), [table.numbers(row, "v", "omega") for row in range(len(times))]
    for row in range(len(times)):
        if row > 0:
            duration = times[row] - times[row - 1]
            pose = compose(pose, midpoint_motion(velocities[row - 1][0] * duration, velocities[row - 1][1] * duration))
            require_possible(table, row - 1, "v", pose)
        yield pose


def add_ranges(table, unit, recording):
    for row in range(len(table.rows)):
        recording.ranges.append(Range(
            table.number(row, "t"), table.whole_number(row, "beacon", -1), unit * table.number(row, "range", 0.0),
            unit * unit * table.number(row, "variance", 0.0), "antenna"))


def add_beacons(table, _, recording):
    known = set()
    for row in range(len(table.rows)):
        beacon = table.once(row, "beacon", table.whole_number(row, "beacon", 0), known)
        recording.beacons.append(Beacon(beacon, *table.numbers(row, "x", "y"),
                                        table.number(row, "z") if "z" in table.names else None))


def add_observations(table, unit, recording):
    for row in range(len(table.rows)):
        bearing = table.number(row, "bearing")
        if abs(bearing) > FULL_TURN:
            raise table.error(row, "bearing", "is more than a full turn; bearings are in radians")
        recording.observations.append(Observation(
            table.number(row, "t"), table.whole_number(row, "id", -1), unit * table.number(row, "range", 0.0), bearing,
            unit * unit * table.number(row, "range_variance", 0.0), table.number(row, "bearing_variance", 0.0)))


def add_landmarks(table, _, recording):
    known = set()
    for row in range(len(table.rows)):
        mark = table.once(row, "id", table.whole_number(row, "id", 0), known)
        recording.landmarks.append(Landmark(mark, *table.numbers(row, "x", "y"), 0.0, 0.0))


def add_truth(table, _, recording):
    recording.truth_has_heading = "heading" in table.names
    if recording.truth_has_heading:
        table.note_degrees("heading")
    for row in range(len(table.rows)):
        time, x, y, heading = table.numbers(row, "t", "x", "y", "heading")
        recording.truth.append(Truth(time, (x, y, wrap_angle(heading))))


def add_frames(table, _, recording):
    known = set()
    for row in range(len(table.rows)):
        name = table.text(row, "frame")
        if name not in ("antenna", "sensor"):
            raise table.error(row, "frame", "is not known; frames are antenna and sensor")
        x, y, z, yaw = table.numbers(row, "x", "y", "z", "yaw")
        recording.frames.append(Frame(table.once(row, "frame", name, known), x, y, z, wrap_angle(yaw)))


READERS = {
    "odometry.csv": ((("t", "x", "y", "heading"), ("t", "distance", "dheading"), ("t", "v", "omega")), add_odometry),
    "ranges.csv": (("t", "beacon", "range", "?variance"), add_ranges),
    "beacons.csv": (("beacon", "x", "y", "?z"), add_beacons),
    "landmark_observations.csv": (("t", "id", "range", "bearing", "?range_variance", "?bearing_variance"), add_observations),
    "landmarks.csv": (("id", "x", "y"), add_landmarks),
    "ground_truth.csv": (("t", "x", "y", "?heading"), add_truth),
    "frames.csv": (("frame", "x", "y", "?z", "?yaw"), add_frames)}
