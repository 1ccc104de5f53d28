#!/usr/bin/python3
"""Writes the report of a study: one page that loads nothing, DIR/report.html; and for a paper of one's own its pictures,
DIR/figures, as PDF and SVG, and its tables, DIR/tables.tex.

    study_report.py DIR [MEASURE...]

DIR is what `rosrun pf_resampling study NAME DIR` has filled; `rosrun pf_resampling study report DIR` calls this. The studies
`kwak` and `mahmoud` are set beside their papers; of any other one these measures are shown. The same DIR gives the same bytes.
"""
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # nothing is written beside the program, where it is installed

sys.path.append(str(Path(__file__).resolve().parent.parent / "tools"))  # installed, all are in one folder

from new_file import WriteError, end_well_on_signals, write_files  # noqa: E402
from report_document import Document, Drawing  # noqa: E402
from report_kwak import KwakReport  # noqa: E402
from report_mahmoud import MahmoudReport  # noqa: E402
from report_own import OwnReport  # noqa: E402
from report_study import Study, StudyError  # noqa: E402

REPORTS = {"kwak": KwakReport, "mahmoud": MahmoudReport}


def report_of(folder, measures=()):
    """The document of the study in this folder."""
    study = Study(folder)
    document = Document(study.title)
    if study.name in REPORTS:
        REPORTS[study.name](study, document).add_all()
    else:
        OwnReport(study, document, measures).add_all()
    return document


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        print(__doc__.strip())
        sys.exit(0 if sys.argv[1:] in (["-h"], ["--help"]) else 2)
    folder = Path(sys.argv[1])
    end_well_on_signals()
    try:
        document = report_of(folder, sys.argv[2:])
        drawings = [picture for picture in document.pictures() if isinstance(picture.image, Drawing)]
        (folder / "figures").mkdir(exist_ok=True)
        write_files({folder / "report.html": document.html().encode("utf-8"), folder / "tables.tex": document.latex().encode("utf-8"),
                     **{folder / "figures" / f"{each.name}.svg": each.image.svg for each in drawings},
                     **{folder / "figures" / f"{each.name}.pdf": each.image.pdf() for each in drawings}})
    except (StudyError, WriteError) as error:
        sys.exit(str(error))
    except OSError as error:
        sys.exit(f"{error.filename}: {error.strerror}")
    print(folder / "report.html")


if __name__ == "__main__":
    main()
