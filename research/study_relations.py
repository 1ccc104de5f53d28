"""Metamorphic relations: a recording is changed in a way that has to leave the result as it is, or to change it likewise."""
import copy

import numpy as np
from datasets.recording import compose, relative
from study_faults import OBSERVATIONS, Drive, pose_of, position, put, write

TURN = (20.0, -10.0, 2.0)  # m, m, rad
LATER = 1000  # s
SAME = 1e-3  # m: as if nothing had been changed, but for rounding
WITHIN = 5.991  # squared Mahalanobis distance of the 95 % region in the plane
SETTLED = 0.2  # share of the drive that is not compared
# Of the text: figure, heading, decimals.
COLUMNS = (("relation", "relation", 0), ("mean", "mean", 5), ("largest", "largest", 5), ("inside", "inside 95 % region", 3),
           ("needed", "needed", 0), ("holds", "holds", 0))


def turned_odometry(topic, message, _):
    if topic == "/odom":
        put(compose(TURN, pose_of(message)), message)


def turned_world(topic, message, _):
    places = {"/beacons": lambda: [beacon.position for beacon in message.beacons],
              "/ground_truth": lambda: [message.pose.position]}.get(topic, list)()
    for place in places:
        place.x, place.y, _ = compose(TURN, (place.x, place.y, 0.0))


def renamed(drive):
    """Ids in the opposite order."""
    ids = sorted(drive.ids)
    others = dict(zip(ids, reversed(ids)))

    def change(topic, message, _):
        for beacon in message.beacons if topic == "/beacons" else []:
            beacon.id = others.get(beacon.id, beacon.id)
        for seen in OBSERVATIONS.get(topic, lambda _: [])(message):
            name = "beacon" if topic == "/ranges" else "id"
            setattr(seen, name, others[getattr(seen, name)])
    return change


def in_pieces(messages):
    """Between two messages of odometry a third, halfway."""
    before = None
    for topic, message, time in messages:
        if topic == "/odom":
            if before:
                half = copy.deepcopy(message)
                step = relative(pose_of(before), pose_of(message))
                put(compose(pose_of(before), [0.5 * each for each in step]), half)
                half.pose.covariance = 0.5 * (np.array(before.pose.covariance) + message.pose.covariance)
                half.header.stamp = before.header.stamp + (message.header.stamp - before.header.stamp) / 2
                yield topic, half, time
            before = message
        yield topic, message, time


def stamp_later(_, message, __):
    for each in (message, *getattr(message, "transforms", ())):
        if hasattr(each, "header"):
            each.header.stamp.secs += LATER


def relations(drive):
    """(name, messages, what the pose is turned by, seconds later, whether the result has to be the same)"""
    same = (0.0, 0.0, 0.0)
    yield "another seed", drive.messages, same, 0, False
    yield "odometry turned and moved", drive.changed(turned_odometry), same, 0, True
    if drive.beacons:
        yield "world turned and moved", drive.changed(turned_world), TURN, 0, False
    if drive.ids:
        yield "ids in the opposite order", drive.changed(renamed(drive)), same, 0, True
    later = ((topic, message, time + LATER) for topic, message, time in drive.changed(stamp_later))
    yield f"{LATER} s later", later, same, LATER, True
    yield "every message twice", (message for message in drive.messages for _ in range(2)), same, 0, True
    yield "odometry in pieces", in_pieces(drive.messages), same, 0, False


def poses_of(path, turn, shift):
    """{stamp in ns: (x, y, covariance)} of a run, turned back."""
    import rosbag
    poses, cosine, sine = {}, np.cos(turn[2]), np.sin(turn[2])
    back = np.array(((cosine, sine), (-sine, cosine)))
    with rosbag.Bag(str(path)) as bag:
        for _, message, _ in bag.read_messages("/pose"):
            covariance = np.array(message.pose.covariance).reshape(6, 6)[:2, :2]
            stamp = message.header.stamp.to_nsec() - shift * 10**9
            poses[stamp] = back @ (np.array(position(message)) - turn[:2]), back @ covariance @ back.T
    return poses


def compared(there, here):
    """Distances at the stamps of both, and whether they are within the 95 % region of the first."""
    stamps = sorted(set(there) & set(here))
    stamps = stamps[int(SETTLED * len(stamps)):]
    apart = np.array([here[stamp][0] - there[stamp][0] for stamp in stamps])
    inside = [each @ np.linalg.solve(there[stamp][1] + 1e-12 * np.eye(2), each) < WITHIN for each, stamp in zip(apart, stamps)]
    return np.hypot(*apart.T), np.array(inside)


def study(path, seeds, options, work, run, in_parallel):
    """A row for each relation: distances in m between the poses with and without the change, over all seeds."""
    drive = Drive(path)
    report = {"study": "relations", "recording": path.name, "seeds": seeds, "summary": []}

    def poses(bag, turn=(0.0, 0.0, 0.0), shift=0, more=0):
        def trial(seed):
            out = work / f"{seed}.bag"
            run(["run_bag", "beacon_mcl" if drive.beacons else "fastslam", bag, out, "--no-clouds", "--seed", seed + more, *options])
            return poses_of(out, turn, shift)
        return in_parallel(trial, range(1, seeds + 1))

    reference = poses(path)
    for name, messages, turn, shift, is_same in relations(drive):
        bag = work / "changed.bag"
        write(messages, bag)
        runs = [compared(*each) for each in zip(reference, poses(bag, turn, shift, seeds * (name == "another seed")))]
        apart, inside = (np.concatenate([each[i] for each in runs]) for i in (0, 1))
        row = {"relation": name, "mean": float(apart.mean()), "largest": float(apart.max()), "inside": float(inside.mean()),
               "needed": f"below {SAME:g} m" if is_same else "inside: 0.95"}
        row["holds"] = "yes" if (row["largest"] < SAME if is_same else row["inside"] >= 0.95) else "NO"
        report["summary"].append(row)
    return report
