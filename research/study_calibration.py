"""Simulation-based calibration (Cook, Gelman and Rubin 2006; Talts et al. 2018): worlds, paths, noise and errors are drawn, a filter
runs on each drive, and the truth has to be anywhere in its belief with the probability that the belief says. In its standard deviations
the truth has mean 0 and standard deviation 1, with 5 % in the outer 5 %; p: of Kolmogorov and Smirnov, and of the sum of squares."""
import collections
import tempfile
from pathlib import Path

import numpy as np
import yaml
from evaluation.paths import interpolate, normalized_squared, wrapped
from evaluation.recorded_run import BEACON_MAP, MAP, STATUS, RecordedBag, last_of, map_of, numbers_of, path_of, unpacked
from pf_resampling.msg import BeaconMap, FilterStatus, LandmarkMap

SHARES = (0.1, 0.3, 0.6, 1.0)  # of a drive, at which its belief is compared with the truth
DURATION = 150.0  # s
OUTER = 0.05  # probability of the two tails together
BEYOND = 11.829  # squared Mahalanobis distance of the 3-sigma region in the plane, 99.73 %
UNLIKELY = 1e-3  # a p-value below this is no chance
# Nobody has measured where the antenna is.
ANTENNA = "antennas: [{frame: antenna, x: 0.0, y: 0.0}]"
WITHOUT_TF = [f"--topics={topic}" for topic in ("/odom", "/ranges", "/beacons", "/ground_truth")]
# What a drive is of: filter, settings of run_bag, options of simulate_bag.
KINDS = {"landmarks": ("fastslam", [], []), "landmarks without ids": ("fastslam", [], ["--unknown-ids"]),
         "beacons": ("beacon_mcl", WITHOUT_TF, []),
         "unknown beacons": ("beacon_mcl", [*WITHOUT_TF, "--set=beacon_positions=estimated", "--beacons", "/none"], [])}
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
                          "yaw_rate_bias": normal(0.0, 0.001)}}
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
        world["ranges"] = {"rate": between(3.0, 20.0), "range_max": 60.0, "antenna": {"x": normal(0.0, 0.2), "y": normal(0.0, 0.2), "z": 0.0}}
    return world


def belief_of(path):
    """Of a run: when the truth begins and ends, the poses, how far the truth is from each, what the last map holds, and [(stamp in
    s, health, {systematic error: (value, standard deviation)})]."""
    messages = RecordedBag(str(path)).read(["/ground_truth", "/pose", MAP, BEACON_MAP, STATUS])
    truth, poses = (path_of(*numbers_of(messages[topic]), topic) for topic in ("/ground_truth", "/pose"))
    off = interpolate(truth, np.clip(poses.time, truth.time[0], truth.time[-1]))[1].pose - poses.pose
    off[:, 2] = wrapped(off[:, 2])
    found, beacons = last_of(messages[MAP], LandmarkMap), last_of(messages[BEACON_MAP], BeaconMap)
    places = found.landmarks if found else [each for each in beacons.places if each.probability > 0.5] if beacons else []
    status = [(message.header.stamp.to_sec(), message.health,
               {**{each.name: (each.value, each.sigma) for each in message.systematic_errors},
                "yaw_rate_bias": (message.yaw_rate_bias, message.yaw_rate_bias_sigma)}) for message in unpacked(messages[STATUS], FilterStatus)]
    return truth.time[[0, -1]], poses, off, map_of(places, path), status


def systematic_errors(world):
    """As in status. How high the antenna is, among beacons as high as it, has two answers, and is left out."""
    odometry, antenna = world["odometry"], world.get("ranges", {}).get("antenna", {})
    return {"distance_scale": odometry["distance_scale"], "turn_scale": odometry["yaw_scale"], "yaw_rate_bias": odometry["yaw_rate_bias"],
            **{f"antenna_{axis}": antenna[axis] for axis in "xy" if antenna}}


