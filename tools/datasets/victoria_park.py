"""The Victoria Park data set (Guivant, Nebot, "Optimization of the simultaneous localization and map-building algorithm for
real-time implementation", 2001), with the trees already found in the laser scans: a directory with time.txt (ms), speed.txt
(m/s), steering.txt (rad), lasersampling.txt (ms), ObservationDistance.txt (m) and ObservationAngle.txt (rad, from the right, ahead
is pi/2), a row per scan, zeros at its end; and, if there is truth, aa3_gpsx.mat with timeGps (ms), Lo_m and La_m (m).

The vehicle steers by its front wheels (info.txt: L = 2.83, a = 0.95, b = 0.5, H = 0.76 m). base_link is the middle of its rear
axle. The encoder sits at the left rear wheel, H from there, so the middle moves at v / (1 - tan(steering) H / L) and turns at
that times tan(steering) / L; both hold until the next row. The laser sits a before the front axle and b left of the middle:
frame "sensor" at (L + a, b). Observations have no ids. The GPS gives no heading, has gaps, and its x axis is not the direction
in which the vehicle starts.
"""
import math
import os

import numpy as np
from command_line import Error

from .files import MatFile, number_table
from .recording import Frame, Observation, Recording, Truth, wrap_angle

LINE = "text and MATLAB files of Sydney (Victoria Park), trees already found"
HELP = """Makes a bag of a directory with time.txt, speed.txt, steering.txt,
lasersampling.txt, ObservationDistance.txt, ObservationAngle.txt and, if there
is truth, aa3_gpsx.mat. base_link is the middle of the rear axle."""
INPUT = "DIRECTORY"
EXAMPLES = ("victoria_park victoria_park victoria_park.bag",)

SECONDS_PER_UNIT = 1e-3  # all times are in ms
WHEEL_BASE = 2.83  # L, m
LASER_BEFORE_FRONT = 0.95  # a
LASER_LEFT_OF_MIDDLE = 0.5  # b
ENCODER_LEFT_OF_MIDDLE = 0.76  # H


def read(directory):
    recording = Recording()
    columns = [number_table(os.path.join(directory, name), 1)[:, 0].tolist() for name in ("time.txt", "speed.txt", "steering.txt")]
    recording.add_velocities([(SECONDS_PER_UNIT * time, *velocities_of(speed, steering)) for time, speed, steering in zip(*columns)])
    recording.observations = read_scans(directory)
    gps = os.path.join(directory, "aa3_gpsx.mat")
    if os.path.exists(gps):
        recording.truth = [Truth(SECONDS_PER_UNIT * time, (x, y, 0.0))
                           for time, x, y in rows_of_mat(gps, "timeGps", "Lo_m", "La_m")]
    # No document says that the GPS gives the path of the laser, but in FastSLAM's map it fits best: the distance to the GPS is
    # smallest at (3.80, 0.50).
    recording.frames = [Frame(name, WHEEL_BASE + LASER_BEFORE_FRONT, LASER_LEFT_OF_MIDDLE, 0.0, 0.0)
                        for name in ("sensor", "ground_truth")]
    recording.notes.append("base_link is the middle of the rear axle; the laser is 3.78 m in front of it and 0.5 m to its "
                           "left, and so is the point whose path the GPS gives (frame ground_truth)")
    return recording


def rows_of_mat(path, *names):
    file = MatFile(path)
    columns = [file.matrix(name, 1) for name in names]
    if None in columns:
        raise Error(f"{path}: has no variable {names[columns.index(None)]}; it has {file.names()}")
    return np.column_stack([np.array(column)[:, 0] for column in columns]).tolist()


def velocities_of(speed, steering):
    """(m/s, rad/s) of the middle of the rear axle; `speed` is that of the left rear wheel."""
    tangent = math.tan(steering)
    ahead = speed / (1.0 - tangent * ENCODER_LEFT_OF_MIDDLE / WHEEL_BASE)
    return ahead, ahead * tangent / WHEEL_BASE


def read_scans(directory):
    times, distances, angles = (number_table(os.path.join(directory, name), 1)
                                for name in ("lasersampling.txt", "ObservationDistance.txt", "ObservationAngle.txt"))
    if distances.shape != angles.shape or len(distances) != len(times):
        raise Error(f"{directory}: lasersampling.txt, ObservationDistance.txt and ObservationAngle.txt differ in size")
    return [Observation(SECONDS_PER_UNIT * time, -1, r, wrap_angle(a - 0.5 * math.pi), 0.0, 0.0)
            for (time, *_), distance, angle in zip(times.tolist(), distances.tolist(), angles.tolist())
            for r, a in zip(distance, angle) if r > 0]  # the rest is padding
