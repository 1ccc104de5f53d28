"""The report of a study: of a paper's, as the `page` of data/paper_NAME.yaml lays it out, its numbers beside ours; of one's own, a
table and a figure for each question: how does a measure depend on the number of particles, on time, and on the drive?"""
import math

from command_line import Error
import report_pictures as pictures
from report_claims import HEADINGS, findings, rows_of
from report_document import Cell, Document, Row
from report_measures import MEASURES, difference_text, measure, read_data, with_error
from report_statistics import LEVEL, holm

COLUMNS = 7  # of measures in a table that has to fit on a page
USUAL = ("map_error", "pose_error", "map_inside", "effective_sample_size", "cartesian_mean", "heading_mean", "coverage95", "lost")
BY_THE_CLOCK = ("processor_ms", "step_ms", "step_us_per_call")


def report_of(study, measures=()):
    """The document of a study; of one's own with these measures, or the usual ones that it has, or all. Raises Error if it has
    not one of them."""
    paper = read_data(f"paper_{study.name}")  # None of a study of one's own
    page = Page(study, paper, measures)
    if paper:
        page.add_text(f"The paper: {paper['source']}")
    page.lay_out([*(paper["page"] if paper else ["own"]), "filters"])
    return page


def settings_text(settings):
    return ", ".join(f"`{name}: {value}`" for name, value in sorted(settings.items())) or "none"


def problem_text(problem):
    """What it is, how long, and what its scatter says."""
    text = f"`{problem['name']}`: "
    text += "a simulated drive, another with each seed" if problem.get("kind", "world") == "world" else (
        "a recording: the scatter is that of the filter's random numbers and says nothing of other drives")
    if problem.get("duration"):
        text += f"; {problem['duration']:g} s"
    if problem.get("lost_error"):
        text += (f"; the first {100 * problem.get('clip', 0):g} % of the time are left out of the errors, and a run is lost if its error "
                 f"is above {problem['lost_error']:.2f} m for more than a tenth of the rest")
    return text + "."


