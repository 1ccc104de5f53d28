#!/usr/bin/env python3
"""What check_bag says of bags in which all that is wrong is known."""

import math
import re

import rosunit
from bags import ROOT, InFolder, pose_at, program, stamped, transform, write_bag
from geometry_msgs.msg import Point, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from pf_resampling.msg import BeaconArray, BeaconPosition, BeaconRange, LandmarkObservation, LandmarkObservationArray
from sensor_msgs.msg import Imu, Range
from tf2_msgs.msg import TFMessage

from checks import survey  # of the tools, where bags has put them

OPTICAL = (0.5, -0.5, 0.5, -0.5)  # w, x, y, z: the z axis looks ahead
BEACONS = {1: (0, 5), 2: (5, 5), 3: (5, 0)}


def odometry(time, x=0.0, y=0.0, heading=0.0, frame='odom', child='base_link'):
    message = stamped(Odometry, time, frame, child_frame_id=child)
    message.pose.pose = pose_at(x, y, heading)
    return '/odom', time, message


def placed(topic, time, parent, child, **where):
    return topic, time, TFMessage([transform(parent, child, time, **where)])


def listed(places):
    return '/beacons', 9.9, stamped(BeaconArray, 9.9, 'map', beacons=[
        BeaconPosition(number, Point(x, y, 0.5)) for number, (x, y) in places.items()])


def measured(time, beacon, distance, frame='antenna'):
    return '/ranges', time, stamped(BeaconRange, time, frame, beacon=beacon, range=distance)


def drive(spoiled=-1, **frames):
    """10 s along a line."""
    return [odometry(10 + 0.1 * i, math.nan if i == spoiled else 0.1 * i, **frames) for i in range(101)]


def radios(places=None, ids=(1, 2, 3), value=lambda i: 2.0 + i, later=0.0):
    """Ranges to three beacons in turn, with nothing wrong."""
    return [placed('/tf_static', 9.9, 'base_link', 'antenna', ahead=0.25, above=0.5), listed(places or BEACONS),
            *[measured(10.05 + i / 3 + later, ids[i % 3], value(i)) for i in range(30)]]


def scans(number_of=lambda i, k: 7 + k, bearing=0.5, first_range=2.0):
    """One a second, of two landmarks."""
    yield placed('/tf_static', 9.9, 'base_link', 'sensor', ahead=0.1, above=0.3)
    for i in range(9):
        seen = [LandmarkObservation(number_of(i, 0), first_range if i == 0 else 2.0 + i, bearing, 0.0, 0.0),
                LandmarkObservation(number_of(i, 1), 3.0, bearing - 0.75, 0.01, 0.0)]
        yield '/landmarks', 11.05 + i, stamped(LandmarkObservationArray, 11.05 + i, 'sensor', observations=seen)


def circle(unit):
    """4 m about the middle of four beacons at the corners of a square of 12 m."""
    corners = {1: (-6, -6), 2: (6, -6), 3: (6, 6), 4: (-6, 6)}
    yield listed(corners)
    for i in range(601):
        time, angle = 10 + 0.1 * i, 0.0125 * i
        x, y, (to_x, to_y) = 4 * math.cos(angle), 4 * math.sin(angle), corners[1 + i % 4]
        yield odometry(time, x, y, angle + math.pi / 2)
        yield measured(time, 1 + i % 4, math.hypot(to_x - x, to_y - y) * unit, 'base_link')


def sensor_ranges(topic):
    """Of the beacons 1 to 3 and of a sonar, as sensor_msgs/Range."""
    yield listed({number: (5 * number, 5 if number == 2 else 0) for number in (1, 2, 3)})
    for i in range(101):
        frame = 'sonar' if i % 4 == 3 else f'beacon_{1 + i % 4}'
        yield odometry(10 + 0.1 * i)
        yield topic, 10 + 0.1 * i, stamped(Range, 10 + 0.1 * i, frame, range=4.0, max_range=10.0)


def camera(is_optical, parent='base_link'):
    """A scan of a camera; one that is not optical is placed by a driver that repeats where it is."""
    return [odometry(10), ('/landmarks', 10, stamped(LandmarkObservationArray, 10, 'camera', observations=[
        LandmarkObservation(range=3.0)])), placed('/tf_static', 10, parent, 'camera', above=0.3, turn=OPTICAL) if is_optical else
            placed('/tf', 10, parent, 'camera', above=0.3)]


def tags():
    """A robot that stands; a camera that looks ahead sees tag_7 3 m ahead."""
    yield placed('/tf_static', 10, 'base_link', 'camera', above=0.3, turn=OPTICAL)
    for i in range(11):
        yield odometry(10 + 0.1 * i)
        if i < 10:  # an image is complete when odometry has gone on
            yield placed('/tf', 10.01 + 0.1 * i, 'camera', 'tag_7', above=3.0)


def other_odometry(with_tf, with_pose):
    for i in range(10):
        time = 10 + 0.1 * i
        if with_tf:
            yield placed('/tf', time, 'odom', 'base_footprint')
        if with_pose:
            pose = stamped(PoseWithCovarianceStamped, time, 'odom_combined')
            pose.pose.pose.orientation.w = 1.0
            yield '/odom_combined', time, pose
        yield '/imu/data', time, stamped(Imu, time)


