"""What is measured, as data/measures.yaml has it, and numbers as text."""
import math
from collections import namedtuple
from pathlib import Path

import yaml

Measure = namedtuple("Measure", "heading digits definition factor", defaults=(1.0,))
TOO_LARGE = 10000.0  # for a table: as the NEES of copies of one particle


def read_data(name):
    """What data/NAME.yaml holds; None without such a file."""
    path = Path(__file__).resolve().parent / "data" / f"{name}.yaml"
    return yaml.safe_load(path.read_text(encoding="utf-8")) if path.exists() else None


MEASURES = {name: Measure(**of) for name, of in read_data("measures").items()}


def measure(figure):
    return MEASURES.get(figure, Measure(figure, 4, ""))


def digits_for(error, least):
    """As many digits as show the first one of the standard error, two more than asked for at most."""
    if not error > 0.0 or math.isinf(error):
        return least
    return max(least, min(least + 2, -math.floor(math.log10(error))))


def with_error(estimate, figure):
    """mean ± standard error; a dash without values."""
    if estimate is None:
        return "–"
    factor, digits = measure(figure).factor, measure(figure).digits
    mean, error = factor * estimate.mean, factor * estimate.standard_error
    if abs(mean) > TOO_LARGE:
        return f"> {TOO_LARGE:.0f}" if mean > 0.0 else f"< −{TOO_LARGE:.0f}"
    digits = max(digits - 1, 0) if estimate.count > 1 else digits
    digits = digits_for(error, digits)
    text = f"{mean:.{digits}f}".replace("-", "−")
    return text + (f" ±\u00a0{error:.{digits}f}" if estimate.count > 1 else "")


def signed(value, digits):
    """With its sign, a true minus; a zero has none."""
    text = f"{value:+.{digits}f}"
    return text[1:] if not text.strip("+-0.") else text.replace("-", "−")


def difference_digits(difference, figure):
    return digits_for(difference.standard_error * measure(figure).factor, max(measure(figure).digits - 1, 1))


def difference_text(difference, figure):
    """Difference ± standard error, with its sign; of runs lost the pairs that differ: 3 : 0."""
    if difference is None:
        return "–"
    if difference.discordant:
        return distance_text(difference)
    factor, digits = measure(figure).factor, difference_digits(difference, figure)
    if abs(factor * difference.mean) > TOO_LARGE:
        return f"> {TOO_LARGE:.0f}" if difference.mean > 0.0 else f"< −{TOO_LARGE:.0f}"
    return f"{signed(factor * difference.mean, digits)} ±\u00a0{factor * difference.standard_error:.{digits}f}"


def interval_text(difference, figure):
    """The 99 % interval."""
    if math.isinf(difference.low):
        return "none: a single pair"
    factor, digits = measure(figure).factor, difference_digits(difference, figure)
    return f"{signed(factor * difference.low, digits)} to {signed(factor * difference.high, digits)}"


def p_text(p):
    return "<\u00a00.0001" if p < 0.0001 else f"{p:.4f}"


def distance_text(difference):
    """In standard errors; of runs lost the pairs that differ."""
    if difference.discordant:
        return "{} : {}".format(*difference.discordant)
    if difference.standard_error == 0.0:
        return "–" if difference.count < 2 or difference.mean == 0.0 else "all the same"
    distance = difference.mean / difference.standard_error
    return signed(distance, 1)
