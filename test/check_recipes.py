#!/usr/bin/env python3
"""Feeds each recipe of launch/recipes with messages of the definition it is for, and looks at what comes out.

The packages of those messages need not be there: a package of the same name, with the same definition, is
generated for the test and put before all others on PYTHONPATH.
"""

import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import genpy.generate_initpy
import genpy.generator
import rospkg
import rospy
import rostest
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from pf_resampling.msg import BeaconRange, FilterStatus, LandmarkObservationArray
from std_msgs.msg import Header

# Fields in their order: they, and their names, are what the check sum of a type is made of.
DEFINITIONS = {
    'uwb_driver/UwbRange': '''
        Header header
        uint16 msgId
        uint8 requester_id
        uint8 responder_id
        int8 requester_idx
        int8 responder_idx
        uint8 range_status
        uint8 antenna
        uint16 stopwatch_time
        float32 distance
        float32 coarse_range
        float32 filtered_range
        float32 distance_err
        float32 coarse_range_err
        float32 filtered_range_err
        float32 distance_dot
        float32 distance_dot_err
        uint8 range_meas_type
        uint16 requester_LED_flag
        uint16 responder_LED_flag
        uint16 noise
        uint16 vPeak
        int32 coarse_tof_in_bins
        uint32 uwb_time
        geometry_msgs/Point requester_location
        geometry_msgs/Point responder_location
        geometry_msgs/Point rqst_antenna_offset
        geometry_msgs/Point rspd_antenna_offset''',
    'gtec_msgs/Ranging': '''
        int16 anchorId
        int16 tagId
        int32 range
        int32 seq
        float64 errorEstimation''',
    'fiducial_msgs/FiducialTransform': '''
        int32 fiducial_id
        geometry_msgs/Transform transform
        float64 image_error
        float64 object_error
        float64 fiducial_area''',
    'fiducial_msgs/FiducialTransformArray': '''
        Header header
        int32 image_seq
        FiducialTransform[] transforms''',
    'mrpt_msgs/SingleRangeBearingObservation': '''
        int32 INVALID_LANDMARK_ID = -1
        float64 range
        float64 yaw
        float64 pitch
        int32 id''',
    'mrpt_msgs/ObservationRangeBearing': '''
        Header header
        geometry_msgs/Pose sensor_pose_on_robot
        float64 min_sensor_distance
        float64 max_sensor_distance
        float64 sensor_std_range
        float64 sensor_std_yaw
        float64 sensor_std_pitch
        SingleRangeBearingObservation[] sensed_data''',
}


def generate_packages(folder):
    """Python packages with the messages above, as catkin would make them."""
    installed = {
        name: [os.path.join(rospkg.RosPack().get_path(name), 'msg')]
        for name in ('std_msgs', 'geometry_msgs')
    }
    # Where nav_msgs has no Python modules (Debian), they are generated, too.
    files = {'nav_msgs': [os.path.join(rospkg.RosPack().get_path('nav_msgs'), 'msg', 'Odometry.msg')]}
    for name, fields in DEFINITIONS.items():
        package, message = name.split('/')
        path = os.path.join(folder, 'definitions', package, message + '.msg')
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, 'w') as file:
            file.write('\n'.join(line.strip() for line in fields.splitlines()) + '\n')
        files.setdefault(package, []).append(path)
    for package, paths in files.items():
        modules = os.path.join(folder, package, 'msg')
        os.makedirs(modules)
        open(os.path.join(folder, package, '__init__.py'), 'w').close()
        search = dict(installed, **{package: [os.path.dirname(paths[0])]})
        if genpy.generator.MsgGenerator().generate_messages(package, paths, modules, search) != 0:
            raise RuntimeError('cannot generate ' + package)
        genpy.generate_initpy.write_modules(modules)


class Recipe:
    """A running recipe."""

    def __init__(self, name, folder, **arguments):
        environment = dict(os.environ)
        environment['PYTHONPATH'] = folder + ':' + environment.get('PYTHONPATH', '')
        namespace = arguments.pop('ns', None)
        if namespace:
            environment['ROS_NAMESPACE'] = namespace
        self.process = subprocess.Popen(
            ['roslaunch', 'pf_resampling', name + '.launch'] + [f'{key}:={value}' for key, value in arguments.items()],
            env=environment)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait()


class Heard:
    """The messages of a topic."""

    def __init__(self, topic, message_type):
        self.messages = []
        self.came = threading.Event()
        self.subscriber = rospy.Subscriber(topic, message_type, self.take)

    def take(self, message):
        self.messages.append(message)
        self.came.set()


