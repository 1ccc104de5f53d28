"""What a study has left in its folder: study.json and tables of trials, times, curves, paths and places.

A figure is a number for each trial. Differences are taken between trials with the same seed.
"""
import contextlib
import csv
import json
import math
import sys
from collections import namedtuple

try:
    import numpy as np
except ImportError as error:
    sys.exit(f"{error.name} is missing: sudo apt-get install python3-numpy")

from command_line import Error
from report_statistics import lost_difference, mean_and_error, t_difference

Estimate = namedtuple("Estimate", "mean standard_error count")
Curve = namedtuple("Curve", "time mean deviation count")
# Figures that say something of a run that is lost, too; all others are of the runs that were not lost.
OF_LOST_RUNS = ("lost", "lost_share", "converged_after", "processor_ms")
# Settings that decide what a drive costs apart from the renewal: a step is timed against no renewal with the same ones.
OF_COST = ("particles", "version", "excitation/method")
# The schemes as the papers' tables call them; in scheme_times.csv they have the names of the setting.
SCHEME_NAMES = {"residual_then_systematic": "RSR", "stratified": "Stratified", "residual": "Residual",
                "systematic": "Systematic", "multinomial": "Multinomial"}


@contextlib.contextmanager
def reading(path, remedy):
    """What is wrong with the contents of a file becomes a Error that names it."""
    try:
        yield
    except (ValueError, TypeError, KeyError, AttributeError, IndexError, RecursionError, OverflowError, csv.Error):
        raise Error(f"{path}: is damaged; {remedy}") from None


def read_about(path):
    """What study.json says. Raises Error that names the file."""
    remedy = "run the study again in another folder"
    with reading(path, remedy):
        about = json.loads(path.read_text(encoding="utf-8"))
        if about.get("format") != 1:
            raise Error(f'{path}: format {str(about.get("format"))[:40]!r} is unknown; this program reads format 1')
        if not (about["study"] and about["problems"][0]["name"] and about["filters"][0]["name"]):
            raise ValueError
    return about


def rows_of(path):
    """Rows of a CSV file with its first row as names; none if there is no such file."""
    if not path.exists():
        return
    with open(path, newline="", encoding="utf-8") as file:
        yield from csv.DictReader(file)


def number(text):
    return float(text) if text else float("nan")


