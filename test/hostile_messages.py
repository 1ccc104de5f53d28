"""A drive on a circle that both nodes follow, and what can be done to them while they do: for check_hostile_input.py and
for check_soak_attacked.py."""

import contextlib
import io
import math
import random
import struct
import threading
import time
import xmlrpc.client

import rosgraph
import rosnode
import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter, IntParameter, StrParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import Pose, PoseArray, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from pf_resampling.msg import (BeaconArray, BeaconPosition, BeaconRange, LandmarkObservation,
                               LandmarkObservationArray)
from pf_resampling.srv import LoadMap, SaveMap, SetParticles, SetParticlesRequest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Range
from tf2_msgs.msg import TFMessage

NODES = ('beacon_mcl', 'fastslam')
RADIUS = 6.0  # m, driven at 1 m/s
BEACONS = [(-10.0, -3.0), (11.0, -4.0), (9.0, 18.0), (-11.0, 14.0)]
LANDMARKS = [((9.0 if k % 2 == 0 else 3.0) * math.sin(k * math.pi / 6),
              RADIUS - (9.0 if k % 2 == 0 else 3.0) * math.cos(k * math.pi / 6)) for k in range(12)]
# m. What is driven and seen is exact: a filter that is right is within 0.4 m, with a map that it made itself.
LOST = 1.0
LONG_NAME = 'beacon_' + 30000 * '1'
NUMBERS = (math.nan, math.inf, -math.inf, 1e160, -1e160, 1.7e308, 1e15)
NAMES = ('', '/', 'nowhere', LONG_NAME, 'beacon_-99999999999', '\x1b[2J', 'map\nodom')
FILES = ('', '/', '/dev/null', '../../etc/passwd', '/proc/self/mem', 5000 * 'a', 'a\nb', '.')


def truth(seconds):
    return RADIUS * math.sin(seconds / RADIUS), RADIUS * (1.0 - math.cos(seconds / RADIUS)), seconds / RADIUS


def put(pose, at):
    pose.position.x, pose.position.y = at[0], at[1]
    pose.orientation.z, pose.orientation.w = math.sin(at[2] / 2), math.cos(at[2] / 2)


