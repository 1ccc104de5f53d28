"""What a bag holds of a drive, for least squares (solve_drive)."""
import contextlib
import io
import json
import math
from collections import defaultdict
from functools import reduce

import numpy as np
from command_line import Error, answer_of
from messages import LANDMARK_TYPES, MRPT_LANDMARKS, RANGE_TYPES, SIGHTINGS, TAGS, described, header_at, ranges_of, transforms_in
from nav_msgs.msg import Path as PathMessage
from pf_resampling.msg import BeaconArray, LandmarkMap

from .maps import Map, match_by_nearest, usual_gate
from .paths import compose, interpolate, inverse
from .recorded_run import (FARTHEST, MAP, PATH, POSE_TYPES, believed_of, frames_on_robot, last_of, map_of, numbers_of, odometry_of,
                           path_of)

MOST_LANDMARKS = 5000  # more take two matrices of 0.8 GB
LONGEST_STEP = 0.5  # s from pose to pose, as in tools/common/batch_slam.cpp
MOST_POSES = 100000  # their equations take 2.4 GB; an hour has 7,200, or as many as it has observations


def drive_of(bag, topics, setup, listed=True):
    """As solve_drive reads it. `topics`: names by role, landmarks "/none" for ranges. `setup`: how the filters are configured.
    `listed`: with the beacons whose places are known."""
    with contextlib.redirect_stderr(io.StringIO()):  # rosbag and genpy say lines of their own of what is damaged
        return read_drive(bag, topics, setup, listed)


def read_drive(bag, topics, setup, listed):
    is_of_ranges = topics.landmarks not in bag.types and (topics.landmarks == "/none" or topics.ranges in bag.types)
    is_on_tf = is_of_ranges and setup.value("odometry_input/source") == "tf"
    odom = "/tf" if is_on_tf else topics.odom
    bag.require(odom, ["tf2_msgs/TFMessage"] if is_on_tf else POSE_TYPES, "--odom")
    if is_of_ranges:
        bag.require(topics.ranges, [*RANGE_TYPES, "sensor_msgs/Range"], "--ranges")
    else:
        bag.require(topics.landmarks, LANDMARK_TYPES, "--landmarks")
    observed = topics.ranges if is_of_ranges else topics.landmarks
    messages = bag.read(sorted({odom, observed, topics.beacons, "/tf_static", PATH, MAP}))
    for each in messages.values():
        each.sort(key=lambda message: message[2])
    name, frames = f"{bag.name}: {odom}", frames_on_robot(messages["/tf_static"], setup.value("frames/base"))
    odometry = odometry_on_tf(messages[odom], setup, name) if is_on_tf else odometry_of(messages[odom], name, odom)[0]
    drive = {"is_of_ranges": is_of_ranges, "online": False, "name": bag.name.rsplit("/", 1)[-1], "ids": "observations",
             "odometry": dict(zip(("time", "x", "y", "heading"), np.column_stack([odometry.time, odometry.pose]).T.tolist())),
             "odometry_noise": noise_of(messages[odom]), "ranges": [], "beacons": [], "scans": []}
    if is_of_ranges:
        drive["ranges"] = stamped_ranges(messages[topics.ranges], setup)
        if listed:
            drive["beacons"] = beacons_of(messages[topics.beacons], setup, f"{bag.name}: {topics.beacons}")
        for each in setup.lists["antennas"]:
            frames[str(each["frame"])] = translation(each["x"], each["y"], each.get("z", 0.0))
    else:
        drive["scans"] = scans_of(messages[topics.landmarks], frames, setup.value("frames/base"))
        take_ids_of_filter(drive, odometry, frames, messages, bag.name)
    require_size(drive)
    drive["frames"] = {name: [*place[:3, 3], math.atan2(place[1, 0], place[0, 0])] for name, place in frames.items()}
    return drive


