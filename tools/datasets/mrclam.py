"""One robot of a UTIAS multi-robot data set (Leung, Halpern, Barfoot, Liu, "The UTIAS multi-robot cooperative localization and
mapping dataset", IJRR 2011): a directory with Barcodes.dat [subject barcode], Robot<n>_Odometry.dat [t v omega],
Robot<n>_Measurement.dat [t barcode range bearing] and, if there is truth, Robot<n>_Groundtruth.dat [t x y heading] and
Landmark_Groundtruth.dat [subject x y sigma_x sigma_y].

Subjects 1 to 5 are robots: observations of them are left out, as are those of barcodes that no subject carries (misread,
counted in a note). Landmark ids are subject numbers, from 6. A barcode misread as that of another landmark cannot be told
here; the filter's gate has to.

Velocities hold until the next row: on data set 6 this fits the true turns of half a second to 0.015 to 0.017 rad rms, the rule
"since the row before" to 0.016 to 0.020. There a row's motion shows in the truth 0.2 s after its time (robots 1 to 3, best
fit); an odometry delay of 0.2 takes that out.
"""
import os

from command_line import Error, UsageError

from .files import NumberTable, number_of, require_directory
from .recording import Frame, Landmark, Observation, Odometry, Recording, Truth, wrap_angle

LINE = "text files of UTIAS (multi-robot data sets 1 to 9), one robot"
HELP = """Makes a bag of what one robot of a directory with Robot<n>_Odometry.dat,
Robot<n>_Measurement.dat, Barcodes.dat and, if there is truth,
Robot<n>_Groundtruth.dat and Landmark_Groundtruth.dat recorded. Landmark ids
are subject numbers, from 6; observations of robots are left out."""
INPUT = "DIRECTORY"
OPTIONS = (("robot", "N", "1", "number of the robot"),
           ("odometry-delay", "SECONDS", "0",
            "added to the times of the odometry; in data set 6 the truth is 0.2 s behind it"))
EXAMPLES = ("mrclam MRCLAM_Dataset6 robot1.bag --robot 1",)

FIRST_LANDMARK = 6  # subjects before it are robots


def read(directory, robot="1", odometry_delay="0"):
    if not robot.isdecimal():
        raise UsageError(f"--robot {robot}: give the number of a robot")
    delay = number_of(odometry_delay)
    if delay is None or not abs(delay) <= 10:
        raise UsageError("--odometry-delay has to be between -10 and 10 s")
    require_directory(directory, "Robot1_Odometry.dat and the like")

    def path(name):
        return os.path.join(directory, name)

    own = f"Robot{robot}_"
    if not os.path.exists(path(f"{own}Odometry.dat")):
        there = ", ".join(str(n) for n in range(1, FIRST_LANDMARK) if os.path.exists(path(f"Robot{n}_Odometry.dat")))
        remedy = f"--robot has to be one of {there}" if there else "give the directory with Robot1_Odometry.dat and the like"
        raise Error(f"{path(own)}Odometry.dat: no such file; {remedy}")
    recording = Recording()
    read_odometry(path(f"{own}Odometry.dat"), delay, recording)
    read_measurements(path(f"{own}Measurement.dat"), subjects_by_barcode(path("Barcodes.dat")), recording)
    if os.path.exists(path(f"{own}Groundtruth.dat")):
        rows = timed_table(path(f"{own}Groundtruth.dat"), 4, recording).rows
        recording.truth = [Truth(row[0], (row[1], row[2], wrap_angle(row[3]))) for row in rows]
        recording.truth_has_heading = True
    if os.path.exists(path("Landmark_Groundtruth.dat")):
        table = NumberTable(path("Landmark_Groundtruth.dat"), 5)
        recording.landmarks = [Landmark(table.whole_number(i, 0), *row[1:5]) for i, row in enumerate(table.rows)]
    return recording


def timed_table(path, columns, recording):
    """In order of time, however the file has it."""
    table = NumberTable(path, columns)
    if table.sort_by_time():
        recording.notes.append(f"{os.path.basename(path)}: rows put in order of time")
    return table


def subjects_by_barcode(path):
    table, subjects = NumberTable(path, 2), {}
    for row in range(len(table.rows)):
        subject, barcode = table.whole_number(row, 0), table.whole_number(row, 1)
        if subject < 1:
            raise table.error(row, f"subject {subject} is not above 0")
        if barcode in subjects:
            raise table.error(row, f"barcode {barcode} is there twice")
        subjects[barcode] = subject
    return subjects


def read_odometry(path, delay, recording):
    rows = timed_table(path, 3, recording).rows
    recording.add_velocities(rows)
    merged = len(rows) - len(recording.odometry)
    recording.odometry = [Odometry(time + delay, pose) for time, pose in recording.odometry]
    if merged:
        recording.notes.append(f"odometry: {merged} rows merged with the row before, which has the same time")
    if delay:
        recording.notes.append(f"odometry delayed by {delay:f} s")


def read_measurements(path, subjects, recording):
    table = timed_table(path, 4, recording)
    robots = misread = 0
    for i, (time, _, distance, bearing, *_) in enumerate(table.rows):
        subject = subjects.get(table.whole_number(i, 1))
        if subject is None:
            misread += 1
        elif subject < FIRST_LANDMARK:
            robots += 1
        elif not distance > 0:
            raise table.error(i, f"range {distance:f} is not above 0")
        else:
            recording.observations.append(Observation(time, subject, distance, wrap_angle(bearing), 0.0, 0.0))
    if robots:
        recording.notes.append(f"{robots} observations of robots left out")
    if misread:
        recording.notes.append(f"{misread} observations left out because no subject carries their barcode (misread)")
    recording.frames.append(Frame("sensor", 0.0, 0.0, 0.0, 0.0))
