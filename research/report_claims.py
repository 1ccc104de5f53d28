"""What the papers claim, and what a study says of it.

data/paper_NAME.yaml holds the claims, in families. A claim is a conjunction of parts; a part is a sum of one figure over filters, paired
by seed, that has to lie below or above a bound. data/page_parts.yaml says how a verdict comes about; that a conjunction is as certain as
its least certain part is the intersection-union test.
"""
from collections import namedtuple

from report_document import Cell, Row
from report_measures import difference_text, distance_text, interval_text, measure, p_text
from report_statistics import LEVEL, holm, interval

HOLDS, DOES_NOT_HOLD, NO_DIFFERENCE, MISSING = "holds", "does not hold", "no difference found", "not in this study"
KINDS = {HOLDS: "holds", DOES_NOT_HOLD: "not", NO_DIFFERENCE: "open", MISSING: "open"}
HEADINGS = ["Claim", "Claimed", "Found ± s.e.", "in s.e.", "Pairs", "p", "p, of the claim, corrected", "Verdict"]

# differences: one for each part (report_statistics.Difference). p: of the claim; corrected: within its family. deciding: the
# part that the verdict rests on, or at which the claim fails.
Finding = namedtuple("Finding", "family claim differences p corrected verdict deciding")


def side(part, difference):
    """1 on the claimed side, -1 on the other, 0 on neither: a difference of zero, or of fewer standard errors than claimed."""
    sign = (difference.mean > 0.0) - (difference.mean < 0.0)
    where = sign if part["is"] == "above" else -sign
    is_short = abs(difference.mean) <= part.get("standard_errors", 0.0) * difference.standard_error
    return 0 if where > 0 and is_short else where


def judged(parts, differences):
    """The p-value of a claim, the part that it comes from, and the verdict if that is below the level."""
    sides = [side(part, difference) for part, difference in zip(parts, differences)]
    if -1 in sides:
        against = [i for i, where in enumerate(sides) if where < 0]
        deciding = min(against, key=lambda i: differences[i].p)
        return min(1.0, len(parts) * differences[deciding].p), deciding, DOES_NOT_HOLD
    if 0 in sides:
        return 1.0, sides.index(0), NO_DIFFERENCE
    deciding = max(range(len(parts)), key=lambda i: differences[i].p)
    return differences[deciding].p, deciding, HOLDS


def findings(study, family, claims, problem):
    """Of every claim of a family what the study says of it."""
    found = []
    for claim in claims:
        differences = [study.difference(part.get("problem", problem), part["figure"], part["terms"], part.get("bound", 0.0))
                       for part in claim["parts"]]
        p, deciding, verdict = (None, None, MISSING) if None in differences else judged(claim["parts"], differences)
        found.append(Finding(family, claim, differences, p, None, verdict, deciding))
    corrected = iter(holm([each.p for each in found if each.p is not None]))
    found = [each if each.p is None else each._replace(corrected=next(corrected)) for each in found]
    return [each._replace(verdict=NO_DIFFERENCE) if each.p is not None and each.corrected >= LEVEL else each for each in found]


def part_text(part):
    """A part in words: `Eq. 5 (m): RSR − NR`."""
    words = []
    for weight, name in part["terms"]:
        sign = ("−" if weight < 0 else "+") if words or weight < 0 else ""
        factor = "" if abs(weight) == 1 else f"{abs(weight):g} × "
        words.append(f"{sign} {factor}`{name}`".strip())
    bound = f' − {part["bound"]:g}' if part.get("bound") else ""
    where = f' ({part["problem"]})' if "problem" in part else ""
    claimed = "<\u00a00" if part["is"] == "below" else ">\u00a00"
    return f'{measure(part["figure"]).heading}{where}: {" ".join(words)}{bound} {claimed}'


def verdict_text(finding):
    """The verdict; where no difference was found, the interval of the part that fails, corrected as the p-value is."""
    if finding.verdict != NO_DIFFERENCE:
        return finding.verdict
    difference, figure = finding.differences[finding.deciding], finding.claim["parts"][finding.deciding]["figure"]
    times = max(1.0, finding.corrected / difference.p) if difference.p > 0.0 else 1.0
    low, high = interval(difference.mean, difference.standard_error, difference.count, difference.discordant, times)
    return f"{finding.verdict}: 99 % interval {interval_text(difference._replace(low=low, high=high), figure)}"


def rows_of(found):
    """Of a table of claims, below HEADINGS: a row for each part, the verdict beside the first."""
    rows = []
    for finding in found:
        for i, (part, difference) in enumerate(zip(finding.claim["parts"], finding.differences)):
            cells = [finding.claim["claim"] if i == 0 else "", part_text(part)]
            if difference is None:
                cells += ["–", "–", "–", "–"]
            else:
                mark = "\u00a0◂" if i == finding.deciding and len(finding.differences) > 1 else ""
                cells += [difference_text(difference, part["figure"]), distance_text(difference), str(difference.count),
                          p_text(difference.p) + mark]
            if i > 0:
                rows.append([*cells, "", ""])
            else:
                corrected = "" if finding.corrected is None else p_text(finding.corrected)
                rows.append(Row([*cells, corrected, Cell(verdict_text(finding), KINDS[finding.verdict])], "rule"))
    return rows
