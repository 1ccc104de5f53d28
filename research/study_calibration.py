"""Simulation-based calibration (Cook, Gelman and Rubin 2006; Talts et al. 2018): worlds, paths, noise and errors are drawn, a filter
runs on each drive, and the truth has to be anywhere in its belief with the probability that the belief says."""
import collections
import contextlib
import threading

import numpy as np
import yaml

SHARES = (0.1, 0.3, 0.6, 1.0)  # of a drive, at which its belief is compared with the truth
DURATION = 150.0  # s
OUTER = 0.05  # probability of the two tails together
BEYOND = 11.829  # squared Mahalanobis distance of the 3-sigma region in the plane, 99.73 %
UNLIKELY = 1e-3  # a p-value below this is no chance
# What a drive is of: filter, settings of run_bag, options of simulate_bag.
KINDS = {"landmarks": ("fastslam", [], []), "landmarks without ids": ("fastslam", [], ["--unknown-ids"]),
         "beacons": ("beacon_mcl", [], []), "unknown beacons": ("beacon_mcl", ["--set=beacon_positions=estimated", "--beacons", "/none"], [])}
READING = threading.Lock()  # rosbag makes the classes of messages as it reads, and two threads that do so meet half of one
# Of the text: figure, heading, decimals.
COLUMNS = (("drives", "drives", 0), ("marginal", "marginal", 0), ("share", "share of drive", 1), ("number", "of", 0),
           ("mean", "mean", 2), ("sd", "sd", 2), ("outer", "in outer 5 %", 3), ("p", "p", 4), ("belief", "belief", 0))


def drawn_world(kind, seed):
    """A world of simulate_bag. Errors of odometry and radios are within what the filters expect; the frame is that of the
    start."""
    draw = np.random.default_rng((seed, list(KINDS).index(kind)))
    size = draw.uniform(10.0, 30.0, 2)

    def places(count):
        return (draw.uniform(-0.5, 0.5, (count, 2)) * size).tolist()

    def between(smallest, largest):
        return float(np.exp(draw.uniform(np.log(smallest), np.log(largest))))

    def normal(mean, sigma):
        return float(draw.normal(mean, sigma))

    world = {"start": {"x": 0.0, "y": 0.0, "heading": 0.0}, "waypoints": places(int(draw.integers(5, 12))), "repeat": True,
             "duration": DURATION,
             "robot": {"speed": between(0.4, 1.5), "control_period": 0.1, "yaw_rate_limit": 1.0,
                       "motion_noise": {"speed": between(0.02, 0.2), "lateral": between(0.005, 0.05), "yaw_rate": between(0.003, 0.05)}},
             "odometry": {"period": 0.1, "distance_scale": normal(1.0, 0.02), "yaw_scale": normal(1.0, 0.02),
                          "yaw_rate_bias": normal(0.0, 0.002)}}
    if KINDS[kind][0] == "fastslam":
        world["landmarks"] = places(int(draw.integers(20, 60)))
        world["robot"]["observation_period"] = between(0.1, 1.0)
        world["robot"]["sensor"] = {"range_max": between(4.0, 10.0), "field_of_view": float(draw.uniform(1.2, 3.1)),
                                    "range_noise": between(0.02, 0.2), "bearing_noise": between(0.005, 0.05)}
    else:
        sigma, scale, bias = between(0.05, 0.5), normal(1.0, 0.02), normal(0.0, 0.2)  # of all radios
        height = 1.0 if kind == "unknown beacons" else 0.0
        world["beacons"] = [{"id": i, "x": x, "y": y, "z": normal(0.0, height), "scale": normal(scale, 0.007),
                             "bias": normal(bias, 0.07), "sigma": sigma} for i, (x, y) in enumerate(places(int(draw.integers(4, 9))), 1)]
        world["ranges"] = {"rate": between(3.0, 20.0), "range_max": 60.0}
    return world


def pose_of(message):
    of = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    return of.position.x, of.position.y, 2.0 * np.arctan2(of.orientation.z, of.orientation.w)


