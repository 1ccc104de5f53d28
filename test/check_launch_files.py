#!/usr/bin/env python3
"""Calls the launch files as users do, with names relative to a folder of their own, and looks at what they leave."""

import glob
import os
import socket
import subprocess
import sys
import xml.etree.ElementTree

import rosbag
import rospkg
import rostest
from bags import InFolder

PACKAGE = rospkg.RosPack().get_path('pf_resampling')


def free_port():
    with socket.socket() as listener:
        listener.bind(('localhost', 0))
        return str(listener.getsockname()[1])


def counts_of(name):
    """Messages by topic."""
    with rosbag.Bag(str(name)) as bag:
        return {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}


class LaunchFiles(InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.check_call(['rosrun', 'pf_resampling', 'simulate_bag', 'beacons_figure8', os.path.join(cls.shared, 'drive.bag'),
                               '--duration', '60'], stdout=subprocess.DEVNULL)

    def run_in_folder(self, *words, **environment):
        """Runs a command in the folder; with a roscore of its own, if it is roslaunch."""
        environment = dict(os.environ, PWD=self.shared, **environment)
        environment.pop('ROS_NAMESPACE', None)
        return subprocess.run(words, cwd=self.shared, env=environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, universal_newlines=True, timeout=120)

    def roslaunch(self, *words):
        port = free_port()
        return self.run_in_folder('roslaunch', '-p', port, 'pf_resampling', *words,
                                  ROS_MASTER_URI='http://localhost:' + port)

    def test_every_argument_says_what_it_is(self):
        files = glob.glob(os.path.join(PACKAGE, '*', '*.launch'))
        self.assertGreaterEqual(len(files), 5)
        for name in files:
            for argument in xml.etree.ElementTree.parse(name).getroot().iter('arg'):
                if 'doc' in argument.attrib or 'value' in argument.attrib and argument.get('name') is not None:
                    continue
                self.fail(f'{name}: argument {argument.get("name")} has no doc')

    def test_offline(self):
        done = self.roslaunch('offline.launch', 'bag:=drive.bag', 'out:=out.bag', 'seed:=3',
                              'options:=--set particles=300 --no-clouds')
        self.assertTrue((self.shared / 'out.bag').exists(), done.stdout)
        counts = counts_of(self.shared / 'out.bag')
        self.assertGreater(counts['/pose'], 500)
        self.assertNotIn('/particles', counts)
        self.assertIn('300 particles', done.stdout)

    def test_a_bag_that_is_played_in_a_namespace_and_recorded(self):
        done = self.roslaunch('beacon_mcl.launch', 'bag:=drive.bag', 'rate:=15', 'rviz:=false', 'record:=record.bag',
                              'stop_with_bag:=true', '__ns:=robot1')
        self.assertTrue((self.shared / 'record.bag').exists(), done.stdout)
        self.assertIn('/robot1/', done.stdout)
        counts = counts_of(self.shared / 'record.bag')
        for topic in ('/odom', '/ranges', '/beacons', '/ground_truth', '/tf', '/pose', '/status', '/particles'):
            self.assertGreater(counts.get(topic, 0), 0, f'{topic} in {counts}')
        self.assertGreater(counts['/pose'], 400)
        # What was recorded is good for run_bag, whatever namespace it came from.
        again = self.run_in_folder('rosrun', 'pf_resampling', 'run_bag', 'beacon_mcl', 'record.bag', 'again.bag')
        self.assertEqual(again.returncode, 0, again.stdout)

    def test_a_bag_with_outputs_is_played_without_them(self):
        self.run_in_folder('rosrun', 'pf_resampling', 'run_bag', 'beacon_mcl', 'drive.bag', 'made.bag')
        done = self.roslaunch('beacon_mcl.launch', 'bag:=made.bag', 'rate:=15', 'rviz:=false', 'record:=second.bag',
                              'stop_with_bag:=true')
        self.assertTrue((self.shared / 'second.bag').exists(), done.stdout)
        callers, frames = {}, set()
        with rosbag.Bag(str(self.shared / 'second.bag')) as bag:
            for topic, message, _, header in bag.read_messages(return_connection_header=True):
                caller = header['callerid']
                caller = caller.decode() if isinstance(caller, bytes) else caller
                callers.setdefault(topic, set()).add(caller)
                for transform in message.transforms if topic == '/tf' else ():
                    frames.add((caller, transform.header.frame_id, transform.child_frame_id))
        for topic in ('/pose', '/path', '/particlecloud', '/particles', '/markers', '/status', '/diagnostics'):
            self.assertEqual(callers[topic], {'/beacon_mcl'}, topic)
        self.assertEqual(callers['/odom'], {'/play'})
        self.assertEqual({caller for caller, parent, child in frames if (parent, child) == ('map', 'odom')},
                         {'/beacon_mcl'})
        # The others of the bag are there.
        self.assertIn(('odom', 'base_link'), {frame[1:] for frame in frames})

    def test_odometry_of_another_name(self):
        # The bag is played under that name, and the node listens to it.
        self.roslaunch('beacon_mcl.launch', 'bag:=drive.bag', 'rate:=30', 'rviz:=false', 'record:=vesc.bag',
                       'stop_with_bag:=true', 'odom:=/vesc/odom')
        self.assertGreater(counts_of(self.shared / 'vesc.bag').get('/pose', 0), 400)

    def test_the_example_beside_other_packages(self):
        parameters = os.path.join(PACKAGE, 'config', 'fastslam.yaml')
        done = self.run_in_folder('roslaunch', '--nodes', os.path.join(PACKAGE, 'examples', 'navigation.launch'),
                                  'map:=my.map', 'building:=building.yaml', 'move_base:=' + parameters, 'rviz:=false')
        self.assertEqual(set(done.stdout.split()), {'/fastslam', '/fused_odometry', '/map_server', '/move_base'}, done.stdout)


if __name__ == '__main__':
    rostest.rosrun('pf_resampling', 'launch_files', LaunchFiles, sys.argv)
