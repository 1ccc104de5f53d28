"""What tests of the Python programs share: where those are, running one, a folder to do so, and the bags that it is given."""

import contextlib
import importlib.machinery
import io
import math
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

import pf_resampling
import rosbag
import roslib.packages
from genpy import Time
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATASETS = ROOT.parent / 'shared/datasets'
PROGRAMS = pathlib.Path(pf_resampling.__file__).parents[3] / 'pf_resampling'
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / 'research'), str(ROOT / 'tools')]
IN_PYTHON = {name: importlib.machinery.SourceFileLoader(name, str(ROOT / 'tools' / name)).load_module()
             for name in ('check_bag', 'evaluate_bag', 'survey_beacons')}


class InFolder(unittest.TestCase):
    """The tests of a class share a folder; each has an empty one in it."""
    @classmethod
    def setUpClass(cls):
        cls.shared = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.shared)

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=self.shared))


def program(tool, *words):
    """Exit code, output and error. What is in Python runs in this process: to start anew takes longer than a bag."""
    command = [str(PROGRAMS / tool), *map(str, words)]
    if tool not in IN_PYTHON:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        return done.returncode, done.stdout.decode(), done.stderr.decode()
    module, out, error = IN_PYTHON[tool], io.TextIOWrapper(io.BytesIO()), io.StringIO()
    with mock.patch.multiple(sys, argv=command, stdout=out, stderr=error):
        try:
            code = module.run_tool(tool, getattr(module, tool))
        except SystemExit as end:  # of --help
            code = end.code
    return code, out.buffer.getvalue().decode('utf-8', 'surrogateescape'), error.getvalue()


@contextlib.contextmanager
def recorded(path, *topics):
    """Records topics meanwhile."""
    record = roslib.packages.find_node('rosbag', 'record')[0]  # `rosbag record` ends before it does
    recorder = subprocess.Popen([record, '--quiet', '-b', '0', '-O', str(path), *topics])
    try:
        yield
    finally:
        recorder.send_signal(signal.SIGINT)
        recorder.wait()


def play(path, rate, *options):
    # The pause lets all subscribers connect.
    subprocess.check_call(['rosbag', 'play', '--quiet', '--delay', '3', '--rate', str(rate), *options, str(path)],
                          stdout=subprocess.DEVNULL)
    time.sleep(2.0)


def stamped(kind, time, frame='', **fields):
    message = kind(**fields)
    message.header.stamp, message.header.frame_id = Time.from_sec(time), frame
    return message


def pose_at(x, y, heading):
    return Pose(Point(x, y, 0.0), Quaternion(0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)))


def transform(parent, child, time=0.0, *, ahead=0.0, left=0.0, above=0.0, turn=(1.0, 0.0, 0.0, 0.0)):
    """`turn`: w, x, y, z."""
    message = stamped(TransformStamped, time, parent, child_frame_id=child)
    place, rotation = message.transform.translation, message.transform.rotation
    place.x, place.y, place.z = ahead, left, above
    rotation.w, rotation.x, rotation.y, rotation.z = turn
    return message


def write_bag(path, messages):
    """[(topic, time, message)]; a header without a stamp gets that time."""
    with rosbag.Bag(str(path), 'w') as bag:
        for topic, time, message in messages:
            if hasattr(message, 'header') and not message.header.stamp:
                message.header.stamp = Time.from_sec(time)
            bag.write(topic, message, Time.from_sec(time))
