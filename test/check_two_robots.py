#!/usr/bin/env python3
"""Plays two simulated drives at once, each in a robot's namespace and frames, to the two nodes of
two_robots.launch (private parameter `filter`: beacon_mcl or fastslam), and looks whether each finds its own
robot and nothing crosses."""

import collections
import os
import pathlib
import subprocess
import sys

import numpy as np
import rosbag
import rosgraph
import rospkg
import rospy
import rostest
import yaml
from bags import InFolder, play, recorded

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
    package, mirrored = pathlib.Path(rospkg.RosPack().get_path('pf_resampling')), pathlib.Path(folder, 'mirrored.yaml')
    world = yaml.safe_load((package / 'config/worlds/indoor_two_loops.yaml').read_text())
    for key in ('waypoints', 'landmarks'):
        world[key] = [[x, -y] for x, y in world[key]]
    mirrored.write_text(yaml.safe_dump(world))
    return {'robot1': 'indoor_two_loops', 'robot2': str(mirrored)}


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


def mean_error(poses, truth):
    """m, over the second half of the drive."""
    poses, truth = np.array(poses[len(poses) // 2:]), np.array(truth)
    return np.hypot(*(poses[:, i] - np.interp(poses[:, 0], truth[:, 0], truth[:, i]) for i in (1, 2))).mean()


class TwoRobots(InFolder):
    def setUp(self):
        super().setUp()
        self.name = rospy.get_param('~filter', 'beacon_mcl')
        self.paths, self.senders = collections.defaultdict(list), collections.defaultdict(set)
        self.status, self.transforms, self.diagnostics = {}, set(), set()
        played, path = make_bag(self.name, self.folder), str(self.folder / 'recorded.bag')
        topics = [f'/{robot}/{topic}' for robot in ROBOTS for topic in ('pose', 'ground_truth', 'status')]
        with recorded(path, '/tf', '/diagnostics', *topics):
            play(played, RATE)
        with rosbag.Bag(path) as bag:
            for message in bag.read_messages(return_connection_header=True):
                self.take(*message)

    def take(self, topic, message, _, header):
        caller = header['callerid']
        caller = caller.decode() if isinstance(caller, bytes) else caller
        robot, name = topic.split('/')[1], topic.split('/')[-1]
        if name == 'tf':
            self.transforms |= {(caller, each.header.frame_id, each.child_frame_id) for each in message.transforms}
        elif name == 'diagnostics':
            self.diagnostics |= {each.name for each in message.status}
        elif name == 'status':
            self.status[robot] = message
        else:
            place = getattr(message.pose, 'pose', message.pose).position
            self.paths[robot, name].append((message.header.stamp.to_sec(), place.x, place.y))
            self.senders[robot, name].add((caller, message.header.frame_id))

    def test_each_node_finds_its_own_robot_and_nothing_crosses(self):
        for robot, other in (ROBOTS, ROBOTS[::-1]):
            node = f'/{robot}/{self.name}'
            frame = 'map' if self.name == 'beacon_mcl' else f'{robot}/map'
            poses = self.paths[robot, 'pose']
            self.assertGreater(len(poses), 500, robot)
            error, elsewhere = (mean_error(poses, self.paths[each, 'ground_truth']) for each in (robot, other))
            print(f'{robot}: {len(poses)} poses, error {error:.3f} m, {elsewhere:.1f} m to the other robot')
            self.assertLess(error, LARGEST_ERROR[self.name])
            self.assertGreater(elsewhere, 3.0 * LARGEST_ERROR[self.name], 'the drives do not tell the robots apart')
            self.assertEqual(self.senders[robot, 'pose'], {(node, frame)})
            self.assertEqual([(reject.input, reject.reason) for reject in self.status[robot].rejects
                              if reject.reason in ('wrong_frame', 'unknown_frame', 'unknown_beacon')], [])
            self.assertEqual({(parent, child) for caller, parent, child in self.transforms if caller == node},
                             {(frame, robot + '/odom')})
            for part in PARTS[self.name]:
                self.assertIn(f'{robot}/{self.name}: {part}', self.diagnostics)
        self.assertNotIn(f'{self.name}: inputs', self.diagnostics)
        self.check_names()

    def check_names(self):
        """Only what all robots share is outside of their namespaces."""
        publishers, _, services = rosgraph.Master('/check_two_robots').getSystemState()
        shared = {'/tf', '/tf_static', '/diagnostics', '/rosout'}
        for robot in ROBOTS:
            node = f'/{robot}/{self.name}'
            for topic, nodes in publishers:
                if node in nodes and topic not in shared:
                    self.assertTrue(topic.startswith(f'/{robot}/'), topic)
            for service, nodes in services:
                if node in nodes:
                    self.assertTrue(service.startswith(f'/{robot}/'), service)


if __name__ == '__main__':
    rospy.init_node('check_two_robots')
    rostest.rosrun('pf_resampling', 'two_robots', TwoRobots, sys.argv)
