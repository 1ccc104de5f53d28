"""What a bag holds for the filters, before anything is judged."""
import math
from dataclasses import dataclass, field

import numpy as np
from evaluation.paths import key_poses, wrapped
from evaluation.recorded_run import unpacked, yaw_of
from messages import LANDMARK_TYPES, RANGE_TYPES, header_at, id_in, pose_at, ranges_of, transforms_in
from pf_resampling.msg import BeaconArray

ODOMETRY_TYPES = ["nav_msgs/Odometry", "geometry_msgs/PoseWithCovarianceStamped"]
SAME_MOMENT = 0.5  # s
FEWEST_PAIRS, FEWEST_TURNS = 20, 20
# Shares of the pairs of ranges that do not fit: no unit is to have more than the first, that of the beacons has to have more
# than the second. A sum or a difference may be off by SLACK of the distance.
FITS, DOES_NOT_FIT, SLACK = 0.1, 0.2, 0.1
UNITS = [(1.0, None), (1000.0, "1000 times too long", "ranges were in millimetres"),  # scale of the ranges
         (100.0, "100 times too long", "ranges were in centimetres"), (1 / 0.3048, "3.3 times too long", "ranges were in feet"),
         (0.001, "1000 times too short", "the beacons were in millimetres"),
         (0.01, "100 times too short", "the beacons were in centimetres"),
         (0.3048, "3.3 times too short", "the beacons were in feet")]
PIECE = 0.05  # m, of way that has a course
TURNS = math.radians(0.5), math.radians(3.0)  # between two pieces, that tell something


class Heard:
    """What came on a topic, of the messages whose stamps filters do not reject as none."""

    def __init__(self, topic):
        self.topic, self.stamps, self.delays, self.frames = topic, [], [], set()

    def add(self, header, time):
        seconds, nanoseconds, _, _ = header
        if 0 < seconds + nanoseconds and seconds <= 0x7fffffff:
            self.stamps.append(seconds + 1e-9 * nanoseconds)
            self.delays.append(abs(self.stamps[-1] - time))

    def longest_gap(self):
        """(s, when it begins), between the latest stamp and the next."""
        latest = np.maximum.accumulate(self.stamps or [0.0])
        gaps = np.array(self.stamps[1:]) - latest[:-1]
        return (max(gaps), latest[np.argmax(gaps)]) if len(gaps) else (0.0, 0.0)


@dataclass
class Survey:
    types: dict  # of the topics
    odometry: Heard
    ranges: Heard  # of sensor_msgs/Range where there are no others
    landmarks: Heard
    base_frames: set = field(default_factory=set)  # child frames of the odometry
    transforms: set = field(default_factory=set)  # (parent, child), of /tf
    poses: list = field(default_factory=list)  # (x, y, heading), of the odometry
    measured: list = field(default_factory=list)  # (time, beacon, range), positive ones
    beacons: dict = field(default_factory=dict)  # id: (x, y)
    beacon_frame: str = ""


def survey_of(bag, topics, setup):
    """`topics`: names by role. `setup`: how the filters are configured. Raises whatever a damaged message leads to."""
    is_on_tf = setup.value("odometry_input/source") == "tf"
    types = {name: sorted(each)[-1] for name, each in sorted(bag.types.items())}
    has_others = topics.ranges in types or types.get(topics.sensor_ranges) != "sensor_msgs/Range"
    survey = Survey(types, Heard("/tf (odometry)" if is_on_tf else topics.odom),
                    Heard(topics.ranges if has_others else topics.sensor_ranges), Heard(topics.landmarks))
    survey.beacons = {each["id"]: (each["x"], each["y"]) for each in setup.lists["beacons"]}
    wanted = [topics.odom, survey.ranges.topic, topics.landmarks, topics.beacons, "/tf", "/tf_static"]
    messages = bag.read(sorted(set(wanted)))
    for each in messages.values():
        each.sort(key=lambda message: message[2])
    if not is_on_tf:
        for connection, data, time in messages[topics.odom]:
            if connection.datatype in ODOMETRY_TYPES:
                note_pose(survey, *pose_at(connection, data, setup.value("frames/base")), time)
    for topic in ("/tf_static", "/tf"):
        for connection, data, time in messages[topic]:
            if connection.datatype == "tf2_msgs/TFMessage":
                note_transforms(survey, setup, topic, transforms_in(data), time)
    for connection, data, time in messages[survey.ranges.topic]:
        if connection.datatype in ("sensor_msgs/Range", *RANGE_TYPES):
            header, measured = ranges_of(connection, data, time, setup)
            survey.ranges.add(header, time)
            survey.ranges.frames |= {header[2]} - {None}
            survey.measured += measured
    for connection, data, time in messages[topics.landmarks]:
        if connection.datatype in LANDMARK_TYPES:
            survey.landmarks.add(header_at(data), time)
    if not survey.beacons:
        for message in unpacked(messages[topics.beacons], BeaconArray):
            survey.beacon_frame = message.header.frame_id.lstrip("/")
            survey.beacons = {each.id: (each.position.x, each.position.y) for each in reversed(message.beacons)}
    return survey