def require_size(drive):
    """Raises Error for a drive of more landmarks or poses than memory can be expected to hold: one at each observation, and some in
    between, whether or not there is odometry."""
    landmarks = len({seen[0] for scan in drive["scans"] for seen in scan[2]})
    if landmarks > MOST_LANDMARKS:
        raise Error(f"{landmarks} landmarks: the batch solution takes {MOST_LANDMARKS} at most; give a part of the recording (rosbag filter)")
    odometry = np.array(drive["odometry"]["time"])
    seen = np.clip([each[0] for each in drive["ranges"] + drive["scans"]], odometry[0], odometry[-1])
    poses = 1 + np.ceil(np.diff(np.unique([odometry[0], *seen, odometry[-1]])) / LONGEST_STEP).sum()
    if poses > MOST_POSES:
        gap = np.argmax(np.diff(odometry))
        raise Error(f"the batch solution would need {poses:.0f} poses and takes {MOST_POSES} at most: give a part of the recording (rosbag "
                    f"filter). The odometry has a gap of {np.diff(odometry)[gap]:.0f} s after {odometry[gap]:.3f} s: was the clock set?")


def solution_of(drive, is_online=False):
    return answer_of("solve_drive", [], json.dumps(dict(drive, online=is_online)).encode())


def translation(x, y, z):
    place = np.eye(4)
    place[:3, 3] = x, y, z
    return place


def odometry_on_tf(messages, setup, name):
    wanted = setup.value("frames/odom"), setup.value("frames/base")
    found = [(header[0] + 1e-9 * header[1], *pose) for _, data, _ in messages for header, child, pose in transforms_in(data)
             if (header[2], child) == wanted]
    rows = np.array(sorted(found, key=lambda row: row[0])).reshape(-1, 8)
    return path_of(rows[:, 0], rows[:, 1:] @ np.eye(7, 43), name)


def noise_of(messages):
    """White noise of the odometry along, across and in heading, per sqrt(s): from the covariances of the twists, each that of
    the mean velocity since the message before. None if none is stated."""
    times, rows = numbers_of(messages, {"nav_msgs/Odometry": 43 + 6 + 36})  # pose, twist, covariance of that
    stated, steps = rows[:, [49, 49 + 7, 49 + 35]], np.diff(times, prepend=times[:1])
    is_finite = np.isfinite(stated).all(axis=1)
    variance, duration = sum((steps**2)[is_finite, None] * stated[is_finite]), sum(steps[is_finite])
    if not duration > 0 or not np.isfinite(variance).all() or (variance < 0).any() or not variance.any():
        return None
    return np.sqrt(variance / duration).tolist()


def stamped_ranges(messages, setup):
    """[(time, frame, beacon, range)]; messages of drivers name no frame."""
    found = []
    for connection, data, time in messages:
        if connection.datatype not in ("sensor_msgs/Range", *RANGE_TYPES):
            continue
        header, measured = ranges_of(connection, data, time, setup)
        frame = header[2] if connection.datatype == RANGE_TYPES[0] else ""
        if connection.datatype == "sensor_msgs/Range":
            frame = setup.value("range_input/antenna") or setup.value("frames/base")
        found += [(stamp or time, frame, beacon, size) for stamp, beacon, size in measured]
    return sorted(found, key=lambda each: each[0])


def beacons_of(messages, setup, name):
    """[(id, x, y, z or None, sigma)]: of the configuration, else as they were said last. A height of None or NaN: that of the
    antenna."""
    if setup.lists["beacons"]:
        return [(each["id"], each["x"], each["y"], each.get("z"), each.get("sigma", 0.0)) for each in setup.lists["beacons"]]
    last = last_of(messages, BeaconArray)
    found = [(each.id, *(each.position.x, each.position.y), None if math.isnan(each.position.z) else each.position.z, 0.0)
             for each in (last.beacons if last else [])]
    for number, x, y, z, _ in found:
        if not all(map(math.isfinite, (x, y, z or 0.0))):
            raise Error(f"{name}: the position of beacon {number} is not finite")
    return found


