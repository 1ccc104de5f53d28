"""A directory with any of odometry.csv, ranges.csv, beacons.csv, landmark_observations.csv, landmarks.csv, ground_truth.csv and
frames.csv (HELP says what is in them).

Odometry of the kind t,distance,dheading: distance driven and angle turned since the row above (mid-point rule); of the kind
t,v,omega: velocities that hold from t to the next row.
"""
import math
import os

from command_line import Error

from .files import finite_number, lines_of
from .recording import METRES_PER, RANGE_UNIT, Beacon, Frame, Landmark, Observation, Range, Recording, Truth, start_of_steps, wrap_angle

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
OPTIONS = RANGE_UNIT
EXAMPLES = ("csv my_recording my_recording.bag",)

FULL_TURN = 2 * math.pi  # an angle beyond it is one in degrees


def value_of(name, word, place):
    if name == "frame":
        if word not in ("antenna", "sensor"):
            raise Error(f"{place}'{word}' is not known; frames are antenna and sensor")
        return word
    value = finite_number(word, place)
    if name == "bearing" and abs(value) > FULL_TURN:
        raise Error(f"{place}'{word}' is more than a full turn; bearings are in radians")
    if name not in ("beacon", "id"):
        return value
    if not value.is_integer() or abs(value) >= 2**31:
        raise Error(f"{place}'{word}' is not a whole number of 32 bits")
    return int(value)


def rows_of(path, kinds, recording):
    """Of a line that names the columns, in any order, then a line of as many fields for each row: the kind of table that it is, and
    {column: value} of each row, in order of time. Comments (#), blank lines, spaces and quotes around fields, CR LF and a byte
    order mark are passed over. `kinds`: names of columns; those that begin with ? may be missing. Every error is one line
    "FILE:LINE: column NAME: 'VALUE' ...". What filters reject, they count."""
    file, names, rows = os.path.basename(path), None, []
    for line, text in enumerate(lines_of(path), 1):
        words = [word.strip(' \t\r"') for word in text.split("#", 1)[0].split(",")]
        if words == [""]:
            continue
        place = f"{path}:{line}: "
        if names is None:
            names = [word.lower() for word in words]
            kind = next((each for each in kinds if set(names).issuperset(name for name in each if name[0] != "?")), None)
            if not kind or len(set(names)) < len(names):
                raise Error(f"{place}the columns are {','.join(names)}; {file} has {' or '.join(map(','.join, kinds))} (?: may be "
                            "missing), each once, separated by commas")
            continue
        if len(words) != len(names):
            raise Error(f"{place}{len(words)} fields, where the header names {len(names)} columns")
        rows.append({name: value_of(name, word, f"{place}column {name}: ")
                     for name, word in zip(names, words) if name in kind or f"?{name}" in kind})
    if names is None:
        raise Error(f"{path}: is empty; its first line has to name the columns")
    recording.notes += [f"{file}: column '{name}' is not used" for name in names if name not in kind and f"?{name}" not in kind]
    return kind, recording.in_order(file, rows, "t") if "t" in kind else rows


def note_degrees(rows, file, column, recording, turns=False):
    """Radians that go far from zero come in small steps (but `turns` stand each for themselves); degrees begin anywhere."""
    angles = [row[column] for row in rows]
    steps = angles if turns else [b - a for a, b in zip([0.0] + angles, angles)]
    largest = max(map(abs, angles), default=0.0)
    if largest > FULL_TURN and max(map(abs, steps)) > FULL_TURN:
        recording.notes.append(f"{file}: column '{column}' looks like degrees (it goes to {largest:.1f}); angles have to be in radians")


def read(directory, range_unit="m"):
    recording, there = Recording(), [name for name in READERS if os.path.exists(os.path.join(directory, name))]
    if not there:
        raise Error(f"{directory}: has none of {', '.join(READERS)}")
    for name in there:
        kinds, add_rows = READERS[name]
        add_rows(*rows_of(os.path.join(directory, name), kinds, recording), METRES_PER[range_unit], recording)
    recording.note_unit()
    return recording


def add_odometry(kind, rows, _, recording):
    given, begins_earlier = [tuple(row[name] for name in kind) for row in rows], kind[1] == "distance" and bool(rows)
    if begins_earlier:
        recording.add_steps(start_of_steps([row["t"] for row in rows]), given)
    elif kind[1] == "v":
        recording.add_velocities(given)
    else:
        recording.add_poses(given)
    merged = len(rows) + begins_earlier - len(recording.odometry)
    note_degrees(rows, "odometry.csv", kind[-1], recording, turns=kind[1] != "x")
    if merged:
        recording.notes.append(f"odometry.csv: {merged} rows merged with the row before, which has the same time")


def adding(name, entry):
    """What adds entry(row, unit) of each row to the list of that name."""
    return lambda _, rows, unit, recording: getattr(recording, name).extend(entry(row, unit) for row in rows)


def add_truth(_, rows, __, recording):
    recording.truth_has_heading = bool(rows) and "heading" in rows[0]
    if recording.truth_has_heading:
        note_degrees(rows, "ground_truth.csv", "heading", recording)
    recording.truth = [Truth(row["t"], (row["x"], row["y"], wrap_angle(row.get("heading", 0.0)))) for row in rows]


READERS = {
    "odometry.csv": ((("t", "x", "y", "heading"), ("t", "distance", "dheading"), ("t", "v", "omega")), add_odometry),
    "ranges.csv": ((("t", "beacon", "range", "?variance"),), adding("ranges", lambda row, unit: Range(
        row["t"], row["beacon"], unit * row["range"], unit * unit * row.get("variance", 0.0), "antenna"))),
    "beacons.csv": ((("beacon", "x", "y", "?z"),), adding("beacons", lambda row, _: Beacon(
        row["beacon"], row["x"], row["y"], row.get("z")))),
    "landmark_observations.csv": (
        (("t", "id", "range", "bearing", "?range_variance", "?bearing_variance"),),
        adding("observations", lambda row, unit: Observation(
            row["t"], row["id"], unit * row["range"], row["bearing"], unit * unit * row.get("range_variance", 0.0),
            row.get("bearing_variance", 0.0)))),
    "landmarks.csv": ((("id", "x", "y"),), adding("landmarks", lambda row, _: Landmark(row["id"], row["x"], row["y"], 0.0, 0.0))),
    "ground_truth.csv": ((("t", "x", "y", "?heading"),), add_truth),
    "frames.csv": ((("frame", "x", "y", "?z", "?yaw"),), adding("frames", lambda row, _: Frame(
        row["frame"], row["x"], row["y"], row.get("z", 0.0), wrap_angle(row.get("yaw", 0.0)))))}
