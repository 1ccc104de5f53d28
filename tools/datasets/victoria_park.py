"""The Victoria Park data set (Guivant, Nebot, "Optimization of the simultaneous localization and map-building algorithm for
real-time implementation", 2001), with the trees already found in the laser scans: a directory with time.txt (ms), speed.txt
(m/s), steering.txt (rad), or all three in aa3_dr.mat; lasersampling.txt (ms), ObservationDistance.txt (m) and
ObservationAngle.txt (rad, from the right, ahead is pi/2), a row per scan, zeros at its end; and, if there is truth, aa3_gpsx.mat
with timeGps (ms), Lo_m and La_m (m).

The vehicle steers by its front wheels (info.txt: L = 2.83, a = 0.95, b = 0.5, H = 0.76 m). base_link is the middle of its rear
axle. The encoder sits at the left rear wheel, H from there, so the middle moves at v / (1 - tan(steering) H / L) and turns at
that times tan(steering) / L; both hold until the next row. The laser sits a before the front axle and b left of the middle:
frame "sensor" at (L + a, b). Observations have no ids. The GPS gives no heading, has gaps, and its x axis is not the direction
in which the vehicle starts.
"""
import math
import os

from command_line import Error

from .files import MatFile, NumberTable, require_directory
from .recording import Frame, Observation, Recording, Truth, wrap_angle

LINE = "text and MATLAB files of Sydney (Victoria Park), trees already found"
HELP = """Makes a bag of a directory with time.txt, speed.txt and steering.txt (or
aa3_dr.mat), lasersampling.txt, ObservationDistance.txt, ObservationAngle.txt
and, if there is truth, aa3_gpsx.mat. base_link is the middle of the rear axle."""
INPUT = "DIRECTORY"
OPTIONS = ()
EXAMPLES = ("victoria_park victoria_park victoria_park.bag",)

SECONDS_PER_UNIT = 1e-3  # all times are in ms
WHEEL_BASE = 2.83  # L, m
LASER_BEFORE_FRONT = 0.95  # a
LASER_LEFT_OF_MIDDLE = 0.5  # b
ENCODER_LEFT_OF_MIDDLE = 0.76  # H
MOST_STEERING = 1.0  # rad: wheels do not turn further, and near pi/2 the model has no meaning


def read(directory):
    require_directory(directory, "time.txt and the like")
    recording = Recording()
    recording.add_velocities([(time, *velocities_of(speed, steering)) for time, speed, steering in read_controls(directory)])
    recording.observations = read_scans(directory)
    gps = os.path.join(directory, "aa3_gpsx.mat")
    if os.path.exists(gps):
        recording.truth = [Truth(SECONDS_PER_UNIT * time, (x, y, 0.0))
                           for time, x, y in in_order_of_time(rows_of_mat(gps, "timeGps", "Lo_m", "La_m"), gps)]
    # No document says that the GPS gives the path of the laser, but in FastSLAM's map it fits best: the distance to the GPS is
    # smallest at (3.80, 0.50).
    recording.frames = [Frame(name, WHEEL_BASE + LASER_BEFORE_FRONT, LASER_LEFT_OF_MIDDLE, 0.0, 0.0)
                        for name in ("sensor", "ground_truth")]
    recording.notes.append("base_link is the middle of the rear axle; the laser is 3.78 m in front of it and 0.5 m to its "
                           "left, and so is the point whose path the GPS gives (frame ground_truth)")
    return recording


def tables_of(directory, *names):
    """Text files with as many rows as the first."""
    tables = [NumberTable(os.path.join(directory, name), 1) for name in names]
    for table in tables:
        if len(table.rows) != len(tables[0].rows):
            raise Error(f"{table.path}: has {len(table.rows)} rows and {names[0]} {len(tables[0].rows)}")
    return tables


def rows_of_mat(path, *names):
    file = MatFile(path)
    columns = [file.matrix(name, 1) for name in names]
    if None in columns:
        raise Error(f"{path}: has no variable {names[columns.index(None)]}, only {file.names()}")
    rows = [[value for value, *_ in row] for row in zip(*columns)]
    if len(set(map(len, columns))) > 1 or not all(math.isfinite(value) for row in rows for value in row):
        raise Error(f"{path}: the variables {', '.join(names)} need as many finite numbers each")
    return rows


def in_order_of_time(rows, path):
    for row in range(1, len(rows)):
        if rows[row][0] < rows[row - 1][0]:
            raise Error(f"{path}: the time of row {row + 1} is before that of the row above")
    return rows


def read_controls(directory):
    """(s, m/s of the left rear wheel, rad), a row each."""
    path, matrices = os.path.join(directory, "time.txt"), os.path.join(directory, "aa3_dr.mat")
    if os.path.exists(matrices) and not os.path.exists(path):
        path, rows = matrices, rows_of_mat(matrices, "time", "speed", "steering")
    else:
        tables = tables_of(directory, "time.txt", "speed.txt", "steering.txt")
        rows = [[value for value, *_ in row] for row in zip(*(table.rows for table in tables))]
    for row, (_, _, steering) in enumerate(in_order_of_time(rows, path), 1):
        if abs(steering) > MOST_STEERING:
            raise Error(f"{path}: steering {steering:f} in row {row} is not a steering angle in radians")
    return [(SECONDS_PER_UNIT * time, speed, steering) for time, speed, steering in rows]


def velocities_of(speed, steering):
    """(m/s, rad/s) of the middle of the rear axle."""
    tangent = math.tan(steering)
    ahead = speed / (1.0 - tangent * ENCODER_LEFT_OF_MIDDLE / WHEEL_BASE)
    return ahead, ahead * tangent / WHEEL_BASE


def read_scans(directory):
    samples, distances, angles = tables_of(directory, "lasersampling.txt", "ObservationDistance.txt", "ObservationAngle.txt")
    times = in_order_of_time(samples.rows, samples.path)
    observations = []
    for scan, (distance, angle) in enumerate(zip(distances.rows, angles.rows)):
        if len(angle) != len(distance):
            raise angles.error(scan, f"{len(angle)} angles and {len(distance)} distances")
        if min(distance) < 0:
            raise distances.error(scan, "negative distance")
        observations += [Observation(SECONDS_PER_UNIT * times[scan][0], -1, r, wrap_angle(a - 0.5 * math.pi), 0.0, 0.0)
                         for r, a in zip(distance, angle) if r > 0]  # the rest is padding
    return observations
