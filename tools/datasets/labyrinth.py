"""The text format of TU Chemnitz (its readme; libRSF): a directory with one file *Input.txt (lines range2 and odom2diff) and,
if there is truth, one *GT.txt (lines point2, without heading). Beacons stand in the lines of the ranges. Velocities hold from
their time to the next one's.

Two things differ from what the readme says, as the recorded truth shows and libRSF's own factor (OdometryFactor2DDifferential)
confirms: the first velocity is that of the left wheel, the second of the right, and the "distance between wheels" is that from
the middle to a wheel: omega = (second - first) / (2 distance). The other readings leave the path of the recording more than
half a metre off, this one 6 cm.
"""
import os
from collections import Counter

from command_line import Error

from .files import finite_number, lines_of
from .recording import Beacon, Range, Recording, Truth

LINE = "text files of TU Chemnitz (Labyrinth, UWB)"
HELP = """Makes a bag of a directory with one file *Input.txt (lines range2 and
odom2diff) and, if there is truth, one *GT.txt (lines point2)."""
INPUT = "DIRECTORY"
EXAMPLES = ("labyrinth labyrinth_uwb labyrinth.bag",)


def lines(path, needed, ignored):
    """(kind, numbers) of the lines of the kinds that `needed` names with how many numbers they need; counts others in
    `ignored`."""
    for number, text in enumerate(lines_of(path), 1):
        kind, *words = text.split() or [""]
        if kind in needed:
            place = f"{path}:{number}: {kind}"
            if len(words) < needed[kind]:
                raise Error(f"{place} with {len(words)} numbers, {needed[kind]} are needed")
            yield kind, [finite_number(word, f"{place}: ") for word in words]
        elif kind:
            ignored[kind] += 1


def file_ending_with(directory, ending):
    """The one file of the directory with that ending; None if there is none."""
    found = [name for name in os.listdir(directory) if name.endswith(ending)]
    if len(found) > 1:
        raise Error(f"{directory}: has several files *{ending}; give a directory with one")
    return os.path.join(directory, found[0]) if found else None


def read(directory):
    path, truth = file_ending_with(directory, "Input.txt"), file_ending_with(directory, "GT.txt")
    if path is None:
        raise Error(f"{directory}: has no file *Input.txt")
    recording, ignored, beacons, velocities = Recording(), Counter(), {}, []
    for kind, numbers in lines(path, {"range2": 6, "odom2diff": 5}, ignored):
        if kind == "range2":
            time, distance, variance, x, y, beacon = numbers[:6]
            recording.ranges.append(Range(time, int(beacon), distance, variance, "antenna"))
            beacons[int(beacon)] = x, y
        else:
            time, left, right, sideways, half_distance = numbers[:5]
            velocities.append((time, 0.5 * (left + right), (right - left) / (2.0 * half_distance), sideways))
    recording.add_velocities(velocities)
    if not (recording.odometry or recording.ranges):
        raise Error(f"{path}: has no line range2 or odom2diff; is it a recording of this format?")
    recording.beacons = [Beacon(number, x, y, None) for number, (x, y) in beacons.items()]
    if truth:
        recording.truth = [Truth(time, (x, y, 0.0)) for _, (time, x, y, *_) in lines(truth, {"point2": 3}, ignored)]
    recording.notes = [f"{count} lines {kind} are not used" for kind, count in sorted(ignored.items())]
    return recording
