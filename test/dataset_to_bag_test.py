#!/usr/bin/env python3
"""Whether dataset_to_bag reads what the data sets say, and says in one line what is wrong with a file."""

import math
import pathlib
import signal
import subprocess
import sys
import time

import rosbag
import rosunit
import scipy.io
from bags import ROOT, InFolder

from command_line import Error  # of the tools, where bags has put them
from datasets import bag, csv_folder, labyrinth, mrclam, plaza, victoria_park
from datasets.recording import Beacon, Odometry, Range, Recording, wrap_angle


class Reading(InFolder):
    def write(self, **files):
        """robot1="..." writes robot1.csv; a name may have an ending of its own."""
        for name, text in files.items():
            (self.folder / (name.replace('__', '.') if '__' in name else f'{name}.csv')).write_bytes(text.encode())

    def mat(self, name='a.mat', **matrices):
        scipy.io.savemat(str(self.folder / name), matrices)
        return str(self.folder / name)

    def error_of(self, read, *arguments):
        with self.assertRaises(Error) as raised:
            read(*arguments)
        return str(raised.exception)

    def assert_near(self, found, expected, tolerance=1e-12):
        self.assertEqual(len(found), len(expected))
        for one, other in zip(found, expected):
            self.assertAlmostEqual(one, other, delta=tolerance)

    # ---- CSV ----------------------------------------------------------------------------------------------------------

    def csv(self, unit='m'):
        return csv_folder.read(str(self.folder), unit)

    def test_csv_reads_every_file(self):
        self.write(odometry='t,x,y,heading\n1,5,6,0\n2,6,6,0.5\n',
                   ranges='t,beacon,range,variance\n1.5,7,3.25,0.04\n1.75,-1,4,0\n',
                   beacons='beacon,x,y,z\n7,1,2,3\n8,4,5,6\n',
                   landmark_observations='t,id,range,bearing,range_variance,bearing_variance\n1.5,-1,2,0.5,0.01,0.02\n',
                   landmarks='id,x,y\n3,4,5\n', ground_truth='t,x,y,heading\n1,10,20,3.5\n',
                   frames='frame,x,y,z,yaw\nantenna,0.1,0.2,0.3,0\nsensor,1,2,3,0.5\n')
        read = self.csv()
        self.assertEqual(read.odometry, [(1, (0, 0, 0)), (2, (1, 0, 0.5))])  # begins at the origin
        self.assertEqual(read.ranges, [(1.5, 7, 3.25, 0.04, 'antenna'), (1.75, -1, 4, 0, 'antenna')])
        self.assertEqual(read.beacons, [(7, 1, 2, 3), (8, 4, 5, 6)])
        self.assertEqual(read.observations, [(1.5, -1, 2, 0.5, 0.01, 0.02)])
        self.assertEqual(read.landmarks, [(3, 4, 5, 0, 0)])
        self.assertEqual(read.truth, [(1, (10, 20, wrap_angle(3.5)))])
        self.assertTrue(read.truth_has_heading)
        self.assertEqual(read.frames, [('antenna', 0.1, 0.2, 0.3, 0), ('sensor', 1, 2, 3, 0.5)])
        self.assertEqual(read.notes, [])

    def test_csv_passes_over_what_people_and_programs_put_there(self):
        # A byte order mark, comments, blank lines, another order of columns, capitals, quotes, spaces, CR LF, a column of no
        # interest, no end of line at the end.
        text = ('\ufeff# recorded in the hall\r\n\r\n "Range", snr , T ,beacon\r\n3.25, 9,\t1.5 ,7 # first\r\n   \r\n'
                '#3,4,5,6\r\n  4.5,9,2,"8"')
        self.write(ranges=text)
        read = self.csv()
        self.assertEqual(read.ranges, [(1.5, 7, 3.25, 0, 'antenna'), (2, 8, 4.5, 0, 'antenna')])
        self.assertEqual(read.notes, ["ranges.csv: column 'snr' is not used"])
        self.write(ranges=text.replace('   \r\n', ',\r\n'))  # a row of two empty fields
        self.assertIn('2 fields', self.error_of(self.csv))

    def test_csv_odometry(self):
        # A quarter circle of radius 1 in steps of one degree: chords of 2 sin(0.5 deg). It begins an interval earlier.
        degree = math.radians(1)
        self.write(odometry='t,distance,dheading\n' + ''.join(
            f'{10 + 0.5 * i},{2 * math.sin(0.5 * degree)!r},{degree!r}\n' for i in range(1, 91)))
        read = self.csv()
        self.assertEqual((len(read.odometry), read.odometry[0].time), (91, 10))
        self.assert_near(read.odometry[-1].pose, (1, 1, math.pi / 2))
        # Velocities hold until the next row.
        self.write(odometry='t,v,omega\n1,2,0\n2,1,0.2\n2.5,100,100\n')
        read = self.csv()
        self.assertEqual(read.odometry[1], (2, (2, 0, 0)))
        self.assert_near(read.odometry[2].pose, (2 + 0.5 * math.cos(0.05), 0.5 * math.sin(0.05), 0.1))
        # Those of equal times are merged.
        self.write(odometry='t,distance,dheading\n1,1,0\n2,1,0\n2,1,0\n3,1,0\n')
        read = self.csv()
        self.assertEqual([now.pose[0] for now in read.odometry], [0, 1, 3, 4])
        self.assertEqual(read.notes, ['odometry.csv: 1 rows merged with the row before, which has the same time'])

    def test_csv_puts_rows_in_order_of_time(self):
        self.write(odometry='t,v,omega\n2,1,0\n1,2,0\n4,0,0\n', ranges='t,beacon,range\n3,1,9\n2,1,8\n3,2,7\n2,2,6\n')
        read = self.csv()
        self.assertEqual([(now.time, now.pose[0]) for now in read.odometry], [(1, 0), (2, 2), (4, 4)])
        self.assertEqual([heard.range for heard in read.ranges], [8, 6, 9, 7])  # of equal times as they were
        self.assertEqual(read.notes, ['odometry.csv: rows put in order of time', 'ranges.csv: rows put in order of time'])

    def test_csv_says_what_looks_like_another_unit(self):
        for unit, five_metres in (('ft', 16.4), ('cm', 510), ('mm', 4900)):
            self.write(ranges='t,beacon,range\n' + ''.join(f'{i},1,{five_metres}\n' for i in range(20)),
                       beacons='beacon,x,y\n1,3,4\n', ground_truth='t,x,y\n0,0,0\n20,0,0\n')
            self.assertIn(f'--range-unit {unit} ', self.csv().notes[0])
            self.assertEqual(self.csv(unit).notes, [])
        self.write(ranges='t,beacon,range,variance\n1,1,10,4\n',
                   landmark_observations='t,id,range,bearing,range_variance,bearing_variance\n1,1,10,0.5,4,0.1\n')
        read = self.csv('ft')
        self.assert_near(read.ranges[0][2:4], (3.048, 4 * 0.3048**2))
        self.assert_near(read.observations[0][2:], (3.048, 0.5, 4 * 0.3048**2, 0.1))
        for file, text, column, largest in (
                ('odometry', 't,x,y,heading\n1,0,0,90\n2,0,1,91\n', 'heading', '91.0'),
                ('odometry', 't,x,y,heading\n1,0,0,-1\n2,0,1,359\n', 'heading', '359.0'),
                ('ground_truth', 't,x,y,heading\n1,0,0,0\n2,0,1,90\n', 'heading', '90.0'),
                ('odometry', 't,v,omega\n1,1,-20\n2,1,0\n', 'omega', '20.0'),
                ('odometry', 't,distance,dheading\n1,1,10\n2,1,0\n', 'dheading', '10.0')):
            self.write(**{file: text})
            self.assertIn(f"{file}.csv: column '{column}' looks like degrees (it goes to {largest}); angles have to be in radians",
                          self.csv().notes)
        # A heading that counts turns on, in radians.
        self.write(odometry='t,x,y,heading\n1,0,0,3\n2,0,1,6\n3,1,0,9\n4,1,1,12\n', ground_truth='t,x,y\n1,0,0\n')
        self.assertEqual([note for note in self.csv().notes if 'degrees' in note], [])

    def test_csv_errors_name_file_line_column_and_value(self):
        header = 't,beacon,range\n'
        for name, text, error in (
                ('ranges', '', ': is empty; its first line has to name the columns'),
                ('ranges', '# a comment\n\nt,beacon\n1,2\n', ':3: the columns are t,beacon; ranges.csv has t,beacon,range,?variance'),
                ('ranges', 't,beacon,range,t\n', ':1: the columns are t,beacon,range,t; '),
                ('odometry', 't,a,b\n', ':1: the columns are t,a,b; odometry.csv has t,x,y,heading or t,distance,dheading or t,v,omega'),
                ('ranges', header + '1,2,3\n1,2\n', ':3: 2 fields, where the header names 3 columns'),
                ('ranges', header + '# c\n1,2,abc\n', ":3: column range: 'abc' is not a finite number"),
                ('ranges', header + '1,2,\n', ":2: column range: '' is not a finite number"),
                ('ranges', header + '1,2,1e999\n', ":2: column range: '1e999' is not a finite number"),
                ('ranges', header + '1,2.5,3\n', ":2: column beacon: '2.5' is not a whole number of 32 bits"),
                ('ranges', header + '1,99999999999,3\n', ":2: column beacon: '99999999999' is not a whole number of 32 bits"),
                ('landmark_observations', 't,id,range,bearing\n1,2,3,45\n',
                 ":2: column bearing: '45' is more than a full turn; bearings are in radians"),
                ('frames', 'frame,x,y\nwheel,0,0\n', ":2: column frame: 'wheel' is not known; frames are antenna and sensor")):
            self.write(**{name: text})
            self.assertIn(str(self.folder / f'{name}.csv') + error, self.error_of(self.csv))
            (self.folder / f'{name}.csv').unlink()

    # ---- Plaza --------------------------------------------------------------------------------------------------------

    def drive(self, unit=1.0, heading=0.0):
        """2 s along x at 1 m/s with two beacons and antennas; ranges true but in `unit` metres. `heading`: of the truth."""
        steps = [i / 10 for i in range(21)]
        return self.mat(GT=[[100 + x, x, 0, heading] for x in steps], DR=[[100 + x, 0.1, 0] for x in steps[1:]],
                        TD=[row for x in steps for row in ([100 + x, 0, 3, math.hypot(x - 5, 4) / unit],
                                                           [100 + x, 1, 8, math.hypot(x + 2, 3) / unit])],
                        TL=[[3.0, 5, 4], [8, -2, -3]])

    def assert_mentions(self, read, words, does=True):
        self.assertEqual(any(words in note for note in read.notes), does, read.notes)

    def test_plaza_units(self):
        feet = self.drive(unit=0.3048)
        read = plaza.read(feet, 'ft')
        self.assert_near((read.ranges[0].range, read.ranges[41].range), (math.sqrt(41), 5))
        self.assert_mentions(plaza.read(feet), '--range-unit ft')
        # Metres stay metres though ranges are too long.
        self.assertEqual(plaza.read(self.drive(unit=1 / 1.3)).notes, [])

    def test_plaza_heading_is_turned_only_if_it_points_backwards(self):
        for heading in (0.0, 0.3, -1.2, math.pi, 2.8):
            read = plaza.read(self.drive(heading=heading))
            self.assert_mentions(read, 'heading turned by pi', abs(heading) > math.pi / 2)
            self.assertLess(abs(read.truth[5].pose[2]), math.pi / 2)

    def test_plaza_antennas(self):
        read = plaza.read(self.drive(), 'm', ['1:0.1,0.2,0.3'])
        self.assertEqual([heard.frame for heard in read.ranges[:2]], ['antenna_0', 'antenna_1'])
        self.assertEqual(read.frames, [('antenna_1', 0.1, 0.2, 0.3, 0)])
        self.assertEqual([frame[:2] for frame in plaza.read(self.drive(), 'm', ['-1,0,0', '0:2,0,0']).frames],
                         [('antenna_0', 2), ('antenna_1', -1)])

    def test_plaza_files_with_less(self):
        read = plaza.read(self.mat(DR=[[1, 0.5, 0], [1.5, 0.5, 0.1]],
                                   TD=[[1.2, 2, 7, math.nan], [1.3, 2, 7, -1], [1.4, 2, 7, 2.0]]))
        self.assertEqual([now.time for now in read.odometry], [0.5, 1, 1.5])  # one interval before the first step's end
        self.assertEqual(read.ranges, [(1.4, 7, 2, 0, 'antenna')])
        for words in ('1 rows that are not finite', '1 negative', 'no variable TL'):
            self.assert_mentions(read, words)

    def test_mat_files_that_cannot_be_read(self):
        for matrices, words in (({'lm': [[1.0]], 'wp': [[1.0]]}, 'has no variable DR [t distance dheading]; it has lm, wp'),
                                ({'DR': [[1.0, 2.0]]}, 'variable DR has 2 columns, 3 are needed')):
            path = self.mat(**matrices)
            self.assertEqual(self.error_of(plaza.read, path), f'{path}: {words}')
        whole = pathlib.Path(self.drive()).read_bytes()
        for length in range(0, len(whole), 40):
            (self.folder / 'a.mat').write_bytes(whole[:length])
            # A file may end between two variables; then one is missing.
            self.assertRegex(self.error_of(plaza.read, str(self.folder / 'a.mat')),
                             'a.mat: (is damaged, or not a MATLAB file of versions 5 to 7: save it with -v7|has no variable)')

    # ---- Labyrinth ----------------------------------------------------------------------------------------------------

    def test_labyrinth_the_left_wheel_comes_first_and_half_the_distance(self):
        # Left 1 m/s, right 2 m/s, half the distance 0.5 m: turns left by 1 rad/s at 1.5 m/s for 0.1 s, sliding 0.2 m/s left.
        self.write(A_Input__txt='odom2diff 1.0 1 2 0.2 0.5 0 0 0\nunknown 1.05 3\nodom2diff 1.1 0 0 0 0.5 0 0 0\n')
        read = labyrinth.read(str(self.folder))
        self.assert_near(read.odometry[1].pose, (0.15 * math.cos(0.05) - 0.02 * math.sin(0.05),
                                                 0.15 * math.sin(0.05) + 0.02 * math.cos(0.05), 0.1))
        self.assertEqual(read.notes, ['1 lines unknown are not used'])

    def test_labyrinth_errors_name_file_and_line(self):
        self.assertIn('has no file *Input.txt', self.error_of(labyrinth.read, str(self.folder)))
        for text, error in (('range2 1 2 0.01 0 0 7 0\nrange2 1 x 0.01 0 0 7 0\n', ":2: range2: 'x' is not a finite number"),
                            ('range2 1 2 0.01\n', ':1: range2 with 3 numbers, 6 are needed'),
                            ('something else\n', ': has no line range2 or odom2diff')):
            self.write(A_Input__txt=text)
            self.assertIn(f'{self.folder}/A_Input.txt{error}', self.error_of(labyrinth.read, str(self.folder)))

    # ---- MRCLAM -------------------------------------------------------------------------------------------------------

    def small_mrclam(self, **files):
        """One robot, two landmarks and another robot."""
        self.write(**{'Barcodes__dat': '# Subject # Barcode #\n  1  5\n  3 41\n  6 63\n  7 \t 81\r\n',
                      'Robot1_Odometry__dat': '# Time v w\n10.0 1.0 0.0\n12.0 0.5 0.5\n12.0 0.5 1.0\n13.0 0.0 0.0\n',
                      'Robot1_Measurement__dat': '10.5 63 2.0 0.1\n10.5 81 3.0 -0.1\n11.0 41 1.0 0.0\n11.5 99 1.0 0.0\n'
                                                 '11.0 81 4.0 0.2\n', **files})
        return str(self.folder)

    def test_mrclam_small(self):
        read = mrclam.read(self.small_mrclam(Landmark_Groundtruth__dat='6 1.0 2.0 0.1 0.2\n7 3.0 4.0 0.3 0.4\n',
                                             Robot1_Groundtruth__dat='10.0 0.5 0.25 1.5\n'))
        # Robots and unknown barcodes are left out; what stood below a later one is put in order.
        self.assertEqual(read.observations, [(10.5, 6, 2, 0.1, 0, 0), (10.5, 7, 3, -0.1, 0, 0), (11, 7, 4, 0.2, 0, 0)])
        self.assertEqual(read.landmarks[1], (7, 3, 4, 0.3, 0.4))
        self.assertEqual((read.truth, read.truth_has_heading), ([(10, (0.5, 0.25, 1.5))], True))
        self.assertEqual(read.frames, [('sensor', 0, 0, 0, 0)])
        # Of two rows at one time the later one holds: 0.5 m on a turn of 1 rad, chord at half of it.
        self.assertEqual([now.time for now in read.odometry], [10, 12, 13])
        self.assert_near(read.odometry[1].pose, (2, 0, 0))
        self.assert_near(read.odometry[2].pose, (2 + 0.5 * math.cos(0.5), 0.5 * math.sin(0.5), 1))
        delayed = mrclam.read(str(self.folder), 1, 0.25)
        self.assertEqual((delayed.odometry[0].time, delayed.observations[0].time), (10.25, 10.5))

    def test_mrclam_errors_name_the_file(self):
        for text, words in (('# t v w\n10.0 1.0\n', ': has 2 columns, 3 are needed'),
                            ('10.0 1.0 0.0\n11.0 1.0 nan\n', ': row 2 is not finite'),
                            ('10.0 1.0 0.0\n11.0 1', 'columns'), ('10.0 x 0.0\n', 'convert'), ('', 'no data')):
            error = self.error_of(mrclam.read, self.small_mrclam(Robot1_Odometry__dat=text))
            self.assertIn(f'{self.folder}/Robot1_Odometry.dat', error)
            self.assertIn(words, error)

    # ---- Victoria Park ------------------------------------------------------------------------------------------------

    def small_victoria_park(self, steering=0.0, controls=3, **files):
        """Two scans, and controls of a constant left turn."""
        self.write(**{'time__txt': ''.join(f'{1000 + 25 * i}\n' for i in range(controls)), 'speed__txt': '2.0\n' * controls,
                      'steering__txt': f'{steering}\n' * controls, 'lasersampling__txt': '1.1e+003\n1.3e+003\n',
                      'ObservationDistance__txt': '  10 5 0 0\n  20 0 0 0\n',
                      'ObservationAngle__txt': '  0 1.57079633 2.7e-8 2.7e-8\n 3.14159265 0 0 0\n', **files})
        return str(self.folder)

    def test_victoria_park_drives_the_circle_of_its_wheels(self):
        read = victoria_park.read(self.small_victoria_park(0.3, 401))
        # Turning left about a point at R = L / tan(steering) to the left of the rear axle's middle, the left rear wheel is on
        # the circle of radius R - H. The chord of a step is taken as long as its arc: (turn of a step)^2 / 24 of the radius.
        radius = 2.83 / math.tan(0.3)
        self.assertEqual((len(read.odometry), read.odometry[0].time), (401, 1))
        for when, pose in read.odometry:
            turned = 2 / (radius - 0.76) * (when - 1)
            self.assert_near((pose[0], pose[1], wrap_angle(pose[2] - turned)),
                             (radius * math.sin(turned), radius * (1 - math.cos(turned)), 0), 1e-4)

    def test_victoria_park_angles_are_from_the_right_and_zeros_are_padding(self):
        read = victoria_park.read(self.small_victoria_park())
        self.assertEqual([seen[1:3] for seen in read.observations], [(-1, 10), (-1, 5), (-1, 20)])
        self.assert_near([seen.bearing for seen in read.observations], (-math.pi / 2, 0, math.pi / 2), 1e-6)
        self.assert_near([seen.time for seen in read.observations], (1.1, 1.1, 1.3))
        self.assertEqual([frame.name for frame in read.frames], ['sensor', 'ground_truth'])
        self.assert_near(read.frames[0][1:3], (3.78, 0.5))
        self.assertEqual(read.truth, [])

    def test_victoria_park_takes_the_gps_from_a_matlab_file(self):
        self.mat('aa3_gpsx.mat', timeGps=[[2100.0]], Lo_m=[[-60.0]], La_m=[[-40.0]])
        read = victoria_park.read(self.small_victoria_park())
        self.assertEqual((read.truth, read.truth_has_heading), ([(2.1, (-60, -40, 0))], False))

    def test_victoria_park_errors(self):
        folder = self.small_victoria_park(ObservationAngle__txt='0 1 0\n3.1 0 0\n')
        self.assertIn('ObservationAngle.txt differ in size', self.error_of(victoria_park.read, folder))
        self.mat('aa3_gpsx.mat', timeGps=[[1.0]], Lo_m=[[2.0]])
        self.assertIn('aa3_gpsx.mat: has no variable La_m; it has timeGps, Lo_m',
                      self.error_of(victoria_park.read, self.small_victoria_park()))

    # ---- bags, and the program ----------------------------------------------------------------------------------------

    def messages(self, path):
        with rosbag.Bag(str(path)) as file:
            return [(message[0], message[1], message[2].to_sec()) for message in file.read_messages()]

    def test_bag_begins_with_maps_and_frames_and_twists_are_between_poses(self):
        recording, path = Recording(), str(self.folder / 'a.bag')
        recording.odometry = [Odometry(10, (0, 0, 0)), Odometry(10.5, (1, 0.5, 0.25))]
        recording.ranges = [Range(10, 3, 4, 0, 'antenna')]
        recording.beacons = [Beacon(3, 1, 2, None)]
        bag.write_recording(recording, path)
        messages = self.messages(path)
        self.assertEqual([(topic, when) for topic, _, when in messages[:2]], [('/tf_static', 9.999), ('/beacons', 9.999)])
        self.assertEqual(sorted(topic for topic, _, when in messages if when == 10), ['/odom', '/ranges', '/tf'])
        twist = [message for topic, message, _ in messages if topic == '/odom'][1].twist.twist
        self.assertEqual((twist.linear.x, twist.linear.y, twist.angular.z), (2, 1, 0.5))
        with rosbag.Bag(path) as file:
            latched = sorted(each.topic for each in file._get_connections() if each.header.get('latching') == b'1')
        self.assertEqual(latched, ['/beacons', '/tf_static'])

    def test_bag_of_times_that_ros_cannot_hold_is_shifted_or_refused(self):
        recording, path = Recording(), str(self.folder / 'a.bag')
        self.assertIn('nothing in it', self.error_of(bag.write_recording, recording, path))
        for when, words in ((1.6e12, 'times from 1.6e+12 to 1.6e+12 are beyond what ROS can hold'), (math.nan, 'not finite')):
            recording.odometry = [Odometry(when, (0, 0, 0))]
            self.assertIn(words, self.error_of(bag.write_recording, recording, path))
        recording.odometry = [Odometry(0, (0, 0, 0)), Odometry(0.25, (0, 0, 0))]
        bag.write_recording(recording, path)
        self.assertEqual([when for topic, _, when in self.messages(path) if topic == '/odom'], [1, 1.25])

    def program(self, *arguments, **options):
        done = subprocess.run([sys.executable, str(ROOT / 'tools/dataset_to_bag'), *arguments], cwd=str(self.folder), check=False,
                              universal_newlines=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
        return done.returncode, done.stdout, done.stderr

    def assert_refused(self, code, *arguments):
        before = sorted(self.folder.iterdir())
        found, out, error = self.program(*arguments)
        self.assertEqual((found, out, error.count('\n'), error[:16]), (code, '', 1, 'dataset_to_bag: '), (arguments, error))
        self.assertEqual(sorted(self.folder.iterdir()), before)
        return error

    def test_program_takes_units_and_antennas(self):
        path = self.mat(DR=[[1.0, 0.5, 0.0], [1.5, 0.5, 0.1]], TD=[[1.2, 2.0, 7.0, 10.0]], TL=[[7.0, 1.0, 2.0]])
        self.assertEqual(self.program('plaza', path, 'out.bag', '--range-unit=ft', '--antenna', '-0.25,0.5,0.75')[::2], (0, ''))
        messages = {topic: message for topic, message, _ in self.messages(self.folder / 'out.bag')}
        self.assertAlmostEqual(messages['/ranges'].range, 3.048)
        antenna = messages['/tf_static'].transforms[0]
        self.assertEqual((antenna.child_frame_id, antenna.transform.translation.x), ('antenna', -0.25))

    def test_program_fails_with_one_line_and_leaves_no_bag(self):
        self.write(ranges='t,beacon,range\n1,3000000000,3\n')
        late = self.mat('late.mat', DR=[[-1e65, 0.5, 0.0], [1.5, 0.5, 0.1]], TD=[[1.2, 2.0, 7.0, 10.0]])
        for arguments, words in ((('plaza', late, 'out.bag'), f'{late}: times from -'),
                                 (('csv', '.', 'out.bag'), 'ranges.csv:2: '),
                                 (('plaza', 'none\n.mat', 'out.bag'), 'none .mat: No such file'),
                                 (('csv', 'none', 'out.bag'), 'none: has none of odometry.csv, ranges.csv'),
                                 (('mrclam', '.', 'out.bag'), 'Robot1_Odometry.dat not found'),
                                 (('labyrinth', 'late.mat', 'out.bag'), 'late.mat: Not a directory'),
                                 (('victoria_park', '.', 'out.bag'), 'time.txt not found')):
            self.assertIn(words, self.assert_refused(1, *arguments))

    def test_program_misuse_is_one_line_and_two(self):
        for arguments in ('', 'kitti a b', 'plaza a.mat', 'plaza a.mat b.bag c.bag', 'plaza a.mat b.bag --range-unit yd',
                          'plaza a.mat b.bag --antenna 1,2', 'csv a b.bag --antenna 1,2,3', 'mrclam a b.bag --robot x'):
            self.assert_refused(2, *arguments.split())
        for arguments in ('--help', 'plaza --help'):
            code, out, error = self.program(*arguments.split())
            self.assertEqual((code, error, out[:43]), (0, '', 'Usage: rosrun pf_resampling dataset_to_bag '))

    def test_program_ended_by_a_signal_leaves_nothing(self):
        self.write(odometry='t,v,omega\n' + ''.join(f'{i},1,0\n' for i in range(100000)))
        child = subprocess.Popen([sys.executable, str(ROOT / 'tools/dataset_to_bag'), 'csv', '.', 'out.bag'], cwd=str(self.folder))
        while child.poll() is None and not list(self.folder.glob('out.bag.part-*')):
            time.sleep(0.001)
        child.send_signal(signal.SIGTERM)
        self.assertEqual(child.wait(timeout=60), 128 + signal.SIGTERM)
        self.assertEqual([path.name for path in self.folder.iterdir()], ['odometry.csv'])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'dataset_to_bag', Reading)
