"""What a bag holds of a run: paths, maps, and what the filter said. Stamps are those of the headers, or of the bag where a
header has none."""
import os
import struct
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Optional

import nav_msgs.msg
import numpy as np
import rosbag
from pf_resampling.msg import BeaconArray, BeaconMap, FilterStatus, LandmarkMap, LandmarkObservationArray
from scipy.spatial.transform import Rotation
from tf2_msgs.msg import TFMessage

from .maps import Map
from .paths import Error, Path, path_of_place

# How many numbers of float64 follow the header and the names of frames.
NUMBERS = {"geometry_msgs/PointStamped": 3, "geometry_msgs/PoseStamped": 7, "geometry_msgs/PoseWithCovarianceStamped": 43,
           "nav_msgs/Odometry": 43}
TRUTH_TYPES = ["geometry_msgs/PoseStamped", "geometry_msgs/PointStamped", "nav_msgs/Odometry",
               "geometry_msgs/PoseWithCovarianceStamped"]
POSE_TYPES = ["geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry", "geometry_msgs/PoseStamped"]
STATUS, PATH, MAP, BEACON_MAP, TRUE_MAP = "/status", "/path", "/landmark_map", "/beacon_map", "/ground_truth_landmarks"
OF_MESSAGE = b"op=\x02"  # in the header of a record of a bag
SIZE, TIME = struct.Struct("<I").unpack_from, struct.Struct("<2I").unpack_from
NEAR = 0.1  # m, that a listed beacon is moved by what is found
FARTHEST = 1e9  # m; filters reject odometry from beyond


class RecordedBag:
    """The messages of some topics of a bag, read in one go."""

    def __init__(self, name):
        self.name = name
        if not os.path.isfile(name):
            raise Error(f"{name}: " + ("is not a regular file" if os.path.exists(name) else "there is no such file"))
        with open(name, "rb") as file:
            if file.read(9) != b"#ROSBAG V":
                raise Error(f"{name}: is not a bag (it does not begin like one)")
        try:
            self.bag = rosbag.Bag(name, skip_index=True)
            self.types = {}
            used = {number for chunk in self.bag._chunks for number in chunk.connection_counts}
            for connection in self.bag._get_connections():
                if connection.id in used:
                    self.types.setdefault(connection.topic, set()).add(connection.datatype)
        except Exception as error:  # whatever a damaged one leads to
            raise Error(f"{name}: is truncated or damaged ({error}); try: rosbag reindex {name}") from error

    def require(self, topic, types, option):
        if self.types.get(topic, set()).isdisjoint(types):
            known = ", ".join(f"{name} ({' or '.join(sorted(each))})" for name, each in sorted(self.types.items())) or "nothing"
            raise Error(f"{self.name}: has no {topic} of type {' or '.join(types)}; it has {known}; {option} names another topic")

    def read(self, topics):
        """[(connection, bytes, time in the bag)] of each topic, as they stand in the file. rosbag itself takes 20 us for each
        message, with its index: here the chunks that it unpacks are walked through, record by record."""
        messages, wanted = defaultdict(list), {each.id: each for each in self.bag._get_connections(topics)}
        try:
            for info in self.bag._chunks:
                if wanted.keys().isdisjoint(info.connection_counts):
                    continue
                self.bag._reader.seek_and_read_message_data_record((info.pos, 0), True)  # unpacks all of it
                chunk, offset = self.bag._reader.decompressed_chunk_io.getvalue(), 0
                while offset < len(chunk):  # a header, and data, each behind its size
                    begin = offset + 4 + SIZE(chunk, offset)[0]
                    header, offset = chunk[offset + 4:begin], begin + 4 + SIZE(chunk, begin)[0]
                    connection = wanted.get(SIZE(header, header.index(b"conn=") + 5)[0]) if OF_MESSAGE in header else None
                    if connection:
                        seconds, nanoseconds = TIME(header, header.index(b"time=") + 5)
                        messages[connection.topic].append((connection, chunk[begin + 4:offset], seconds + 1e-9 * nanoseconds))
        except Exception as error:
            raise Error(f"{self.name}: cannot be read to its end ({error}); try: rosbag reindex {self.name}") from error
        return messages