def belief_of(path):
    """Of a run: true and believed poses [(stamp in s, (x, y, heading), covariance)], what the last map holds [(id, mean,
    covariance)], and [(stamp, health, yaw-rate bias, its standard deviation)]."""
    import rosbag
    truth, poses, places, status = [], [], [], []
    with rosbag.Bag(str(path)) as bag:
        for topic, message, _ in bag.read_messages(("/ground_truth", "/pose", "/landmark_map", "/beacon_map", "/status")):
            stamp = message.header.stamp.to_sec()
            if topic == "/ground_truth":
                truth.append((stamp, *pose_of(message)))
            elif topic == "/pose":
                covariance = np.array(message.pose.covariance).reshape(6, 6)[np.ix_((0, 1, 5), (0, 1, 5))]
                poses.append((stamp, np.array(pose_of(message)), covariance))
            elif topic == "/status":
                status.append((stamp, message.health, message.yaw_rate_bias, message.yaw_rate_bias_sigma))
            else:
                places = [(each.id, np.array((each.position.x, each.position.y)), np.array(each.covariance).reshape(2, 2))
                          for each in (message.landmarks if topic == "/landmark_map" else message.places)
                          if getattr(each, "probability", 1.0) > 0.5]
    return np.array(truth), poses, places, status


def deviations(kind, world, belief):
    """(marginal, share of the drive, truth less belief in standard deviations)"""
    truth, poses, places, status = belief
    stamps, headings = [each[0] for each in poses], np.unwrap(truth[:, 3])
    for share in SHARES:
        i = min(np.searchsorted(stamps, truth[0, 0] + share * (truth[-1, 0] - truth[0, 0])), len(stamps) - 1)
        stamp, mean, covariance = poses[i]
        off = np.array([np.interp(stamp, truth[:, 0], of) for of in (truth[:, 1], truth[:, 2], headings)]) - mean
        off[2] = np.remainder(off[2] + np.pi, 2.0 * np.pi) - np.pi
        along = np.array((np.cos(mean[2]), np.sin(mean[2]), 0.0))
        for name, axis in (("along track", along), ("cross track", np.array((-along[1], along[0], 0.0))),
                           ("heading", np.array((0.0, 0.0, 1.0)))):
            yield name, share, axis @ off / np.sqrt(axis @ covariance @ axis)
        biases = [each[2:] for each in status if each[0] <= stamp and each[3] > 0.0]
        if biases:
            yield "yaw-rate bias", share, (world["odometry"]["yaw_rate_bias"] - biases[-1][0]) / biases[-1][1]
    if kind != "beacons" and places:
        # One of each drive: those of a drive err alike.
        name, mean, covariance = places[len(poses) % len(places)]
        true = np.array(world["landmarks"] if "landmarks" in world else [(each["x"], each["y"]) for each in world["beacons"]])
        there = true[np.argmin(np.hypot(*(true - mean).T))] if name < 0 or "without" in kind else true[name - ("beacons" in world)]
        for axis, label in enumerate("xy"):
            yield f"{kind.split()[-1 if 'beacons' in kind else 0][:-1]} {label}", 1.0, (there - mean)[axis] / np.sqrt(covariance[axis, axis])


def beyond(belief):
    """Of each pose of a healthy filter, whether the truth is outside its 3-sigma region."""
    truth, poses, _, status = belief
    stamps = [each[0] for each in status]
    for stamp, mean, covariance in poses:
        i = np.searchsorted(stamps, stamp, side="right") - 1
        if i >= 0 and status[i][1] == "healthy":
            off = [np.interp(stamp, truth[:, 0], truth[:, 1 + axis]) - mean[axis] for axis in (0, 1)]
            # The first pose may be the frame, known exactly.
            yield bool(np.dot(off, np.linalg.solve(covariance[:2, :2] + 1e-12 * np.eye(2), off)) > BEYOND)


