"""FastSLAM and EKF-SLAM in a simulated world, by the measures of Kwak (2008, section 4): N_eff, distinct particles, eqs. 5 and 6, and
what these leave out: the error of the weighted mean, and how far its covariance can be believed."""
import functools
import time
from pathlib import Path

import numpy as np
import pf_resampling_core as pf
import yaml
from command_line import Error
from evaluation.paths import align_points, normalized_squared, rotation
from study_definition import read_yaml

CHI_SQUARE_95 = 5.991  # two degrees of freedom
SAME_TIME = 1e-6  # s: multiples of periods are not exact
AROUND_CLOSURE = 1.0  # s around the closing of a loop over which a course is averaged, before and after
FIGURES = ["calls", "effective_sample_size", "distinct", "distinct_end", "feature_error", "feature_error_end", "position_error",
           "map_error", "map_error_aligned", "map_error_end", "pose_error", "map_inside", "pose_inside", "map_nees", "pose_nees"]
DROPS = ["feature_error", "position_error", "effective_sample_size"]  # by how much they fall where a loop closes
CURVES = ["feature_error", "position_error", "map_error", "distinct", "effective_sample_size", "map_inside", "calls"]


def mean_of_known(values):
    known = np.asarray(values, float)[~np.isnan(values)]
    return known.mean() if len(known) else np.nan


def closing_times(steps, waypoints):
    """When each loop closes: on the way to the way-point that marks it, the first scan that sees a landmark again that was out of
    view for long, which is half as long as any other there."""
    seen, returns, closures = {}, [], {}
    for step in steps:
        for number, _, _ in step.seen:
            if number in seen:
                returns.append((step.time, step.time - seen[number]))
            seen[number] = step.time
    for name, marked in waypoints.items():
        begin = max((other for other in waypoints.values() if other < marked), default=0.0)
        there = [each for each in returns if begin < each[0] <= marked]
        longest = max((absence for _, absence in there), default=0.0)
        closures[name] = next((at for at, absence in there if absence >= 0.5 * longest), marked)
    return closures


def read_world(source):
    """The file of a world, by name or path. Raises Error if it cannot be read."""
    import rospkg
    path = source
    if "/" not in source and "." not in source:
        path = Path(rospkg.RosPack().get_path("pf_resampling")) / "config" / "worlds" / f"{source}.yaml"
    return read_yaml(path, f"world {source}", yaml.SafeLoader)


class World:
    """A world with landmarks, by name or file. Raises Error, or pf.Error, if it is none."""

    def __init__(self, source, duration):
        read, self.numbers = read_world(source), {}

        def take(node, prefix):
            for key, value in node.items():
                if isinstance(value, dict):
                    take(value, f"{prefix}{key}/")
                else:
                    self.numbers[prefix + key] = value

        for key in ("filter", "area", "beacons"):  # no part of such a drive
            read.pop(key, None)
        self.waypoints, self.repeat = read.pop("waypoints", []), read.pop("repeat", False)
        self.landmarks = np.array(read.pop("landmarks", []), float).reshape(-1, 2)
        self.closures = {key[len("closure_"):]: read.pop(key) for key in list(read) if key.startswith("closure_")}
        take(read, "")
        if "robot/control_period" in self.numbers:  # odometry comes with the controls unless it is said
            self.numbers.setdefault("odometry/period", self.numbers["robot/control_period"])
        if duration > 0.0:
            self.numbers["duration"] = duration
        if not len(self.landmarks) or not self.numbers.get("robot/observation_period"):
            raise Error(f"world {source} has no landmarks, or no sensor that sees them; indoor_two_loops has both")
        x, y, heading = (self.numbers.get(f"start/{key}", 0.0) for key in ("x", "y", "heading"))
        self.truth = (self.landmarks - (x, y)) @ rotation(heading)  # in the frame of the start, as maps are

    def drive(self, seed, odometry):
        """Its steps, and when loops close."""
        try:
            steps, marked = pf.simulate(self.numbers, self.waypoints, self.landmarks, self.closures, self.repeat, seed, odometry)
        except TypeError:
            raise Error("the world makes no sense; simulate_bag says what of it") from None
        if not steps:
            raise Error("the world ends before the first scan")
        return steps, closing_times(steps, marked)


