"""What stands in messages, as bytes or of packages that need not be there."""
import functools
import math
import re
import struct

import genpy.dynamic
from evaluation.recorded_run import SIZE, TIME
from pf_resampling.msg import LandmarkObservationArray
from sensor_msgs.msg import Range

# Those of drivers as in src/messages/foreign_messages.cpp.
RANGE_TYPES = ["pf_resampling/BeaconRange", "uwb_driver/UwbRange", "gtec_msgs/Ranging"]
LANDMARK_TYPES = [LandmarkObservationArray._type, "apriltag_ros/AprilTagDetectionArray", "fiducial_msgs/FiducialTransformArray",
                  "aruco_msgs/MarkerArray", "mrpt_msgs/ObservationRangeBearing"]
POSE = struct.Struct("<7d").unpack_from  # position and quaternion


def header_at(data, at=0):
    """(seconds, nanoseconds, frame, where it ends)"""
    end = at + 16 + SIZE(data, at + 12)[0]
    return (*TIME(data, at + 4), name_of(data[at + 16:end]), end)


def name_of(text):
    """Of a frame, as the filters compare them."""
    name = text.decode("utf-8", "replace")
    return name[1:] if name.startswith("/") else name


def transforms_in(data):
    """[(header, child frame, position and quaternion)] of a tf2_msgs/TFMessage."""
    at = 4
    for _ in range(SIZE(data)[0]):
        header = header_at(data, at)
        child = header[3] + 4 + SIZE(data, header[3])[0]
        yield header, name_of(data[header[3] + 4:child]), POSE(data, child)
        at = child + 56


def id_in(pattern, frame):
    match = re.fullmatch(pattern, frame) if pattern else None
    return int(match.group(1)) if match and re.fullmatch("[0-9]+", match.group(1)) else None


def pose_at(connection, data, base):
    """(header, child frame, position and quaternion) of odometry, or of a pose of the frame `base`."""
    header = header_at(data)
    child, begin = base, header[3]
    if connection.datatype == "nav_msgs/Odometry":
        begin += 4 + SIZE(data, begin)[0]
        child = name_of(data[header[3] + 4:begin])
    return header, child, POSE(data, begin)


@functools.lru_cache(maxsize=None)
def class_of(datatype, definition):
    return genpy.dynamic.generate_dynamic(datatype, definition)[datatype]


def described(connection, data):
    """A message of another package, by the definition in the bag."""
    return class_of(connection.datatype, connection.msg_def)().deserialize(data)


def ranges_of(connection, data, time, setup):
    """(header or None, [(time, beacon, range)]) of a message of any type that is taken."""
    if connection.datatype == "sensor_msgs/Range":
        header, message = header_at(data), Range().deserialize(data)
        beacon = setup.frames_of_beacons.get(header[2], id_in(setup.value("range_input/frame_pattern"), header[2]))
        is_inside = message.min_range == message.max_range == 0 or message.min_range <= message.range <= message.max_range
        seen = [(beacon, message.range)] if beacon is not None and is_inside else []
        header = (*header[:2], None, 0)  # the frame is the beacon's
    elif connection.datatype == "pf_resampling/BeaconRange":
        header = header_at(data)
        seen = [struct.unpack_from("<id", data, header[3])]
    else:
        message = described(connection, data)
        is_gtec = connection.datatype == "gtec_msgs/Ranging"
        stamp = divmod(round(1e9 * time), 10**9) if is_gtec else (message.header.stamp.secs, message.header.stamp.nsecs)
        header = (*stamp, setup.value("range_input/antenna") or setup.value("frames/base"), 0)
        seen = [(message.anchorId, 0.001 * message.range) if is_gtec else (message.responder_id, message.distance)]
    return header, [(header[0] + 1e-9 * header[1], *each) for each in seen if math.isfinite(each[1]) and each[1] > 0]