def verdict(values, p):
    if p >= UNLIKELY:
        return "calibrated"
    if abs(np.mean(values)) > 4.0 / np.sqrt(len(values)):
        return "biased"
    return "TOO SURE" if np.std(values) > 1.0 else "too unsure"


def row_of(kind, name, share, values):
    from scipy.special import ndtr
    from scipy.stats import chi2, kstest
    level, squares = ndtr(values), np.sum(np.square(values))
    outer = float(np.mean(np.abs(level - 0.5) > 0.5 - 0.5 * OUTER))
    # Of two tests: of any distribution that is not uniform, and, sharper, of one that is too wide or too narrow.
    wide = 2.0 * min(chi2.cdf(squares, len(values)), chi2.sf(squares, len(values)))
    p = float(min(1.0, 2.0 * min(kstest(level, "uniform").pvalue, wide)))
    return {"drives": kind, "marginal": name, "share": share, "number": len(values), "mean": float(np.mean(values)),
            "sd": float(np.std(values)), "outer": outer, "p": p, "belief": verdict(values, p),
            "histogram": np.histogram(level, 10, (0.0, 1.0))[0].tolist()}


def draw_histograms(report, path):
    """Of the level of the truth in the belief; between the lines are 99 % of the bars if it is calibrated."""
    from matplotlib.figure import Figure
    from scipy.stats import binom
    names = list(dict.fromkeys((row["drives"], row["marginal"]) for row in report["summary"]))
    figure = Figure(figsize=(2.2 * len(SHARES), 1.5 * len(names)), layout="constrained")
    axes = figure.subplots(len(names), len(SHARES), squeeze=False, sharex=True)
    rows = {(row["drives"], row["marginal"], row["share"]): row for row in report["summary"]}
    for i, (kind, name) in enumerate(names):
        for j, share in enumerate(SHARES):
            row = rows.get((kind, name, share))
            axes[i][j].set_axis_off() if row is None else axes[i][j].bar(np.arange(0.05, 1.0, 0.1), row["histogram"], 0.1, edgecolor="white")
            if row is not None:
                for level in (0.005, 0.995):
                    axes[i][j].axhline(binom.ppf(level, row["number"], 0.1), color="black", linewidth=0.8)
                axes[i][j].set_title(f"{kind}: {name},\n{100 * share:.0f} % of the drive, {row['belief']}", fontsize=7)
            axes[i][j].tick_params(labelsize=6)
    figure.savefig(path, format="png", dpi=120)


def drive(kind, seed, options, work, run):
    """deviations() and beyond() of a drive."""
    world, (program, settings, of_simulation) = drawn_world(kind, seed), KINDS[kind]
    file, bag, out = (work / f"{list(KINDS).index(kind)}-{seed}.{end}" for end in ("yaml", "bag", "out.bag"))
    try:
        file.write_text(yaml.safe_dump(world))
        run(["simulate_bag", file, bag, "--seed", seed, *of_simulation])
        run(["run_bag", program, bag, out, "--no-clouds", "--seed", seed, *settings, *options])
        with READING:
            belief = belief_of(out)
        return list(deviations(kind, world, belief)), list(beyond(belief))
    finally:
        for each in (file, bag, out):
            with contextlib.suppress(FileNotFoundError):
                each.unlink()


def study(kinds, seeds, options, work, run, in_parallel):
    """A row for each kind of drive, marginal and share of the drive."""
    report, beyond_text = {"study": "calibration", "summary": []}, []
    for kind in kinds:
        found, outside = collections.defaultdict(list), []
        for of_drive, of_poses in in_parallel(lambda seed, kind=kind: drive(kind, seed, options, work, run), seeds):
            outside += of_poses
            for name, share, value in of_drive:
                found[name, share].append(value)
        report["summary"] += [row_of(kind, name, share, values) for (name, share), values in sorted(found.items())]
        beyond_text.append(f"{kind} {100.0 * np.mean(outside):.2f} %")
    return {"healthy, yet beyond 3 sigma": ", ".join(beyond_text), **report}