def unpacked(messages, kind):
    """Those of a class, as objects."""
    for connection, data, _ in messages:
        if connection.md5sum == kind._md5sum:
            yield kind().deserialize(data)


def numbers_of(messages):
    """Of messages with a pose or place: stamps, and rows of position, quaternion and 6 x 6 covariance; zeros where a message has
    none. Messages of other types are passed over."""
    messages = [each for each in messages if each[0].datatype in NUMBERS]
    times, rows = [], np.zeros((len(messages), max(NUMBERS.values())))
    for row, (connection, data, time) in zip(rows, messages):
        stamp, begin, count = TIME(data, 4), 16 + SIZE(data, 12)[0], NUMBERS[connection.datatype]
        if connection.datatype == "nav_msgs/Odometry":
            begin += 4 + SIZE(data, begin)[0]
        times.append(stamp[0] + 1e-9 * stamp[1] if any(stamp) else time)
        row[:count] = np.frombuffer(data, "<f8", count, begin)
    order = np.argsort(times, kind="stable")
    return np.array(times, float)[order], rows[order]


def yaw_of(x, y, z, w):
    return np.arctan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def path_of(times, rows, name):
    """Raises Error unless it is finite, and not empty."""
    if not len(times):
        raise Error(f"{name} is empty: it needs at least one pose")
    wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(wrong):
        raise Error(f"{name}: pose {wrong[0] + 1} of {len(times)} is not finite (time {times[wrong[0]]:.6f} s)")
    planar = rows[:, 7:].reshape(-1, 6, 6)[:, [0, 1, 5]][:, :, [0, 1, 5]]
    return Path(times, np.column_stack([rows[:, :2], yaw_of(*rows[:, 3:7].T)]), planar)


def truth_of(messages, name):
    """A point has no heading; nor has a pose with the quaternion 0, 0, 0, 0."""
    times, rows = numbers_of(messages)
    truth = path_of(times, rows[:, :7] @ np.eye(7, 43), name)
    truth.pose[~np.any(rows[:, 3:7], axis=1), 2] = np.nan
    truth.covariance = None
    return truth


def odometry_of(messages, name, topic):
    """Dead reckoning without what filters reject of it, and a line on how much that is; empty: nothing."""
    times, rows = numbers_of(messages)
    with np.errstate(invalid="ignore"):
        is_good = (np.isfinite(rows).all(axis=1) & (np.abs(rows[:, :2]) <= FARTHEST).all(axis=1)
                   & (np.abs(np.linalg.norm(rows[:, 3:7], axis=1) - 1) <= 0.01))
    if is_good.all() or messages[0][0].datatype != "nav_msgs/Odometry":
        return path_of(times, rows, name), ""
    left_out = (f"{np.count_nonzero(~is_good)} of {len(times)} messages of {topic} left out, which filters reject: they are not "
                "finite, or their orientation is not of length 1")
    if not is_good.any():
        raise Error(f"{name}: {left_out}")
    return path_of(times[is_good], rows[is_good], name), left_out


def last_of(messages, kind):
    """The last message of a class; None without one."""
    fitting = [each for each in messages if each[0].md5sum == kind._md5sum]
    return next(unpacked([max(reversed(fitting), key=lambda each: each[2])], kind)) if fitting else None


def map_of(landmarks, name):
    found = Map(np.array([mark.id for mark in landmarks], int),
                np.array([(mark.position.x, mark.position.y) for mark in landmarks], float).reshape(-1, 2),
                np.array([getattr(mark, "covariance", np.zeros(4)) for mark in landmarks], float).reshape(-1, 2, 2))
    is_finite = np.isfinite(found.position).all(axis=1) & np.isfinite(found.covariance).all(axis=(1, 2))
    if not is_finite.all():
        raise Error(f"{name}: landmark {found.id[~is_finite][0]} is not finite")
    return found


