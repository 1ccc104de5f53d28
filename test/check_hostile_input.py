#!/usr/bin/env python3
"""What goes wrong around both nodes, over their topics and services, while a robot drives on a circle: neither may end, and
30 s later the pose is good again. Prints each node's error and memory before, at most, and after."""

import contextlib
import io
import math
import random
import struct
import sys
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import rosnode
import rospy
import rostest
from geometry_msgs.msg import Pose, PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from pf_resampling.msg import (BeaconArray, BeaconPosition, BeaconRange, LandmarkObservation,
                               LandmarkObservationArray)
from pf_resampling.srv import LoadMap, SetParticles, SetParticlesRequest
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

NODES = ('beacon_mcl', 'fastslam')
RADIUS = 6.0  # m, driven at 1 m/s
BEACONS = [(-10.0, -3.0), (11.0, -4.0), (9.0, 18.0), (-11.0, 14.0)]
LANDMARKS = [((9.0 if k % 2 == 0 else 3.0) * math.sin(k * math.pi / 6),
              RADIUS - (9.0 if k % 2 == 0 else 3.0) * math.cos(k * math.pi / 6)) for k in range(12)]
# m. What is driven and seen is exact: a filter that is right is within 0.4 m, with a map that it made itself.
LOST = 1.0


def truth(seconds):
    return RADIUS * math.sin(seconds / RADIUS), RADIUS * (1.0 - math.cos(seconds / RADIUS)), seconds / RADIUS


def put(pose, at):
    pose.position.x, pose.position.y = at[0], at[1]
    pose.orientation.z, pose.orientation.w = math.sin(at[2] / 2), math.cos(at[2] / 2)


class Drive:
    """Its seconds are since the start; the stamps of its messages are `clock` ahead of them."""

    def __init__(self):
        self.clock = 100.0
        self.step = 0  # of 0.1 s
        self.publishers = {}
        self.poses = {name: {} for name in NODES}
        self.lock = threading.Lock()
        self.subscribers = [
            rospy.Subscriber('/' + name + '/pose', PoseWithCovarianceStamped, self.take, name, queue_size=100)
            for name in NODES]

    def take(self, message, name):
        with self.lock:
            self.poses[name][message.header.stamp.to_nsec() // 1000000] = message.pose.pose.position

    def stamp(self, seconds):
        return rospy.Time.from_sec(round(self.clock + seconds, 3))

    def open(self, topic, kind, latch=False):
        """Before the first message: connections take their time."""
        self.publishers[topic] = rospy.Publisher(topic, kind, queue_size=1000, latch=latch)
        time.sleep(1.0)

    def publish(self, topic, message, latch=False):
        if topic not in self.publishers:
            self.open(topic, type(message), latch)
        self.publishers[topic].publish(message)

    def odometry(self, seconds):
        message = Odometry()
        message.header.stamp = self.stamp(seconds)
        message.header.frame_id, message.child_frame_id = 'odom', 'base_link'
        put(message.pose.pose, truth(seconds))
        return message

    def beacons(self, places):
        message = BeaconArray()
        message.header.frame_id = 'map'
        for number, place in enumerate(places):
            beacon = BeaconPosition(id=number)
            beacon.position.x, beacon.position.y = place
            message.beacons.append(beacon)
        return message

    def observe(self, seconds):
        x, y, heading = truth(seconds)
        number = self.step // 2 % len(BEACONS)
        measured = BeaconRange(beacon=number, variance=0.01)
        measured.header.stamp, measured.header.frame_id = self.stamp(seconds), 'base_link'
        measured.range = math.hypot(BEACONS[number][0] - x, BEACONS[number][1] - y)
        self.publish('/ranges', measured)
        scan = LandmarkObservationArray(header=measured.header)
        for number, place in enumerate(LANDMARKS):
            seen = LandmarkObservation(id=number, range=math.hypot(place[0] - x, place[1] - y))
            seen.bearing = math.remainder(math.atan2(place[1] - y, place[0] - x) - heading, 2 * math.pi)
            if seen.range < 7.0:
                scan.observations.append(seen)
        self.publish('/landmarks', scan)

    def go_on(self, seconds):
        """At 10 Hz of its own time."""
        for _ in range(round(10 * seconds)):
            self.step += 1
            now = 0.1 * self.step
            self.publish('/clock', Clock(clock=self.stamp(now)))
            self.publish('/odom', self.odometry(now))
            if self.step % 2 == 0:
                self.observe(now - 0.06)
            time.sleep(0.01)

    def error(self, name):
        """Of the pose at the newest odometry, for which it waits."""
        newest = round(1000 * (self.clock + 0.1 * self.step))
        for _ in range(200):
            with self.lock:
                position = self.poses[name].get(newest)
            if position is not None:
                x, y, _ = truth(0.1 * self.step)
                return math.hypot(position.x - x, position.y - y)
            time.sleep(0.1)
        return math.inf


def begin_drive():
    """A minute of it, at ten times its speed, to map and to be located."""
    drive = Drive()
    time.sleep(2.0)
    drive.publish('/beacons', drive.beacons(BEACONS), latch=True)
    for topic, kind in (('/odom', Odometry), ('/ranges', BeaconRange), ('/clock', Clock),
                        ('/landmarks', LandmarkObservationArray)):
        drive.open(topic, kind)
    drive.go_on(60.0)
    return drive


def process_of(name):
    uri = rosnode.get_api_uri(rosgraph.Master('/check'), '/' + name + '/filter')
    return xmlrpc.client.ServerProxy(uri).getPid('/check')[2]


def memory_of(pid):
    """MiB."""
    with open('/proc/{}/statm'.format(pid), encoding='ascii') as file:
        return int(file.read().split()[1]) // 256


def peak_of(pid):
    """Of its memory, MiB; since forget_peak(), if it may be forgotten."""
    with open('/proc/{}/status'.format(pid), encoding='ascii') as file:
        return next(int(line.split()[1]) // 1024 for line in file if line.startswith('VmHWM:'))


def forget_peak(pid):
    with contextlib.suppress(OSError), open('/proc/{}/clear_refs'.format(pid), 'w', encoding='ascii') as file:
        file.write('5')


# ---- what happens to them -----------------------------------------------------------------------


def other_beacons(drive):
    drive.publish('/beacons', drive.beacons(BEACONS[:2] + [(500.0, 0.0)]))
    drive.go_on(3.0)
    drive.publish('/beacons', drive.beacons(BEACONS))


def many_beacons(drive):
    drive.publish('/beacons', drive.beacons([(0.1 * i, 0.0) for i in range(100000)]))


def late_pose(drive):
    message = PoseWithCovarianceStamped()
    oldest = 0.1 * drive.step - 30.0
    message.header.frame_id, message.header.stamp = 'map', drive.stamp(oldest)
    put(message.pose.pose, truth(oldest))
    drive.publish('/initialpose', message)


def late_particles(drive):
    oldest = 0.1 * drive.step - 29.9
    particles = PoseArray(poses=[Pose() for _ in range(50)])
    particles.header.frame_id, particles.header.stamp = 'map', drive.stamp(oldest)
    for pose in particles.poses:
        put(pose, truth(oldest))
    for name in NODES:
        rospy.ServiceProxy('/' + name + '/set_particles', SetParticles)(particles, [])


def without_elements(message):
    """Ends in an array, of which it says that it has 2^26 elements: there is none."""
    whole = io.BytesIO()
    message.serialize(whole)
    cut = whole.getvalue()[:-4] + struct.pack('<I', 1 << 26)
    return type('WithoutElements', (type(message),), {'serialize': lambda _, buffer: buffer.write(cut)})()


def false_lengths(drive):
    scan = LandmarkObservationArray()
    scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step), 'base_link'
    for topic, message in (('/beacons', drive.beacons([])), ('/landmarks', scan), ('/tf', TFMessage())):
        drive.publish(topic, without_elements(message))
    for name in NODES:
        particles = SetParticlesRequest()
        particles.particles.header.frame_id = 'map'
        if rospy.ServiceProxy('/' + name + '/set_particles', SetParticles)(without_elements(particles)).success:
            raise AssertionError(name + ' took particles that are not there')


def far_clock(drive):
    for seconds in (0x7fffffff, 0x90000000, 0xffffffff):
        drive.publish('/clock', Clock(clock=rospy.Time(seconds)))
        time.sleep(3.5)  # silence is looked for once a second, after two


def far_odometry(drive):
    for _ in range(10):
        drive.step += 1
        message = drive.odometry(0.1 * drive.step)
        message.pose.pose.position.x = 1e160
        drive.publish('/odom', message)


def large_scan(drive):
    scan = LandmarkObservationArray()
    scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step), 'base_link'
    scan.observations = [LandmarkObservation(id=1000 + i, range=5.0, bearing=1e-4 * i) for i in range(20000)]
    drive.publish('/landmarks', scan)


