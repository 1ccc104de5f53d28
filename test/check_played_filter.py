#!/usr/bin/env python3
"""Plays a bag to a running node, records what that publishes, and checks it against the truth in the bag. Private parameters: make_bag
(a program of this package that writes the bag, with BAG for its name), needs (a file without which the test is skipped), rate and
seconds (of playing), maximum_error (m), inside_share; switch (a node whose strategies are switched meanwhile). Of fastslam_node, too:
landmarks (how many), maximum_end_error, maximum_map_error (m), restart_at (s, when the map is saved, and the node, which this program
then starts, killed)."""

import ast
import collections
import json
import os
import pathlib
import re
import subprocess
import threading
import time

import dynamic_reconfigure.client
import numpy as np
import rosbag
import roslib.packages
import rospy
import rostest
from bags import InFolder, play, recorded
from pf_resampling.srv import SaveMap

TOPICS = ('pose', 'tf', 'path', 'particlecloud', 'particles', 'markers', 'status', 'landmark_map')
STRATEGIES = ['population/schedule', 'population/renewal', 'excitation/method'] + [
    f'population/{part}' for part in ('resampling/scheme', 'resampling/inner_scheme', 'resampling/weights_after', 'compensation/pairing',
                                      'compensation/covariance', 'compensation/weights_after')]
CONVERGED = 0.2  # share of the drive after which a filter that does not know where it starts has to know where it is


def is_finite(message):
    """All numbers of a message, or of a cloud."""
    if hasattr(message, 'data'):
        return bool(np.isfinite(np.frombuffer(message.data, np.float32)).all())
    return not re.search(r'\b(nan|inf)\b', str(message))


class Switcher(threading.Thread):
    """Switches a node through every choice of every strategy, over and over, as a user would."""

    def __init__(self, node, period):
        super().__init__()
        self.client, self.period = dynamic_reconfigure.client.Client(node, 30.0), period
        self.rounds, self.refused, self.is_over = 0.0, [], False
        present = self.client.get_configuration()
        self.switches = [(each['name'], choice) for each in self.client.get_parameter_descriptions() if each['name'] in STRATEGIES
                         for choice in [one['value'] for one in ast.literal_eval(each['edit_method'])['enum']] + [present[each['name']]]]
        self.start()

    def run(self):
        while not self.is_over:
            for name, choice in self.switches:
                if self.is_over:
                    return
                if self.client.update_configuration({name: choice})[name] != choice:
                    self.refused.append((name, choice))
                self.rounds += 1.0 / len(self.switches)
                time.sleep(self.period)


