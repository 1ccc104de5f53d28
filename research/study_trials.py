"""The trials of a study: a range of seeds of filters on one problem. FastSLAM in a simulated world is study_landmarks.py; here is
either filter on a path with truth, a recording or beacons in a simulated world, by the measures of Mahmoud et al. (2012, Tables 1 to
3), through simulate_bag, run_bag and evaluate_bag."""
import math
import re
import tempfile
from pathlib import Path

import numpy as np
import pf_resampling_core as pf
import yaml
from command_line import Error
from study_definition import read_yaml
from study_faults import evaluated
from study_landmarks import LandmarkExperiment, read_world

AXES = ("cross_track", "along_track", "cartesian", "heading")
OWN = ("lost", "coverage95", "updates", "renewals")  # figures that dead reckoning has not
FIGURES = ["lost", *(f"{axis}_{part}" for axis in AXES for part in ("mean", "max", "std")), "coverage95", "lost_share",
           "converged_after", "updates", "renewals"]


def figures_in(said):
    """Those of what evaluate_bag says; NaN where there is none."""
    of, counted = said["estimate"], said.get("filter", {})
    found = {"lost": float(of["lost"]), **{name: of[name] for name in ("coverage95", "lost_share", "converged_after")},
             **{name: counted.get(name) for name in ("updates", "renewals")}}
    found.update({f"{axis}_{part}": of[axis][part] for axis in AXES for part in ("mean", "max", "std")})
    return {name: math.nan if value is None else value for name, value in found.items()}


class PathExperiment:
    """Either filter on a path with truth. `run(words)` runs a program of the package. Raises Error where settings make no
    sense."""

    def __init__(self, study, problem, run, folder):
        self.study, self.problem, self.folder = study, problem, Path(folder)
        self.program = run
        self.filters = study["filters"]
        self.calibration = []
        if problem["calibrated"]:
            self.calibration = [{"beacon": beacon["id"], "scale": beacon.get("scale", 1.0), "bias": beacon.get("bias", 0.0),
                                 "sigma": beacon.get("sigma", 0.0)} for beacon in read_world(problem["source"]).get("beacons", [])]

    def options(self, each):
        """Of run_bag: what the study and the filter set, and on top of it the problem's configuration."""
        files = [{**({"preset": self.study["preset"]} if self.study["preset"] else {}), **self.study["settings"], **each["settings"]}]
        if self.problem["config"]:
            config = read_yaml(self.problem["config"])
            if not each["calibrated"] and isinstance(config, dict) and isinstance(config.get("calibration"), list):
                del config["calibration"]
            files.append(config)
        if self.calibration and each["calibrated"]:
            files.append({"calibration": self.calibration})
        words = []
        for i, content in enumerate(files):
            path = self.folder / f"{i}.yaml"
            path.write_text(yaml.dump(content))
            words += ["--config", path]
        return words

    def drive(self, seed):
        """Its bag."""
        if self.problem["kind"] == "bag":
            return Path(self.problem["source"])
        bag = self.folder / "drive.bag"
        duration = ["--duration", self.problem["duration_given"]] if self.problem["duration_given"] else []
        self.program(["simulate_bag", self.problem["source"], bag, "--seed", seed, *duration])
        return bag

    def judged(self, bag, *more):
        return evaluated(self.program, bag, self.problem["clip"], self.folder, *more)

    def about(self):
        for each in self.filters:  # whether the settings make sense
            if each["estimator"] == "filter":
                try:
                    self.program(["run_bag", self.study["filter"], "--parameters", *self.options(each)])
                except Error as error:
                    raise Error(f"filter {each['name']}: {error}") from None
        said = self.judged(self.drive(1), "--pose", "/odom", "--frame", "start")
        return {"problem": {"duration": said["duration"], "clip": self.problem["clip"], "lost_error": said["lost_error"]},
                "figures": FIGURES, "curves": [], "times": []}

    def run(self, seed):
        """As that of LandmarkExperiment."""
        bag, trials = self.drive(seed), []
        for each in self.filters:
            milliseconds = math.nan
            if each["estimator"] == "dead_reckoning":
                found = figures_in(self.judged(bag, "--pose", "/odom", "--frame", "start"))
                found.update(dict.fromkeys(OWN, math.nan))
            else:
                out = self.folder / "out.bag"
                text = self.program(["run_bag", self.study["filter"], bag, out, "--no-clouds", "--seed", seed, *self.options(each)])
                milliseconds = 1e3 * float(re.search(r"CPU time (\S+) s", text)[1])
                try:
                    found = figures_in(self.judged(out, *(["--frame", "start"] if self.study["filter"] == "fastslam" else [])))
                except Error as error:
                    if "has no /pose" not in str(error):
                        raise
                    found = dict(dict.fromkeys(FIGURES, math.nan), lost=1.0)  # it never found out where it was
            trials.append((milliseconds, [found[name] for name in FIGURES], []))
        return trials


def parameters_of_all(study):
    """What all filters of a study have in common: the value of every parameter of the filter itself. Parameters of the ROS side that the
    study sets are not among them."""
    make = pf.FastSlam if study["filter"] == "fastslam" else lambda given: pf.BeaconMcl({0: (0.0, 0.0)}, given)
    preset = {"preset": study["preset"]} if study["preset"] else {}
    known = make(preset).parameters()
    return make({**preset, **{name: value for name, value in study["settings"].items() if name in known}}).parameters()


def answer(request, run):
    """What a block of trials gives for each filter: rows by seed, time of computation first, and sums of curves, of their squares, and
    their numbers. Without seeds: what the problem is. Raises Error."""
    problem = request["problem"]
    with tempfile.TemporaryDirectory(prefix="pf_resampling_") as folder:
        try:
            if request["filter"] == "beacon_mcl" or problem["kind"] == "bag":
                experiment = PathExperiment(request, problem, run, folder)
            else:
                experiment = LandmarkExperiment(request, problem)
            if request["last"] < request["first"]:
                return dict(experiment.about(), parameters=parameters_of_all(request))
            trials, sums = [], 0.0
            for seed in range(request["first"], request["last"] + 1):
                of_seed = experiment.run(seed)
                trials.append([[milliseconds, *figures] for milliseconds, figures, _ in of_seed])
                curves = np.array([curves for *_, curves in of_seed])
                known = np.where(np.isnan(curves), 0.0, curves)
                sums = sums + np.stack((known, known ** 2, ~np.isnan(curves)), axis=-2)
        except pf.Error as error:
            raise Error(str(error)) from None
    return list(zip(zip(*trials), sums.tolist()))
