#!/usr/bin/env python3
"""Plays two simulated drives at once, each in a robot's namespace and frames, to the two nodes of
two_robots.launch (private parameter `filter`: beacon_mcl or fastslam), and looks whether each finds its own
robot and nothing crosses."""

import bisect
import math
import os
import subprocess
import sys
import tempfile
import unittest

import rosbag
import rosgraph
import rospkg
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from pf_resampling.msg import FilterStatus
from tf2_msgs.msg import TFMessage

ROBOTS = ('robot1', 'robot2')
SECONDS = 90.0
RATE = 10
# Of the mean over the second half of the drive, m. Where a map is made, that is mostly before the outer loop is closed.
# The two robots are three times as far apart.
LARGEST_ERROR = {'beacon_mcl': 1.0, 'fastslam': 3.0}
PARTS = {'beacon_mcl': ('localization', 'inputs', 'beacons', 'timing'), 'fastslam': ('mapping', 'inputs', 'timing')}


def worlds(name, folder):
    """Of each robot; maps begin where the robot does, so both drives start alike, and one is the other's mirror image."""
    if name == 'beacon_mcl':
        return {'robot1': 'beacons_circle', 'robot2': 'beacons_figure8'}
    package = rospkg.RosPack().get_path('pf_resampling')
    with open(os.path.join(package, 'config', 'worlds', 'indoor_two_loops.yaml'), encoding='utf-8') as file:
        world = yaml.safe_load(file)
    for key in ('waypoints', 'landmarks'):
        world[key] = [[x, -y] for x, y in world[key]]
    mirrored = os.path.join(folder, 'mirrored.yaml')
    with open(mirrored, 'w', encoding='utf-8') as file:
        yaml.safe_dump(world, file)
    return {'robot1': 'indoor_two_loops', 'robot2': mirrored}


def put_in_front(robot, message):
    """Frames of the robot get its name; that of the map is shared."""
    headers = [message] if hasattr(message, 'header') else getattr(message, 'transforms', [])
    for stamped in headers:
        if stamped.header.frame_id != 'map':
            stamped.header.frame_id = robot + '/' + stamped.header.frame_id
        if hasattr(stamped, 'child_frame_id'):
            stamped.child_frame_id = robot + '/' + stamped.child_frame_id


def make_bag(name, folder):
    """Both drives from the same time on, in one bag."""
    both = os.path.join(folder, 'both.bag')
    taken = []
    for robot, world in worlds(name, folder).items():
        drive = os.path.join(folder, robot + '.bag')
        subprocess.check_call(['rosrun', 'pf_resampling', 'simulate_bag', world, drive, '--seed', '1'],
                              stdout=subprocess.DEVNULL)
        with rosbag.Bag(drive) as bag:
            start = bag.get_start_time()
            for topic, message, time, header in bag.read_messages(
                    end_time=rospy.Time(start + SECONDS), return_connection_header=True):
                put_in_front(robot, message)
                taken.append((time, topic if topic.startswith('/tf') else '/' + robot + topic, message, header))
    taken.sort(key=lambda entry: entry[0])
    with rosbag.Bag(both, 'w') as bag:
        for time, topic, message, header in taken:
            bag.write(topic, message, time, connection_header=dict(header, topic=topic))
    return both


