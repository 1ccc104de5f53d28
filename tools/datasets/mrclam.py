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

from .files import number_table
from .recording import Frame, Landmark, Observation, Odometry, Recording, Truth, wrap_angle

LINE = "text files of UTIAS (multi-robot data sets 1 to 9), one robot"
HELP = """Makes a bag of what one robot of a directory with Robot<n>_Odometry.dat,
Robot<n>_Measurement.dat, Barcodes.dat and, if there is truth,
Robot<n>_Groundtruth.dat and Landmark_Groundtruth.dat recorded. Landmark ids
are subject numbers, from 6; observations of robots are left out."""
INPUT = "DIRECTORY"
OPTIONS = {"--robot": {"metavar": "N", "type": int, "default": 1, "help": "number of the robot (=%(default)s)"},
           "--odometry-delay": {
               "metavar": "SECONDS", "type": float, "default": 0,
               "help": "added to the times of the odometry; in data set 6 the truth is 0.2 s behind it (=%(default)s)"}}
EXAMPLES = ("mrclam MRCLAM_Dataset6 robot1.bag --robot 1",)

FIRST_LANDMARK = 6  # subjects before it are robots


def read(directory, robot=1, odometry_delay=0.0):
    def path(name):
        return os.path.join(directory, name)

    recording = Recording()
    read_odometry(path(f"Robot{robot}_Odometry.dat"), odometry_delay, recording)
    read_measurements(path(f"Robot{robot}_Measurement.dat"), path("Barcodes.dat"), recording)
    truth, landmarks = path(f"Robot{robot}_Groundtruth.dat"), path("Landmark_Groundtruth.dat")
    if os.path.exists(truth):
        recording.truth = [Truth(time, (x, y, wrap_angle(heading))) for time, x, y, heading in timed_rows(truth, 4, recording)]
        recording.truth_has_heading = True
    if os.path.exists(landmarks):
        recording.landmarks = [Landmark(int(subject), *places[:4]) for subject, *places in number_table(landmarks, 5).tolist()]
    return recording


def timed_rows(path, columns, recording):
    return recording.in_order(os.path.basename(path), number_table(path, columns)[:, :columns].tolist())


def read_odometry(path, delay, recording):
    rows = timed_rows(path, 3, recording)
    recording.add_velocities(rows)
    merged = len(rows) - len(recording.odometry)
    recording.odometry = [Odometry(time + delay, pose) for time, pose in recording.odometry]
    if merged:
        recording.notes.append(f"odometry: {merged} rows merged with the row before, which has the same time")
    if delay:
        recording.notes.append(f"odometry delayed by {delay:f} s")


def read_measurements(path, barcodes, recording):
    subjects = {barcode: int(subject) for subject, barcode, *_ in number_table(barcodes, 2).tolist()}
    robots = misread = 0
    for time, barcode, distance, bearing in timed_rows(path, 4, recording):
        subject = subjects.get(barcode)
        if subject is None:
            misread += 1
        elif subject < FIRST_LANDMARK:
            robots += 1
        else:
            recording.observations.append(Observation(time, subject, distance, wrap_angle(bearing), 0.0, 0.0))
    if robots:
        recording.notes.append(f"{robots} observations of robots left out")
    if misread:
        recording.notes.append(f"{misread} observations left out because no subject carries their barcode (misread)")
    recording.frames.append(Frame("sensor", 0.0, 0.0, 0.0, 0.0))
