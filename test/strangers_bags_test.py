#!/usr/bin/env python3
"""Three bags that somebody else might have, taken through check_bag, the command it prints, and evaluate_bag.

Nothing is typed that check_bag did not say: its suggestions are followed until it prints a command. What such bags hold
is simulated: tags seen by a camera, with odometry on tf; ranges of radios, with beacons in a YAML file; landmarks, with
odometry as a pose and an IMU.
"""

import json
import math
import re
import subprocess

import genpy.dynamic
import rosbag
import rosunit
import yaml
from bags import InFolder, stamped, transform
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Imu, Range
from tf2_msgs.msg import TFMessage

SEPARATOR = '\n' + 80 * '=' + '\n'
APRIL_TAGS = SEPARATOR.join((
    'Header header\nAprilTagDetection[] detections',
    'MSG: apriltag_ros/AprilTagDetection\nint32[] id\nfloat64[] size\ngeometry_msgs/PoseWithCovarianceStamped pose',
    'MSG: geometry_msgs/PoseWithCovarianceStamped\n' + PoseWithCovarianceStamped._full_text))
CAMERA = (0.1, 0.0, 0.4)  # m, on the robot; it looks ahead: z ahead, x to the right


def april_tags(scan, types):
    tags = stamped(types['apriltag_ros/AprilTagDetectionArray'], scan.header.stamp.to_sec(), 'camera')
    for observation in scan.observations:
        tag = types['apriltag_ros/AprilTagDetection']()
        tag.id = [observation.id]
        tag.size = [0.2]
        tag.pose.header = tags.header
        place = tag.pose.pose.pose.position
        place.x = -observation.range * math.sin(observation.bearing)
        place.y = CAMERA[2]
        place.z = observation.range * math.cos(observation.bearing) - CAMERA[0]
        tag.pose.pose.pose.orientation.w = 1.0
        tags.detections.append(tag)
    return tags


def write_tags(source, out, odometry='/tf'):
    types = genpy.dynamic.generate_dynamic('apriltag_ros/AprilTagDetectionArray', APRIL_TAGS)
    with rosbag.Bag(str(out), 'w') as bag:
        for number, (topic, message, time) in enumerate(rosbag.Bag(str(source)).read_messages()):
            if number == 0:
                there = transform('base_link', 'camera', time.to_sec(), ahead=CAMERA[0], above=CAMERA[2], turn=(0.5, -0.5, 0.5, -0.5))
                bag.write('/tf_static', TFMessage([there]), time)
            if topic in (odometry, '/ground_truth', '/ground_truth_landmarks'):
                bag.write(topic, message, time)
            elif topic == '/landmarks':
                bag.write('/tag_detections', april_tags(message, types), time)


def write_radios(source, out, beacons):
    with rosbag.Bag(str(out), 'w') as bag:
        for topic, message, time in rosbag.Bag(str(source)).read_messages():
            if topic in ('/odom', '/ground_truth'):
                bag.write(topic, message, time)
            elif topic == '/beacons':
                beacons.write_text(yaml.safe_dump({'beacons': [dict(id=each.id, **{axis: getattr(each.position, axis) for axis in 'xyz'})
                                                               for each in message.beacons]}))
            elif topic == '/ranges':
                bag.write('/uwb', stamped(Range, message.header.stamp.to_sec(), f'beacon_{message.beacon}', range=message.range,
                                          min_range=0.1, max_range=100.0), time)


def write_poses(source, out):
    before = None
    with rosbag.Bag(str(out), 'w') as bag:
        for topic, message, time in rosbag.Bag(str(source)).read_messages():
            if topic in ('/landmarks', '/ground_truth', '/ground_truth_landmarks', '/tf_static'):
                bag.write(topic, message, time)
            if topic != '/odom':
                continue
            bag.write('/robot_pose', PoseWithCovarianceStamped(message.header, message.pose), time)
            seconds = message.header.stamp.to_sec()
            turned = message.pose.pose.orientation
            heading = 2.0 * math.atan2(turned.z, turned.w)
            if before:
                imu = stamped(Imu, seconds, 'base_link')
                imu.orientation_covariance[0] = -1.0  # it has none
                imu.angular_velocity.z = math.remainder(heading - before[1], 2.0 * math.pi) / (seconds - before[0])
                imu.angular_velocity_covariance[8] = 1e-4
                bag.write('/imu', imu, time)
            before = seconds, heading


