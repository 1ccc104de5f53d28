"""What filters do, and find, when something goes wrong: faults, each put into a recording by itself, at 40 % of the drive, through
run_bag and evaluate_bag."""
import bisect
import collections
import copy
import json
import math
import random
import tempfile
from pathlib import Path

import numpy as np
from datasets.recording import compose, relative

BEGIN, END = 0.4, 0.7  # when what lasts begins and ends, as shares of the drive
LAST = 0.9  # the end of the drive is what comes after this share
MOVED = 5.0  # m, of a beacon; and the lie of one that lies
BAD_SHARE = 0.1
INPUTS = ("/tf_static", "/beacons", "/odom", "/ground_truth", "/ground_truth_landmarks", "/ranges", "/landmarks")
# Of the text: figure, heading, decimals.
COLUMNS = (("fault", "fault", 0), ("mean", "mean", 2), ("largest", "largest", 2), ("at_end", "at the end", 2),
           ("recovered", "recovered", 0), ("runs", "of", 0), ("healthy", "healthy", 3),
           ("wrong_when_healthy", "healthy, yet outside", 3), ("finding", "finds", 0), ("found", "in runs", 0))


class Drive:
    """A recording: [(topic, message, time in s)]. Raises ValueError if it holds nothing to put faults into."""

    def __init__(self, path):
        import rosbag  # takes a third of a second
        try:
            with rosbag.Bag(str(path)) as bag:
                self.messages = [(topic, message, time.to_sec()) for topic, message, time in bag.read_messages(INPUTS)]
        except rosbag.ROSBagException as error:
            raise ValueError(f"cannot be read: {error}") from None
        truth = [(time, *position(message)) for topic, message, time in self.messages if topic == "/ground_truth"]
        self.beacons = {beacon.id: beacon.position for topic, message, _ in self.messages if topic == "/beacons"
                        for beacon in message.beacons}
        self.observed = "/ranges" if self.beacons else "/landmarks"
        seen = collections.Counter(id_of(each) for topic, message, _ in self.messages if topic == self.observed
                                   for each in observations_of(topic, message))
        if not (truth and seen):
            raise ValueError("it needs /odom, /ground_truth, and /ranges with /beacons or /landmarks")
        self.truth, self.times = truth, [time for time, *_ in truth]
        self.ids = {name for name in seen if name >= 0}
        self.most_observed, self.next_most_observed = [name for name, _ in (2 * seen.most_common(2))[:2]]
        self.first, self.last = self.times[0], self.times[-1]

    def at(self, share):
        return self.first + share * (self.last - self.first)

    def place(self, time):
        return self.truth[min(bisect.bisect(self.times, time), len(self.truth) - 1)][1:]

    def changed(self, change, begin=-math.inf, end=math.inf):
        """Copies of the messages between two times go through `change`; those for which it says False are left out."""
        for topic, message, time in self.messages:
            if begin <= time <= end:
                message = copy.deepcopy(message)
                if change(topic, message, time) is False:
                    continue
            yield topic, message, time

    def with_steps(self, end, change):
        """Steps of the odometry and their seconds go through `change` until `end`; what comes later joins on."""
        before = now = last = None
        for topic, message, time in self.messages:
            if topic == "/odom":
                given = pose_of(message)
                if before:
                    step = relative(before, given)
                    now = compose(now, change(step, time - last) if self.at(BEGIN) <= time <= end else step)
                else:
                    now = given
                before, last, message = given, time, copy.deepcopy(message)
                put(now, message)
            yield topic, message, time


def observations_of(topic, message):
    return [message] if topic == "/ranges" else message.observations if topic == "/landmarks" else []


def id_of(observation):
    return observation.beacon if hasattr(observation, "beacon") else observation.id


def position(message):
    while hasattr(message, "pose"):
        message = message.pose
    point = message.position if hasattr(message, "position") else message.point
    return point.x, point.y


def pose_of(message):
    turn = getattr(message.pose, "pose", message.pose).orientation
    return (*position(message), 2.0 * math.atan2(turn.z, turn.w))


