"""What the reports of all studies have in common: settings, how to read the figures, tables of all filters."""
import json

from report_claims import claims_table, data_file, findings
from report_document import Bullets, Cell, Heading, Row, Table, Text
from report_measures import MEASURES, difference_text, measure, signed, with_error
from report_statistics import LEVEL, holm

COLUMNS = 7  # of figures in a table that has to fit on a page


def papers():
    """The printed numbers of both papers."""
    return json.loads(data_file("papers.json").read_text(encoding="utf-8"))


def listed(names):
    """`a`, `b` and `c`"""
    names = [f"`{name}`" for name in names]
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]


def settings_text(settings):
    return ", ".join(f"`{name}: {value}`" for name, value in sorted(settings.items())) or "none"


class Claims:
    """The findings of families of claims, to be shown beside what they are about."""

    def __init__(self, study, problem, families):
        self.study, self.problem = study, problem
        self.found = {family: findings(study, family, problem) for family in families}

    def at(self, *places):
        """The table of the claims about these places of the paper, or None."""
        found = [finding for family in self.found.values() for finding in family if finding.claim["where"] in places]
        return claims_table(self.study, found, self.problem, f"Claims: {' and '.join(places)}")

    def of(self, family, caption):
        return claims_table(self.study, self.found[family], self.problem, caption)

    def counts(self, *families):
        """How often which verdict is given: `12 hold, ...`."""
        verdicts = [finding.verdict for family in families for finding in self.found[family]]
        words = (("holds", "holds", "hold"), ("does not hold", "does not hold", "do not hold"),
                 ("no difference found", "shows no difference", "show no difference"),
                 ("not in this study", "is not in this study", "are not in this study"))
        return ", ".join(f"{verdicts.count(verdict)} {one if verdicts.count(verdict) == 1 else many}"
                         for verdict, one, many in words if verdict in verdicts)


def problem_text(problem, filter_name):
    """A problem in a sentence: what it is, how long, and what its scatter says. Errors of maps leave nothing out."""
    kind = problem.get("kind", "world")
    text = f'`{problem["name"]}`: ' + ("a simulated drive" if kind == "world" else "a recording")
    if problem.get("duration"):
        text += f' of {problem["duration"]:g} s'
    if filter_name == "beacon_mcl" and problem.get("clip"):
        text += f', of which the first {100 * problem["clip"]:g} % of the time are left out of the errors'
    if problem.get("lost_error"):
        text += f'; a run is lost if its error is above {problem["lost_error"]:.2f} m for more than a tenth of what counts'
    if kind == "world":
        return text + ". Every seed has a drive of its own, so the scatter is that of drives and filter."
    return text + (". All seeds share this one drive: the scatter is that of the filter's random numbers and says nothing of "
                   "other drives.")


def add_settings(document, study, paper=None):
    document.add(Heading(2, "Settings", "settings"))
    document.add(Text(f"""The filter is `{study.filter}` with the preset `{study.preset or 'none'}`. On top of it, for all
        filters of the study: {settings_text(study.settings)}. Each filter has at most {study.trials} trials, with seeds from
        1; filters with the same seed share their drive. Differences are taken to `{study.reference}` unless said otherwise.
        The last section lists what each filter sets."""))
    document.add(Bullets([problem_text(problem, study.filter) for problem in study.problems]))
    if not paper:
        return
    values = {**study.parameters, **study.settings}
    rows = []
    for setting in paper["settings"]:
        ours = {name: values[name] for name in setting.get("parameters", []) if name in values}
        rows.append([setting["name"], Cell(setting["value"], "paper"), setting["where"],
                     Cell(settings_text(ours) if ours else "", "settings"), setting.get("why", "")])
    if not any(row[3].text for row in rows):  # the study does not say what it has set
        rows = [row[:3] + row[4:] for row in rows]
    headings = ["Setting", "In the paper", "Where", "Here", "Where it is ours: why"]
    if len(rows[0]) < len(headings):
        headings.remove("Here")
    document.add(Table("Settings: what the paper says, and what is ours", headings, rows, texts=range(len(headings))))


def add_reading(document, study):
    document.add(Heading(2, "How to read it", "reading"))
    document.add(Text("""**Numbers.** A figure is the mean over the trials ± its standard error (s.e.). Numbers of the paper
        are on yellow, as printed (where `per drive` or `per call` is said, divided by us); the papers give no standard errors.
        Rows and columns that the paper does not have are on grey."""))
    document.add(Text(f"""**Verdicts.** A claim is a set of differences, each with a direction, paired by seed: what the drives
        have in common cancels. Each difference is tested by Student's t, shares of lost runs by McNemar's exact test; all
        p-values are two-sided. A claim holds if all its differences are on the claimed side: its p-value is then the largest
        of them. It does not hold if one is on the other side: its p-value is then the smallest of those, times the number of
        differences in the claim. The p-values of all claims of a family are corrected for their number (Holm). Below {LEVEL:g}
        the claim **holds** or **does not hold**; otherwise there is **no difference found**, and the 99 % interval of the
        difference at which the claim fails, widened by the same correction, says how large it may be. So the chance that a
        family has any wrong "holds" or "does not hold" is at most {LEVEL:g}. ◂ marks the difference that decides."""))
    timed = ("processor_ms", "step_ms", "step_us_per_call") if study.filter == "fastslam" else ()
    add_measures(document, [figure for figure in MEASURES if figure in study.figures or figure in timed])