class Page(Document):
    def __init__(self, study, paper, measures):
        super().__init__(study.title)
        self.study, self.paper, self.parts = study, paper or {"claims": {}}, read_data("page_parts")
        self.problem = study.problems[0]["name"]
        self.findings = [finding for family in self.paper["claims"].items() for finding in findings(study, *family, self.problem)]
        timed = list(BY_THE_CLOCK) if study.filter == "fastslam" else []
        self.known = study.figures + timed if paper else [*study.figures, "processor_ms"]
        for name in measures:
            if name not in self.known:
                raise Error(f"--measures: {name} is no measure of this study; known: {', '.join(self.known)}")
        self.chosen = list(measures) or [name for name in USUAL if name in self.known] or study.figures

    def lay_out(self, blocks):
        for block in blocks:
            if isinstance(block, str) and block in self.parts:
                self.lay_out(self.parts[block])
            else:
                super().lay_out([block])

    def add_about(self, text):
        self.add_text(text.format(study=self.study, level=LEVEL, preset=self.study.preset or "none",
                                  settings=settings_text(self.study.settings)))

    def figure(self, problem, name, figure):
        """A mean as text; of runs lost the count: 19 of 30."""
        values = self.study.values(problem, name, figure)
        if figure == "lost" and len(values):
            return f"{sum(values > 0.0)} of\u00a0{len(values)}"
        return with_error(self.study.estimate(problem, name, figure), figure)

    # ---- blocks of a page

    def add_problems(self):
        self.add_bullets([problem_text(problem) for problem in self.study.problems])

    def add_settings_of_paper(self):
        values = {**self.study.parameters, **self.study.settings}
        rows = [[each["name"], Cell(each["value"], "paper"), each.get("where", ""), Cell(settings_text(ours) if ours else "", "settings"),
                 each.get("why", "")] for each in self.paper.get("settings", [])
                for ours in [{name: values[name] for name in each.get("parameters", []) if name in values}]]
        if rows:
            self.add_rows("Settings: what the paper says, and what is ours",
                          ["Setting", "In the paper", "Where", "Here", "Where it is ours: why"], rows, texts=range(5))

    def add_measures(self):
        figures = MEASURES if self.paper["claims"] else dict.fromkeys([*self.chosen, "processor_ms"])
        self.add_text("**Measures.**")
        self.add_bullets([f"**{measure(figure).heading}**: {measure(figure).definition}" for figure in figures if figure in self.known])

    def add_claims(self, which):
        """Those of a family, or of a place in the paper."""
        found = [each for each in self.findings if which in (each.family, each.claim["where"])]
        if found:
            self.add_rows(f"Claims: {which.replace('_', ' ')}", HEADINGS, rows_of(found), texts=(0, 1, 7))

    def add_table(self, given):
        """A table of the paper: below each of its rows ours, at its end the filters `beside`."""
        table, number = self.paper["tables"][given["paper"]], given["paper"]
        problem = table.get("problem", self.problem)
        columns = [{"measure": column} if isinstance(column, str) else column for column in table["columns"]]
        size = math.ceil(len(columns) / math.ceil(len(columns) / COLUMNS))  # what is too wide for a page is several tables

        def printed(value, column):
            unit = f" {column['unit']}" if "unit" in column else ""
            mean = f" / {column['sum_of']} = {float(value) / column['sum_of']:.4g}{unit}" if "sum_of" in column else ""
            return Cell(f"{value}{unit}{mean}", "paper")

        for first in range(0, len(columns), size):
            part, rows = columns[first:first + size], []
            for name in dict.fromkeys([*table["rows"], *given.get("beside", [])]):
                ours = [f"`{name}`", *(self.figure(problem, name, column.get("measure")) for column in part)]
                if name in table["rows"]:
                    cells = [printed(value, column) for value, column in zip(table["rows"][name][first:], part)]
                    rows += [Row([f"`{name}`, paper", *cells, *["–"] * (len(part) - len(cells))], "paper rule"), Row(ours)]
                elif self.study.has(problem, name):
                    rows.append(Row(ours, "more"))
            headings = ["Filter", *(column.get("heading") or measure(column["measure"]).heading for column in part)]
            self.add_rows(f"Table {number} of the paper: {table['title']}", headings, rows)

    def add_comparison(self, given):
        """Filters, each beside its reference: `pairs`, or all beside one `reference`."""
        problem = given.get("problem", self.problem)
        pairs = given.get("pairs") or dict.fromkeys(given["filters"], given.get("reference", self.study.reference))
        pairs = {name: other for name, other in pairs.items() if self.study.has(problem, name)}
        self.add_differences(problem, given["caption"], pairs, given["measures"], given["measures"])

    def add_differences(self, problem, caption, references, figures, compared, found=None):
        """A table of the measures, and one of the differences to the references, {filter: reference}."""
        found = found or {figure: self.differences_to(problem, references, figure) for figure in compared}
        others = dict.fromkeys(reference for reference in references.values() if self.study.has(problem, reference))
        shown = dict.fromkeys([*(name for name in others if name not in references), *references])
        tables = [("means ± s.e.", figures, [(f"`{name}`", name) for name in shown],
                   lambda name, figure: self.figure(problem, name, figure)),
                  ("differences, paired by seed", compared, [(f"`{name}` − `{reference}`", name) for name, reference in references.items()
                                                             if reference in others and name != reference],
                   lambda name, figure: Cell(difference_text(found[figure].get(name, [None])[0], figure),
                                             "sure" if found[figure].get(name, [None, 1.0])[1] < LEVEL else ""))]
        for what, of_table, rows, cell in tables:
            for first in range(0, len(of_table) if rows else 0, COLUMNS):
                part = of_table[first:first + COLUMNS]
                self.add_rows(f"{caption}: {what}", ["Filter", *(measure(figure).heading for figure in part)],
                              [[title, *(cell(name, figure) for figure in part)] for title, name in rows])

    def differences_to(self, problem, references, figure):
        """{name: (difference to its reference, p corrected for the number of names)}, of those that have one."""
        found = {name: self.study.difference(problem, figure, [(1.0, name), (-1.0, other)])
                 for name, other in references.items() if name != other}
        found = {name: difference for name, difference in found.items() if difference is not None}
        return dict(zip(found, zip(found.values(), holm([difference.p for difference in found.values()]))))

    def add_groups(self, compared):
        """All filters of the study, group by group, on every problem."""
        self.add_section(["all", "All filters"])
        for problem in self.study.problems:
            self.add_heading(3, f"On {problem['name']}")
            self.add_groups_of(problem["name"], self.known, compared)

    def add_groups_of(self, problem, figures, compared):
        figures = self.study.measured(problem, figures)
        compared = [figure for figure in compared if figure in figures]
        references = {name: self.study.reference_for(name) for name in self.study.names(problem)}
        found = {figure: self.differences_to(problem, references, figure) for figure in compared}
        for group, names in self.study.groups():
            of_group = {name: references[name] for name in names if name in references}
            if of_group:
                self.add_heading(4, group or "Filters")
                self.add_differences(problem, group or "Filters", of_group, figures, compared, found)

    def add_settings_of_filters(self):
        self.add_rows("Settings of each filter", ["Filter", "Group", "Settings"],
                      [[f"`{each['name']}`", each["group"], Cell(settings_text(each["settings"]), "settings")]
                       for each in self.study.filters], texts=(0, 1, 2))

    # ---- pictures

    def add_curves(self, given):
        """`filters` in one panel, or `panels`, each with a measure over the drive."""
        figure, panels = given["measure"], given.get("panels") or [given["filters"]]
        problem = self.study.problems[0]
        curves = {name: self.study.curve(problem["name"], name, figure) for panel in panels for name in panel}
        curves = {name: curve for name, curve in curves.items() if curve is not None}
        if not curves:
            return
        trials = int(max(curve.count.max() for curve in curves.values()))
        panels = [(panel[0] if len(panels) > 1 else "", [(curves[name], name) for name in panel if name in curves]) for panel in panels]
        image = pictures.draw_curves([panel for panel in panels if panel[1]], measure(figure).heading, problem.get("closures", {}))
        self.add_figure(given["name"], image, f"""{given['caption']} Means over {trials} drives; bands: ± one standard deviation
                        over the drives.""")

    def add_scheme_times(self, given):
        times = self.study.scheme_times
        if not times:
            return
        sizes = sorted({size for points in times.values() for size in points})
        self.add_figure(given["name"], pictures.draw_scheme_times(times), given["caption"])
        self.add_rows("Time of one resampling (µs)", ["Particles", *times],
                      [[str(size), *(f"{points[size]:.2f}" for points in times.values())] for size in sizes])

    # ---- a study of one's own

    def add_own_figures(self):
        figures = list(dict.fromkeys([*self.chosen, "processor_ms"]))
        for number, problem in enumerate(self.study.problems, 1):
            self.add_section([f"problem-{number}", f"On {problem['name']}"])
            self.add_groups_of(problem["name"], figures, figures)
            for group_number, (group, names) in enumerate(self.study.groups(), 1):
                for figure in self.chosen:
                    self.add_measure(f"{figure}_{number}_{group_number}", problem, group or problem["name"], names, figure)

    def add_measure(self, name, problem, title, names, figure):
        """Against the number of particles and time; and over the drive where the study has that."""
        heading, factor = measure(figure).heading, measure(figure).factor
        lines, panels = {}, {}  # of each filter: points; of each number of particles: curves
        for each in names:
            value, time = (self.study.estimate(problem["name"], each, of) for of in (figure, "processor_ms"))
            curve = self.study.curve(problem["name"], each, figure)
            of, particles = self.study.place_of(each)
            if value is not None:
                lines.setdefault(of, []).append((particles or math.nan, time.mean if time else math.nan, factor * value.mean,
                                                 factor * value.standard_error))
            if curve is not None:
                error = curve.deviation / [max(1.0, count) ** 0.5 for count in curve.count]
                panels.setdefault(particles, []).append((curve._replace(deviation=error), of))
        image = pictures.draw_measure(lines, heading)
        if image:
            self.add_figure(name, image, f"**{heading}, {title}.** Means ± standard error.")
        if panels:
            image = pictures.draw_curves([(f"M = {key}" if key else "", curves) for key, curves in panels.items()], heading,
                                         problem.get("closures", {}))
            self.add_figure(f"curve_{name}", image, f"""**{heading} over the drive, {title}.** Means over the trials; bands: ±
                            one standard error.""")