def deviations(kind, world, belief):
    """(marginal, share of the drive, truth less belief in standard deviations)"""
    (begin, end), poses, offs, places, status = belief
    for share in SHARES:
        i = min(np.searchsorted(poses.time, begin + share * (end - begin)), len(poses) - 1)
        stamp, off, covariance = poses.time[i], offs[i], poses.covariance[i]
        along = np.array((np.cos(poses.pose[i, 2]), np.sin(poses.pose[i, 2]), 0.0))
        for name, axis in (("along track", along), ("cross track", np.array((-along[1], along[0], 0.0))),
                           ("heading", np.array((0.0, 0.0, 1.0)))):
            yield name, share, axis @ off / np.sqrt(axis @ covariance @ axis)
        for name, true in systematic_errors(world).items():
            believed = [errors[name] for when, _, errors in status if when <= stamp and errors.get(name, (0.0, 0.0))[1] > 0.0]
            if believed:
                yield name.replace("_", " "), share, (true - believed[-1][0]) / believed[-1][1]
    if kind != "beacons" and len(places):
        # One of each drive: those of a drive err alike.
        one = len(poses) % len(places)
        name, mean, covariance = places.id[one], places.position[one], places.covariance[one]
        true = np.array(world["landmarks"] if "landmarks" in world else [(each["x"], each["y"]) for each in world["beacons"]])
        there = true[np.argmin(np.hypot(*(true - mean).T))] if name < 0 or "without" in kind else true[name - ("beacons" in world)]
        for axis, label in enumerate("xy"):
            yield f"place {label}", 1.0, (there - mean)[axis] / np.sqrt(covariance[axis, axis])


def beyond(belief):
    """Of each pose of a healthy filter, whether the truth is outside its 3-sigma region."""
    _, poses, off, _, status = belief
    last = np.searchsorted([each[0] for each in status], poses.time, side="right")
    is_healthy = np.array([False, *(each[1] == "healthy" for each in status)])[last]
    # The first pose may be the frame, known exactly.
    return (normalized_squared(poses.covariance[:, :2, :2] + 1e-12 * np.eye(2), off[:, :2]) > BEYOND)[is_healthy].tolist()


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
    """Of the level of the truth in the belief, a line for each share of the drive; in the band are 99 % of the bars if it is
    calibrated."""
    from matplotlib.figure import Figure
    from scipy.stats import binom
    kinds, names = (list(dict.fromkeys(row[key] for row in report["summary"])) for key in ("drives", "marginal"))
    figure = Figure(figsize=(1.6 * len(kinds) + 0.6, 0.9 * len(names) + 0.6), layout="constrained")
    axes = figure.subplots(len(names), len(kinds), squeeze=False, sharex=True)
    for i, name in enumerate(names):
        for j, kind in enumerate(kinds):
            rows = [row for row in report["summary"] if (row["drives"], row["marginal"]) == (kind, name)]
            axes[i][j].set(xticks=[], yticks=[], frame_on=bool(rows))
            for row in rows:
                band = binom.ppf((0.005, 0.995), row["number"], 0.1) / row["number"]
                axes[i][j].stairs(np.array(row["histogram"]) / row["number"], np.linspace(0.0, 1.0, 11), color=str(0.8 * (1.0 - row["share"])), linewidth=0.6 + row["share"])
            if rows:
                axes[i][j].axhspan(*band, color="tab:blue", alpha=0.2, linewidth=0.0)
                axes[i][j].set_ylim(0.0, max(0.3, 1.1 * max(max(row["histogram"]) / row["number"] for row in rows)))
        axes[i][0].set_ylabel(name, rotation=0.0, horizontalalignment="right", fontsize=8)
    for j, kind in enumerate(kinds):
        axes[0][j].set_title(kind.replace(", ", "\n"), fontsize=8)
    figure.supxlabel("light to dark: after 10, 30, 60 and 100 % of the drive", fontsize=8)
    figure.savefig(path, format="png", dpi=120)


def drive(kind, seed, options, work, run):
    """deviations() and beyond() of a drive."""
    world, (program, settings, of_simulation) = drawn_world(kind, seed), KINDS[kind]
    with tempfile.TemporaryDirectory(dir=work) as folder:
        file, config, bag, out = (Path(folder) / name for name in ("world.yaml", "config.yaml", "drive.bag", "out.bag"))
        file.write_text(yaml.safe_dump(world))
        config.write_text(ANTENNA if program == "beacon_mcl" else "")
        run(["simulate_bag", file, bag, "--seed", seed, *of_simulation])
        run(["run_bag", program, bag, out, "--no-clouds", "--seed", seed, "--config", config, *settings, *options])
        belief = belief_of(out)
    return list(deviations(kind, world, belief)), beyond(belief)


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
