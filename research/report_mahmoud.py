"""The report of the study of Mahmoud et al. (2012): its tables and figures beside ours, runs lost, its three conclusions."""
import report_pictures as pictures
from report_document import Bullets, Cell, Heading, Picture, Row, Table, Text
from report_measures import AXES, PARTS, difference_text, distance_text, p_text, with_error
from report_parts import (Claims, add_filters, add_groups, add_reading, add_settings, figure_text, interval_words, listed,
                          lost_text, papers, plain_row)
from report_statistics import LEVEL, holm

SCHEMES = ("RSR", "Stratified", "Residual", "Systematic", "Multinomial")
DEAD_RECKONING = "dead reckoning"
REFERENCE = "Systematic"
# Of the paper's figures of paths: number, scheme.
PATH_FIGURES = ((2, "Systematic"), (3, "RSR"), (4, "Stratified"), (5, "Multinomial"), (6, "Residual"))
TITLES = {"circle": "circle", "figure8": "figure of eight"}


class MahmoudReport:
    def __init__(self, study, document):
        self.study, self.document = study, document
        self.paper = papers()["mahmoud"]
        self.problems = {word: found["name"] for word, found in ((word, study.problem_like(word)) for word in TITLES) if found}
        self.claims = Claims(study, next(iter(self.problems.values()), study.problems[0]["name"]), ("mahmoud", "mahmoud_more"))
        self.found = []

    def heading(self, text, anchor):
        self.found.append((text, anchor))
        self.document.add(Heading(3, text, anchor))

    # ---- tables

    def errors_table(self, caption, problem, excitation, printed=None):
        """Errors of the five schemes, the paper's numbers above ours; below them the runs lost."""
        study = self.study
        names = [DEAD_RECKONING, *(f"{scheme} {excitation}".strip() for scheme in SCHEMES)]
        missing = [name for name in names if not study.has(problem, name)]
        rows = []
        for axis, short, _ in AXES:
            for part, ending, _ in PARTS:
                title = f"{short}_abs_{ending}"
                if printed and title in printed:
                    rows.append(Row([f"{title}, paper", *printed[title]], "paper", "rule"))
                figure = f"{axis}_{part}"
                rows.append(Row([f"{title}, ours" if printed else title,
                                 *(with_error(study.estimate(problem, name, figure), figure) for name in names)],
                                *(["more"] if printed and title not in printed else [])))
        reference = f"{REFERENCE} {excitation}".strip()
        figures = [("Inside own 95 % region (%)", "coverage95"), ("**Runs lost**", "lost")]
        for i, (title, figure) in enumerate(figures):
            rows.append(plain_row([title, *(figure_text(study, problem, name, figure) for name in names)], i == 0))
        rows += [Row(cells, "more") for cells in self.lost_rows(problem, names, reference)]
        self.document.add(Table(caption, ["Error (m)", "Dead reckoning", *SCHEMES], rows))
        if missing:
            self.document.add(Text(f"Not in this study: {listed(missing)}."))

    def lost_rows(self, problem, names, reference):
        """Rows of the tests on what was lost, and of the error where neither was: each scheme beside the reference."""
        study = self.study
        lost = {name: study.difference(problem, "lost", [(1.0, name), (-1.0, reference)])
                for name in names[1:] if name != reference}
        tested = [name for name, difference in lost.items() if difference is not None]
        p = dict(zip(tested, holm([lost[name].p for name in tested])))
        error = {name: study.difference(problem, "cartesian_mean", [(1.0, name), (-1.0, reference)]) for name in tested}
        yield [f"Lost only here : only with {reference}", "–",
               *(distance_text(lost[name]) if name in p else "–" for name in names[1:])]
        yield ["p of that (McNemar, exact; Holm)", "–", *(p_text(p[name]) if name in p else "–" for name in names[1:])]
        yield [f"Cartesian_abs_avg minus {reference}'s, pairs with neither lost", "–",
               *(f"{difference_text(error[name], 'cartesian_mean')} ({error[name].count})" if error.get(name) else "–"
                 for name in names[1:])]

    def excitation_table(self, problem, excitation):
        """With minus without: what is lost and the error, each scheme; None if there is none."""
        study, found = self.study, []
        for scheme in SCHEMES:
            terms = [(1.0, f"{scheme} {excitation}"), (-1.0, scheme)]
            lost = study.difference(problem, "lost", terms)
            if lost is not None:
                found.append((scheme, lost, study.difference(problem, "cartesian_mean", terms)))
        return self.pairs_table(f"With `{excitation}` and without, {problem}", problem,
                                [(f"{scheme} {excitation}", scheme, lost, error) for scheme, lost, error in found])

    def pairs_table(self, caption, problem, pairs):
        """Rows of (with, without, difference of runs lost, difference of errors)."""
        if not pairs:
            return None
        p = holm([lost.p for _, _, lost, _ in pairs])
        rows = [[f"`{name}`", f"`{other}`", lost_text(self.study, problem, name), lost_text(self.study, problem, other),
                 distance_text(lost), Cell(p_text(corrected), "sure" if corrected < LEVEL else ""),
                 "–" if error is None else f"{difference_text(error, 'cartesian_mean')} ({error.count})"]
                for (name, other, lost, error), corrected in zip(pairs, p)]
        return Table(caption, ["Filter", "Beside", "Lost", "Lost, beside", "Lost only here : only beside",
                               "p (McNemar, exact; Holm)", "Cartesian_abs_avg, difference (pairs with neither lost)"],
                     rows, texts=(0, 1))

    def beside_systematic(self, problem, names, caption):
        study, pairs = self.study, []
        for name in names:
            terms = [(1.0, name), (-1.0, REFERENCE)]
            lost = study.difference(problem, "lost", terms)
            if lost is not None:
                pairs.append((name, REFERENCE, lost, study.difference(problem, "cartesian_mean", terms)))
        return self.pairs_table(caption, problem, pairs)

    # ---- sections

    def add_all(self):
        document, study = self.document, self.study
        document.add(Text(f"""This page sets the tables and figures of {self.paper['source'].rstrip('.')}, beside what this
            package measures. The recordings of the paper (Kurth 2004) cannot be obtained. The circle and the figure of eight
            here are simulated drives among beacons in an area of the same size, so what can be compared is order, not
            digits."""))
        document.add(Heading(2, "In short", "short"))
        document.add(Text(f"""The paper draws three conclusions: about schemes, about excitation and about run time. Here:
            {self.claims.counts('mahmoud')}. The second is taken apart, for an error that is averaged over the runs that were
            not lost says nothing of those that were."""))
        document.add(self.claims.of("mahmoud", "The paper's conclusions: claims and verdicts"))
        document.add(Text("""RSR (residual, then systematic on the residue) and systematic resampling take the same particles
            for the same random number, so with the same seed their columns here are equal. That RSR and systematic resampling
            differ in the paper's tables is due to random numbers, not to the schemes. So RSR is no part of the first
            claim."""))
        self.add_largest_difference()
        index = len(document.blocks)
        add_settings(document, study, self.paper)
        self.add_size_of_errors()
        add_reading(document, study)
        self.add_paths()
        self.add_tables()
        self.add_excitation()
        self.add_times()
        self.add_recordings()
        document.add(Heading(2, "What has no counterpart, and why", "absent"))
        document.add(Bullets([
            """The recordings: Kurth's data of 2004 cannot be obtained. The importer takes their layout, so that they can be put in
            the place of the simulated drives.""",
            "Figure 2 also shows particles and measured ranges at one moment; here the estimated path is drawn.",
            "The caption of Figure 3 is missing in the copy at hand; of the five schemes it is the one left, RSR.",
            "The bars of Figure 7 are numbers of Tables 1 and 3.",
            "The ranges of the axes cannot be told from the copy at hand, which has no pictures."]))
        document.add(Heading(2, "All filters", "all"))
        document.add(Text("Differences are bold if their p-value, corrected for the number of filters (Holm), is below 0.01."))
        for problem in study.problems:
            document.add(Heading(3, f'On {problem["name"]}'))
            add_groups(document, study, problem["name"], study.figures,
                       ("cartesian_mean", "cross_track_mean", "along_track_mean", "lost", "coverage95", "converged_after"),
                       level=4)
        add_filters(document, study)
        document.blocks[index:index] = [Heading(3, "Where each table and figure is"),
                                        Bullets([f"[{text}](#{anchor})" for text, anchor in self.found])]

    def add_largest_difference(self):
        """The largest difference among the schemes, for the paper's `the difference is not significant`."""
        found = []
        for problem in self.problems.values():
            for i, first in enumerate(SCHEMES):
                for second in SCHEMES[i + 1:]:
                    difference = self.study.difference(problem, "cartesian_mean", [(1.0, first), (-1.0, second)])
                    if difference is not None and difference.count > 1:
                        found.append((abs(difference.mean), problem, first, second, difference))
        if not found:
            return
        _, problem, first, second, difference = max(found, key=lambda each: each[0])
        self.document.add(Text(f"""The paper itself adds that the difference among the schemes is not significant. No test can
            show that there is none, but its size can be bounded: the largest of all pairs of schemes here is that of `{first}`
            and `{second}` on {problem}, {interval_words(difference, 'cartesian_mean')}, in m, over {difference.count} pairs of
            runs that were not lost."""))

    def add_size_of_errors(self):
        """Why the paper's errors are so much larger."""
        if "circle" not in self.problems:
            return
        rows = self.paper["tables"]["1"]["rows"]
        column = self.paper["columns"].index(REFERENCE)
        cross, along, total = (float(rows[f"{axis}_abs_avg"][column]) for axis in ("XTE", "ATE", "Cartesian"))
        ours = [self.study.estimate(self.problems["circle"], REFERENCE, figure)
                for figure in ("cross_track_mean", "along_track_mean", "cartesian_mean")]
        if None in ours:
            return
        self.document.add(Text(f"""**Why our errors are smaller.** With systematic resampling on the circle the paper has
            {total:.2f} m, we have {ours[2].mean:.2f} m. In the paper the error along the track is {along / cross:.1f} times
            that across it; here it is {ours[1].mean / ours[0].mean:.1f} times. Noise of ranges from beacons all around does
            not make one direction so much worse than the other; a delay between ranges, odometry and truth does, and so does a
            wrong scale of the odometry or of the ranges. The paper says nothing of how its ranges were calibrated or its
            clocks compared. In the simulation there are no delays, and the filter is given the calibration of the ranges. So
            the size of the errors cannot be compared, only what schemes and excitation change about them."""))

    def add_paths(self):
        document, study = self.document, self.study
        document.add(Heading(2, "Paths", "paths"))
        self.heading("Figure 1: the paths and the beacons", "figure-1")
        self.add_path_figure(1, [(DEAD_RECKONING, "dead reckoning", pictures.ORANGE, "-")],
                             "**Figure 1.** True path, dead reckoning and beacons.")
        for number, scheme in PATH_FIGURES:
            self.heading(f"Figure {number}: {scheme} resampling", f"figure-{number}")
            if any(study.path(problem, scheme) is not None for problem in self.problems.values()):
                self.add_path_figure(number, [(scheme, f"estimated, {scheme}", pictures.RED, "-")],
                                     f"""**Figure {number}.** The path that the filter with {scheme} resampling estimates, with the
                                     first seed. The filter is not told where it starts, so the path begins with jumps.""")
            else:
                document.add(Text(f"Figure {number}: no path of `{scheme}` is in this study."))

    def add_path_figure(self, number, filters, caption):
        study, panels = self.study, []
        for word, problem in self.problems.items():
            paths = [(study.path(problem, name), label, colour, line)
                     for name, label, colour, line in [("truth", "true path", pictures.INK, "-"), *filters]]
            paths = [each for each in paths if each[0] is not None]
            if paths:
                panels.append((f"({'ab'[len(panels)]}) {TITLES[word]}", paths,
                               [(study.places(problem, "beacon"), "beacon", "^", pictures.VIOLET)], []))
        if panels:
            self.document.add(Picture(f"mahmoud_figure_{number:02d}", pictures.draw_paths(panels), caption))
        else:
            self.document.add(Text(f"Figure {number}: no paths are in this study."))

    def add_tables(self):
        document = self.document
        document.add(Heading(2, "Errors", "errors"))
        document.add(Text("""XTE is the error across the track, ATE along it; avg, max and std are of the absolute value. **Our
            errors are means over the runs that were not lost**; the number of runs lost stands below, with a test on it: of
            the pairs with the same seed those count in which one scheme is lost and the other is not."""))
        for number, excitation in (("1", ""), ("2", ""), ("3", "gaussian")):
            table = self.paper["tables"][number]
            title = TITLES[table["problem"]] + (", with excitation" if excitation else "")
            self.heading(f"Table {number}: {title}", f"table-{number}")
            if table["problem"] not in self.problems:
                document.add(Text(f"Table {number}: the {TITLES[table['problem']]} is not in this study."))
                continue
            self.errors_table(f"Table {number} of Mahmoud: {table['title']}", self.problems[table["problem"]], excitation,
                              table["rows"])
            document.add(self.claims.at(f"Table {number}"))

    def add_excitation(self):
        document, study = self.document, self.study
        document.add(Heading(2, "Excitation", "excitation"))
        for word, problem in self.problems.items():
            document.add(self.excitation_table(problem, "gaussian"))
        document.add(Text("""The paper adds a Gaussian around each particle and does not say how wide. `roughening` takes its
            width from the range of the particles, `regularized` from their covariance; both become narrow as the filter
            converges. The scan of widths says where the paper's form of excitation helps, if anywhere."""))
        for problem in self.problems.values():
            names = [name for name in study.names(problem) if name.startswith(f"{REFERENCE} ") or name == "shipped"]
            sizes = [name for name in names if " M=" in name]
            others = [name for name in names if name not in sizes]
            document.add(self.beside_systematic(problem, others, f"Excitations, widths and controls, {problem}"),
                         self.beside_systematic(problem, sizes, f"Number of particles, {problem}"))
        self.heading("Figure 7: with and without excitation", "figure-7")
        document.add(self.claims.at("Figure 7"))

    def add_times(self):
        document, times = self.document, self.study.scheme_times
        document.add(Heading(2, "Run time", "time"))
        self.heading("Figure 8: time over the number of particles", "figure-8")
        if not times:
            document.add(Text("Figure 8: no times of schemes are in this study."))
            return
        lines = [(name, sorted(points), [points[size] for size in sorted(points)]) for name, points in times.items()]
        document.add(Picture("mahmoud_figure_08", pictures.draw_scheme_times(lines),
                             """**Figure 8.** Time of one resampling over the number of particles: medians of many, by the clock,
                             of the machine that ran the study. The paper's times are those of a Matlab program."""))
        sizes = sorted({size for points in times.values() for size in points})
        rows = [[str(size), *(f"{points[size]:.2f}" if size in points else "–" for points in times.values())]
                for size in sizes]
        document.add(Table("Time of one resampling (µs)", ["Particles", *times], rows))
        document.add(Text("""A pair in the test is a number of particles, its difference that of the logarithms of the times;
            so the test says whether one scheme is faster over the whole range."""))
        document.add(self.claims.at("Figure 8"))

    def add_recordings(self):
        """The same tables of what is no problem of the paper."""
        others = [each for each in self.study.problems if each["name"] not in self.problems.values()]
        if not others:
            return
        self.document.add(Heading(2, "The same on other drives", "others"))
        for each in others:
            for excitation in ("", "gaussian", "regularized"):
                if any(self.study.has(each["name"], f"{scheme} {excitation}".strip()) for scheme in SCHEMES):
                    words = f"with `{excitation}`" if excitation else "without excitation"
                    self.errors_table(f"{each['name']}, {words}", each["name"], excitation)
            self.document.add(self.excitation_table(each["name"], "gaussian"))
