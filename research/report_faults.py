"""What filters do, and say, when something goes wrong: the tables of `study faults`, from what study_faults ran."""
import collections
import math

import numpy as np
from scipy import stats

SETTLED = 30.0  # s: the error after a fault is that of the last part of the drive, once the fault is over
STAYS_GOOD = 10.0  # s
LIKELY_LOST = 0.5  # kLikelyLost
JUDGED = 2  # of the first faults, nothing and kidnapping: by them the probability of being lost is judged
# Figures of a run; of several runs the summary has the medians.
MEDIANS = ("before", "during", "largest", "after", "good_after", "alarm_delay")
# Of the text: figure, heading, decimals.
COLUMNS = (("fault", "fault", 0), ("before", "before", 2), ("during", "during", 2), ("largest", "largest", 2),
           ("after", "at the end", 2), ("recovered", "good again", 0), ("good_after", "after (s)", 0), ("alarms", "says so", 0),
           ("alarm_delay", "after (s)", 1), ("all_finite", "all finite", 0), ("wrong_when_healthy", "healthy, yet outside", 4),
           ("right_when_not", "inside, not healthy", 4), ("alarm", "says", 0))


def samples_of(run):
    """[(time, error, probability of being lost, whether the truth is inside or None, whether it says healthy)]"""
    return [(time, math.nan if error is None else error, lost, inside, healthy)
            for time, error, lost, inside, healthy in run["samples"]]


def errors_in(samples, begin, end):
    return [error for time, error, *_ in samples if begin <= time <= end]


def back_after(samples, time, limit):
    """s after `time` from when the error stays below `limit` for ten seconds; None if never."""
    since = math.inf
    for at, error, *_ in samples:
        if at < time:
            continue
        since = math.inf if error > limit else min(since, at)
        if at - since >= STAYS_GOOD:
            return since - time
    return None


def figures_of(run, fault, lost_error):
    """Mean errors before, during and after the fault, and how long it took; None where there is no figure."""
    samples, begin = samples_of(run), fault["begin"]
    during_end = max(fault["end"], begin + SETTLED)

    def mean(first, last):
        errors = errors_in(samples, first, last)
        return sum(errors) / len(errors) if errors else None

    return {"fault": fault["fault"], "before": mean(begin - SETTLED, begin), "during": mean(begin, during_end),
            "largest": max(errors_in(samples, begin, during_end), default=None),
            "after": mean(max(during_end, fault["last"] - SETTLED), fault["last"]),
            "good_after": back_after(samples, begin, lost_error), "alarm_delay": run.get("alarm_delay"),
            "alarm": run.get("alarm"), "all_finite": run["all_finite"]}


def health_of(runs):
    """How often the judgement of health is wrong: shares of the seconds of which that is known."""
    judged = [(inside, healthy) for run in runs for *_, inside, healthy in run["samples"] if inside is not None]
    count = max(1, len(judged))
    return {"healthy": sum(healthy for _, healthy in judged) / count,
            "wrong_when_healthy": sum(healthy and not inside for inside, healthy in judged) / count,
            "right_when_not": sum(inside and not healthy for inside, healthy in judged) / count}


def lost_of(runs, limit):
    """How well the probability of being lost tells seconds with an error above the limit from others: the area under the
    receiver operating characteristic, and the shares of both kinds above one half."""
    samples = [sample for run in runs for sample in samples_of(run)]
    lost, good = ([chance for _, error, chance, *_ in samples if (error > limit) == is_lost] for is_lost in (True, False))
    if not lost or not good:
        return {"area": 0.0, "detected": 0.0, "false_alarms": 0.0, "lost_samples": len(lost), "good_samples": len(good)}
    return {"area": stats.mannwhitneyu(lost, good, alternative="two-sided").statistic / (len(lost) * len(good)),
            "detected": float(np.mean(np.array(lost) > LIKELY_LOST)),
            "false_alarms": float(np.mean(np.array(good) > LIKELY_LOST)), "lost_samples": len(lost), "good_samples": len(good)}


def summary_of(rows, runs):
    """A row for a fault: medians over its runs, how many recovered and said something, and what most of them said."""
    summary = {"fault": rows[0]["fault"], "runs": len(rows), "all_finite": all(row["all_finite"] for row in rows)}
    for figure in MEDIANS:
        values = [row[figure] for row in rows if row[figure] is not None and math.isfinite(row[figure])]
        summary[figure] = float(np.median(values)) if values else None
        if figure in ("good_after", "alarm_delay"):
            summary["recovered" if figure == "good_after" else "alarms"] = len(values)
    alarms = collections.Counter(sorted(row["alarm"] for row in rows if row["alarm"]))
    summary["alarm"] = max(alarms, key=alarms.get) if alarms else ""
    return dict(summary, **health_of(runs))


def report_of(studies):
    """All figures: what it is about, a row for each fault and each run. `studies`: of a seed each, from 1 on."""
    about, limit = studies[0], studies[0]["lost_error"]
    faults = [dict(fault, runs=[study["faults"][i]["run"] for study in studies]) for i, fault in enumerate(about["faults"])]
    report = {"study": "faults", **{name: about[name] for name in ("recording", "lost_error", "is_in_map")}, "seeds": len(studies),
              "health": health_of([run for fault in faults for run in fault["runs"]]),
              "lost": lost_of([run for fault in faults[:JUDGED] for run in fault["runs"]], limit), "summary": [], "runs": []}
    for fault in faults:
        rows = [dict(figures_of(run, fault, limit), seed=seed) for seed, run in enumerate(fault["runs"], 1)]
        report["summary"].append(summary_of(rows, fault["runs"]))
        report["runs"] += [{name: value for name, value in row.items() if value is not None} for row in rows]
    return report


def text_of(report):
    """What it is about, and the summary in aligned columns."""
    def cell(value, decimals):
        if isinstance(value, (bool, str)) or value is None:
            return {None: "–", True: "yes", False: "no"}.get(value, value)
        return f"{value:.{decimals}f}"

    def plain(value):
        return ", ".join(f"{name} = {each}" for name, each in value.items()) if isinstance(value, dict) else str(value)

    rows = [[heading for _, heading, _ in COLUMNS]]
    rows += [[cell(row[figure], decimals) for figure, _, decimals in COLUMNS] for row in report["summary"]]
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(text.ljust(width) if i in (0, len(widths) - 1) else text.rjust(width)
                       for i, (text, width) in enumerate(zip(row, widths))).rstrip() for row in rows]
    about = [f"{name}: {plain(value)}" for name, value in report.items() if name not in ("summary", "runs")]
    return "\n".join([*about, "", *lines, ""])