class StrangersBags(InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.say('simulate_bag', 'indoor_two_loops', 'world.bag')
        cls.say('simulate_bag', 'beacons_figure8', 'figure.bag', '--duration', '120')
        write_radios(cls.shared / 'figure.bag', cls.shared / 'uwb.bag', cls.shared / 'beacons.yaml')

    @classmethod
    def say(cls, name, *arguments):
        done = subprocess.run(['rosrun', 'pf_resampling', name, *arguments], cwd=cls.shared, universal_newlines=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        assert done.returncode in ((0, 1) if name == 'check_bag' else (0,)), done.stdout  # 1: the bag is not ready as it is
        return done.stdout

    def command_for(self, *arguments):
        """What check_bag says to type, after it has been asked for as often as it says."""
        for _ in range(3):
            said = self.say('check_bag', *arguments)
            command = re.search(r'^  rosrun pf_resampling (run_bag .*)$', said, re.MULTILINE)
            if command:
                return command.group(1).split(), said
            again = re.search(r'^  try: rosrun pf_resampling check_bag (.*)$', said, re.MULTILINE)
            self.assertTrue(again, said)
            arguments = again.group(1).split()
        raise AssertionError('check_bag asks again and again: ' + said)

    def assert_good(self):
        """The error is half of what counts as lost, or less, and the filter knows how large it is."""
        self.say('evaluate_bag', 'out.bag', '--json', 'out.json')
        judged = json.loads((self.shared / 'out.json').read_text(encoding='utf-8'))
        self.assertLess(judged['estimate']['cartesian']['mean'], 0.5 * judged['lost_error'])
        self.assertGreater(judged['coverage95'], 0.8)
        self.assertGreater(judged['health']['shares']['healthy'], 0.8)  # not while a loop is open

    def test_tags_with_odometry_on_tf(self):
        write_tags(self.shared / 'world.bag', self.shared / 'tags.bag')
        command, _ = self.command_for('tags.bag')
        self.assertEqual(command[:3], ['run_bag', 'fastslam', 'tags.bag'])
        self.say(*command)
        self.assert_good()

    def test_drivers_messages_are_solved_by_least_squares(self):
        write_tags(self.shared / 'world.bag', self.shared / 'tags.bag', '/odom')
        self.say('run_bag', 'fastslam', 'tags.bag', 'out.bag', '--landmarks', '/tag_detections')
        self.assert_solved('--landmarks', '/tag_detections')
        self.say('run_bag', 'beacon_mcl', 'uwb.bag', 'out.bag', '--sensor-ranges', '/uwb', '--config', 'beacons.yaml')
        self.assert_solved('--sensor-ranges', '/uwb')

    def assert_solved(self, *options):
        self.say('evaluate_bag', 'out.bag', '--batch', '--json', 'out.json', *options)
        judged = json.loads((self.shared / 'out.json').read_text(encoding='utf-8'))
        self.assertLess(judged['batch']['cartesian_aligned']['mean'], 0.15)

    def test_radios_with_beacons_in_a_file(self):
        said = self.say('check_bag', 'uwb.bag')
        self.assertIn('--config beacons.yaml', said)
        topic = re.search(r'\((--sensor-ranges /uwb);', said)
        self.assertTrue(topic, said)
        command, _ = self.command_for('uwb.bag', *topic.group(1).split(), '--config', 'beacons.yaml')
        self.assertEqual(command[:3], ['run_bag', 'beacon_mcl', 'uwb.bag'])
        self.say(*command)
        self.assert_good()

    def test_poses_with_an_imu(self):
        write_poses(self.shared / 'world.bag', self.shared / 'poses.bag')
        command, said = self.command_for('poses.bag')
        self.assertEqual(command[:3], ['run_bag', 'fastslam', 'poses.bag'])
        imu = re.search(r'remark: /imu is an IMU: (--set odometry_input/imu_heading=yaw_rate) ', said)
        self.assertTrue(imu, said)
        for options in ([], imu.group(1).split()):
            self.say(*command, *options)
            self.assert_good()


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'strangers_bags', StrangersBags)