def note_pose(survey, header, child, pose, time):
    survey.odometry.add(header, time)
    survey.odometry.frames.add(header[2])
    survey.base_frames.add(child)
    survey.poses.append((pose[0], pose[1], float(yaw_of(*pose[3:]))))


def note_transforms(survey, setup, topic, transforms, time):
    odom, base, space = (setup.value(f"frames/{name}") for name in ("odom", "base", "map"))
    for header, child, pose in transforms:
        parent = header[2]
        if id_in(setup.value("landmark_input/tag_pattern"), child) is not None and parent not in (space, odom):
            survey.landmarks.topic = "/tf (tags)"
            survey.landmarks.add(header, time)
            survey.landmarks.frames.add(parent)
            continue
        if setup.value("odometry_input/source") == "tf" and (parent, child) == (odom, base):
            note_pose(survey, header, child, pose, time)
        if topic == "/tf":
            survey.transforms.add((parent, child))


def unit_of_ranges(measured, beacons):
    """(how many times too long, as if what) they are, or None if they fit the beacons' places, or no unit fits much better:
    with the distance d between two beacons, ranges of the same moment have a sum of at least d and a difference of at most d."""
    known = np.array([(time, size, *beacons[beacon]) for time, beacon, size in measured if beacon in beacons])
    if len(known) < 2:
        return None
    ids = [beacon in beacons for _, beacon, _ in measured]
    is_next = np.diff(np.flatnonzero(ids)) == 1  # as they came, with none between
    distance = np.hypot(*np.diff(known[:, 2:], axis=0).T)
    pairs = is_next & (distance > 0) & (np.abs(np.diff(known[:, 0])) <= SAME_MOMENT)
    if np.count_nonzero(pairs) < FEWEST_PAIRS:
        return None
    a, b, distance = known[:-1, 1][pairs], known[1:, 1][pairs], distance[pairs]
    misfits = [np.mean(((a + b) / unit[0] < (1 - SLACK) * distance) | (np.abs(a - b) / unit[0] > (1 + SLACK) * distance))
               for unit in UNITS]
    best = int(np.argmin(misfits))
    # Ranges that are all alike, of a robot that stands, fit each unit that makes them long enough.
    if misfits[0] < DOES_NOT_FIT or sum(share <= FITS for share in misfits) != 1:
        return None
    return UNITS[best][1:]


def turns_in_degrees(poses):
    """Whether odometry turns, beside its way, as if a heading in degrees was taken as one in radians."""
    poses = np.array(poses).reshape(-1, 3)
    pieces = poses[key_poses(poses, PIECE)] if len(poses) else poses
    turns = wrapped(np.diff(np.arctan2(*np.diff(pieces[:, 1::-1], axis=0).T)))
    tells = (np.abs(turns) > TURNS[0]) & (np.abs(turns) < TURNS[1])
    ratios = wrapped(np.diff(pieces[1:, 2]))[tells] / turns[tells]
    return len(ratios) >= FEWEST_TURNS and 30 < sorted(ratios)[len(ratios) // 2] < 90
