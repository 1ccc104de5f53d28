#!/usr/bin/python3
"""What is claimed of compensation and resampling, and whether a study bears it out.

    research/claims.py STUDY.json

STUDY.json is written by `study compensation --json`. A claim comes down to differences of one figure between two filters,
paired by drive. It holds if every difference is on the claimed side of zero; chance is ruled out from three standard errors
on. data/claims.json holds the claims.
"""
import json
import math
import statistics
import sys
from pathlib import Path

CLEAR = 3.0  # standard errors: by chance once in 370


def claim_groups():
    """The claims, by the table they stand in."""
    return json.loads((Path(__file__).resolve().parent / "data" / "claims.json").read_text(encoding="utf-8"))


def paired_difference(runs, figure, first, second, times=1.0):
    """Mean and standard error of `figure` of filter `first` minus `times` that of `second`, drive by drive; None if the
    study lacks one of them."""
    values = {name: {run["seed"]: run[figure] for run in runs if run["filter"] == name} for name in (first, second)}
    if not values[first] or not values[second]:
        return None
    differences = [value - times * values[second][seed] for seed, value in values[first].items()]
    return {"mean": statistics.mean(differences),
            "standard_error": statistics.stdev(differences) / math.sqrt(len(differences)), "count": len(differences)}


def standard_errors(difference):
    """How many standard errors the difference is above zero."""
    if difference["standard_error"] > 0.0:
        return difference["mean"] / difference["standard_error"]
    return math.copysign(math.inf, difference["mean"]) if difference["mean"] else 0.0


def differences_of(group, runs):
    """Of every claim of a group the differences that it comes down to."""
    return [{"name": claim["claim"], "differences": [
        paired_difference(runs, each["figure"], each["first"], each["second"], each.get("times", 1.0))
        for each in claim["differences"]]} for claim in claim_groups()[group]]


def verdict(claim, differences):
    """In words: whether the claim holds, and whether chance is ruled out."""
    if any(difference is None for difference in differences):
        return "not in this study"
    distances = [standard_errors(difference) * (-1.0 if each["is"] == "below" else 1.0)
                 for each, difference in zip(claim["differences"], differences)]
    least = [each.get("standard_errors", 0.0) for each in claim["differences"]]
    if all(distance > bound for distance, bound in zip(distances, least)):
        is_clear = all(abs(distance) >= CLEAR for distance in distances)
        return "holds" if is_clear else "holds, but chance is not ruled out"
    is_clear = any(distance <= -CLEAR for distance in distances)
    return "does not hold" if is_clear else "does not hold, but chance is not ruled out"


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    runs = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["runs"]
    for group, claims in claim_groups().items():
        for claim, found in zip(claims, differences_of(group, runs)):
            print(f'{claim["claim"]}: {verdict(claim, found["differences"])}')


if __name__ == "__main__":
    main()