class EkfSlam:
    """EKF-SLAM with known ids (Smith, Self, Cheeseman 1990; Thrun, Burgard, Fox 2005, section 10.2): one Gaussian over the pose and all
    landmarks. What the particle filters are held against. The sensor sits in the middle of the robot."""

    def __init__(self, range_sigma, range_sigma_share, bearing_sigma):
        self.noise = range_sigma, range_sigma_share, bearing_sigma
        self.state, self.covariance, self.rows = np.zeros(3), np.zeros((3, 3)), {}

    def take(self, step):
        turn = rotation(self.state[2], 3)
        motion = turn @ step.motion
        by_state = np.eye(len(self.state))
        by_state[:2, 2] = -motion[1], motion[0]
        self.covariance = by_state @ self.covariance @ by_state.T
        self.covariance[:3, :3] += turn @ step.motion_covariance @ turn.T
        self.state[:3] += motion
        for number, distance, bearing in step.seen:
            (self.correct if number in self.rows else self.start)(
                number, distance, bearing, np.diag(((self.noise[0] + self.noise[1] * distance) ** 2, self.noise[2] ** 2)))

    def start(self, number, distance, bearing, noise):
        direction, size = self.state[2] + bearing, len(self.state)
        ahead = np.array((np.cos(direction), np.sin(direction)))
        left = np.array((-ahead[1], ahead[0]))
        by_state = np.zeros((2, size))
        by_state[:, :2], by_state[:, 2] = np.eye(2), distance * left
        by_seen = np.column_stack((ahead, distance * left))
        cross = by_state @ self.covariance
        self.covariance = np.block([[self.covariance, cross.T], [cross, cross @ by_state.T + by_seen @ noise @ by_seen.T]])
        self.rows[number] = size
        self.state = np.append(self.state, self.state[:2] + distance * ahead)

    def correct(self, number, distance, bearing, noise):
        row = self.rows[number]
        offset = self.state[row:row + 2] - self.state[:2]
        there = np.hypot(*offset)
        if there == 0.0:  # no direction to a landmark under the sensor
            return
        by_landmark = np.array((offset / there, (-offset[1] / there ** 2, offset[0] / there ** 2)))
        by_state = np.zeros((2, len(self.state)))
        by_state[:, :2], by_state[1, 2], by_state[:, row:row + 2] = -by_landmark, -1.0, by_landmark
        cross = self.covariance @ by_state.T
        gain = np.linalg.solve(by_state @ cross + noise, cross.T).T
        turn = bearing - np.arctan2(offset[1], offset[0]) + self.state[2]
        self.state += gain @ (distance - there, np.angle(np.exp(1j * turn)))
        self.covariance -= gain @ cross.T
        self.covariance = 0.5 * (self.covariance + self.covariance.T)

    def estimate(self):
        return self.state[:3], self.covariance[:3, :3]

    def landmarks(self):
        rows = np.array(list(self.rows.values()), int)
        places = rows[:, None] + (0, 1)
        return {"id": np.array(list(self.rows), int), "mean": self.state[places].reshape(-1, 2),
                "covariance": self.covariance[places[:, :, None], places[:, None, :]].reshape(-1, 2, 2)}

    def of_particles(self):
        """Positions and maps of its particles: those of a single one at its mean."""
        landmarks = self.landmarks()
        return self.state[None, :2], dict(zip(landmarks["id"], landmarks["mean"][:, None]))


class FastSlam(pf.FastSlam):
    def of_particles(self):
        particles = self.particles()
        return np.column_stack((particles["x"], particles["y"])), self.landmarks_of_particles()


def measured(filter_, step, truth):
    """{name: what is measured at a scan}; what there is not is NaN. Also "nees": of all landmarks."""
    (pose, covariance), landmarks = filter_.estimate(), filter_.landmarks()
    positions, maps = filter_.of_particles()
    row = dict.fromkeys(("effective_sample_size", "distinct", "calls", "feature_error", "map_error", "map_error_aligned", "map_inside"),
                        np.nan)
    if isinstance(filter_, FastSlam):
        status = filter_.status()
        row.update(effective_sample_size=status["effective_sample_size"], distinct=status["distinct_ancestors_since_start"],
                   calls=status["renewals"])
    # Root mean square errors of what the particles hold, unweighted (Kwak eqs. 5 and 6): of the landmarks, each of each particle
    # counting the same, and of the positions. The spread of the particles is part of them, so whatever shrinks the cloud lowers them.
    row["position_error"] = np.sqrt(((positions - step.truth[:2]) ** 2).sum(axis=1).mean())
    if maps:
        squares = np.concatenate([((places - truth[number]) ** 2).sum(axis=1) for number, places in maps.items()])
        row["feature_error"] = np.sqrt(mean_of_known(squares))
    offset = pose[None, :2] - step.truth[:2]
    row["pose_error"] = np.hypot(*offset[0])
    row["pose_nees"] = normalized_squared(covariance[None, :2, :2], offset)[0]
    row["pose_inside"] = float(row["pose_nees"] <= CHI_SQUARE_95)
    row["nees"] = np.zeros(0)
    if len(landmarks["id"]):
        wanted, mean = truth[landmarks["id"]], landmarks["mean"]
        row["nees"] = normalized_squared(landmarks["covariance"], mean - wanted)
        row["map_error"] = np.sqrt(((mean - wanted) ** 2).sum(axis=1).mean())
        row["map_inside"] = (row["nees"] <= CHI_SQUARE_95).mean()
        if len(mean) > 1:
            by = align_points(mean, wanted)
            aligned = mean @ rotation(by[2]).T + by[:2]
            row["map_error_aligned"] = np.sqrt(((aligned - wanted) ** 2).sum(axis=1).mean())
    return row


