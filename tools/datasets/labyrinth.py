"""The text format of TU Chemnitz (its readme; libRSF): a directory with one file *Input.txt (lines range2 and odom2diff) and,
if there is truth, one *GT.txt (lines point2, without heading). Beacons stand in the lines of the ranges. Velocities hold from
their time to the next one's.

Two things differ from what the readme says, as the recorded truth shows and libRSF's own factor (OdometryFactor2DDifferential)
confirms: the first velocity is that of the left wheel, the second of the right, and the "distance between wheels" is that from
the middle to a wheel: omega = (second - first) / (2 distance). The other readings leave the path of the recording more than
half a metre off, this one 6 cm.
"""
import math
import os
from collections import Counter

from command_line import Error

from .files import finite_number, lines_of, require_directory
from .recording import Beacon, Odometry, Range, Recording, Truth, compose, midpoint_motion

LINE = "text files of TU Chemnitz (Labyrinth, UWB)"
HELP = """Makes a bag of a directory with one file *Input.txt (lines range2 and
odom2diff) and, if there is truth, one *GT.txt (lines point2)."""
INPUT = "DIRECTORY"
OPTIONS = ()
EXAMPLES = ("labyrinth labyrinth_uwb labyrinth.bag",)


class Line:
    """One measurement: its kind and the numbers behind it."""

    def __init__(self, place, kind, words, needed):
        self.place = f"{place}{kind}"
        self.numbers = [finite_number(word, f"{self.place}: ") for word in words]
        if len(self.numbers) < needed:
            raise Error(f"{self.place} with {len(self.numbers)} numbers, {needed} are needed")

    def require(self, good, what):
        if not good:
            raise Error(f"{self.place}: {what}")


def lines(path, needed, ignored):
    """The lines of the kinds that `needed` names with how many numbers they need; counts others in `ignored`."""
    last = {}
    for number, text in enumerate(lines_of(path), 1):
        kind, *words = text.split() or [""]
        if kind in needed:
            line = Line(f"{path}:{number}: ", kind, words, needed[kind])
            time = line.numbers[0]
            line.require(time >= last.get(kind, time), f"time {time:f} is before that of the line above of this kind")
            last[kind] = time
            yield kind, line
        elif kind:
            ignored[kind] += 1


def file_ending_with(directory, ending):
    """The one file of the directory with that ending; None if there is none."""
    found = [name for name in os.listdir(directory) if name.endswith(ending)]
    if len(found) > 1:
        raise Error(f"{directory}: has several files *{ending}; give a directory with one")
    return os.path.join(directory, found[0]) if found else None


def read(directory):
    require_directory(directory, "*Input.txt and *GT.txt")
    path, truth = file_ending_with(directory, "Input.txt"), file_ending_with(directory, "GT.txt")
    if path is None:
        raise Error(f"{directory}: has no file *Input.txt")
    recording, ignored, beacons = Recording(), Counter(), {}
    velocities = (0.0, 0.0, 0.0)
    for kind, line in lines(path, {"range2": 6, "odom2diff": 5}, ignored):
        if kind == "range2":
            add_range(line, beacons, recording)
        else:
            velocities = add_odometry(line, velocities, recording)
    if not (recording.odometry or recording.ranges):
        raise Error(f"{path}: has no line range2 or odom2diff; is it a recording of this format?")
    recording.beacons = [Beacon(number, x, y, None) for number, (x, y) in beacons.items()]
    if truth:
        recording.truth = [Truth(line.numbers[0], (line.numbers[1], line.numbers[2], 0.0))
                           for _, line in lines(truth, {"point2": 3}, ignored)]
    recording.notes = [f"{count} lines {kind} are not used" for kind, count in sorted(ignored.items())]
    return recording


def add_range(line, beacons, recording):
    """t, range, variance, beacon's x and y, id."""
    time, distance, variance, x, y, number = line.numbers[:6]
    line.require(number.is_integer() and -2**31 <= number < 2**31, f"the id {number:g} is not a whole number of 32 bits")
    line.require(distance >= 0, "negative range")
    line.require(variance >= 0, "negative variance")
    recording.ranges.append(Range(time, int(number), distance, variance, "antenna"))
    known = beacons.setdefault(int(number), (x, y))
    line.require(math.hypot(known[0] - x, known[1] - y) <= 1e-6,
                 f"beacon {int(number)} is not where it was in the lines above")


def add_odometry(line, velocities, recording):
    """t, velocity of the left wheel, of the right, to the side, half the distance of the wheels. `velocities` hold since the
    pose before: m/s ahead and to the left, rad/s; returns those from here on."""
    time, left, right, sideways, half_distance = line.numbers[:5]
    line.require(half_distance > 0, "distance of wheels is not positive")
    pose = (0.0, 0.0, 0.0)
    if recording.odometry:
        before = recording.odometry[-1]
        duration = time - before.time
        turn = velocities[2] * duration
        x, y, heading = midpoint_motion(velocities[0] * duration, turn)
        aside = velocities[1] * duration
        pose = compose(before.pose, (x - aside * math.sin(0.5 * turn), y + aside * math.cos(0.5 * turn), heading))
    if not recording.odometry or time > recording.odometry[-1].time:
        recording.odometry.append(Odometry(time, pose))
    return 0.5 * (left + right), sideways, (right - left) / (2.0 * half_distance)
