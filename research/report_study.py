"""What a study has left in its folder: study.json and tables of trials, times and curves.

A figure is a number for each trial. Differences are taken between trials with the same seed.
"""
import csv
import json
from collections import namedtuple

import numpy as np
from command_line import Error, naming
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


def rows_of(path):
    """Rows of a CSV file with its first row as names; none if there is no such file."""
    if path.exists():
        with open(path, newline="", encoding="utf-8") as file:
            yield from csv.DictReader(file)


def columns_of(path):
    """{(problem, filter): {column: array}} of a CSV file, NaN where a cell is empty. Raises Error that names the file."""
    found = {}
    with naming(str(path)):
        for row in rows_of(path):
            columns = found.setdefault((row.pop("problem"), row.pop("filter")), {})
            for name, text in row.items():
                columns.setdefault(name, []).append(float(text or "nan"))
    return {key: {name: np.array(values) for name, values in columns.items()} for key, columns in found.items()}


class Study:
    def __init__(self, folder):
        if not (folder / "study.json").exists() or not (folder / "trials.csv").exists():
            raise Error(f"{folder}: holds no study: study.json and trials.csv are not there")
        with naming(str(folder / "study.json")):
            about = json.loads((folder / "study.json").read_text(encoding="utf-8"))
            if about["format"] != 1:
                raise Error(f'format {about["format"]} is unknown; this program reads format 1')
            self.name, self.title, self.filter, self.preset, self.settings, self.parameters = (
                about[key] for key in ("study", "title", "filter", "preset", "settings", "parameters"))
            self.trials, self.reference, self.problems, self.filters, self.figures = (
                about[key] for key in ("trials", "reference", "problems", "filters", "figures"))
        self._figures = columns_of(folder / "trials.csv")
        for key, columns in columns_of(folder / "times.csv").items():
            self._figures[key]["processor_ms"] = columns["processor_ms"]
        self._curves = columns_of(folder / "curves.csv")
        self.scheme_times = {}  # {scheme: {number of particles: microseconds}}
        for row in rows_of(folder / "scheme_times.csv"):
            scheme = SCHEME_NAMES.get(row["scheme"], row["scheme"])
            self.scheme_times.setdefault(scheme, {})[int(row["particles"])] = float(row["microseconds"])
        # In logarithms, so that a pair of schemes differs by a factor, and small counts weigh like large ones.
        self._figures.update({("one resampling", scheme): {"log_time": np.log(list(times.values()))}
                              for scheme, times in self.scheme_times.items()})
        self._add_steps()

    def _add_steps(self):
        """What the step of renewal costs: the filter's time minus that of no renewal, with the same seed."""
        for (problem, name), figures in self._figures.items():
            base = self._figures.get((problem, self.no_renewal_beside(name)), figures)
            if base is not figures and "processor_ms" in base and "processor_ms" in figures:
                figures["step_ms"] = figures["processor_ms"] - base["processor_ms"]
                with np.errstate(divide="ignore", invalid="ignore"):
                    figures["step_us_per_call"] = 1000.0 * figures["step_ms"] / figures.get("calls", np.nan)

    # ---- what there is

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
            found.setdefault(each["group"], []).append(each["name"])
        return list(found.items())

    def names(self, problem):
        """The filters of a problem, in the order of study.json."""
        return [each["name"] for each in self.filters if (problem, each["name"]) in self._figures]

    def has(self, problem, name):
        return (problem, name) in self._figures

    def no_renewal_beside(self, name):
        """The filter that renews nothing and is else the same, or None."""
        settings = {each["name"]: each["settings"] for each in self.filters if each.get("estimator", "filter") == "filter"}
        wanted = {**{key: value for key, value in settings.get(name, {}).items() if key in OF_COST}, "population/renewal": "none"}
        return next((other for other, of in settings.items() if name in settings and of == wanted), None)

    # ---- figures

    def of_trials(self, problem, name, figure):
        """In their order; NaN for those that have no such figure. Of a lost run there are no errors."""
        figures = self._figures.get((problem, name), {})
        values = figures.get(figure, np.array([np.nan]))
        is_lost = np.array(figures.get("lost", 0.0)) > 0.0
        return np.where(np.isfinite(values) & (~is_lost | (figure in OF_LOST_RUNS)), values, np.nan)

    def values(self, problem, name, figure):
        """Of the trials that have it."""
        return known(self.of_trials(problem, name, figure))

    def measured(self, problem, figures):
        """Those that a trial of this problem has."""
        return [figure for figure in figures if any(len(self.values(problem, name, figure)) for name in self.names(problem))]

    def estimate(self, problem, name, figure):
        """Mean and standard error over the trials, or None."""
        values = self.values(problem, name, figure)
        return Estimate(*mean_and_error(values)) if len(values) else None

    def difference(self, problem, figure, terms, bound=0.0):
        """The test that a sum of weight times figure over the terms [(weight, filter)], minus a bound, is zero over the seeds that all
        have (report_statistics.Difference), or None."""
        values = [self.of_trials(problem, name, figure) for _, name in terms]
        if figure == "lost" and len(terms) == 2:
            pairs = known(np.column_stack(np.broadcast_arrays(*values)))
            return lost_difference(*pairs.T > 0.0)
        return t_difference(known(sum(weight * each for (weight, _), each in zip(terms, values)) - bound))

    def curve(self, problem, name, figure):
        columns = self._curves.get((problem, name), {})
        if f"{figure}_mean" not in columns:
            return None
        return Curve(columns["time"], *(columns[f"{figure}_{part}"] for part in ("mean", "sd", "count")))


def known(values):
    """Those rows that hold no NaN."""
    return values[~np.isnan(values).reshape(len(values), -1).any(axis=1)]