def judged(rows, steps, closures):
    """Figures and curves of a run."""
    times, saw = np.array([step.time for step in steps]), np.array([bool(step.seen) for step in steps])
    course = {name: np.array([row[name] for row in rows], float) for name in rows[0] if name != "nees"}

    def drop(name, closure):
        since = times - closure
        before = (since < -SAME_TIME) & (since >= -AROUND_CLOSURE - SAME_TIME)
        after = (since >= -SAME_TIME) & (since < AROUND_CLOSURE - SAME_TIME)
        return mean_of_known(course[name][before]) - mean_of_known(course[name][after])

    figures = {name: mean_of_known(values) for name, values in course.items()}
    figures.update({f"{name}_end": values[-1] for name, values in course.items()})
    figures["calls"] = course["calls"][-1]
    figures.update({name: mean_of_known(course[name][saw]) for name in ("effective_sample_size", "distinct")})
    nees = np.concatenate([row["nees"] for row in rows])
    figures["map_nees"] = np.median(nees) if len(nees) else np.nan
    figures["pose_nees"] = np.median(course["pose_nees"])
    return ([figures[name] for name in FIGURES] + [drop(name, at) for _, at in sorted(closures.items()) for name in DROPS],
            [course[name] for name in CURVES])


class LandmarkExperiment:
    """FastSLAM with the settings of a study in one of its worlds. Raises Error, or pf.Error, where they make no sense."""

    def __init__(self, study, problem):
        self.world, self.makers, self.odometry = World(problem["source"], problem["duration_given"]), [], None
        for each in study["filters"]:
            given = {**({"preset": study["preset"]} if study["preset"] else {}), **study["settings"], **each["settings"]}
            try:
                parameters = FastSlam(given, 1).parameters()
            except pf.Error as error:
                raise Error(f"filter {each['name']}: {error}") from None
            if parameters["association/method"] != "known":
                raise Error(f"filter {each['name']}: association/method is {parameters['association/method']}: the study needs known, "
                                 "because eq. 5 of Kwak (2008) compares landmark by landmark")
            odometry = {name[len("odometry/"):]: value for name, value in parameters.items() if name.startswith("odometry/")}
            self.odometry = self.odometry or odometry
            if odometry != self.odometry:
                raise Error(f"filter {each['name']}: its odometry/... differ from those of other filters; all of a study in a world are "
                                 "given the same odometry, so set them for the study")
            sensor = [float(parameters[f"sensor/{name}"]) for name in ("range_sigma", "range_sigma_share", "bearing_sigma")]
            self.makers.append(functools.partial(FastSlam, given) if each["estimator"] == "filter" else lambda _, of=sensor: EkfSlam(*of))

    def about(self):
        steps, closures = self.world.drive(1, self.odometry)
        return {"problem": {"duration": steps[-1].time, "closures": closures},
                "figures": FIGURES + [f"{name}_drop_at_{closure}" for closure in sorted(closures) for name in DROPS],
                "curves": CURVES, "times": [step.time for step in steps]}

    def run(self, seed):
        """[(ms of processor time, figures, curves)] of the filters."""
        steps, closures = self.world.drive(seed, self.odometry)
        trials = []
        for maker in self.makers:
            # Without measuring anything else, which would make a filter read its whole map at every step.
            timed, filter_ = maker(seed), maker(seed)
            begin = time.process_time()
            for step in steps:
                timed.take(step)
            milliseconds = 1e3 * (time.process_time() - begin)
            rows = []
            for step in steps:
                filter_.take(step)
                rows.append(measured(filter_, step, self.world.truth))
            trials.append((milliseconds, *judged(rows, steps, closures)))
        return trials


def scheme_times():
    """Rows scheme,particles,microseconds: medians of the time of one resampling."""
    table = "scheme,particles,microseconds\n"
    for scheme in pf.resampling_schemes():
        for particles in (100, 300, 1000, 3000, 10000, 30000, 100000):
            weights = np.exp(pf.RandomStream(1).normal(particles))
            repetitions = max(1, 200000 // particles)  # so that a sample is long for the clock
            samples = [pf.resampling_seconds(scheme, weights, repetitions, i * repetitions) for i in range(51)]
            table += f"{scheme},{particles},{1e6 * np.median(samples):.4g}\n"
    return table