class Recipes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        generate_packages(cls.folder)
        sys.path.insert(0, cls.folder)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def ask(self, recipe, topic, message, answers, answer_type, **arguments):
        """Publishes the message, stamped, on a topic until the recipe answers; returns both."""
        heard = Heard(answers, answer_type)
        publisher = rospy.Publisher(topic, type(message), queue_size=10)
        with Recipe(recipe, self.folder, **arguments):
            for _ in range(600):
                if hasattr(message, 'header'):
                    message.header.stamp = rospy.Time.now()
                publisher.publish(message)
                if heard.came.wait(0.05):
                    break
        self.assertTrue(heard.messages, recipe + ' gave nothing')
        return heard.messages[0]

    def test_uwb_driver(self):
        from uwb_driver.msg import UwbRange
        message = UwbRange(header=Header(frame_id='uwb'), requester_id=200, responder_id=101,
                           distance=12.25, distance_err=0.5, coarse_range=99.0, filtered_range=99.0)
        answer = self.ask('uwb_driver', '/uwb_endorange_info', message, '/ranges', BeaconRange)
        self.assertEqual(answer.beacon, 101)
        self.assertEqual(answer.range, 12.25)
        self.assertEqual(answer.variance, 0.25)
        self.assertEqual(answer.header.frame_id, 'antenna')
        self.assertLess(abs((rospy.Time.now() - answer.header.stamp).to_sec()), 5.0)
        self.assertGreater(answer.header.stamp.to_sec(), 0.0)

    def test_gtec_ranging_in_a_namespace(self):
        from gtec_msgs.msg import Ranging
        before = rospy.Time.now()
        answer = self.ask('gtec_ranging', '/robot1/uwb', Ranging(anchorId=3, tagId=0, range=4321, errorEstimation=0.1),
                          '/robot1/ranges', BeaconRange, ns='robot1', antenna='robot1/mast', **{'from': 'uwb'})
        self.assertEqual(answer.beacon, 3)
        self.assertAlmostEqual(answer.range, 4.321, 12)
        self.assertEqual(answer.variance, 0.0)
        self.assertEqual(answer.header.frame_id, 'robot1/mast')
        self.assertGreaterEqual(answer.header.stamp, before)
        self.assertLessEqual(answer.header.stamp, rospy.Time.now())

    def test_fiducial_transforms(self):
        from fiducial_msgs.msg import FiducialTransform, FiducialTransformArray
        # In an optical frame: 4 m ahead and 3 m to the left, 1 m up; then 2 m ahead and 2 m to the right.
        places = [(7, Vector3(-3.0, -1.0, 4.0)), (12, Vector3(2.0, 0.5, 2.0))]
        message = FiducialTransformArray(header=Header(frame_id='optical'), transforms=[
            FiducialTransform(fiducial_id=id, transform=Transform(place, Quaternion(0, 0, 0, 1))) for id, place in places
        ])
        answer = self.ask('fiducial_transforms', '/fiducial_transforms', message, '/landmarks',
                          LandmarkObservationArray, sensor='camera_level')
        self.assertEqual(answer.header.frame_id, 'camera_level')
        self.assertEqual([seen.id for seen in answer.observations], [7, 12])
        left, right = answer.observations
        self.assertAlmostEqual(left.range, 5.0, 12)
        self.assertAlmostEqual(left.bearing, math.atan2(3.0, 4.0), 12)
        self.assertAlmostEqual(right.range, math.sqrt(8.0), 12)
        self.assertAlmostEqual(right.bearing, -math.pi / 4.0, 12)
        self.assertEqual(left.range_variance + left.bearing_variance, 0.0)

    def test_mrpt_range_bearing(self):
        from mrpt_msgs.msg import ObservationRangeBearing, SingleRangeBearingObservation
        message = ObservationRangeBearing(
            header=Header(frame_id='laser'), sensor_pose_on_robot=Pose(Point(0.1, 0, 0), Quaternion(0, 0, 0, 1)),
            max_sensor_distance=20.0, sensor_std_range=0.1, sensor_std_yaw=0.02, sensed_data=[
                SingleRangeBearingObservation(range=5.0, yaw=0.3, pitch=0.0, id=4),
                SingleRangeBearingObservation(range=6.0, yaw=-0.7, pitch=math.pi / 3.0, id=-1),
            ])
        answer = self.ask('mrpt_range_bearing', '/range_bearing', message, '/landmarks', LandmarkObservationArray)
        self.assertEqual(answer.header.frame_id, 'sensor')
        first, second = answer.observations
        self.assertEqual((first.id, first.range, first.bearing), (4, 5.0, 0.3))
        self.assertEqual((second.id, second.bearing), (-1, -0.7))
        self.assertAlmostEqual(second.range, 3.0, 12)
        self.assertAlmostEqual(first.range_variance, 0.01, 12)
        self.assertAlmostEqual(second.bearing_variance, 0.0004, 12)

    def test_the_node_localizes_by_what_a_recipe_makes(self):
        from nav_msgs.msg import Odometry
        from uwb_driver.msg import UwbRange
        beacons = {1: (5.0, 0.0), 2: (0.0, 6.0), 3: (-7.0, 1.0), 4: (1.0, -8.0)}
        status = Heard('/status', FilterStatus)
        odometry = rospy.Publisher('/odom', Odometry, queue_size=10)
        ranges = rospy.Publisher('/radio', UwbRange, queue_size=10)
        with Recipe('uwb_driver', self.folder, antenna='mast', **{'from': 'radio'}):
            for step in range(600):
                now = rospy.Time.now()
                # Along the x axis at 0.5 m/s.
                x = 0.05 * step
                pose = Odometry(header=Header(stamp=now, frame_id='odom'), child_frame_id='base_link')
                pose.pose.pose = Pose(Point(x, 0, 0), Quaternion(0, 0, 0, 1))
                odometry.publish(pose)
                beacon = 1 + step % 4
                place = beacons[beacon]
                ranges.publish(UwbRange(header=Header(stamp=now), responder_id=beacon, distance_err=0.1,
                                        distance=math.hypot(place[0] - x, place[1])))
                if status.messages and status.messages[-1].updates >= 10:
                    break
                rospy.sleep(0.1)
        self.assertTrue(status.messages, 'the node used no range')
        self.assertGreaterEqual(status.messages[-1].updates, 10)
        reasons = {(reject.input, reject.reason) for reject in status.messages[-1].rejects}
        self.assertFalse({reason for input, reason in reasons if reason in ('unknown_beacon', 'unknown_frame')}, reasons)


if __name__ == '__main__':
    rospy.init_node('check_recipes')
    rostest.rosrun('pf_resampling', 'recipes', Recipes, sys.argv)