def put(pose, odometry):
    place, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
    place.x, place.y, turn.z, turn.w = pose[0], pose[1], math.sin(0.5 * pose[2]), math.cos(0.5 * pose[2])


def kidnapped(drive, distance):
    """Taken from where it is to where it is when it is that far away."""
    begin = drive.at(BEGIN)
    here = drive.place(begin)
    there = next((time for time, x, y in drive.truth if time > begin and math.dist((x, y), here) >= distance), drive.last)
    last = first_after = None
    for topic, message, time in drive.messages:
        if begin < time < there:
            continue
        if time <= begin and topic == "/odom":
            last = pose_of(message)
        elif time >= there:
            message, time = copy.deepcopy(message), time - (there - begin)
            message.header.stamp = type(message.header.stamp).from_sec(message.header.stamp.to_sec() - (there - begin))
            if topic == "/odom" and last:
                first_after = first_after or pose_of(message)
                put(compose(last, relative(first_after, pose_of(message))), message)
        yield topic, message, time


def faults(drive):
    """(name, messages) of each."""
    begin, end, most = drive.at(BEGIN), drive.at(END), drive.most_observed

    def without(seconds, *topics):
        return drive.changed(lambda topic, *_: topic not in topics, begin, begin + seconds)

    def of_most_observed(change):
        def change_all(topic, message, time):
            if topic == "/ranges":
                return message.beacon != most or change(message, time)
            if topic == "/landmarks":
                message.observations = [seen for seen in message.observations if seen.id != most or change(seen, time) is not False]
        return drive.changed(change_all, begin, end)

    def lies(seen, _):
        if drive.beacons:
            seen.range += MOVED
        else:
            seen.range, seen.bearing = 1.1 * seen.range, seen.bearing + 0.2

    def shares_its_id(topic, message, _):
        for seen in message.observations if topic == "/landmarks" else ():
            if seen.id == drive.next_most_observed:
                seen.id = most

    def moved(heard, time):
        beacon, robot = drive.beacons[most], drive.place(time)
        heard.range = max(0.1, heard.range + math.dist((beacon.x + MOVED, beacon.y), robot)
                          - math.dist((beacon.x, beacon.y), robot))

    def spoilt(draw):
        def change(topic, message, _):
            if topic in ("/odom", drive.observed) and draw.random() < BAD_SHARE:
                spoil(topic, message, draw.choice(("number", "frame", "no stamp", "late stamp")))
        return change

    spread = np.ptp(np.array(drive.truth)[:, 1:], axis=0)
    far = min(40.0 if drive.beacons else math.inf, 0.3 * math.hypot(*spread))
    yield "nothing", iter(drive.messages)
    yield f"kidnapped by {far:.0f} m", kidnapped(drive, far)
    name = f"{'beacon' if drive.beacons else 'landmark'} {most}"
    yield f"{name} {'dies' if drive.beacons else 'is hidden'}", of_most_observed(lambda *_: False)
    if drive.beacons:
        yield f"{name} is moved by {MOVED:.0f} m", of_most_observed(moved)
    else:
        yield f"{name} shares its id with landmark {drive.next_most_observed}", drive.changed(shares_its_id)
    yield f"{name} {'lies by 5 m' if drive.beacons else 'is seen 10 % farther and 0.2 rad aside'}", of_most_observed(lies)
    yield "nothing observed for 60 s", without(60.0, drive.observed)
    yield "no odometry for 20 s", without(20.0, "/odom")
    yield "wheels slip for 10 s: half of the way is not made", drive.with_steps(
        begin + 10.0, lambda step, _: (2.0 * step[0], 2.0 * step[1], step[2]))
    yield "odometry says for 10 s that the robot stands", drive.with_steps(begin + 10.0, lambda *_: (0.0, 0.0, 0.0))
    yield "the robot is turned by 90 degrees within 2 s, unnoticed", drive.with_steps(
        begin + 2.0, lambda step, seconds: (step[0], step[1], step[2] - 0.25 * math.pi * seconds))
    yield "one message in ten makes no sense", drive.changed(spoilt(random.Random(1)), begin, end)
    yield "every message comes twice", (message for message in drive.messages for _ in range(2))


