#!/usr/bin/env python3
"""Plays a bag to a running node, records what that publishes, and checks it against the truth in the bag. Private parameters: make_bag
(a program of this package that writes the bag, with BAG for its name), needs (a file without which the test is skipped), rate and
seconds (of playing), maximum_error (m), inside_share; switch (a node whose strategies are switched meanwhile). Of fastslam_node, too:
landmarks (how many), maximum_end_error, maximum_map_error (m), restart_at (s, when the map is saved, and the node, which this program
then starts, killed)."""

import ast
import collections
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import dynamic_reconfigure.client
import numpy as np
import rosbag
import roslib.packages
import rospy
import rostest
from pf_resampling.srv import SaveMap

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / 'research'))
from study_calibration import BEYOND, belief_of  # noqa: E402

TOPICS = ('pose', 'tf', 'path', 'particlecloud', 'particles', 'markers', 'status', 'landmark_map')
STRATEGIES = ['population/schedule', 'population/renewal', 'excitation/method'] + [
    f'population/{part}' for part in ('resampling/scheme', 'resampling/inner_scheme', 'resampling/weights_after', 'compensation/pairing',
                                      'compensation/covariance', 'compensation/weights_after')]
CONVERGED = 1.0  # m: when the filter itself believes to know the position this well, it has


def is_finite(message):
    """All numbers of a message."""
    if isinstance(message, (float, int)):
        return math.isfinite(message)
    if isinstance(message, bytes):  # of a cloud
        return bool(np.isfinite(np.frombuffer(message, np.float32)).all())
    if isinstance(message, (list, tuple)):
        return all(map(is_finite, message))
    return all(is_finite(getattr(message, name)) for name in getattr(message, '__slots__', []))


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


class PlayedFilter(unittest.TestCase):
    def setUp(self):
        if not os.path.exists(rospy.get_param('~needs', '/')):
            self.skipTest('needs ' + rospy.get_param('~needs'))
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder, self.bag, self.recorded = folder.name, f'{folder.name}/in.bag', f'{folder.name}/recorded.bag'
        program, *arguments = rospy.get_param('~make_bag').replace('BAG', self.bag).split()
        subprocess.check_call(['rosrun', 'pf_resampling', program, *arguments], stdout=subprocess.DEVNULL)
        with open(os.path.join(self.folder, 'log'), 'w') as log:
            record = roslib.packages.find_node('rosbag', 'record')[0]  # `rosbag record` ends before it does
            recorder = subprocess.Popen(
                [record, '--quiet', '-b', '0', '-O', self.recorded, '/diagnostics', '/ground_truth', '/ground_truth_landmarks', '/odom',
                 *('/' + topic for topic in TOPICS)], stdout=log, stderr=log)

        def stop():
            recorder.send_signal(2)
            recorder.wait()

        self.stop_recording = stop

    def play(self, start=0.0, seconds=1e4):
        # The pause lets all subscribers connect.
        subprocess.check_call(['rosbag', 'play', '--quiet', '--clock', '--delay', '3', '--rate', str(rospy.get_param('~rate', 1.0)),
                               '--start', str(start), '--duration', str(seconds), self.bag], stdout=subprocess.DEVNULL)
        time.sleep(2.0)

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
        self.stop_recording()
        self.is_slam = rospy.has_param('~landmarks')
        self.read()
        self.check_all_is_published()
        self.check_poses_are_true()
        if self.is_slam:
            self.check_map_is_true()
            self.check_diagnostics_are_fine()

    def read(self):
        self.truth, self.poses, _, _ = belief_of(self.recorded)
        self.odometry, self.statuses, self.diagnostics, self.finite = [], [], [], collections.defaultdict(list)
        with rosbag.Bag(self.recorded) as bag:
            for topic, message, _ in bag.read_messages():
                name = topic.strip('/')
                if name == 'odom':
                    self.odometry.append(message.header.stamp.to_sec())
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
        self.assertGreater(len(self.poses), 100, 'the node gave no poses')
        stamps = [stamp for stamp, _, _ in self.poses]
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

    def check_poses_are_true(self):
        stamps, places = np.array([each[0] for each in self.poses]), np.array([each[1][:2] for each in self.poses])
        covariances = np.array([each[2][:2, :2] for each in self.poses])
        knows = np.ones(len(stamps), bool) if self.is_slam else np.trace(covariances, axis1=1, axis2=2) < CONVERGED ** 2
        self.assertTrue(knows.any(), 'the filter never converged')
        times = self.truth[:, 0]
        after = np.searchsorted(stamps, times - 1e-6)
        counts = (times > stamps[knows.argmax()]) & (after < len(stamps)) & (after > 0)
        counts[counts] &= np.diff(stamps)[after[counts] - 1] <= 0.5
        believed = np.column_stack([np.interp(times[counts], stamps, places[:, i]) for i in (0, 1)])
        errors, spreads = believed - self.truth[counts, 1:3], covariances[after[counts]]
        squares = np.array([error @ np.linalg.pinv(spread) @ error for error, spread in zip(errors, spreads)])
        distances = np.hypot(*errors.T)
        # At the start of a map the place is known without any doubt: nothing to divide by.
        inside = ((squares <= BEYOND) | (distances < 1e-6)).mean()
        print(f'{counts.sum()} true poses: error mean {distances.mean():.3f} m, maximum {distances.max():.3f} m, inside 3 sigma {inside:.1%}')
        self.assertGreater(counts.sum(), 0.9 * (times > stamps[knows.argmax()]).sum())
        self.assertLess(distances.max(), rospy.get_param('~maximum_error'))
        self.assertGreaterEqual(inside, rospy.get_param('~inside_share'))
        self.assertLess(distances[times[counts] > times[-1] - 2.0].max(), rospy.get_param('~maximum_end_error', math.inf))

    def check_map_is_true(self):
        """Its shape; where it lies depends on how well the start was seen."""
        said = f'{self.folder}/said.json'
        subprocess.check_call(['rosrun', 'pf_resampling', 'evaluate_bag', self.recorded, '--quiet', '--json', said])
        found = json.loads(pathlib.Path(said).read_text())['map']
        print(found)
        self.assertEqual((found['landmarks'], found['false_landmarks']), (rospy.get_param('~landmarks'), 0))
        self.assertLess(found['rms_aligned'], rospy.get_param('~maximum_map_error'))

    def check_diagnostics_are_fine(self):
        """While odometry comes, and after the first seconds, in which there is no landmark yet."""
        first, last = self.poses[0][0] + 2.0, self.poses[-1][0]
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