class Study:
    def __init__(self, folder):
        if not (folder / "study.json").exists() or not (folder / "trials.csv").exists():
            raise Error(f"{folder}: holds no study: study.json and trials.csv are not there")
        about = read_about(folder / "study.json")
        self.name, self.title = about["study"], about.get("title", about["study"])
        self.filter, self.preset = about.get("filter", ""), about.get("preset", "")
        self.settings, self.parameters = about.get("settings", {}), about.get("parameters", {})
        self.trials, self.reference = int(about.get("trials", 0)), about.get("reference", "")
        self.problems = about["problems"]
        self.filters = about["filters"]
        self.figures, self.curves = about.get("figures", []), about.get("curves", [])
        self._figures = {}  # (problem, filter): {figure: {seed: value}}
        self._curves, self._paths, self._places, self.scheme_times = {}, {}, [], {}
        for name, take in (("trials.csv", self._take_trial), ("times.csv", self._take_trial),
                           ("scheme_times.csv", self._take_scheme_time), ("curves.csv", self._take_curves),
                           ("paths.csv", self._take_path), ("places.csv", self._take_place)):
            with reading(folder / name, "run the study again with this folder"):
                for row in rows_of(folder / name):
                    take(row)
        self._add_steps()

    def _take_path(self, row):
        self._paths.setdefault((row["problem"], row["filter"]), []).append([number(row[name]) for name in ("time", "x", "y")])

    def _take_place(self, row):
        self._places.append((row["problem"], row["kind"], row["id"], number(row["x"]), number(row["y"])))

    def _take_trial(self, row):
        """An empty cell: a trial has no such figure."""
        figures, seed = self._figures.setdefault((row.pop("problem"), row.pop("filter")), {}), int(row.pop("seed"))
        for figure, text in row.items():
            if text:
                figures.setdefault(figure, {})[seed] = float(text)

    def _take_scheme_time(self, row):
        """In logarithms, too, so that a pair of schemes differs by a factor, and small counts weigh like large ones."""
        scheme, size, time = SCHEME_NAMES.get(row["scheme"], row["scheme"]), int(row["particles"]), float(row["microseconds"])
        self.scheme_times.setdefault(scheme, {})[size] = time
        self._figures.setdefault(("one resampling", scheme), {"log_time": {}})["log_time"][size] = math.log(time)

    def _take_curves(self, row):
        for name in [column[:-5] for column in row if column.endswith("_mean")]:
            self._curves.setdefault((row["problem"], row["filter"], name), []).append(
                [number(row[column]) for column in ("time", f"{name}_mean", f"{name}_sd", f"{name}_count")])

    def _add_steps(self):
        """What the step of renewal costs: the filter's time minus that of no renewal, with the same seed."""
        for (problem, name), figures in self._figures.items():
            base = self.no_renewal_beside(name)
            without = self._figures.get((problem, base), {}).get("processor_ms", {}) if base != name else {}
            calls = figures.get("calls", {})
            steps = {seed: time - without[seed] for seed, time in figures.get("processor_ms", {}).items() if seed in without}
            figures["step_ms"] = steps
            figures["step_us_per_call"] = {seed: 1000.0 * step / calls[seed] for seed, step in steps.items() if calls.get(seed)}

    # ---- what there is

    def settings_of(self, name):
        """Settings of a filter on top of those of the study; none for what is no filter of it."""
        return next((dict(each.get("settings", {})) for each in self.filters if each["name"] == name), {})

    def place_of(self, name):
        """(filter, number of particles) where a study has each filter with several; else (name, None)."""
        each = next((each for each in self.filters if each["name"] == name), {})
        return each.get("of", name), each.get("particles")

    def reference_for(self, name):
        """What a filter is compared with: the reference, with as many particles."""
        wanted = (self.reference, self.place_of(name)[1])
        return next((each["name"] for each in self.filters if self.place_of(each["name"]) == wanted), self.reference)

    def groups(self):
        """Groups of filters in their order: [(group, [names])]."""
        found = {}
        for each in self.filters:
            found.setdefault(each.get("group", ""), []).append(each["name"])
        return list(found.items())

    def names(self, problem):
        """The filters of a problem, in the order of study.json."""
        return [each["name"] for each in self.filters if (problem, each["name"]) in self._figures]

    def has(self, problem, name):
        return (problem, name) in self._figures

    def problem_like(self, word):
        """The problem whose name contains this word, or None."""
        return next((each for each in self.problems if word in each["name"]), None)

    def no_renewal_beside(self, name):
        """The filter that renews nothing and is else the same, or None."""
        def cost(settings):
            return {key: str(settings[key]) for key in OF_COST if key in settings}

        if any(each["name"] == name and each.get("estimator", "filter") != "filter" for each in self.filters):
            return None  # it renews nothing, and costs something else
        wanted = cost(self.settings_of(name))
        for each in self.filters:
            settings = each.get("settings", {})
            is_plain = all(key == "population/renewal" or key in OF_COST for key in settings)
            if settings.get("population/renewal") == "none" and is_plain and cost(settings) == wanted:
                return each["name"]
        return None

    # ---- figures

    def values(self, problem, name, figure):
        """{seed: value} of the trials that have the figure; of a lost run there are no errors."""
        figures = self._figures.get((problem, name), {})
        lost = {} if figure in OF_LOST_RUNS else figures.get("lost", {})
        return {seed: value for seed, value in figures.get(figure, {}).items() if math.isfinite(value) and not lost.get(seed)}

    def measured(self, problem, figures):
        """Those that a trial of this problem has."""
        return [figure for figure in figures if any(self.values(problem, name, figure) for name in self.names(problem))]

    def estimate(self, problem, name, figure):
        """Mean and standard error over the trials, or None."""
        values = self.values(problem, name, figure)
        return Estimate(*mean_and_error(values.values())) if values else None

    def difference(self, problem, figure, terms, bound=0.0):
        """The test that a sum of weight times figure over the terms [(weight, filter)], minus a bound, is zero over the seeds that all
        have (report_statistics.Difference), or None."""
        lists = [self.values(problem, name, figure) for _, name in terms]
        if not all(lists):
            return None
        seeds = sorted(set(lists[0]).intersection(*lists[1:]))
        if figure == "lost" and len(terms) == 2:
            return lost_difference(*([values[seed] > 0.0 for seed in seeds] for values in lists))
        return t_difference([sum(weight * values[seed] for (weight, _), values in zip(terms, lists)) - bound for seed in seeds])

    # ---- curves, paths and places

    def curve(self, problem, name, figure):
        rows = self._curves.get((problem, name, figure))
        return Curve(*np.array(rows).T) if rows else None

    def path(self, problem, name):
        """Rows of time, x, y (s, m), or None."""
        points = self._paths.get((problem, name))
        return np.array(points) if points else None

    def places(self, problem):
        """[(kind, id, x, y)]"""
        return [place for where, *place in self._places if where == problem]