def scans_of(messages, frames, base):
    """[[time, frame, [[id, range, bearing, their variances]]]], without what is not finite. Tags are seen from the middle of the
    robot, by cameras that /tf_static places."""
    scans, tags, latest = [], defaultdict(list), {}
    for connection, data, time in messages:
        if connection.datatype not in LANDMARK_TYPES:
            continue
        seconds, nanoseconds, frame, _ = header_at(data)
        stamp, message = seconds + 1e-9 * nanoseconds, described(connection, data)
        if connection.datatype == SIGHTINGS:
            scans.append([stamp or time, frame, [[each.id, each.range, each.bearing, each.range_variance, each.bearing_variance]
                                                 for each in message.observations]])
        elif connection.datatype == MRPT_LANDMARKS:
            variances = [message.sensor_std_range**2, message.sensor_std_yaw**2]
            scans.append([stamp or time, frame, [[usable_id(each.id), each.range * math.cos(each.pitch), each.yaw, *variances]
                                                 for each in message.sensed_data]])
        elif stamp and frame in frames:
            for number, place in tags_in(message, *TAGS[connection.datatype]):
                x, y = (frames[frame] @ [*place, 1.0])[:2]
                if number >= 0 and math.isfinite(x + y) and latest.get((number, frame)) != stamp:
                    latest[number, frame] = stamp
                    tags[stamp, frame].append([number, math.hypot(x, y), math.atan2(y, x), 0.0, 0.0])
    scans += [[stamp, base, seen] for (stamp, _), seen in tags.items()]
    for scan in scans:
        scan[2] = [[*each[:3], *(np.nan_to_num(each[3:], posinf=1e300).tolist())] for each in scan[2]
                   if math.isfinite(each[1]) and math.isfinite(each[2])]
    return sorted(scans, key=lambda scan: scan[0])


def usable_id(number):
    return int(number) if 0 <= number <= 0x7fffffff else -1


def tags_in(message, name, number, place):
    for each in getattr(message, name):
        ids = getattr(each, number)
        at = reduce(getattr, place.split("."), each)
        if isinstance(ids, int) or len(ids) == 1:
            yield usable_id(ids if isinstance(ids, int) else ids[0]), (at.x, at.y, at.z)


# ---- without ids ----

def take_ids_of_filter(drive, odometry, frames, messages, name):
    """Where no observation has an id: those of the landmarks that it is of by the filter's last path and map."""
    path, found = last_of(messages[PATH], PathMessage), last_of(messages[MAP], LandmarkMap)
    has_ids = any(each[0] >= 0 for scan in drive["scans"] for each in scan[2])
    if has_ids or not path or not path.poses or not found or not found.landmarks:
        return
    drive["ids"] = "filter"
    believed = believed_of(path, f"{name}: {PATH}", np.zeros(3))
    associate(drive["scans"], believed, odometry, frames, map_of(found.landmarks, f"{name}: {MAP}"))


def associate(scans, path, odometry, frames, marks):
    """Each is of the nearest landmark within the usual gate, the nearest first, no landmark twice in a scan; others get -1.
    Between the path's poses the robot goes as the odometry says, and what is then missing to the next pose is added in proportion
    to the time."""
    gate = usual_gate(marks)
    for scan in scans:
        if scan[1] not in frames or not scan[2]:
            continue
        sensor = frames[scan[1]]
        eye = compose(robot_at(path, odometry, scan[0]), np.array([*sensor[:2, 3], math.atan2(sensor[1, 0], sensor[0, 0])]))
        seen = np.array([each[1:3] for each in scan[2]])
        direction = eye[2] + seen[:, 1]
        places = eye[:2] + np.clip(seen[:, :1], -FARTHEST, FARTHEST) * np.column_stack([np.cos(direction), np.sin(direction)])
        matches = dict(match_by_nearest(Map(None, places, None), marks, gate).tolist())
        for i, each in enumerate(scan[2]):
            each[0] = int(marks.id[matches[i]]) if i in matches else -1


def robot_at(path, odometry, time):
    """A path of few poses, at any time."""
    def reckoned(at):
        return interpolate(odometry, np.clip([at], odometry.time[0], odometry.time[-1]))[1].pose[0]

    after = np.searchsorted(path.time, time, side="right")
    before = max(after - 1, 0)
    start = inverse(reckoned(path.time[before]))
    here = compose(path.pose[before], compose(start, reckoned(time)))
    if after in (0, len(path)):
        return here
    share = (time - path.time[before]) / (path.time[after] - path.time[before])
    there = compose(path.pose[before], compose(start, reckoned(path.time[after])))
    return compose(here, share * compose(inverse(there), path.pose[after]))
