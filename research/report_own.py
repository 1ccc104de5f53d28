"""The report of a study of one's own: a table, and a figure for each question: how does the measure depend on the number of
particles, on time, and on the drive?
"""
import math

from report_document import Heading, Picture, Text
from report_measures import measure
from report_parts import add_filters, add_groups, add_measures, add_settings, listed
from report_statistics import LEVEL
from report_study import StudyError

OF_A_BAG = ("cartesian_mean", "heading_mean", "coverage95", "lost")
USUAL = {"fastslam": ("map_error", "pose_error", "map_inside", "effective_sample_size", *OF_A_BAG), "beacon_mcl": OF_A_BAG}


class OwnReport:
    """Of these measures; of none named, the usual ones that the study has, or all that it has."""

    def __init__(self, study, document, measures=()):
        self.known = known = [*study.figures, "processor_ms"]
        for name in measures:
            if name not in known:
                raise StudyError(f"--measures: {name} is no measure of this study; known: {', '.join(known)}")
        usual = [name for name in USUAL.get(study.filter, ()) if name in known]
        self.study, self.document, self.chosen = study, document, measures
        self.measures = list(measures) or usual or study.figures

    def add_all(self):
        document, study = self.document, self.study
        add_settings(document, study)
        document.add(Heading(2, "How to read it", "reading"))
        document.add(Text(f"""A figure is the mean over the trials ± its standard error. Differences to `{study.reference}`, with
            as many particles, are paired by seed; they are bold if their p-value, corrected for the number of filters (Holm),
            is below {LEVEL:g}. Boxes hold the middle half of the trials, with the median; whiskers reach 1.5 times as far,
            and what is beyond them is a dot."""))
        figures = list(dict.fromkeys([*self.measures, "processor_ms"]))
        add_measures(document, figures)
        for number, problem in enumerate(study.problems, 1):
            document.add(Heading(2, f'On {problem["name"]}', f"problem-{number}"))
            there = study.measured(problem["name"], self.known)
            missing = [figure for figure in self.chosen if figure not in there]
            if missing:
                document.add(Text(f"Not measured here: {listed(missing)}. There are {listed(there)}."))
            add_groups(document, study, problem["name"], figures, figures)
            for group_number, (group, names) in enumerate(study.groups(), 1):
                names = [name for name in names if study.has(problem["name"], name)]
                for figure in self.measures:
                    name = f"{figure}_{number}_{group_number}"
                    self.add_picture(name, problem["name"], group, names, figure)
                    self.add_curves(name, problem, group, names, figure)
        add_filters(document, study)

    def add_picture(self, name, problem, group, names, figure):
        import report_pictures as pictures
        factor = measure(figure).factor
        lines = {}  # of each filter, by number of particles: its trials and how long they took
        for each in names:
            values = [factor * value for value in self.study.values(problem, each, figure).values()]
            time = self.study.estimate(problem, each, "processor_ms")
            of, particles = self.study.place_of(each)
            if values:
                lines.setdefault(of, {})[particles] = (values, time.mean if time else math.nan)
        if not lines:
            return
        self.document.add(Picture(name, pictures.draw_measure(lines, measure(figure).heading), f"""**{measure(figure).heading},
            {group or problem}.** Means ± standard error, and all trials."""))

    def add_curves(self, name, problem, group, names, figure):
        """Where the study has the measure at each time: a panel for each number of particles."""
        import report_pictures as pictures
        panels = {}
        for each in names:
            curve = self.study.curve(problem["name"], each, figure)
            of, particles = self.study.place_of(each)
            if curve is not None:
                error = curve.deviation / [max(1.0, count) ** 0.5 for count in curve.count]
                panel = panels.setdefault(particles, [])
                panel.append((curve._replace(deviation=error), of, pictures.colour_of(len(panel)), "-"))
        if panels:
            drawing = pictures.draw_curves([(f"M = {key}" if key else "", curves) for key, curves in panels.items()],
                                           measure(figure).heading, problem.get("closures", {}))
            self.document.add(Picture(f"curve_{name}", drawing, f"""**{measure(figure).heading} over the drive, {group}.** Means over
                the trials; bands: ± one standard error."""))
