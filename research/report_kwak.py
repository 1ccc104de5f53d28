"""The report of the study of Kwak et al. (2008): each of its tables and figures beside ours, and its claims."""
import numpy as np

import report_pictures as pictures
from report_document import Bullets, Cell, Heading, Picture, Table, Text
from report_measures import difference_text, with_error
from report_parts import (Claims, add_filters, add_groups, add_reading, add_settings, difference_cell, differences_to,
                          interval_words, listed, more_rows, papers, plain_row)
from report_statistics import LEVEL
from report_tempering import add_tempering

FAMILIES = ("five_points", "kwak", "honesty")
# Filters in the figures: name, label, colour, line.
NR, RSR = ("NR", "no renewal (NR)", pictures.GREY, "-"), ("RSR", "RSR", pictures.INK, "-")
PR, RBR = ("PR", "PR", pictures.ORANGE, "-"), ("RBR", "RBR", pictures.GREEN, "-")
COMPENSATION = ("compensation", "compensation", pictures.RED, "-")
THRESHOLDS = [("compensation T_N=0.25", "T_N = 0.25", pictures.GREEN, "-"),
              ("compensation T_N=0.5", "T_N = 0.5", pictures.BLUE, "-"),
              ("compensation", "T_N = 0.75", pictures.RED, "-"), ("compensation T_N=1", "T_N = 1", pictures.ORANGE, "-")]
SIZES = [("compensation M=10", "compensation, M = 10", pictures.GREEN, "-"),
         ("compensation M=50", "compensation, M = 50", pictures.BLUE, "-"),
         ("compensation", "compensation, M = 100", pictures.RED, "-"), ("RSR", "RSR, M = 100", pictures.INK, "-")]
BEYOND = [RSR, RBR, COMPENSATION, ("compensation 20 %", "compensation, ratio 20 %", pictures.BLUE, "-"),
          ("reset", "weights reset, nothing else", pictures.ORANGE, "-"), ("redraw", "redraw", pictures.VIOLET, "-"),
          ("EKF-SLAM", "EKF-SLAM", pictures.GREY, "-")]
LABELS = {"feature_error": "eq. 5 (m)", "position_error": "eq. 6 (m)", "effective_sample_size": "N_eff",
          "distinct": "distinct particles", "calls": "calls so far", "map_error": "weighted-mean map (m)",
          "map_inside": "landmarks inside their 95 % ellipse"}
# Of the tables: what the paper prints and what it does not, heading and figure.
PRINTED = {"distinct": "Distinct", "effective_sample_size": "N_eff", "feature_error": "Eq. 5 (m)"}
ADDED = ("map_error", "map_inside")
RISE = 2.0  # s: over which point A is looked for


def point_a(study, problem):
    """When eq. 5 of RSR rises most, over RISE seconds: the middle of that time. None without its curve."""
    curve = study.curve(problem, "RSR", "feature_error")
    if curve is None or len(curve.time) < 2 or curve.time[-1] - curve.time[0] <= RISE:
        return None
    starts = curve.time[curve.time <= curve.time[-1] - RISE]
    rise = np.interp(starts + RISE, curve.time, curve.mean) - np.interp(starts, curve.time, curve.mean)
    return float(starts[int(np.argmax(rise))] + 0.5 * RISE)


