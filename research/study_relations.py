"""Metamorphic relations: a recording is changed in a way that has to leave the result as it is, or to change it likewise."""
import copy

import numpy as np
from datasets.recording import compose, relative
from evaluation.paths import Path, inverse, moved, normalized_squared
from study_faults import Drive, observations_of, pose_of, put, write

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
        for seen in observations_of(topic, message):
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
    """The path of a run, turned back; times to the microsecond."""
    from evaluation.recorded_run import RecordedBag, numbers_of, path_of  # which take a third of a second
    poses = moved(path_of(*numbers_of(RecordedBag(str(path)).read(["/pose"])["/pose"]), "/pose"), inverse(turn))
    return Path(np.round(poses.time - shift, 6), poses.pose, poses.covariance)


def compared(there, here):
    """Distances at the stamps of both, and whether they are within the 95 % region of the first."""
    stamps, *both = np.intersect1d(there.time, here.time, return_indices=True)
    there, here = (path.part(of[int(SETTLED * len(stamps)):]) for path, of in zip((there, here), both))
    apart = here.pose[:, :2] - there.pose[:, :2]
    return np.hypot(*apart.T), normalized_squared(there.covariance[:, :2, :2] + 1e-12 * np.eye(2), apart) < WITHIN


def study(path, seeds, options, work, run, in_parallel):
    """A row for each relation: distances in m between the poses with and without the change, over all seeds."""
    drive = Drive(path)
    report = {"study": "relations", "recording": path.name, "seeds": len(seeds), "summary": []}

    def poses(bag, turn=(0.0, 0.0, 0.0), shift=0, more=0):
        def trial(seed):
            out = work / f"{seed}.bag"
            run(["run_bag", "beacon_mcl" if drive.beacons else "fastslam", bag, out, "--no-clouds", "--seed", seed + more, *options])
            return poses_of(out, turn, shift)
        return in_parallel(trial, seeds)

    reference = poses(path)
    for name, messages, turn, shift, is_same in relations(drive):
        bag = work / "changed.bag"
        write(messages, bag)
        runs = [compared(*each) for each in zip(reference, poses(bag, turn, shift, len(seeds) * (name == "another seed")))]
        apart, inside = (np.concatenate([each[i] for each in runs]) for i in (0, 1))
        row = {"relation": name, "mean": float(apart.mean()), "largest": float(apart.max()), "inside": float(inside.mean()),
               "needed": f"below {SAME:g} m" if is_same else "inside: 0.95"}
        row["holds"] = "yes" if (row["largest"] < SAME if is_same else row["inside"] >= 0.95) else "NO"
        report["summary"].append(row)
    return report
