#!/usr/bin/env python3
"""Attacks both nodes over their topics and services while a robot drives on a circle: neither may end, and within 30 s of
good input after each attack the pose is good again. Prints what each node's pose and memory were."""

import math
import sys
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import rosnode
import rospy
import rostest
from geometry_msgs.msg import Pose, PoseArray, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from pf_resampling.msg import (BeaconArray, BeaconPosition, BeaconRange, LandmarkObservation,
                               LandmarkObservationArray)
from pf_resampling.srv import LoadMap, SetParticles
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Range
from tf2_msgs.msg import TFMessage

NODES = ('beacon_mcl', 'fastslam')
RADIUS = 6.0  # m, driven at 1 m/s
BEACONS = [(-10.0, -3.0), (11.0, -4.0), (9.0, 18.0), (-11.0, 14.0)]
LANDMARKS = [((9.0 if k % 2 == 0 else 3.0) * math.sin(k * math.pi / 6),
              RADIUS - (9.0 if k % 2 == 0 else 3.0) * math.cos(k * math.pi / 6)) for k in range(12)]
# m. What is driven and seen is exact: a filter that is right is within 0.4 m, with a map that it made itself.
LOST = 1.0
LONG_NAME = 'beacon_' + 30000 * '1'


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

    def publish(self, topic, message, latch=False):
        if topic not in self.publishers:
            self.publishers[topic] = rospy.Publisher(topic, type(message), queue_size=1000, latch=latch)
            time.sleep(1.0)
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


def memory_of(name):
    """MiB."""
    uri = rosnode.get_api_uri(rosgraph.Master('/check'), '/' + name + '/filter')
    pid = xmlrpc.client.ServerProxy(uri).getPid('/check')[2]
    with open('/proc/{}/statm'.format(pid), encoding='ascii') as file:
        return int(file.read().split()[1]) // 256


class HostileInput(unittest.TestCase):
    def test_no_attack_ends_a_node(self):
        drive = Drive()
        time.sleep(2.0)
        drive.publish('/beacons', drive.beacons(BEACONS), latch=True)
        for topic, message in (('/odom', Odometry()), ('/ranges', BeaconRange()), ('/clock', Clock()),
                               ('/landmarks', LandmarkObservationArray())):
            drive.publish(topic, message)
        drive.go_on(60.0)
        self.expect_good(drive, 'nothing yet')
        for attack in (self.other_beacons, self.many_beacons, self.late_pose, self.late_particles, self.long_names,
                       self.far_clock, self.far_odometry, self.large_scan, self.no_map, self.clock_from_1970):
            attack(drive)
            drive.go_on(30.0)
            self.expect_good(drive, attack.__name__)

    def expect_good(self, drive, what):
        for name in NODES:
            error = drive.error(name)
            print('{:18} {:12} {:6.3f} m {:6} MiB'.format(what, name, error, memory_of(name)), flush=True)
            self.assertLess(error, LOST, '{} after {}'.format(name, what))

    def other_beacons(self, drive):
        drive.publish('/beacons', drive.beacons(BEACONS[:2] + [(500.0, 0.0)]))
        drive.go_on(3.0)
        drive.publish('/beacons', drive.beacons(BEACONS))

    def many_beacons(self, drive):
        drive.publish('/beacons', drive.beacons([(0.1 * i, 0.0) for i in range(100000)]))

    def late_pose(self, drive):
        message = PoseWithCovarianceStamped()
        oldest = 0.1 * drive.step - 30.0
        message.header.frame_id, message.header.stamp = 'map', drive.stamp(oldest)
        put(message.pose.pose, truth(oldest))
        drive.publish('/initialpose', message)

    def late_particles(self, drive):
        oldest = 0.1 * drive.step - 29.9
        particles = PoseArray(poses=[Pose() for _ in range(50)])
        particles.header.frame_id, particles.header.stamp = 'map', drive.stamp(oldest)
        for pose in particles.poses:
            put(pose, truth(oldest))
        for name in NODES:
            rospy.ServiceProxy('/' + name + '/set_particles', SetParticles)(particles, [])

    def long_names(self, drive):
        measured = Range(range=3.0)
        measured.header.stamp, measured.header.frame_id = drive.stamp(0.1 * drive.step), LONG_NAME
        drive.publish('/sensor_ranges', measured)
        tag = TransformStamped(child_frame_id=LONG_NAME)
        tag.header.stamp, tag.header.frame_id = measured.header.stamp, 'base_link'
        tag.transform.rotation.w = 1.0
        drive.publish('/tf', TFMessage(transforms=[tag]))

    def far_clock(self, drive):
        for seconds in (0x7fffffff, 0x90000000, 0xffffffff):
            drive.publish('/clock', Clock(clock=rospy.Time(seconds)))
            time.sleep(3.5)  # silence is looked for once a second, after two

    def far_odometry(self, drive):
        for _ in range(10):
            drive.step += 1
            message = drive.odometry(0.1 * drive.step)
            message.pose.pose.position.x = 1e160
            drive.publish('/odom', message)

    def large_scan(self, drive):
        scan = LandmarkObservationArray()
        scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step), 'base_link'
        scan.observations = [LandmarkObservation(id=1000 + i, range=5.0, bearing=1e-4 * i) for i in range(20000)]
        drive.publish('/landmarks', scan)

    def no_map(self, _drive):
        load = rospy.ServiceProxy('/fastslam/load_map', LoadMap)
        for file in ('/proc/self/mem', '/proc', '/nowhere'):
            self.assertFalse(load(file, True).success)

    def clock_from_1970(self, drive):
        drive.clock += 1.7e9


if __name__ == '__main__':
    rospy.init_node('check_hostile_input')
    rostest.rosrun('pf_resampling', 'hostile_input', HostileInput, sys.argv)