def spoil(topic, message, what):
    """As a driver gone mad would."""
    if what == "frame":
        message.header.frame_id = "nowhere"
    elif what != "number":
        message.header.stamp = type(message.header.stamp)(0 if what == "no stamp" else message.header.stamp.secs + 3600)
    elif topic == "/odom":
        message.pose.pose.position.x = math.nan
    else:
        for seen in observations_of(topic, message):
            seen.range = math.nan


def write(messages, path):
    import genpy
    import rosbag
    with rosbag.Bag(str(path), "w") as bag:
        for topic, message, time in messages:
            bag.write(topic, message, genpy.Time.from_sec(time))


def evaluated(run, bag, clip, work, *options):
    """What evaluate_bag says; `work`: where it may write."""
    with tempfile.TemporaryDirectory(dir=work) as folder:
        run(["evaluate_bag", bag, "--quiet", "--clip", clip, "--json", f"{folder}/said.json", *options])
        return json.loads(Path(folder, "said.json").read_text())


def figures_of(after, at_end):
    """Of a run: what evaluate_bag says of it from the fault on, and of the end."""
    health, errors = after.get("health", {}), after["estimate"]["cartesian"]
    healthy = health.get("shares", {}).get("healthy", 0.0)
    return {"mean": errors["mean"], "largest": errors["max"], "at_end": at_end["estimate"]["cartesian"]["mean"],
            "recovered": at_end["estimate"]["cartesian"]["mean"] < after["lost_error"], "healthy": healthy,
            "wrong_when_healthy": healthy * (health.get("wrong_when_healthy") or 0.0),
            "findings": sorted({finding["kind"] for finding in after.get("findings", [])})}


def summary_of(name, runs):
    """A row for a fault: medians of errors, means of shares, and what most of its runs found."""
    found = collections.Counter(kind for run in runs for kind in run["findings"])
    kind, count = max(found.items(), key=lambda item: item[1], default=("", 0))
    row = {figure: float(np.median([run[figure] for run in runs])) for figure in ("mean", "largest", "at_end")}
    row.update({figure: float(np.mean([run[figure] for run in runs])) for figure in ("healthy", "wrong_when_healthy")})
    return dict(row, fault=name, runs=len(runs), recovered=sum(run["recovered"] for run in runs), finding=kind, found=count)


def study(path, seeds, options, work, run, in_parallel):
    """All figures, a row for each fault. `work`: a folder; `run(command)`: runs a program of the package;
    `in_parallel(function, list)`: its results."""
    drive = Drive(path)
    filter_name = "beacon_mcl" if drive.beacons else "fastslam"
    report = {"study": "faults", "recording": path.name, "seeds": len(seeds), "summary": []}
    for name, messages in faults(drive):
        bag = work / "fault.bag"
        write(messages, bag)

        def trial(seed, bag=bag):
            out = work / f"{seed}.bag"
            run(["run_bag", filter_name, bag, out, "--no-clouds", "--seed", seed, *options])
            judged = [evaluated(run, out, clip, work) for clip in (BEGIN, LAST)]
            out.unlink()
            report["lost_error"] = judged[0]["lost_error"]
            return figures_of(*judged)

        report["summary"].append(summary_of(name, in_parallel(trial, seeds)))
    for figure in ("healthy", "wrong_when_healthy"):
        report[figure] = float(np.mean([row[figure] for row in report["summary"]]))
    return report


def text_of(report, columns):
    """What it is about, and the summary in aligned columns."""
    rows = [[heading for _, heading, _ in columns]]
    rows += [[row[figure] if isinstance(row[figure], str) else f"{row[figure]:.{decimals}f}" for figure, _, decimals in columns]
             for row in report["summary"]]
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(text.ljust(width) if i == 0 else text.rjust(width)
                       for i, (text, width) in enumerate(zip(row, widths))).rstrip() for row in rows]
    about = [f"{name}: {value}" for name, value in report.items() if name != "summary"]
    return "\n".join([*about, "", *lines, ""])
