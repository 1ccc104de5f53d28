"""Differences paired by seed: their p-values and intervals, and the correction for how many are looked at.

All p-values are two-sided.
"""
import math
from collections import namedtuple

import numpy as np
from scipy import special

CONFIDENCE = 0.99  # of all intervals of differences
LEVEL = 0.01  # a corrected p-value below it decides

# mean: of the differences. p: two-sided, that the true mean is zero. low, high: the 99 % interval. discordant: for runs that
# are lost or not, (only lost in the first, only lost in the second).
Difference = namedtuple("Difference", "mean standard_error count p low high discordant")


def mean_and_error(values):
    """Mean, standard error and number of the values; the standard error of a single one is zero."""
    mean, count = float(np.mean(values)), len(values)
    error = float(np.std(values, ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    # What rounding leaves of equal values is no scatter.
    return mean, error if error > 1e-13 * np.abs(values).max() else 0.0, count


def interval(mean, error, count, discordant=None, times=1.0):
    """The 99 % interval of a mean difference. `times` is what its p-value is multiplied with when it is corrected for the
    number of claims: it widens the interval likewise, so that zero is inside if the corrected p-value is above 0.01."""
    upper = 1.0 - 0.5 * (1.0 - CONFIDENCE) / times
    if discordant is None:
        reach = special.stdtrit(count - 1, upper) * error if count > 1 else math.inf
        return mean - reach, mean + reach
    more, less = ((pairs + 1.0) / (count + 2.0) for pairs in discordant)
    reach = special.ndtri(upper) * math.sqrt((more + less - (more - less) ** 2) / (count + 2.0))
    return max(-1.0, more - less - reach), min(1.0, more - less + reach)


def t_difference(differences):
    """Of differences, one for each seed: Student's t test that their mean is zero. None without any; one alone decides
    nothing."""
    if len(differences) == 0:
        return None
    mean, error, count = mean_and_error(differences)
    if error > 0.0:
        p = 2.0 * special.stdtr(count - 1, -abs(mean / error))
    else:  # a single one, or the same difference with every seed
        p = 0.0 if mean and count > 1 else 1.0
    return Difference(mean, error, count, p, *interval(mean, error, count), None)


def lost_difference(first, second):
    """Difference of the share of runs lost, pairs of whether they are by seed: McNemar's test in its exact form, in which the pairs
    that differ are heads and tails of a fair coin; the interval is that of Bonett and Price (2012), which has a width even where
    no pair differs."""
    count = len(first)
    if count == 0:
        return None
    discordant = int(np.sum(first & ~second)), int(np.sum(second & ~first))
    mean, share = (discordant[0] - discordant[1]) / count, sum(discordant) / count
    error = math.sqrt(max(0.0, share - mean * mean) / count)
    p = min(1.0, 2.0 * special.bdtr(min(discordant), sum(discordant), 0.5)) if any(discordant) else 1.0
    return Difference(mean, error, count, p, *interval(mean, error, count, discordant), discordant)


def holm(p_values):
    """p-values corrected for their number (Holm 1979), in the order given: below a level with the probability of that
    level at most if all hypotheses are true, however they depend on each other."""
    order, corrected = np.argsort(p_values), np.empty(len(p_values))
    corrected[order] = np.maximum.accumulate(np.sort(p_values) * np.arange(len(p_values), 0, -1))
    return np.minimum(1.0, corrected).tolist()