def no_map(_drive):
    load = rospy.ServiceProxy('/fastslam/load_map', LoadMap)
    for file in ('/proc/self/mem', '/proc', '/nowhere'):
        if load(file, True).success:
            raise AssertionError(file + ' was taken for a map')


def clock_from_1970(drive):
    drive.clock += 1.7e9


def false_landmarks(drive):
    """As many as a scan may have, wherever."""
    draw = random.Random(1)
    for _ in range(10):
        drive.go_on(0.1)
        scan = LandmarkObservationArray()
        scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step - 0.05), 'base_link'
        scan.observations = [
            LandmarkObservation(id=1000 + i, range=draw.uniform(0.5, 30), bearing=draw.uniform(-3, 3)) for i in range(100)]
        drive.publish('/landmarks', scan)


MOST_MEMORY = 1000  # MiB, of nodes that take 20, and with sanitizers 300: what only says that it comes takes more
ACCIDENTS = (other_beacons, many_beacons, late_pose, late_particles, far_clock, far_odometry, large_scan, no_map,
             false_lengths, false_landmarks, clock_from_1970)


class HostileInput(unittest.TestCase):
    def test_nothing_ends_a_node(self):
        drive = begin_drive()
        self.processes = {name: process_of(name) for name in NODES}
        before = self.expect_good(drive, 'nothing yet')
        print('{:16} {:11} {:>8} {:>8}   {:>5} {:>5} {:>5} MiB'.format(
            'accident', 'node', 'before', 'after m', 'before', 'most', 'after'), flush=True)
        for accident in ACCIDENTS:
            for name in NODES:
                forget_peak(self.processes[name])
            accident(drive)
            drive.go_on(30.0)
            after = self.expect_good(drive, accident.__name__)
            for name in NODES:
                most = peak_of(self.processes[name])
                print('{:16} {:11} {:8.3f} {:8.3f}   {:5} {:5} {:5}'.format(
                    accident.__name__, name, before[name][0], after[name][0], before[name][1], most,
                    after[name][1]), flush=True)
                self.assertLess(most, MOST_MEMORY, '{} after {}'.format(name, accident.__name__))
            before = after

    def expect_good(self, drive, what):
        """The error (m) and the memory (MiB) of each node."""
        present = {name: (drive.error(name), memory_of(self.processes[name])) for name in NODES}
        for name in NODES:
            self.assertLess(present[name][0], LOST, '{} after {}'.format(name, what))
        return present


if __name__ == '__main__':
    rospy.init_node('check_hostile_input')
    rostest.rosrun('pf_resampling', 'hostile_input', HostileInput, sys.argv)