class Drive:
    """Its seconds are since the start; the stamps of its messages are `clock` ahead of them. `pause`: s of real time for
    each tenth of a second."""

    def __init__(self, pause=0.01):
        self.pause = pause
        self.clock = 100.0
        self.step = 0  # of 0.1 s
        self.publishers = {}
        self.poses = {name: {} for name in NODES}
        self.heard = {name: [] for name in NODES}  # of each pose when it came, by time.monotonic(), and its error
        self.sent = {}  # when the odometry of a stamp (ms) was published
        self.lock = threading.Lock()
        self.subscribers = [
            rospy.Subscriber('/' + name + '/pose', PoseWithCovarianceStamped, self.take, name, queue_size=100)
            for name in NODES]

    def take(self, message, name):
        position = message.pose.pose.position
        x, y, _ = truth(message.header.stamp.to_sec() - self.clock)
        with self.lock:
            self.poses[name][message.header.stamp.to_nsec() // 1000000] = position, time.monotonic()
            self.heard[name].append((time.monotonic(), math.hypot(position.x - x, position.y - y)))

    def stamp(self, seconds):
        return rospy.Time.from_sec(round(self.clock + seconds, 3))

    def open(self, topic, kind, latch=False):
        """Before the first message: connections take their time."""
        self.publishers[topic] = rospy.Publisher(topic, kind, queue_size=1000, latch=latch)
        time.sleep(1.0)

    def publish(self, topic, message, latch=False):
        if topic not in self.publishers:
            self.open(topic, type(message), latch)
        self.publishers[topic].publish(message)

    def odometry(self, seconds):
        message = Odometry()
        message.header.stamp = self.stamp(seconds)
        message.header.frame_id, message.child_frame_id = 'odom', 'base_link'
        put(message.pose.pose, truth(seconds))
        return message

    def beacons(self, places):
        message = BeaconArray()
        message.header.frame_id = 'map'
        for number, place in enumerate(places):
            beacon = BeaconPosition(id=number)
            beacon.position.x, beacon.position.y = place
            message.beacons.append(beacon)
        return message

    def observe(self, seconds):
        x, y, heading = truth(seconds)
        number = self.step // 2 % len(BEACONS)
        measured = BeaconRange(beacon=number, variance=0.01)
        measured.header.stamp, measured.header.frame_id = self.stamp(seconds), 'base_link'
        measured.range = math.hypot(BEACONS[number][0] - x, BEACONS[number][1] - y)
        self.publish('/ranges', measured)
        scan = LandmarkObservationArray(header=measured.header)
        for number, place in enumerate(LANDMARKS):
            seen = LandmarkObservation(id=number, range=math.hypot(place[0] - x, place[1] - y))
            seen.bearing = math.remainder(math.atan2(place[1] - y, place[0] - x) - heading, 2 * math.pi)
            if seen.range < 7.0:
                scan.observations.append(seen)
        self.publish('/landmarks', scan)

    def go_on(self, seconds):
        """At 10 Hz of its own time."""
        for _ in range(round(10 * seconds)):
            self.step += 1
            now = 0.1 * self.step
            self.publish('/clock', Clock(clock=self.stamp(now)))
            self.sent[self.stamp(now).to_nsec() // 1000000] = time.monotonic()
            self.publish('/odom', self.odometry(now))
            if self.step % 2 == 0:
                self.observe(now - 0.06)
            time.sleep(self.pause)

    def error(self, name):
        """Of the pose at the newest odometry, for which it waits."""
        newest = round(1000 * (self.clock + 0.1 * self.step))
        for _ in range(200):
            with self.lock:
                pose = self.poses[name].get(newest)
            if pose is not None:
                position = pose[0]
                x, y, _ = truth(0.1 * self.step)
                return math.hypot(position.x - x, position.y - y)
            time.sleep(0.1)
        return math.inf


def begin_drive():
    """A minute of it, at ten times its speed, to map and to be located."""
    drive = Drive()
    time.sleep(2.0)
    drive.publish('/beacons', drive.beacons(BEACONS), latch=True)
    for topic, kind in (('/odom', Odometry), ('/ranges', BeaconRange), ('/clock', Clock),
                        ('/landmarks', LandmarkObservationArray)):
        drive.open(topic, kind)
    drive.go_on(60.0)
    return drive


def process_of(name):
    uri = rosnode.get_api_uri(rosgraph.Master('/check'), '/' + name + '/filter')
    return xmlrpc.client.ServerProxy(uri).getPid('/check')[2]


def memory_of(pid):
    """MiB."""
    with open('/proc/{}/statm'.format(pid), encoding='ascii') as file:
        return int(file.read().split()[1]) // 256


def peak_of(pid):
    """Of its memory, MiB; since forget_peak(), if it may be forgotten."""
    with open('/proc/{}/status'.format(pid), encoding='ascii') as file:
        return next(int(line.split()[1]) // 1024 for line in file if line.startswith('VmHWM:'))


def forget_peak(pid):
    with contextlib.suppress(OSError), open('/proc/{}/clear_refs'.format(pid), 'w', encoding='ascii') as file:
        file.write('5')


# ---- attacks that come once ---------------------------------------------------------------------


def other_beacons(drive):
    drive.publish('/beacons', drive.beacons(BEACONS[:2] + [(500.0, 0.0)]))
    drive.go_on(3.0)
    drive.publish('/beacons', drive.beacons(BEACONS))


def many_beacons(drive):
    drive.publish('/beacons', drive.beacons([(0.1 * i, 0.0) for i in range(100000)]))


def late_pose(drive):
    message = PoseWithCovarianceStamped()
    oldest = 0.1 * drive.step - 30.0
    message.header.frame_id, message.header.stamp = 'map', drive.stamp(oldest)
    put(message.pose.pose, truth(oldest))
    drive.publish('/initialpose', message)


def late_particles(drive):
    oldest = 0.1 * drive.step - 29.9
    particles = PoseArray(poses=[Pose() for _ in range(50)])
    particles.header.frame_id, particles.header.stamp = 'map', drive.stamp(oldest)
    for pose in particles.poses:
        put(pose, truth(oldest))
    for name in NODES:
        rospy.ServiceProxy('/' + name + '/set_particles', SetParticles)(particles, [])


def long_names(drive):
    measured = Range(range=3.0)
    measured.header.stamp, measured.header.frame_id = drive.stamp(0.1 * drive.step), LONG_NAME
    drive.publish('/sensor_ranges', measured)
    tag = TransformStamped(child_frame_id=LONG_NAME)
    tag.header.stamp, tag.header.frame_id = measured.header.stamp, 'base_link'
    tag.transform.rotation.w = 1.0
    drive.publish('/tf', TFMessage(transforms=[tag]))


def without_elements(message):
    """Ends in an array, of which it says that it has 2^26 elements: there is none."""
    whole = io.BytesIO()
    message.serialize(whole)
    cut = whole.getvalue()[:-4] + struct.pack('<I', 1 << 26)
    return type('WithoutElements', (type(message),), {'serialize': lambda _, buffer: buffer.write(cut)})()


def false_lengths(drive):
    scan = LandmarkObservationArray()
    scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step), 'base_link'
    for topic, message in (('/beacons', drive.beacons([])), ('/landmarks', scan), ('/tf', TFMessage())):
        drive.publish(topic, without_elements(message))
    for name in NODES:
        particles = SetParticlesRequest()
        particles.particles.header.frame_id = 'map'
        if rospy.ServiceProxy('/' + name + '/set_particles', SetParticles)(without_elements(particles)).success:
            raise AssertionError(name + ' took particles that are not there')


def far_clock(drive):
    for seconds in (0x7fffffff, 0x90000000, 0xffffffff):
        drive.publish('/clock', Clock(clock=rospy.Time(seconds)))
        time.sleep(3.5)  # silence is looked for once a second, after two


def far_odometry(drive):
    for _ in range(10):
        drive.step += 1
        message = drive.odometry(0.1 * drive.step)
        message.pose.pose.position.x = 1e160
        drive.publish('/odom', message)


def large_scan(drive):
    scan = LandmarkObservationArray()
    scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step), 'base_link'
    scan.observations = [LandmarkObservation(id=1000 + i, range=5.0, bearing=1e-4 * i) for i in range(20000)]
    drive.publish('/landmarks', scan)


def no_map(_drive):
    load = rospy.ServiceProxy('/fastslam/load_map', LoadMap)
    for file in ('/proc/self/mem', '/proc', '/nowhere'):
        if load(file, True).success:
            raise AssertionError(file + ' was taken for a map')


def clock_from_1970(drive):
    drive.clock += 1.7e9


def clock_a_day_ahead(drive):
    drive.clock += 86400.0


def false_landmarks(drive):
    """As many as a scan may have, wherever."""
    draw = random.Random(1)
    for _ in range(10):
        drive.go_on(0.1)
        scan = LandmarkObservationArray()
        scan.header.stamp, scan.header.frame_id = drive.stamp(0.1 * drive.step - 0.05), 'base_link'
        scan.observations = [
            LandmarkObservation(id=1000 + i, range=draw.uniform(0.5, 30), bearing=draw.uniform(-3, 3)) for i in range(100)]
        drive.publish('/landmarks', scan)


# ---- and those that come all the time -----------------------------------------------------------


class Hostile:
    """Messages and requests that no filter may believe, one with each call of send(). Same seed, same messages but for
    their stamps."""

    def __init__(self, drive, seed):
        self.drive = drive
        self.draw = random.Random(seed)
        self.sent = 0
        self.large = LandmarkObservationArray(
            observations=[LandmarkObservation(id=i, range=5.0, bearing=1e-3 * i) for i in range(1001)])
        self.large.header.frame_id = 'base_link'
        self.many = drive.beacons([(0.1 * i, 0.0) for i in range(1001)])
        self.services = {}

    def send(self):
        self.draw.choice((self.odometry, self.range, self.sensor_range, self.scan, self.beacons, self.pose, self.transforms,
                          self.clock, self.particles, self.parameters, self.file))()
        self.sent += 1

    def now(self):
        return self.drive.stamp(0.1 * self.drive.step)

    def number(self):
        return self.draw.choice(NUMBERS)

    def stamp(self):
        """1970, before the drive, an hour ahead, the end of time."""
        return self.draw.choice((rospy.Time(0), rospy.Time(0, 1), rospy.Time(1), rospy.Time(0xffffffff),
                                 self.now() + rospy.Duration(3600)))

    def spoil(self, message, *others):
        """Stamp or frame, or what one of `others` makes wrong."""
        spoil = self.draw.choice(('stamp', 'frame') + 3 * others)
        if spoil == 'stamp':
            message.header.stamp = self.stamp()
        elif spoil == 'frame':
            message.header.frame_id = self.draw.choice(NAMES)
        else:
            spoil()

    def set_number(self, thing, *fields):
        setattr(thing, self.draw.choice(fields), self.number())

    def spoil_pose(self, pose):
        if self.draw.random() < 0.5:
            self.set_number(pose.position, 'x', 'y')
        else:
            pose.orientation.w = self.draw.choice((0.0, math.nan, 1e160))
            pose.orientation.z = 0.0

    def odometry(self):
        message = self.drive.odometry(0.1 * self.drive.step)
        self.spoil(message, lambda: self.spoil_pose(message.pose.pose))
        self.drive.publish('/odom', message)

    def range(self):
        message = BeaconRange(beacon=self.draw.choice((0, 1, 2, 3)), range=3.0, variance=0.01)
        message.header.stamp, message.header.frame_id = self.now(), 'base_link'

        def field():
            if self.draw.random() < 0.3:
                message.beacon = self.draw.choice((-2**31, 2**31 - 1, 77))
            else:
                message.range = self.draw.choice((math.nan, math.inf, -1.0, 0.0))
        self.spoil(message, field)
        self.drive.publish('/ranges', message)

    def sensor_range(self):
        message = Range(range=3.0, max_range=10.0)
        message.header.stamp = self.now()
        message.header.frame_id = self.draw.choice(NAMES + ('beacon_1',))
        message.range = self.draw.choice((math.nan, math.inf, -1.0, 11.0))
        self.drive.publish('/sensor_ranges', message)

    def scan(self):
        if self.draw.random() < 0.05:
            self.large.header.stamp = self.now()
            self.drive.publish('/landmarks', self.large)
            return
        seen = LandmarkObservation(id=self.draw.randrange(12), range=3.0)
        message = LandmarkObservationArray(observations=[seen])
        message.header.stamp, message.header.frame_id = self.now(), 'base_link'

        def field():
            if self.draw.random() < 0.3:
                seen.id = self.draw.choice((-1, -2**31))
            else:
                seen.range = self.draw.choice((math.nan, math.inf, -1.0, 0.0))
        self.spoil(message, field)
        self.drive.publish('/landmarks', message)

    def beacons(self):
        if self.draw.random() < 0.05:
            self.drive.publish('/beacons', self.many)
            return
        message = self.drive.beacons(BEACONS)

        def field():
            what = self.draw.randrange(3)
            if what == 0:
                message.beacons = []
            elif what == 1:
                message.beacons[0].id = message.beacons[1].id
            else:
                message.beacons[2].position.x = self.draw.choice((math.nan, math.inf))
        message.header.frame_id = 'map'
        if self.draw.random() < 0.3:
            message.header.frame_id = self.draw.choice(NAMES)
        else:
            field()
        self.drive.publish('/beacons', message)

    def pose(self):
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = 'map', self.now()
        put(message.pose.pose, truth(0.1 * self.drive.step))
        if self.draw.random() < 0.3:
            message.header.frame_id = self.draw.choice(NAMES)
        else:
            self.spoil_pose(message.pose.pose)
        self.drive.publish('/initialpose', message)

    def transforms(self):
        message = TFMessage()
        for _ in range(self.draw.randrange(1, 4)):
            transform = TransformStamped(child_frame_id=self.draw.choice(NAMES))
            transform.header.frame_id = self.draw.choice(('base_link', 'map', 'odom') + NAMES)
            transform.header.stamp = self.stamp()
            transform.transform.rotation.w = self.draw.choice((1.0, 0.0, math.nan))
            transform.transform.translation.x = self.number()
            message.transforms.append(transform)
        # Ever new names: what is kept of them has an end.
        message.transforms.append(TransformStamped(child_frame_id='frame_{}'.format(self.draw.randrange(10**9))))
        message.transforms[-1].header.frame_id = 'base_link'
        message.transforms[-1].transform.rotation.w = 1.0
        self.drive.publish('/tf', message)

    def clock(self):
        self.drive.publish('/clock', Clock(clock=self.stamp()))

    def call(self, name, service, *arguments):
        """Of what it calls wrong, nothing may be done."""
        if name not in self.services:
            self.services[name] = rospy.ServiceProxy(name, service, persistent=True)
        return self.services[name](*arguments)

    def particles(self):
        particles = PoseArray()
        particles.header.frame_id, particles.header.stamp = 'map', self.now()
        for _ in range(self.draw.randrange(4)):
            pose = Pose()
            put(pose, truth(0.1 * self.drive.step))
            self.spoil_pose(pose)
            particles.poses.append(pose)
        name = self.draw.choice(NODES)
        if self.call('/' + name + '/set_particles', SetParticles, particles, []).success:
            raise AssertionError('{} took particles that make no sense: {}'.format(name, particles))

    def parameters(self):
        name = self.draw.choice(NODES)
        config = Config()
        what = self.draw.randrange(3)
        if what == 0:
            config.doubles.append(DoubleParameter('population/threshold', self.number()))
        elif what == 1:
            config.ints.append(IntParameter('particles', self.draw.choice((-1, 0, 2**31 - 1, -2**31))))
        else:
            config.strs.append(StrParameter('population/renewal', self.draw.choice(NAMES)))
        with contextlib.suppress(rospy.ServiceException):  # most are refused
            self.call('/' + name + '/filter/set_parameters', Reconfigure, config)

    def file(self):
        service, kind, *more = self.draw.choice((('load_map', LoadMap, True), ('save_map', SaveMap)))
        name = self.draw.choice(FILES)
        if self.call('/fastslam/' + service, kind, name, *more).success:
            raise AssertionError('{} took the file {!r}'.format(service, name))