def place_on_robot(messages, wanted, base="base_link"):
    """Where the frame that the truth is about sits on the robot, in the plane: (x, y, heading); by the newest transforms of
    /tf_static, as the nodes find it going up from the frame to the base."""
    parents = {}
    for each in (each for message in unpacked(messages, TFMessage) for each in message.transforms):
        t, q = each.transform.translation, each.transform.rotation
        if abs(np.linalg.norm([q.x, q.y, q.z, q.w]) - 1) <= 0.01:
            parents[each.child_frame_id.lstrip("/")] = (each.header.frame_id.lstrip("/"), [t.x, t.y, t.z],
                                                        Rotation.from_quat([q.x, q.y, q.z, q.w]))
    name, place, ahead = wanted or "ground_truth", np.zeros(3), np.array([1.0, 0.0, 0.0])
    for _ in parents:  # so many at most, unless they are a circle
        if name in parents and name != base:
            name, shift, turn = parents[name]
            place, ahead = turn.apply(place) + shift, turn.apply(ahead)
    if name != base and wanted:
        raise Error(f"--truth-frame {wanted}: /tf_static does not place it on base_link; give one that it does")
    return np.array([*place[:2], np.arctan2(ahead[1], ahead[0])]) if name == base else np.zeros(3)


def summary_of(statuses):
    """What the filter said of its population; None if it said nothing."""
    if not statuses:
        return None
    last, renewals = statuses[-1], [each.distinct_ancestors_of_renewal for each in statuses if each.renewed]
    return {"particles": last.particles, "updates": last.updates, "renewals": last.renewals,
            "weight_resets": last.weight_resets, "distinct_ancestors_since_start": last.distinct_ancestors_since_start,
            "mean_effective_sample_size": np.mean([each.effective_sample_size for each in statuses]),
            "mean_distinct_ancestors_of_renewal": np.mean(renewals) if renewals else float(last.particles)}


def findings_of(status):
    return [{"kind": each.kind, "id": each.id, "begin": each.begin.to_sec(), "end": each.end.to_sec(),
             "place": [each.place.x, each.place.y], "size": each.size, "sigma": each.sigma, "probability": each.probability,
             "open": bool(each.open), "text": each.text} for each in status.findings]


@dataclass
class RecordedRun:
    truth: Optional[Path]  # while there is odometry
    estimate: Path  # of the place on the robot that the truth is about, as all paths are
    place: np.ndarray  # that place
    dead_reckoning: Optional[Path] = None
    odometry_left_out: str = ""
    believed: Optional[Path] = None  # the whole path at the end, if there is a map
    beacons: Map = field(default_factory=lambda: map_of([], ""))
    map: Optional[Map] = None
    true_map: Optional[Map] = None
    finds_beacons: bool = False  # which are the map
    frame_is_own: bool = False  # there is a map, and it was begun at nothing
    sees_without_ids: bool = False  # landmarks were seen, none of them with an id
    map_file: str = ""  # that the filter had loaded
    summary: Optional[dict] = None
    findings: list = field(default_factory=list)
    health: list = field(default_factory=list)  # [(time, name, number of places that fit)]


def truth_while_recording(truth, odometry):
    """A reference that was switched on earlier, or off later, is nothing a filter can be judged by."""
    part = truth.part((truth.time >= odometry.time[0]) & (truth.time <= odometry.time[-1]))
    if not len(part):
        raise Error(f"no pose of the ground truth lies in the time of the odometry ({odometry.time[0]:.6f} to "
                    f"{odometry.time[-1]:.6f} s): their clocks have to agree")
    return part


