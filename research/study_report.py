#!/usr/bin/python3
"""Writes the report of a study: one page that loads nothing, DIR/report.html.

    study_report.py DIR

DIR is what `rosrun pf_resampling study NAME DIR` has filled; `rosrun pf_resampling study report DIR` calls this. The studies
`kwak` and `mahmoud` are set beside their papers; of any other one all figures are shown. The same DIR gives the same bytes.
"""
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # nothing is written beside the program, where it is installed

sys.path.append(str(Path(__file__).resolve().parent.parent / "tools"))  # installed, all are in one folder

from new_file import WriteError, end_well_on_signals, write_files  # noqa: E402
from report_document import Document, Heading, Picture, Text  # noqa: E402
from report_kwak import KwakReport  # noqa: E402
from report_mahmoud import MahmoudReport  # noqa: E402
from report_measures import measure  # noqa: E402
from report_parts import add_filters, add_groups, add_reading, add_settings  # noqa: E402
from report_statistics import LEVEL  # noqa: E402
from report_study import Study, StudyError  # noqa: E402

REPORTS = {"kwak": KwakReport, "mahmoud": MahmoudReport}


class GeneralReport:
    """All figures of a study, its differences to the reference and its curves."""

    def __init__(self, study, document):
        self.study, self.document = study, document

    def add_all(self):
        document, study = self.document, self.study
        add_settings(document, study)
        add_reading(document, study)
        for problem in study.problems:
            document.add(Heading(2, f'On {problem["name"]}', f'problem-{study.problems.index(problem) + 1}'))
            document.add(Text(f"""Differences to `{study.reference}` are paired by seed. They are bold if their p-value, corrected
                for the number of filters (Holm), is below {LEVEL:g}."""))
            add_groups(document, study, problem["name"], study.figures, study.figures)
            self.add_curves(problem)
        add_filters(document, study)

    def add_curves(self, problem):
        import report_pictures as pictures
        name, number = problem["name"], self.study.problems.index(problem) + 1
        colours = (pictures.INK, pictures.RED, pictures.BLUE, pictures.GREEN, pictures.ORANGE, pictures.VIOLET, pictures.GREY)
        for figure in self.study.curves:
            for group_number, (group, names) in enumerate(self.study.groups(), 1):
                names = [each for each in names if self.study.curve(name, each, figure) is not None]
                for first in range(0, len(names), len(colours)):
                    curves = [(self.study.curve(name, each, figure), each, colour, "-")
                              for each, colour in zip(names[first:first + len(colours)], colours)]
                    svg = pictures.draw_curves([("", curves)], measure(figure).heading, problem.get("closures", {}))
                    self.document.add(Picture(
                        f"curve_{number}_{figure}_{group_number}_{first // len(colours) + 1}", svg,
                        f"**{measure(figure).heading}, {group}.** Means over the trials; bands: ± one standard deviation."))


def report_of(folder):
    """The document of the study in this folder."""
    study = Study(folder)
    document = Document(study.title)
    REPORTS.get(study.name, GeneralReport)(study, document).add_all()
    return document


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__.strip())
        sys.exit(0 if sys.argv[1:] in (["-h"], ["--help"]) else 2)
    folder = Path(sys.argv[1])
    end_well_on_signals()
    try:
        write_files({folder / "report.html": report_of(folder).html().encode("utf-8")})
    except (StudyError, WriteError) as error:
        sys.exit(str(error))
    except OSError as error:
        sys.exit(f"{error.filename}: {error.strerror}")
    print(folder / "report.html")


if __name__ == "__main__":
    main()
