"""What a robot recorded on a drive, whatever file it came from: readers fill a Recording, bag.py makes a bag of it.

Times are in seconds, on one clock, and each list is in their order. Poses are (x, y, heading): m and rad, counter-clockwise
from x. Angles go through `math`, whose values are those of the C library; numpy's may differ in the last bit.
"""
import math
from bisect import bisect_left
from collections import namedtuple

METRES_PER = {"m": 1.0, "ft": 0.3048, "cm": 0.01, "mm": 0.001}
RANGE_UNIT = {"--range-unit": {"metavar": "m|ft|cm|mm", "choices": METRES_PER, "default": "m",
                               "help": "unit of the measured ranges (=%(default)s)"}}
FEWEST_RANGES_FOR_RATIO = 10

Odometry = namedtuple("Odometry", "time pose")  # dead reckoning from the origin of the frame "odom"
Range = namedtuple("Range", "time beacon range variance frame")  # m, m^2 (0: unknown), the antenna's frame
Beacon = namedtuple("Beacon", "id x y z")  # frame "map"; z None: as high as the antenna
# Of one landmark; those of equal time are a scan. Frame "sensor"; id -1: unknown; variances 0: unknown.
Observation = namedtuple("Observation", "time id range bearing range_variance bearing_variance")
Landmark = namedtuple("Landmark", "id x y sigma_x sigma_y")  # frame "map"
Truth = namedtuple("Truth", "time pose")  # frame "map"; the heading counts if truth_has_heading
Frame = namedtuple("Frame", "name x y z yaw")  # where it sits on base_link


class Recording:
    def __init__(self):
        self.odometry, self.ranges, self.beacons, self.observations, self.landmarks = [], [], [], [], []
        self.truth, self.truth_has_heading, self.frames = [], False, []
        self.notes = []  # what the reader found and did, for people

    def add_pose(self, time, pose):
        """Of the odometry; one at the same time replaces the last."""
        if self.odometry and time <= self.odometry[-1].time:
            self.odometry.pop()
        self.odometry.append(Odometry(time, pose))

    def add_poses(self, rows):
        """Odometry of (s, x, y, heading) in a frame of its own, taken to begin at the origin."""
        for time, *pose in rows:
            self.add_pose(time, relative(rows[0][1:4], pose))

    def add_steps(self, start, rows):
        """Odometry of (s, m driven and rad turned since the row before), from `start` on, by the mid-point rule."""
        pose = (0.0, 0.0, 0.0)
        self.add_pose(start, pose)
        for time, distance, turn, *_ in rows:
            pose = compose(pose, midpoint_motion(distance, turn))
            self.add_pose(time, pose)

    def add_velocities(self, rows):
        """Odometry of (s, m/s ahead, rad/s, and m/s to the left, if any), each of which holds until the next row."""
        pose = (0.0, 0.0, 0.0)
        for (before, *velocities), (time, *_) in zip(rows[:1] + rows, rows):
            pose = compose(pose, midpoint_motion(*(each * (time - before) for each in velocities)))
            self.add_pose(time, pose)

    def in_order(self, name, rows, time=0):
        """Rows in order of time, however the file has them; `time`: its column."""
        ordered = sorted(rows, key=lambda row: row[time])
        if ordered != rows:
            self.notes.append(f"{name}: rows put in order of time")
        return ordered

    def note_unit(self):
        """Of ranges that are not in metres, as the true distances tell."""
        ratio = median_range_ratio(self)
        unit = ratio and min(METRES_PER, key=lambda unit: abs(math.log(ratio * METRES_PER[unit])))
        if unit not in (None, "m"):
            self.notes.append(f"ranges are {ratio:.2f} times the true distances: are they in another unit? --range-unit {unit} "
                              "would make metres of them")


def wrap_angle(angle):
    """To [-pi, pi]; nan of what is not finite."""
    return math.remainder(angle, 2 * math.pi) if math.isfinite(angle) else math.nan


def compose(first, second):
    """`first`, then `second`, which is given in the frame of the former."""
    cosine, sine = math.cos(first[2]), math.sin(first[2])
    return (first[0] + cosine * second[0] - sine * second[1], first[1] + sine * second[0] + cosine * second[1],
            wrap_angle(first[2] + second[2]))


def relative(origin, pose):
    """`pose` seen from `origin`."""
    cosine, sine = math.cos(origin[2]), math.sin(origin[2])
    dx, dy = pose[0] - origin[0], pose[1] - origin[1]
    return cosine * dx + sine * dy, -sine * dx + cosine * dy, wrap_angle(pose[2] - origin[2])


def midpoint_motion(distance, turn, aside=0.0):
    """The pose after `distance` while the heading turns by `turn`: the chord points half the turn to the left."""
    half = 0.5 * turn if math.isfinite(turn) else math.nan
    return (distance * math.cos(half) - aside * math.sin(half), distance * math.sin(half) + aside * math.cos(half),
            wrap_angle(turn))


def upper_median(values):
    return sorted(values)[len(values) // 2]


def start_of_steps(times):
    """When a recording of steps began whose first one ended at times[0]: a median interval (or 1 s) earlier."""
    intervals = [b - a for a, b in zip(times, times[1:])]
    return times[0] - (upper_median(intervals) if intervals else 1.0)


def median_range_ratio(recording):
    """The median of range over true distance, about 1 in metres and 3.28 in feet; None if fewer than ten can be compared."""
    beacons = {beacon.id: beacon for beacon in recording.beacons}
    times = [truth.time for truth in recording.truth]
    ratios = []
    for heard in recording.ranges:
        beacon, after = beacons.get(heard.beacon), bisect_left(times, heard.time)
        if beacon is None or after == len(times) or (after == 0 and times[0] > heard.time):
            continue
        x, y, _ = recording.truth[after].pose
        distance = math.hypot(x - beacon.x, y - beacon.y)
        if distance > 0:
            ratios.append(heard.range / distance)
    return upper_median(ratios) if len(ratios) >= FEWEST_RANGES_FOR_RATIO else None