def sees_without_ids(messages):
    """Whether landmarks were seen, and none of them had an id: those of the map are numbers that the filter gave."""
    return max((seen.id for scan in unpacked(messages, LandmarkObservationArray) for seen in scan.observations), default=0) < 0


def read_run(bag, given, with_odometry, with_truth):
    """`given`: the options. Raises Error: the bag holds what makes no sense, or lacks a frame."""
    sightings = [topic for topic, types in bag.types.items() if LandmarkObservationArray._type in types]
    topics = [given.pose, given.beacons, "/tf_static", STATUS, PATH, MAP, BEACON_MAP, TRUE_MAP, *sightings]
    topics += [given.odom] if with_odometry else []
    topics += [given.truth] if with_truth else []
    messages = bag.read(sorted(set(topics)))

    def name(topic):
        return f"{bag.name}: {topic}"

    place = place_on_robot(messages["/tf_static"], given.truth_frame)
    estimate = path_of_place(path_of(*numbers_of(messages[given.pose]), name(given.pose)), place)
    truth = truth_of(messages[given.truth], name(given.truth)) if with_truth else None
    run = RecordedRun(truth, estimate, place)
    if with_odometry:
        odometry, run.odometry_left_out = odometry_of(messages[given.odom], name(given.odom), given.odom)
        run.dead_reckoning = path_of_place(odometry, place)
        run.truth = truth_while_recording(truth, odometry) if with_truth else None
    listed = last_of(messages[given.beacons], BeaconArray)
    run.beacons = map_of(listed.beacons if listed else [], name(given.beacons))
    found = last_of(messages[MAP], LandmarkMap)
    real = last_of(messages[TRUE_MAP], LandmarkMap)
    beacon_map = last_of(messages[BEACON_MAP], BeaconMap)
    run.true_map = map_of(real.landmarks, name(TRUE_MAP)) if real else None
    last = last_of(messages[PATH], nav_msgs.msg.Path)
    if found:
        run.map = map_of(found.landmarks, name(MAP))
        if last and last.poses:
            run.believed = believed_of(last, name(PATH), place)
    elif beacon_map:
        run.finds_beacons, places = True, beacon_map.places
        # Of each beacon the likeliest place, which is the first.
        run.map = map_of([each for before, each in zip([None] + places, places) if not before or before.id != each.id],
                         name(BEACON_MAP))
        run.true_map = run.beacons if len(run.beacons.id) else None
    run.sees_without_ids = sees_without_ids([each for topic in sightings for each in messages[topic]])
    statuses = [(status.header.stamp.to_sec() or each[2], status) for each in messages[STATUS]
                for status in unpacked([each], FilterStatus)]
    run.summary = summary_of([status for _, status in statuses])
    run.health = sorted(((time, status.health, len(status.hypotheses)) for time, status in statuses if status.health),
                        key=lambda each: each[0])
    if statuses:
        run.findings, run.map_file = findings_of(statuses[-1][1]), statuses[-1][1].map_file
    is_listed = run.finds_beacons and lies_on(run.beacons, run.map)
    run.frame_is_own = run.map is not None and "/initialpose" not in bag.types and not run.map_file and not is_listed
    return run


def lies_on(listed, found):
    """Whether two beacons were found where they are listed: the filter began with the list, and has its frame."""
    place = dict(zip(listed.id, listed.position))
    return sum(np.hypot(*(there - place.get(id, np.inf))) < NEAR for id, there in zip(found.id, found.position)) >= 2


def believed_of(message, name, place):
    rows = np.zeros((len(message.poses), 43))
    for row, each in zip(rows, message.poses):
        p, q = each.pose.position, each.pose.orientation
        row[:7] = p.x, p.y, p.z, q.x, q.y, q.z, q.w
    times = np.array([each.header.stamp.to_sec() for each in message.poses])
    order = np.argsort(times, kind="stable")
    return path_of_place(path_of(times[order], rows[order], name), place)