class KwakReport:
    def __init__(self, study, document):
        self.study, self.document = study, document
        self.problem = (study.problem_like("indoor_two_loops") or study.problems[0])
        self.name = self.problem["name"]
        self.paper = papers()["kwak"]
        self.claims = Claims(study, self.name, FAMILIES)
        self.marks = dict(sorted(self.problem.get("closures", {}).items()))
        self.point_a = point_a(study, self.name)
        self.found = []  # (of the paper, anchor)

    def heading(self, text, anchor):
        self.found.append((text, anchor))
        self.document.add(Heading(3, text, anchor))

    def add_curves(self, name, figure, panels, caption, marks=None, **options):
        """A picture of curves; those that the study lacks are named below it."""
        drawn = {each[0]: self.study.curve(self.name, each[0], figure) for _, filters in panels for each in filters}
        missing = [name for name, curve in drawn.items() if curve is None]
        curves = [(title, [(drawn[each[0]], *each[1:]) for each in filters if drawn[each[0]] is not None])
                  for title, filters in panels]
        curves = [(title, filters) for title, filters in curves if filters]
        note = f" Not in this study: {listed(sorted(set(missing)))}." if missing else ""
        if not curves:
            self.document.add(Text(f"{caption} This study has no such curves.{note}"))
            return
        trials = int(max(np.max(curve.count) for _, filters in curves for curve, *_ in filters))
        svg = pictures.draw_curves(curves, LABELS[figure], self.marks if marks is None else marks, **options)
        self.document.add(Picture(name, svg, f"""{caption} Means over {trials} drives; bands: ± one standard deviation over the
                                  drives.{note}"""))

    # ---- tables

    def table(self, number):
        """A table of the paper, each of its numbers beside ours."""
        tables, study = self.paper["tables"], self.study
        table, runs = tables[number], float(self.paper["runs"])
        calls_of = {row["filter"]: float(row["calls"]) / runs for row in tables["III"]["rows"]}
        printed = [figure for figure in PRINTED if figure in table["columns"]]
        groups, headings = [("", 1)], ["Filter"]
        if number == "III":
            groups += [("Complexity", 1), ("Calls", 3), ("Run time of the step", 5)]
            headings += ["paper", "paper, sum", "paper, per drive", "ours, per drive", "paper, sum (s)",
                         "paper, per drive (s)", "ours, per drive (ms)", "paper, per call (ms)", "ours, per call (µs)"]
        else:
            groups += [(PRINTED[figure], 2) for figure in printed] + [("Run time of the step", 3), ("Not in the paper", 2)]
            headings += ["paper", "ours"] * len(printed)
            headings += ["paper, per drive (s)", "ours, per drive (ms)", "ours, per call (µs)", "Map (m)", "Landmarks inside"]

        def ours(name, figure):
            return with_error(study.estimate(self.name, name, figure), figure)

        def cells(row, name):
            def text(key):
                return Cell(row[key] if row else "–", "paper")

            if number == "III":
                per_call = f'{1000.0 * float(row["run_time"]) / float(row["calls"]):.2f}' if row else "–"
                per_drive = f'{float(row["run_time"]) / runs:.4f}' if row else "–"
                return [text("complexity"), text("calls"), Cell(f"{calls_of[name]:.2f}" if row else "–", "paper"),
                        ours(name, "calls"), text("run_time"), Cell(per_drive, "paper"), ours(name, "step_ms"),
                        Cell(per_call, "paper"), ours(name, "step_us_per_call")]
            pairs = [cell for figure in printed for cell in (text(figure), ours(name, figure))]
            return [*pairs, text("run_time"), ours(name, "step_ms"), ours(name, "step_us_per_call"),
                    *(ours(name, figure) for figure in ADDED)]

        rows = [[f'{row["method"]} (`{row["filter"]}`)' if row["method"] != row["filter"] else row["method"],
                 *cells(row, row["filter"])] for row in table["rows"]]
        shown = {row["filter"] for row in table["rows"]}
        figures = ["calls", "step_ms"] if number == "III" else [*printed, "step_ms"]
        more = more_rows(study, self.name, [name for name in self.beside() if name not in shown], figures)
        rows += [plain_row([f"`{name}`", *cells(None, name)], i == 0) for i, name in enumerate(more)]
        self.document.add(Table(f'Table {number} of Kwak: {table["title"]}', headings, rows, groups))
        missing = [row["filter"] for row in table["rows"] if not study.has(self.name, row["filter"])]
        if missing:
            self.document.add(Text(f"Not in this study: {listed(missing)}."))

    def beside(self):
        """What stands below the paper's rows: no renewal, plain resampling, the controls and what goes beyond the papers."""
        groups = dict(self.study.groups())
        return ["NR", "RSR", "compensation", "compensation 10 %", *groups.get("Tempering", []),
                *groups.get("Beyond the papers", [])]

    # ---- sections

    def add_all(self):
        document, study = self.document, self.study
        document.add(Text(f"""This page sets the tables and figures of {self.paper['source'].rstrip('.')}, beside what this
            package measures. The paper prints averages of {self.paper['runs']} runs in a world that is not available; ours is
            one of the same kind (Figure 5), so what can be compared is order and size, not digits."""))
        document.add(Heading(2, "In short", "short"))
        document.add(Text(f"""Of the five points that this study has to show and the claims of the paper, taken together:
            {self.claims.counts('five_points', 'kwak')}. The five points first; every other claim stands below its table or
            figure."""))
        document.add(self.claims.of("five_points", "The five points: claims and verdicts"))
        index = len(document.blocks)  # of the list of what is where, known at the end
        add_settings(document, study, self.paper)
        document.add(Text("""**Compensation.** Equations 7 and 8 are built with weights normalised over the pair, a = w_l /
            (w_l + w_h) and b = 1 − a: as printed the two weights do not add up to one, so the blend is no mean of the two
            particles but is drawn towards the origin of the coordinates. Which particles are low and which high the paper does
            not say: the split at the median weight is our reading. The rows `literal` show what the printed equations do."""))
        add_reading(document, study)
        self.add_resampling()
        self.add_compensation()
        self.add_literal()
        self.add_honesty()
        add_tempering(document, study, self.name)
        self.add_parameters()
        self.add_absent()
        document.add(Heading(2, "All filters", "all"))
        document.add(Text("Differences are bold if their p-value, corrected for the number of filters (Holm), is below 0.01."))
        figures = list(study.figures) + ["processor_ms", "step_ms", "step_us_per_call"]
        for problem in study.problems:
            document.add(Heading(3, f'On {problem["name"]}') if len(study.problems) > 1 else None)
            add_groups(document, study, problem["name"], figures,
                       ("feature_error", "position_error", "map_error", "map_error_end", "map_inside", "pose_inside", "calls"),
                       level=4 if len(study.problems) > 1 else 3)
        add_filters(document, study)
        document.blocks[index:index] = [
            Heading(3, "Where each table and figure is"),
            Bullets([f"[{text}](#{anchor})" for text, anchor in self.found]),
            Text("[Figures 1 to 4 and 10, Tables I and II](#absent): what has no counterpart, and why.")]

    def figure(self, number, title, figure, panels, caption, after=None, **options):
        """A figure of the paper with its heading, what is said after it, and its claims."""
        self.heading(f"Figure {number}: {title}", f"figure-{number}")
        self.add_curves(f"kwak_figure_{int(number):02d}", figure, panels, f"**Figure {number}.** {caption}", **options)
        if after:
            after()
        self.document.add(self.claims.at(f"Figure {number}"))

    def add_resampling(self):
        document, schemes = self.document, [("", [NR, RSR, PR, RBR])]
        document.add(Heading(2, "Resampling (sections 3 and 4 of the paper)", "resampling"))
        self.add_figure_5()
        self.figure("6", "distinct particles", "distinct", schemes,
                    "Number of distinct particles: ancestors that survive since the first landmark.", self.add_left_after_b)
        self.figure("7", "effective sample size", "effective_sample_size",
                    [("(a) NR", [NR]), ("(b) RSR", [RSR]), ("(c) PR", [PR]), ("(d) RBR", [RBR])],
                    "Effective sample size, before the renewal.", top=100.0)
        self.figure("8", "RMS feature error", "feature_error", schemes, "RMS feature error, eq. 5.", marks=self.marks_with_a())
        self.figure("9", "RMS position error", "position_error", schemes, "RMS position error, eq. 6.", self.add_position_at_end)
        self.heading("Table III: calls and run time", "table-3")
        document.add(Text("""The paper's run time is that of the step alone. Ours is the processor time of the filter minus that
            of the same filter without renewal (NR), paired by seed, because maps are copied only when they are next looked at, so
            that a step's cost comes later and cannot be timed within the step. In the paper a step copies the maps, O(MN); here it
            notes who descends from whom, O(M)."""))
        self.table("III")
        document.add(self.claims.at("Table III"))
        self.heading("Table IV: performance", "table-4")
        self.table("IV")
        document.add(self.claims.at("Table IV"))

    def marks_with_a(self):
        return {**({"A": self.point_a} if self.point_a is not None else {}), **self.marks}

    def add_figure_5(self):
        study, name = self.study, self.name
        self.heading("Figure 5: the world", "figure-5")
        truth, landmarks = study.path(name, "truth"), study.places(name, "landmark")
        if truth is None and not landmarks:
            self.document.add(Text("Figure 5: this study has neither the true path nor the landmarks."))
            return
        notes = list(study.places(name, "closure"))
        text = ""
        if self.point_a is not None and truth is not None:
            notes.append(("A", *(float(np.interp(self.point_a, truth[:, 0], truth[:, i])) for i in (1, 2))))
            text = (f" A is where eq. 5 of RSR rises most within {RISE:g} s, found from its curve: at {self.point_a:.1f} s.")
        closures = "; ".join(f"{each} is passed at {when:g} s" for each, when in self.marks.items())
        paths = [(truth, "true path of the first drive", pictures.BLUE, "-")] if truth is not None else []
        self.document.add(Picture(
            "kwak_figure_05", pictures.draw_paths([("", paths, [(landmarks, "landmark", "x", pictures.INK)], notes)]),
            f"""**Figure 5.** The world: {len(landmarks)} landmarks. The geometry is our own, since that of the paper is not
            available; it has an inner loop that closes at B and an outer one that closes at C, too.{text}
            {closures + '.' if closures else ''}"""))

    def add_left_after_b(self):
        curve = self.study.curve(self.name, "RSR", "distinct")
        if curve is None or "B" not in self.marks:
            return
        left = float(np.interp(self.marks["B"] + RISE, curve.time, curve.mean))
        self.document.add(Text(f"""The paper says that soon after B a single particle is left with RSR. Here, {RISE:g} s after
            B, it is {left:.1f} on average."""))

    def add_position_at_end(self):
        said = self.paper["said"]["position_error_end"]
        ends = {each[0]: self.study.curve(self.name, each[0], "position_error") for each in (RSR, PR, RBR)}
        ends = [f"`{name}` {curve.mean[-1]:.3f} m" for name, curve in ends.items() if curve is not None]
        if ends:
            self.document.add(Text(f"""The paper says that eq. 6 goes to about {said['value']} {said['unit']} after the outer
                loop ({said['where']}). Here it is at the end: {', '.join(ends)}."""))

    def add_compensation(self):
        document = self.document
        document.add(Heading(2, "Compensation (section 5 of the paper)", "compensation"))
        self.figure("11", "effective sample size of compensation", "effective_sample_size", [("", [COMPENSATION, RSR])],
                    "Effective sample size of compensation. RSR is added.", top=100.0)
        self.heading("Figure 12: errors of compensation and RSR", "figure-12")
        for letter, figure, title in (("a", "feature_error", "RMS feature error, eq. 5"),
                                      ("b", "position_error", "RMS position error, eq. 6")):
            self.add_curves(f"kwak_figure_12{letter}", figure, [("", [RSR, COMPENSATION])],
                            f"**Figure 12 ({letter}).** {title}.")
        document.add(Text("The claim on eq. 5 is the second of the five points."))
        document.add(self.claims.at("Figure 12"))
        self.heading("Table V: selection of pairs", "table-5")
        self.table("V")
        document.add(self.claims.at("Table V"))
        self.heading("Table VI: ratio", "table-6")
        self.table("VI")
        document.add(Text("The claim on eq. 5 is the third of the five points."))
        document.add(self.claims.at("Table VI"))
        self.figure("13", "effective sample size and threshold", "effective_sample_size",
                    [(f"({letter}) {each[1]}", [each]) for letter, each in zip("abcd", THRESHOLDS)],
                    "Effective sample size of compensation with four thresholds.", top=100.0)
        self.figure("14", "feature error and threshold", "feature_error", [("", THRESHOLDS)], """RMS feature error, eq. 5, of
                    compensation with four thresholds. That T_N = 1 does not lower it at C is part of the fourth of the five
                    points.""")
        self.figure("15", "calls and threshold", "calls", [("", THRESHOLDS)], """Number of calls so far, of compensation with four
                    thresholds. The claim on them is part of the fourth of the five points.""")
        self.figure("16", "number of particles", "feature_error", [("", SIZES)], """RMS feature error, eq. 5, of compensation with
                    fewer particles, and of RSR. That 50 particles beat RSR with 100 is the fifth of the five points.""",
                    self.add_similar)

    def add_similar(self):
        similar = self.study.difference(self.name, "feature_error", [(1.0, "compensation M=50"), (-1.0, "compensation")])
        if similar is not None:
            self.document.add(Text(f"""The paper says that 50 particles are similar to 100. Eq. 5 with 50 minus eq. 5 with 100,
                paired by drive, is {interval_words(similar, 'feature_error')}: this is how similar they are."""))

    def add_literal(self):
        study, name = self.study, self.name
        names = [each["name"] for each in study.filters if "literal" in each["name"] and study.has(name, each["name"])]
        self.document.add(Heading(2, "Equations 7 and 8 as printed", "literal"))
        if not names:
            self.document.add(Text("No filter with the literal equations is in this study."))
            return
        figures = ("feature_error", "position_error", "map_error", "map_inside", "pose_error")
        pairs = [(each, each.replace(" literal", "")) for each in names]
        rows = [[f"`{each}`", *(with_error(study.estimate(name, each, figure), figure) for figure in figures)]
                for pair in pairs for each in reversed(pair)]
        headings = ["Eq. 5 (m)", "Eq. 6 (m)", "Map (m)", "Landmarks inside", "Pose (m)"]
        self.document.add(Table("Weights normalised over the pair, and as printed", ["Filter", *headings], rows))
        rows = []
        for each, normalised in pairs:
            changes = [study.difference(name, figure, [(1.0, each), (-1.0, normalised)]) for figure in figures]
            rows.append([f"`{each}` − `{normalised}`", *map(difference_text, changes, figures)])
        self.document.add(Table("What the printed equations change, paired by drive", ["Difference", *headings], rows))

    def add_honesty(self):
        document = self.document
        document.add(Heading(2, "What the paper does not look at", "honesty"))
        document.add(Text("""Eq. 5 takes the error over all particles, without their weights. So it holds the error of the map
            and the spread of the particles, and whatever shrinks the cloud lowers it. What a user gets is the weighted-mean
            map and its covariance. A 95 % ellipse that can be believed contains the truth 95 % of the time."""))
        self.add_curves("kwak_beyond_map", "map_error", [("", BEYOND)], """**Beyond the paper: the map.** RMS error of the
                        weighted-mean map over the drive.""")
        self.add_curves("kwak_beyond_inside", "map_inside", [("", BEYOND)], """**Beyond the paper: honesty.** Share of the
                        landmarks inside their 95 % ellipse over the drive.""", top=1.05, level=(0.95, "honest"))
        document.add(self.claims.at("honesty"))

    def add_parameters(self):
        study, name = self.study, self.name
        self.document.add(Heading(2, "Parameters that the paper names and does not vary", "parameters"))
        for title, first, begin in (
                ("Slope of rank-based resampling, η_max; `RBR` has the paper's 1.5", "RBR", "RBR eta_max"),
                ("Thresholds of partial resampling, T_h and T_l; `PR` has 2 / M and 0.5 / M", "PR", "PR T_")):
            names = [each for each in study.names(name) if each == first or each.startswith(begin)]
            if len(names) < 2:
                self.document.add(Text(f"{title}: not in this study."))
                continue
            figures = ("calls", "distinct", "effective_sample_size", "feature_error", "map_error", "map_inside")
            found = {figure: differences_to(study, name, names, first, figure) for figure in figures}
            headings = ["Calls", "Distinct", "N_eff", "Eq. 5 (m)", "Map (m)", "Landmarks inside"]
            rows = [[f"`{each}`", *(with_error(study.estimate(name, each, figure), figure) for figure in figures)]
                    for each in names]
            self.document.add(Table(title, ["Filter", *headings], rows))
            rows = [[f"`{each}`", *(difference_cell(found[figure], each, figure) for figure in figures)]
                    for each in names if each != first]
            caption = f"Minus `{first}`, paired by drive; bold: corrected p below {LEVEL:g}"
            self.document.add(Table(caption, ["Filter", *headings], rows))

    def add_absent(self):
        self.document.add(Heading(2, "What has no counterpart, and why", "absent"))
        self.document.add(Bullets([
            "Figure 1 is a drawing of how FastSLAM 2.0 goes on with two particles: a concept, with nothing measured.",
            "Figure 2 is a family tree of resampling algorithms: a concept.",
            "Figures 3 and 4 are an example of systematic resampling, and probabilities over the rank: nothing is measured.",
            "Figure 10 is a drawing of what a particle holds: a concept.",
            """Tables I and II are listings; the schemes are `systematic` and `residual_systematic`. The bracket in Table II is
            read as the integer below.""",
            """Figure 5 is our own world of the same kind: the paper's map is not available. Point A is therefore where our own
            curve rises most.""",
            """The ranges of the vertical axes cannot be told from the paper at hand, which has no pictures; effective sample sizes
            are drawn from 0 to the number of particles."""]))
