"""Differences paired by seed: their p-values and intervals, and the correction for how many are looked at.

All p-values are two-sided.
"""
import math
from collections import namedtuple

from scipy import special

CONFIDENCE = 0.99  # of all intervals of differences
LEVEL = 0.01  # a corrected p-value below it decides

# mean: of the differences. p: two-sided, that the true mean is zero. low, high: the 99 % interval. discordant: for runs that
# are lost or not, (only lost in the first, only lost in the second).
Difference = namedtuple("Difference", "mean standard_error count p low high discordant")


def mean_and_error(values):
    """Mean, standard error and number of the values; the standard error of a single one is zero."""
    values = [float(value) for value in values]
    count = len(values)
    mean = math.fsum(values) / count
    if count < 2:
        return mean, 0.0, count
    variance = math.fsum((value - mean) ** 2 for value in values) / (count - 1)
    error = math.sqrt(variance / count)
    # What rounding leaves of equal values is no scatter.
    return mean, error if error > 1e-13 * max(map(abs, values)) else 0.0, count


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
    if count < 2:
        return Difference(mean, 0.0, count, 1.0, -math.inf, math.inf, None)
    if error == 0.0:  # the same difference with every seed
        return Difference(mean, 0.0, count, 0.0 if mean else 1.0, mean, mean, None)
    p = 2.0 * special.stdtr(count - 1, -abs(mean / error))
    return Difference(mean, error, count, p, *interval(mean, error, count), None)


def mcnemar_p(only_first, only_second):
    """McNemar's test in its exact form: the pairs that differ are heads and tails of a fair coin."""
    count, fewer = only_first + only_second, min(only_first, only_second)
    return min(1.0, 2.0 * special.bdtr(fewer, count, 0.5)) if count else 1.0


def lost_difference(first, second):
    """Difference of the share of runs lost, pairs of 0 or 1 by seed: exact McNemar test; the interval is that of Bonett and
    Price (2012), which has a width even where no pair differs."""
    count = len(first)
    if count == 0:
        return None
    only_first = sum(1 for a, b in zip(first, second) if a and not b)
    only_second = sum(1 for a, b in zip(first, second) if b and not a)
    mean = (only_first - only_second) / count
    error = math.sqrt(max(0.0, (only_first + only_second) / count - mean * mean) / count)
    discordant = (only_first, only_second)
    return Difference(mean, error, count, mcnemar_p(*discordant), *interval(mean, error, count, discordant), discordant)


def holm(p_values):
    """p-values corrected for their number (Holm 1979), in the order given: below a level with the probability of that
    level at most if all hypotheses are true, however they depend on each other."""
    corrected, least = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[index]))
        corrected[index] = least
    return corrected
