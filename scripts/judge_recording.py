#!/usr/bin/python3
"""Judges a filter over a whole recording that is being played: launch/recording.test starts both.

Listens until the bag is over, keeps what comes in a bag of its own, and fails with what is wrong: no pose or status,
what is not finite, gaps, a low rate, a filter that says it is lost, and, where the recording has the truth, the error.
Private parameters: bag, filter, config, and the limits that recording.test explains.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rosbag
import rosgraph
import rospy
import rostest

SILENCE = 20.0  # s of wall time in which a bag that is played says nothing
OVER = 0.5  # s before the last message, when a bag is as good as over
# What evaluate_bag needs of a run.
TOPICS = ('odom', 'pose', 'path', 'status', 'landmark_map', 'initialpose', 'ground_truth', 'ground_truth_landmarks',
          '/tf_static')
LOST = 0.5  # a probability above it counts as lost, as in all of the package


def numbers_of(value):
    """All numbers in a message."""
    if isinstance(value, (int, float)):
        yield value
    elif isinstance(value, (list, tuple)):
        for element in value:
            yield from numbers_of(element)
    elif hasattr(value, '__slots__'):
        for name in value.__slots__:
            yield from numbers_of(getattr(value, name))


class Recording(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bag = cls.setting('bag')
        cls.filter = cls.setting('filter')
        with rosbag.Bag(cls.bag) as bag:
            cls.begin, cls.end = bag.get_start_time(), bag.get_end_time()
        cls.directory = tempfile.TemporaryDirectory()
        cls.out = os.path.join(cls.directory.name, 'run.bag')
        cls.stamps = {'odom': [], 'pose': [], 'status': []}
        cls.lost = []
        cls.counts, cls.not_finite = {}, {}
        cls.last_health = ''
        cls.diagnostics = {}
        cls.lock = threading.Lock()
        cls.listen()

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    @staticmethod
    def setting(name):
        return rospy.get_param('~' + name)

    @classmethod
    def listen(cls):
        """Keeps what comes until the bag is over, or nothing comes any more."""
        with rosbag.Bag(cls.out, 'w') as out:
            import roslib.message  # pylint: disable=import-outside-toplevel
            master = rosgraph.Master(rospy.get_name())
            subscribers = {}
            last, changed = 0.0, time.monotonic()
            while not rospy.is_shutdown():
                # A topic is known once somebody has told its type.
                types = dict(master.getTopicTypes())
                for topic in TOPICS + ('/diagnostics',):
                    kind = types.get(rospy.resolve_name(topic), '*')
                    if topic in subscribers or kind == '*':
                        continue
                    message_class = roslib.message.get_message_class(kind)
                    if message_class:
                        subscribers[topic] = rospy.Subscriber(
                            topic, message_class, lambda message, topic=topic: cls.take_locked(topic, message, out))
                now = rospy.get_time()
                if now != last:
                    last, changed = now, time.monotonic()
                if now >= cls.end - OVER or time.monotonic() - changed > SILENCE:
                    break
                time.sleep(0.1)
            cls.played = min(last, cls.end)
            time.sleep(2.0)  # what is still under way
            for subscriber in subscribers.values():
                subscriber.unregister()
            time.sleep(0.5)

    @classmethod
    def take_locked(cls, topic, message, out):
        """Callbacks come from many threads, and a bag is written by one at a time."""
        with cls.lock:
            cls.take(topic, message, out)

    @classmethod
    def take(cls, topic, message, out):
        name = topic.lstrip('/')
        if name == 'diagnostics':
            for entry in message.status:
                cls.diagnostics[entry.name] = entry.message
            return
        cls.counts[name] = cls.counts.get(name, 0) + 1
        if name in ('pose', 'path', 'status', 'landmark_map') and not all(map(math.isfinite, numbers_of(message))):
            cls.not_finite[name] = cls.not_finite.get(name, 0) + 1
        if name in cls.stamps:
            cls.stamps[name].append(message.header.stamp.to_sec())
        if name == 'status':
            cls.lost.append(message.lost)
            cls.last_health = message.health_text
        stamp = getattr(getattr(message, 'header', None), 'stamp', rospy.Time())
        out.write('/' + name, message, stamp if stamp.to_sec() > 0.0 else rospy.Time.from_sec(max(cls.begin, 1e-3)))

    def needs(self, name):
        """Whatever is judged by messages that have not come is not judged; test_2 says so."""
        if self.counts.get(name, 0) == 0:
            self.skipTest(f'nothing came on {name}')

    def what_the_node_says(self):
        return '; '.join(f'{name}: {text}' for name, text in sorted(self.diagnostics.items())) or 'nothing'

    def what_the_bag_lacks(self):
        """What check_bag says of this filter and bag."""
        words = ['rosrun', 'pf_resampling', 'check_bag', self.bag, '--config', self.setting('config')]
        found = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
        for line in found.stdout.splitlines():
            if line.startswith('ready for ' + self.filter):
                return line
        return found.stdout.strip()

    def test_1_is_played_to_its_end(self):
        self.assertGreaterEqual(self.played, self.end - OVER,
                                f'the bag lasts {self.end - self.begin:.1f} s, and {self.played - self.begin:.1f} s were '
                                'played: did a node end?')

    def test_2_poses_and_status_come(self):
        for name in ('odom', 'pose', 'status'):
            self.assertGreater(self.counts.get(name, 0), 0,
                               f'nothing came on {name} in {self.played - self.begin:.1f} s of the recording. check_bag: '
                               f'{self.what_the_bag_lacks()}. The node: {self.what_the_node_says()}')

    def test_3_everything_is_finite(self):
        self.assertEqual(self.not_finite, {}, 'messages with NaN or infinity, by topic')

    def test_4_rate_and_gaps(self):
        self.needs('pose')
        poses, odometry = self.stamps['pose'], self.stamps['odom']
        self.assertGreater(len(poses), 1, 'fewer than two poses came')
        # Until the filter has begun there are none; how long that takes is limited by skip.
        began = poses[0] - self.begin
        allowed = float(self.setting('skip')) * (self.end - self.begin)
        self.assertLessEqual(began, allowed, f'the first pose comes {began:.1f} s after the beginning, allowed are '
                             f'{allowed:.1f} s (skip:=)')
        heard = sum(stamp >= poses[0] for stamp in odometry)
        share = len(poses) / max(1, heard)
        self.assertGreaterEqual(share, float(self.setting('min_rate')),
                                f'{len(poses)} poses to {heard} messages of odometry: {share:.2f} of them (min_rate:=)')
        gap, at = max((later - earlier, earlier) for earlier, later in zip(poses, poses[1:]))
        self.assertLessEqual(gap, float(self.setting('max_gap')),
                             f'no pose for {gap:.2f} s, {at - self.begin:.1f} s after the beginning (max_gap:=)')

    def test_5_is_not_lost(self):
        self.needs('status')
        kept = self.lost[int(float(self.setting('skip')) * len(self.lost)):]
        self.assertTrue(kept, 'there is no status to judge by')
        share = sum(lost > LOST for lost in kept) / len(kept)
        self.assertLessEqual(share, float(self.setting('max_lost')),
                             f'it says that it is lost {100 * share:.1f} % of the time (max_lost:=); at the end: '
                             f'{self.last_health}')

    def test_6_error(self):
        self.needs('pose')
        self.needs('ground_truth')
        result = os.path.join(self.directory.name, 'result.json')
        words = ['rosrun', 'pf_resampling', 'evaluate_bag', self.out, '--quiet', '--json', result, '--clip',
                 str(self.setting('skip'))]
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)
        with open(result, encoding='utf-8') as file:
            found = json.load(file)
        error = found['estimate']['cartesian']['mean']
        limit = float(self.setting('max_error')) or found['lost_error']
        print(f'mean Cartesian error {error:.3f} m, limit {limit:.3f} m')
        self.assertLessEqual(error, limit, 'mean Cartesian error, m (max_error:=)')


if __name__ == '__main__':
    rospy.init_node('judge_recording')
    rostest.rosrun('pf_resampling', 'recording', Recording, sys.argv)
