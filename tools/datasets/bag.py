"""Writes a Recording as the messages that the nodes read, in order of time."""
import math
from itertools import groupby

import geometry_msgs.msg as geometry
import nav_msgs.msg as nav
import pf_resampling.msg as own
import rosbag
from command_line import Error
from genpy import Time
from tf2_msgs.msg import TFMessage

from .recording import Frame, relative

LATEST = 2.0**32 - 1  # s, of a time in ROS
# s, by which beacons and frames precede all else: readers of bags see equal times in any order, and a range whose antenna
# is not yet known is lost.
HEAD_START = 1e-3


def write_recording(recording, path):
    """Writes a new bag: odom, ranges, beacons (latched), landmarks, ground_truth, ground_truth_landmarks (latched), tf,
    tf_static (latched).

    Bag time is the stamp. Twists are those between two poses of the odometry. An antenna or sensor that the recording does
    not place is put at base_link. A recording that begins at or before time zero, which ROS takes for "no time", is shifted
    to begin at 1 s. Raises Error if there is nothing in the recording, or a time that ROS cannot hold."""
    start, shift = span_of(recording)
    with rosbag.Bag(path, "w") as bag:
        Writer(recording, bag, shift).write(start)


def span_of(recording):
    """The earliest time, and what is added to all."""
    times = [entry.time for entries in (recording.odometry, recording.ranges, recording.observations, recording.truth)
             for entry in entries]
    if not all(map(math.isfinite, times)):
        raise Error("recording with a time that is not finite")
    if not (times or recording.beacons or recording.landmarks):
        raise Error("recording with nothing in it")
    earliest, latest = (min(times), max(times)) if times else (1.0, 1.0)
    shift = 1.0 - math.floor(earliest) if earliest < 10 * HEAD_START else 0.0
    if not (latest + shift < LATEST and earliest + shift > 0):
        raise Error(f"times from {earliest:.10g} to {latest:.10g} are beyond what ROS can hold; times are in seconds")
    return earliest, shift


class Writer:
    def __init__(self, recording, bag, shift):
        self.recording, self.bag, self.shift = recording, bag, shift

    def write(self, start):
        self.write_static(self.stamp(start - HEAD_START))
        # At equal times truth, then odometry, ranges, scans.
        writers = (self.write_truth, self.write_odometry, self.write_range, self.write_scan)
        scans = [list(scan) for _, scan in groupby(self.recording.observations, key=lambda seen: seen.time)]
        odometry = zip([None] + self.recording.odometry, self.recording.odometry)
        events = [(truth.time, 0, truth) for truth in self.recording.truth]
        events += [(now.time, 1, (before, now)) for before, now in odometry]
        events += [(heard.time, 2, heard) for heard in self.recording.ranges]
        events += [(scan[0].time, 3, scan) for scan in scans]
        for time, kind, what in sorted(events, key=lambda event: event[:2]):
            writers[kind](self.stamp(time), what)

    def stamp(self, time):
        """As roscpp rounds it: to the nearest nanosecond."""
        time += self.shift
        seconds = math.floor(time)
        exact = (time - seconds) * 1e9
        nanoseconds = math.ceil(exact)
        return Time(seconds, nanoseconds - (nanoseconds - exact > 0.5))

    def stamped(self, kind, stamp, frame):
        message = kind()
        message.header.stamp, message.header.frame_id = stamp, frame
        return message

    def write_latched(self, topic, stamp, message):
        self.bag.write(topic, message, stamp, connection_header={
            "topic": topic, "type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text,
            "callerid": "/pf_resampling", "latching": "1"})

    def quaternion(self, yaw):
        return geometry.Quaternion(0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))

    def pose(self, pose):
        return geometry.Pose(geometry.Point(pose[0], pose[1], 0.0), self.quaternion(pose[2]))

    def transform(self, stamp, parent, child, place, rotation):
        transform = self.stamped(geometry.TransformStamped, stamp, parent)
        transform.child_frame_id = child
        transform.transform = geometry.Transform(geometry.Vector3(*place), rotation)
        return transform

    def write_static(self, stamp):
        recording = self.recording
        placed = {frame.name for frame in recording.frames}
        used = {heard.frame for heard in recording.ranges} | ({"sensor"} if recording.observations else set())
        frames = recording.frames + [Frame(name, 0.0, 0.0, 0.0, 0.0) for name in sorted(used - placed)]
        if frames:
            self.write_latched("/tf_static", stamp, TFMessage(
                [self.transform(stamp, "base_link", f.name, (f.x, f.y, f.z), self.quaternion(f.yaw)) for f in frames]))
        if recording.beacons:
            height = next((frame.z for frame in recording.frames if frame.name.startswith("antenna")), 0.0)
            message = self.stamped(own.BeaconArray, stamp, "map")
            message.beacons = [
                own.BeaconPosition(b.id, geometry.Point(b.x, b.y, height if b.z is None else b.z))
                for b in recording.beacons]
            self.write_latched("/beacons", stamp, message)
        if recording.landmarks:
            message = self.stamped(own.LandmarkMap, stamp, "map")
            message.landmarks = [
                own.Landmark(mark.id, geometry.Point(mark.x, mark.y, 0.0),
                                  [mark.sigma_x * mark.sigma_x, 0.0, 0.0, mark.sigma_y * mark.sigma_y])
                for mark in recording.landmarks]
            self.write_latched("/ground_truth_landmarks", stamp, message)

    def write_truth(self, stamp, truth):
        if self.recording.truth_has_heading:
            message = self.stamped(geometry.PoseStamped, stamp, "map")
            message.pose = self.pose(truth.pose)
        else:
            message = self.stamped(geometry.PointStamped, stamp, "map")
            message.point = geometry.Point(truth.pose[0], truth.pose[1], 0.0)
        self.bag.write("/ground_truth", message, stamp)

    def write_odometry(self, stamp, pair):
        before, now = pair
        message = self.stamped(nav.Odometry, stamp, "odom")
        message.child_frame_id = "base_link"
        message.pose.pose = self.pose(now.pose)
        duration = now.time - before.time if before else 0.0
        if duration > 0:
            forward, left, turn = relative(before.pose, now.pose)
            message.twist.twist.linear = geometry.Vector3(forward / duration, left / duration, 0.0)
            message.twist.twist.angular.z = turn / duration
        self.bag.write("/odom", message, stamp)
        self.bag.write("/tf", TFMessage([self.transform(
            stamp, "odom", "base_link", (now.pose[0], now.pose[1], 0.0), message.pose.pose.orientation)]), stamp)

    def write_range(self, stamp, heard):
        message = self.stamped(own.BeaconRange, stamp, heard.frame)
        message.beacon, message.range, message.variance = heard.beacon, heard.range, heard.variance
        self.bag.write("/ranges", message, stamp)

    def write_scan(self, stamp, scan):
        message = self.stamped(own.LandmarkObservationArray, stamp, "sensor")
        message.observations = [own.LandmarkObservation(*seen[1:]) for seen in scan]
        self.bag.write("/landmarks", message, stamp)