class PlayedFilter(InFolder):
    def setUp(self):
        super().setUp()
        if not os.path.exists(rospy.get_param('~needs', '/')):
            self.skipTest('needs ' + rospy.get_param('~needs'))
        self.bag, self.recorded = f'{self.folder}/in.bag', f'{self.folder}/recorded.bag'
        program, *arguments = rospy.get_param('~make_bag').replace('BAG', self.bag).split()
        subprocess.check_call(['rosrun', 'pf_resampling', program, *arguments], stdout=subprocess.DEVNULL)

    def play(self, start=0.0, seconds=1e4):
        play(self.bag, rospy.get_param('~rate', 1.0), '--clock', '--start', str(start), '--duration', str(seconds))

    def start_node(self, *more):
        program = roslib.packages.find_node('pf_resampling', 'fastslam_node')[0]  # itself, so that it can be killed
        node = subprocess.Popen([program, '__name:=fastslam', f'_map_file/directory:={self.folder}', *more])
        self.addCleanup(node.kill)
        rospy.wait_for_service('save_map', 20.0)
        return node

    def play_with_restart(self, restart_at):
        node = self.start_node()
        self.play(0.0, restart_at)
        answer = rospy.ServiceProxy('save_map', SaveMap)('saved.map')
        self.assertTrue(answer.success, answer.message)
        self.assertIsNone(node.poll())
        node.kill()
        node.wait()
        with self.assertRaises(rospy.ROSException, msg='somebody else is there'):
            rospy.wait_for_service('save_map', 0.1)
        node = self.start_node(f'_map_file/load:={self.folder}/saved.map')
        self.play(restart_at)
        self.assertIsNone(node.poll())

    def test_follows_the_truth(self):
        restart_at, switched = rospy.get_param('~restart_at', 0.0), rospy.get_param('~switch', '')
        switcher = Switcher(switched, 0.1) if switched else None
        extras = 'diagnostics', 'ground_truth', 'ground_truth_landmarks', 'odom'
        with recorded(self.recorded, *('/' + topic for topic in TOPICS + extras)):
            if restart_at:
                self.play_with_restart(restart_at)
            else:
                self.play(seconds=rospy.get_param('~seconds', 1e4))
        if switcher:
            switcher.is_over = True
            switcher.join()
            self.assertEqual(switcher.refused, [])
            self.assertGreaterEqual(len(switcher.switches), 25)
            self.assertGreaterEqual(switcher.rounds, 1.0, 'not every strategy had its turn')
        self.is_slam = rospy.has_param('~landmarks')
        self.read()
        self.check_all_is_published()
        self.check_poses_are_true()
        if self.is_slam:
            self.check_diagnostics_are_fine()

    def read(self):
        self.stamps, self.odometry, self.statuses, self.diagnostics = [], [], [], []
        self.finite = collections.defaultdict(list)
        with rosbag.Bag(self.recorded) as bag:
            for topic, message, _ in bag.read_messages():
                name = topic.strip('/')
                if name in ('odom', 'pose'):
                    (self.odometry if name == 'odom' else self.stamps).append(message.header.stamp.to_sec())
                elif name == 'status':
                    self.statuses.append(message)
                elif name == 'diagnostics':
                    self.diagnostics.append(message)
                if name == 'tf':
                    message = [each for each in message.transforms if each.header.frame_id == 'map']
                # Clouds are long, and many: of those every tenth is looked at.
                if name in TOPICS and message and (name not in ('particles', 'particlecloud') or len(self.finite[name]) % 10 == 0):
                    self.finite[name].append(is_finite(message))
                elif name in TOPICS and message:
                    self.finite[name].append(True)

    def check_all_is_published(self):
        """From the first pose on, one for every message of odometry, at its stamp, and all finite."""
        self.assertGreater(len(self.odometry), 100, 'the bag did not arrive')
        self.assertGreater(len(self.stamps), 100, 'the node gave no poses')
        stamps = self.stamps
        self.assertLess(min(stamps) - min(self.odometry), 0.5 if self.is_slam else 20.0, 'the filter took too long to start')
        self.assertLess(max(self.odometry) - max(stamps), 0.5)
        self.assertEqual({stamp for stamp in self.odometry if min(stamps) <= stamp <= max(stamps)} - set(stamps), set())
        self.assertEqual(len(stamps), len(set(stamps)), 'a stamp came twice')
        for topic in TOPICS[:None if self.is_slam else -1]:
            self.assertGreater(len(self.finite[topic]), 3, topic)
            self.assertTrue(all(self.finite[topic]), topic)
        last = self.statuses[-1]
        # Played faster than it was recorded on a machine that others use, messages may come too late for the computation; that they
        # are then dropped and counted is what is wanted.
        rejected = {(each.input, each.reason): each.count for each in last.rejects if each.reason != 'overload'}
        self.assertGreater(last.updates, 50 * sum(rejected.values()), rejected)
        if self.is_slam and not rospy.has_param('~restart_at'):
            self.assertGreaterEqual(last.updates, 170, 'of 180 scans')
        elif self.is_slam:
            self.assertLess(last.updates, max(each.updates for each in self.statuses), 'this is no other node')

    def judged(self, clip):
        """What evaluate_bag says."""
        said = f'{self.folder}/said.json'
        subprocess.check_call(['rosrun', 'pf_resampling', 'evaluate_bag', self.recorded, '--quiet', '--frame', 'given',
                               '--clip', str(clip), '--json', said])
        return json.loads(pathlib.Path(said).read_text())

    def check_poses_are_true(self):
        said = self.judged(0.0 if self.is_slam else CONVERGED)
        found = said['estimate']
        print(f"{found['cartesian']}, inside 3 sigma {found['coverage_3sigma']:.1%}")
        self.assertLess(found['uncovered'], 0.1 * said['truth_poses'])
        self.assertLess(found['cartesian']['max'], rospy.get_param('~maximum_error'))
        self.assertGreaterEqual(found['coverage_3sigma'], rospy.get_param('~inside_share'))
        if self.is_slam:
            self.assertLess(self.judged(0.95)['estimate']['cartesian']['max'], rospy.get_param('~maximum_end_error'))
            found = said['map']
            self.assertEqual((found['landmarks'], found['false_landmarks']), (rospy.get_param('~landmarks'), 0))
            # Its shape; where it lies depends on how well the start was seen.
            self.assertLess(found['rms_aligned'], rospy.get_param('~maximum_map_error'))

    def check_diagnostics_are_fine(self):
        """While odometry comes, and after the first seconds, in which there is no landmark yet."""
        first, last = self.stamps[0] + 2.0, self.stamps[-1]
        entries = [each for array in self.diagnostics if first <= array.header.stamp.to_sec() <= last for each in array.status
                   if each.name.startswith('fastslam')]
        levels = [each.level if isinstance(each.level, int) else ord(each.level) for each in entries]
        self.assertGreater(len(levels), 60)
        self.assertGreaterEqual(levels.count(0), 0.9 * len(levels), [each.message for each in entries])
        self.assertNotIn(2, levels)
        self.assertEqual([each.reason for each in self.statuses[-1].rejects], [])
        # Of 327 observations beyond 13.8, two degrees of freedom, 0.3 are so by chance.
        self.assertLessEqual(self.statuses[-1].not_believed, 20)


if __name__ == '__main__':
    rospy.init_node('check_played_filter')
    rostest.rosrun('pf_resampling', 'played_filter', PlayedFilter)