def add_measures(document, figures):
    """What each of them is."""
    if figures:
        document.add(Text("**Measures.**"))
        document.add(Bullets([f"**{measure(figure).heading}**: {measure(figure).definition}" for figure in figures]))


def lost_text(study, problem, name):
    """19 of 30"""
    values = study.values(problem, name, "lost")
    return f"{sum(1 for value in values.values() if value > 0.0)} of\u00a0{len(values)}" if values else "–"


def figure_text(study, problem, name, figure):
    if figure == "lost":
        return lost_text(study, problem, name)
    return with_error(study.estimate(problem, name, figure), figure)


def differences_to(study, problem, names, reference, figure):
    """{name: (difference to the reference, p corrected for the number of names)}, of those that have one. `reference`: a
    filter; None: of each its own."""
    references = {name: reference or study.reference_for(name) for name in names}
    found = {name: study.difference(problem, figure, [(1.0, name), (-1.0, other)])
             for name, other in references.items() if name != other}
    found = {name: difference for name, difference in found.items() if difference is not None}
    return dict(zip(found, zip(found.values(), holm([difference.p for difference in found.values()]))))


def difference_cell(found, name, figure):
    """A difference, bold if it is sure."""
    if name not in found:
        return Cell("–")
    difference, p = found[name]
    return Cell(difference_text(difference, figure), "sure" if p < LEVEL else "")


def add_groups(document, study, problem, figures, compared, level=3):
    """Of every group of filters a table of figures, and one of their differences to the reference."""
    figures = study.measured(problem, figures)
    compared = [figure for figure in compared if figure in figures]
    found = {figure: differences_to(study, problem, study.names(problem), None, figure) for figure in compared}
    for group, names in study.groups():
        names = [name for name in names if study.has(problem, name)]
        if not names:
            continue
        document.add(Heading(level, group or "Filters"))
        references = dict.fromkeys(map(study.reference_for, names))
        shown = [*(name for name in references if name not in names and study.has(problem, name)), *names]
        for first in range(0, len(figures), COLUMNS):
            part = figures[first:first + COLUMNS]
            document.add(Table(f"{group or 'Filters'}: means ± s.e.",
                               ["Filter", *(measure(figure).heading for figure in part)],
                               [[f"`{name}`", *(figure_text(study, problem, name, figure) for figure in part)]
                                for name in shown]))
        others = [name for name in names if name not in references]
        for first in range(0, len(compared) if others else 0, COLUMNS):
            part = compared[first:first + COLUMNS]
            document.add(Table(f"{group or 'Filters'}: minus `{study.reference}`, paired by seed",
                               ["Filter", *(measure(figure).heading for figure in part)],
                               [[f"`{name}`", *(difference_cell(found[figure], name, figure) for figure in part)]
                                for name in others]))


def add_filters(document, study):
    """What each filter sets, and how a trial is repeated."""
    document.add(Heading(2, "The filters", "filters"))
    document.add(Text("""Each trial can be repeated alone: `rosrun pf_resampling study trial DIR PROBLEM FILTER SEED`. A filter
        is the preset, the settings of the study and these on top."""))
    document.add(Table("Settings of each filter", ["Filter", "Group", "Settings"],
                       [[f"`{each['name']}`", each.get("group", ""), Cell(settings_text(each.get("settings", {})), "settings")]
                        for each in study.filters], texts=(0, 1, 2)))


def interval_words(difference, figure):
    """`+0.0012 ± 0.0003`, and whether zero is inside its 99 % interval, in words."""
    side = "zero is inside" if difference.low <= 0.0 <= difference.high else "zero is not inside"
    factor, digits = measure(figure).factor, measure(figure).digits
    return (f"{difference_text(difference, figure)} ({side} its 99 % interval, {signed(factor * difference.low, digits)} to "
            f"{signed(factor * difference.high, digits)})")


def more_rows(study, problem, names, figures):
    """Those of the names that have one of the figures here."""
    return [name for name in names if any(study.values(problem, name, figure) for figure in figures)]


def plain_row(cells, is_first):
    """A row of what the paper does not have; a line above the first."""
    return Row(cells, "more", *(["rule"] if is_first else []))