class CheckBag(InFolder):
    def setUp(self):
        super().setUp()
        self.bag = self.folder / 'a.bag'

    def check(self, *messages, options=(), ready=None):
        """What is said of a bag; `ready`: which filters are."""
        write_bag(self.bag, sorted((each for part in messages for each in part), key=lambda each: each[1]))
        code, said, error = program('check_bag', self.bag, *options)
        self.assertEqual(error, '')
        found = re.findall(r'^ready for (\w+): yes$', said, re.MULTILINE)
        self.assertEqual(code, 0 if found else 1)
        if ready is not None:
            self.assertEqual(' '.join(found), ready, said)
        return said

    def assert_says(self, said, *words):
        for each in words:
            self.assertIn(each, said)

    def test_good_bags_are_ready_and_have_no_remarks(self):
        run = f'  rosrun pf_resampling run_bag {{}} {self.bag} out.bag\n'
        said = self.check(drive(), radios(), ready='beacon_mcl')
        self.assertEqual(said, f'{self.bag}:\nready for beacon_mcl: yes\n{run.format("beacon_mcl")}ready for fastslam: no: no '
                         '/landmarks (needed: pf_resampling/LandmarkObservationArray)\n')
        self.assertNotIn('remark', self.check(drive(), scans(), ready='fastslam'))
        self.assertNotIn('remark', self.check(drive(), scans(), radios(), ready='beacon_mcl fastslam'))

    def test_ids_of_landmarks(self):
        self.check(drive(), scans(lambda i, k: -1 if i < 2 else 7 + k), ready='fastslam')
        self.assert_says(self.check(drive(), scans(lambda i, k: -1), ready='fastslam'), '/landmarks: without ids')
        self.assert_says(self.check(drive(), scans(lambda i, k: 2 * i + k)), '/landmarks: no id is seen twice')

    def test_numbers_that_are_none(self):
        self.assert_says(self.check(drive(), scans(first_range=math.nan), ready='fastslam'), '1 landmarks rejected, not_finite')
        self.assert_says(self.check(drive(), scans(bearing=math.nan), ready=''), 'landmarks rejected, not_finite')
        said = self.check(drive(spoiled=5), radios(value=lambda i: -1.0 if i == 4 else 2.0 + i), ready='beacon_mcl')
        self.assert_says(said, '1 odom rejected, not_finite', '1 ranges rejected, not_positive')
        self.assert_says(self.check(drive(), radios(value=lambda i: math.nan), ready=''), '30 ranges rejected, not_finite')
        self.assert_says(self.check(drive(), radios(later=100.0), ready=''), 'rejected, ahead_of_odometry')

    def test_sensors_lie_flat_and_may_be_placed_by_tf(self):
        self.assert_says(self.check(camera(True), ready=''), "the z axis of 'camera' does not point up")
        self.assertNotIn('frame', self.check(camera(False)))
        self.assert_says(self.check(camera(False, 'mast')), "where 'camera' is on 'base_link' is not known: give it on /tf_static")

    def test_what_is_missing_and_what_is_there(self):
        self.assertEqual(self.check(drive(), ready='').split('\n', 1)[1], (
            'ready for beacon_mcl: no: no /ranges (needed: pf_resampling/BeaconRange); no /beacons (needed: '
            'pf_resampling/BeaconArray) (or give the beacons in the configuration: --config beacons.yaml)\n'
            'ready for fastslam: no: no /landmarks (needed: pf_resampling/LandmarkObservationArray)\n'))
        said = self.check(drive(), radios(), options=('--odom', '/robot/odom', '--ranges', '/odom'), ready='')
        self.assert_says(said, 'no /robot/odom (needed: nav_msgs/Odometry), /odom could be it (--odom /odom; for the node '
                         'odom:=/odom)', '/odom is a nav_msgs/Odometry (needed: pf_resampling/')

    def test_command_has_the_options_that_the_bag_needs(self):
        messages = [('/o', time, message) for _, time, message in drive()], scans()
        self.assert_says(self.check(*messages, options=('--odom', 'o'), ready='fastslam'), 'out.bag --odom /o\n')
        placed_there = [placed('/tf_static', 9.8, 'the robot', 'sensor'), *list(scans())[1:]]
        said = self.check(drive(frame='wheels', child='the robot'), placed_there, ready='fastslam')
        self.assert_says(said, 'set the parameter frames/odom', 'set the parameter frames/base',
                         "out.bag --set frames/odom=wheels --set 'frames/base=the robot'\n")

    def test_beacons_that_are_not_known(self):
        said = self.check(drive(), radios(places={9: (0, 5), 2: (5, 5), 3: (5, 0)}), ready='beacon_mcl')
        self.assert_says(said, '10 ranges rejected, unknown_beacon: beacon 1 is unknown', 'only 2 known beacons')
        self.assert_says(self.check(drive(), radios(ids=(77, 77, 77)), ready=''), 'beacon 77 is unknown')
        twice = listed(BEACONS)
        twice[2].beacons[0].id = 2
        self.assert_says(self.check(drive(), [twice, *radios()[2:]], ready=''), 'beacon 2 is there twice')

    def test_units(self):
        self.check(circle(1.0), ready='beacon_mcl')
        for unit, words in ((1000.0, '1000 times too long for the distances between the beacons, as if ranges were in millimetres'),
                            (100.0, 'as if ranges were in centimetres'), (1 / 0.3048, 'as if ranges were in feet'),
                            (0.001, 'as if the beacons were in millimetres'), (0.3048, 'as if the beacons were in feet')):
            self.assert_says(self.check(circle(unit), ready=''), words)

    def test_frames(self):
        self.assert_says(self.check([odometry(10, child='')]), "/odom names no child_frame_id: it is taken as that of 'base_link'")
        self.assert_says(self.check([odometry(10), placed('/tf', 10, 'map', 'odom')]),
                         "/tf places 'odom' in 'map': that is from another localization")
        yaml = self.bag.parent / 'antennas.yaml'
        yaml.write_text('antennas:\n  - {frame: mast, x: 1, y: 0}\n')
        self.assert_says(self.check(drive(), radios(), options=('--config', yaml)),
                         'the list `antennas` places \'mast\', but /ranges is measured from antenna: --set range_input/antenna=mast')

    def test_ranges_may_be_of_sensor_msgs(self):
        said = self.check(sensor_ranges('/sensor_ranges'), ready='beacon_mcl')
        self.assert_says(said, "rejected, unknown_beacon: frame 'sonar' does not name a beacon")
        self.assert_says(self.check(sensor_ranges('/radio'), ready=''), '/radio could be it (--sensor-ranges /radio')

    def test_it_confirms_its_own_advice(self):
        pattern = " --set 'landmark_input/tag_pattern=tag_(\\d+)'"
        self.assert_says(self.check(tags(), ready=''), f'\n  try: rosrun pf_resampling check_bag {self.bag}{pattern}\n')
        said = self.check(tags(), options=('--set', 'landmark_input/tag_pattern=tag_(\\d+)'), ready='fastslam')
        self.assert_says(said, f'  rosrun pf_resampling run_bag fastslam {self.bag} out.bag{pattern}\n', 'is unknown')
        self.assert_says(self.check(tags(), options=('--set', 'landmark_input/tag_pattern=mark_(.)')),
                         'no frame in /tf has a name that fits landmark_input/tag_pattern mark_(.)')
        self.assertNotIn('tag_pattern', self.check([placed('/tf', 10, 'map', 'ar_marker_12')]))

    def test_odometry_on_tf_as_a_pose_and_the_imu(self):
        self.assert_says(self.check(other_odometry(True, False), ready=''), "'odom' -> 'base_footprint' on /tf could be it (--set "
                         'odometry_input/source=tf --set frames/base=base_footprint)', '/imu/data is an IMU: --imu /imu/data --set')
        self.assert_says(self.check(other_odometry(False, True)), '/odom_combined could be it (--odom /odom_combined')
        both = list(other_odometry(True, True))
        by_tf = self.check(both, options=('--set', 'odometry_input/source=tf', '--set', 'frames/base=base_footprint'))
        self.assertNotRegex(by_tf, 'no /odom|nothing on /tf')
        by_pose = self.check(both, options=('--odom', '/odom_combined'))
        self.assert_says(by_pose, "frame 'odom_combined' instead of 'odom'")
        self.assertNotIn('needed: nav_msgs', by_pose)
        self.assert_says(self.check(both, options=('--set', 'odometry_input/imu_heading=yaw_rate')),
                         'no /imu (needed: sensor_msgs/Imu), /imu/data could be it (--imu /imu/data')

    def test_drivers_are_those_of_the_filters(self):
        source = (ROOT / 'src/messages/foreign_messages.cpp').read_text(encoding='utf-8')
        self.assertEqual(set(re.findall(r'const char\* const \w+ = "(\w+/\w+)";', source)),
                         set(survey.RANGE_TYPES[1:] + survey.LANDMARK_TYPES[1:]))

    def test_bad_files_and_misuse_are_one_line(self):
        self.check(drive(), radios())
        data = self.bag.read_bytes()
        for name, content in (('cut.bag', data[:len(data) // 2]), ('text.bag', b'hello'), ('none.bag', None)):
            path = self.bag.parent / name
            if content:
                path.write_bytes(content)
            self.assertRegex(program('check_bag', path)[2], f'^check_bag: .*{name}.*\n$')
            self.assertEqual(program('check_bag', path)[:2], (1, ''))
        self.assertEqual(program('check_bag', self.bag, '--set', 'no_such=1')[0], 1)
        for words in ((), ('a.bag', 'b.bag'), ('a.bag', '--odm', '/odom')):
            code, _, error = program('check_bag', *words)
            self.assertEqual((code, error.count('\n'), error[:10]), (2, 1, 'check_bag:'))
        self.assertIn('Usage: rosrun pf_resampling check_bag in.bag', program('check_bag', '--help')[1])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'check_bag', CheckBag)