class Heard:
    def __init__(self):
        self.poses = {robot: [] for robot in ROBOTS}
        self.truth = {robot: [] for robot in ROBOTS}
        self.status = {}
        self.frames = {robot: set() for robot in ROBOTS}
        self.callers = {robot: set() for robot in ROBOTS}
        self.transforms = set()
        self.diagnostics = set()
        for robot in ROBOTS:
            rospy.Subscriber(f'/{robot}/pose', PoseWithCovarianceStamped, self.take_pose, robot, queue_size=10000)
            rospy.Subscriber(f'/{robot}/ground_truth', PoseStamped, self.take_truth, robot, queue_size=10000)
            rospy.Subscriber(f'/{robot}/status', FilterStatus, self.take_status, robot, queue_size=10000)
        rospy.Subscriber('/tf', TFMessage, self.take_transforms, queue_size=10000)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.take_diagnostics, queue_size=10000)

    def take_pose(self, message, robot):
        place = message.pose.pose.position
        self.poses[robot].append((message.header.stamp.to_sec(), place.x, place.y))
        self.frames[robot].add(message.header.frame_id)
        self.callers[robot].add(message._connection_header['callerid'])

    def take_truth(self, message, robot):
        place = message.pose.position
        self.truth[robot].append((message.header.stamp.to_sec(), place.x, place.y))

    def take_status(self, message, robot):
        self.status[robot] = message

    def take_transforms(self, message):
        for transform in message.transforms:
            self.transforms.add((message._connection_header['callerid'], transform.header.frame_id,
                                 transform.child_frame_id))

    def take_diagnostics(self, message):
        self.diagnostics.update(status.name for status in message.status)


def mean_error(poses, truth):
    """Over the second half of the drive."""
    stamps = [entry[0] for entry in truth]
    errors = []
    for stamp, x, y in poses[len(poses) // 2:]:
        place = bisect.bisect_left(stamps, stamp - 1e-6)
        if place < len(stamps) and abs(stamps[place] - stamp) < 1e-3:
            errors.append(math.hypot(x - truth[place][1], y - truth[place][2]))
    return sum(errors) / len(errors), len(errors)


class TwoRobots(unittest.TestCase):
    def test_each_node_finds_its_own_robot_and_nothing_crosses(self):
        name = rospy.get_param('~filter', 'beacon_mcl')
        heard = Heard()
        with tempfile.TemporaryDirectory() as folder:
            subprocess.check_call(['rosbag', 'play', '--quiet', '--delay', '3', '--rate', str(RATE),
                                   make_bag(name, folder)],
                                  stdout=subprocess.DEVNULL)
        rospy.sleep(2.0)

        for robot in ROBOTS:
            node = f'/{robot}/{name}'
            frame = 'map' if name == 'beacon_mcl' else f'{robot}/map'
            self.assertGreater(len(heard.poses[robot]), 500, robot)
            error, compared = mean_error(heard.poses[robot], heard.truth[robot])
            other = next(each for each in ROBOTS if each != robot)
            elsewhere, _ = mean_error(heard.poses[robot], heard.truth[other])
            print(f'{robot}: {len(heard.poses[robot])} poses, error {error:.3f} m over {compared} true poses, '
                  f'{elsewhere:.1f} m to the other robot')
            self.assertLess(error, LARGEST_ERROR[name])
            self.assertGreater(elsewhere, 3.0 * LARGEST_ERROR[name], 'the drives do not tell the robots apart')
            self.assertEqual(heard.frames[robot], {frame})
            self.assertEqual(heard.callers[robot], {node})
            self.assertEqual([(reject.input, reject.reason) for reject in heard.status[robot].rejects
                              if reject.reason in ('wrong_frame', 'unknown_frame', 'unknown_beacon')], [])
            self.assertEqual({(parent, child) for caller, parent, child in heard.transforms if caller == node},
                             {(frame, robot + '/odom')})
            for part in PARTS[name]:
                self.assertIn(f'{robot}/{name}: {part}', heard.diagnostics)
        self.assertNotIn(f'{name}: inputs', heard.diagnostics)
        self.check_names(name)

    def check_names(self, name):
        """Only what all robots share is outside of their namespaces."""
        publishers, _, services = rosgraph.Master('/check_two_robots').getSystemState()
        shared = {'/tf', '/tf_static', '/diagnostics', '/rosout'}
        for robot in ROBOTS:
            node = f'/{robot}/{name}'
            for topic, nodes in publishers:
                if node in nodes and topic not in shared:
                    self.assertTrue(topic.startswith(f'/{robot}/'), topic)
            for service, nodes in services:
                if node in nodes:
                    self.assertTrue(service.startswith(f'/{robot}/'), service)


if __name__ == '__main__':
    rospy.init_node('check_two_robots')
    rostest.rosrun('pf_resampling', 'two_robots', TwoRobots, sys.argv)
