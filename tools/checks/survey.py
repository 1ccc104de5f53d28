"""What a bag holds for the filters, before anything is judged."""
import re
from dataclasses import dataclass, field

import numpy as np
from evaluation.recorded_run import unpacked
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from pf_resampling.msg import BeaconArray, BeaconRange
from tf2_msgs.msg import TFMessage

ODOMETRY_TYPES = ["nav_msgs/Odometry", "geometry_msgs/PoseWithCovarianceStamped"]
# Those of drivers as in src/messages/foreign_messages.cpp.
RANGE_TYPES = ["pf_resampling/BeaconRange", "uwb_driver/UwbRange", "gtec_msgs/Ranging"]
LANDMARK_TYPES = ["pf_resampling/LandmarkObservationArray", "apriltag_ros/AprilTagDetectionArray",
                  "fiducial_msgs/FiducialTransformArray", "aruco_msgs/MarkerArray", "mrpt_msgs/ObservationRangeBearing"]
SAME_MOMENT = 0.5  # s
FEWEST_PAIRS = 20
# Shares of the pairs of ranges that do not fit: no unit is to have more than the first, that of the beacons has to have more
# than the second. A sum or a difference may be off by SLACK of the distance.
FITS, DOES_NOT_FIT, SLACK = 0.1, 0.2, 0.1
UNITS = [(1.0, None), (1000.0, "1000 times too long", "ranges were in millimetres"),  # scale of the ranges
         (100.0, "100 times too long", "ranges were in centimetres"), (1 / 0.3048, "3.3 times too long", "ranges were in feet"),
         (0.001, "1000 times too short", "the beacons were in millimetres"),
         (0.01, "100 times too short", "the beacons were in centimetres"),
         (0.3048, "3.3 times too short", "the beacons were in feet")]


@dataclass
class Survey:
    types: dict  # of the topics
    ranges: str  # the topic: of sensor_msgs/Range where there are no others
    odometry_frames: set = field(default_factory=set)
    base_frames: set = field(default_factory=set)  # child frames of the odometry
    range_frames: set = field(default_factory=set)
    transforms: set = field(default_factory=set)  # (parent, child), of /tf, without tags
    has_tags: bool = False  # on /tf
    beacons: dict = field(default_factory=dict)  # id: (x, y)
    beacon_frame: str = ""


def survey_of(bag, topics, setup):
    """`topics`: names by role. `setup`: how the filters are configured. Raises whatever a damaged message leads to."""
    odom, base, space = (setup.value(f"frames/{name}") for name in ("odom", "base", "map"))
    types = {name: sorted(each)[-1] for name, each in sorted(bag.types.items())}
    has_others = topics.ranges in types or types.get(topics.sensor_ranges) != "sensor_msgs/Range"
    survey = Survey(types, topics.ranges if has_others else topics.sensor_ranges)
    messages = bag.read(sorted({topics.odom, topics.ranges, topics.beacons, "/tf", "/tf_static"}))
    on_tf, on_tf_static = ({(each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/"))
                            for message in unpacked(messages[topic], TFMessage) for each in message.transforms}
                           for topic in ("/tf", "/tf_static"))
    pattern = setup.value("landmark_input/tag_pattern")
    tags = {(parent, child) for parent, child in on_tf | on_tf_static if is_tag(pattern, child) and parent not in (space, odom)}
    survey.transforms, survey.has_tags = on_tf - tags, bool(tags)
    if setup.value("odometry_input/source") != "tf":
        poses = {(message.header.frame_id, base) for message in unpacked(messages[topics.odom], PoseWithCovarianceStamped)}
        frames = poses | {(message.header.frame_id, message.child_frame_id) for message in unpacked(messages[topics.odom], Odometry)}
    else:
        frames = {(odom, base)} & (on_tf | on_tf_static)
    survey.odometry_frames, survey.base_frames = ({names[i].lstrip("/") for names in frames} for i in (0, 1))
    if types.get(topics.ranges) in RANGE_TYPES[1:]:  # of drivers that name no frame
        survey.range_frames = {setup.value("range_input/antenna") or base}
    else:
        survey.range_frames = {each.header.frame_id.lstrip("/") for each in unpacked(messages[topics.ranges], BeaconRange)}
    survey.beacons = {each["id"]: (each["x"], each["y"]) for each in setup.lists["beacons"]}
    for message in unpacked(messages[topics.beacons], BeaconArray) if not survey.beacons else ():
        survey.beacon_frame = message.header.frame_id.lstrip("/")
        survey.beacons = {each.id: (each.position.x, each.position.y) for each in message.beacons}
    return survey


def is_tag(pattern, frame):
    match = re.fullmatch(pattern, frame) if pattern else None
    return bool(match and re.fullmatch("[0-9]+", match.group(1)))


def unit_of_ranges(measured, beacons):
    """(how many times too long, as if what) they are, or None if they fit the beacons' places, or no unit fits much better:
    with the distance d between two beacons, ranges of the same moment have a sum of at least d and a difference of at most d.
    `measured`: rows of time, beacon and range."""
    known = np.array([(time, size, *beacons[beacon]) for time, beacon, size in measured if beacon in beacons]).reshape(-1, 4)
    distance = np.hypot(*np.diff(known[:, 2:], axis=0).T)
    pairs = (distance > 0) & (np.abs(np.diff(known[:, 0])) <= SAME_MOMENT)
    if np.count_nonzero(pairs) < FEWEST_PAIRS:
        return None
    a, b, distance = known[:-1, 1][pairs], known[1:, 1][pairs], distance[pairs]
    misfits = [np.mean(((a + b) / unit[0] < (1 - SLACK) * distance) | (np.abs(a - b) / unit[0] > (1 + SLACK) * distance))
               for unit in UNITS]
    # Ranges that are all alike, of a robot that stands, fit each unit that makes them long enough.
    if misfits[0] < DOES_NOT_FIT or sum(share <= FITS for share in misfits) != 1:
        return None
    return UNITS[int(np.argmin(misfits))][1:]
