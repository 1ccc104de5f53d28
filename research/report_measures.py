"""What is measured: heading and unit, digits, definition; and numbers as text."""
import math
from collections import namedtuple

Measure = namedtuple("Measure", "heading digits factor definition")
TOO_LARGE = 10000.0  # for a table: as the NEES of copies of one particle

OF_FASTSLAM = {
    "calls": Measure("Calls", 1, 1.0, "How often the particles were renewed (resampled or compensated) in a drive."),
    "effective_sample_size": Measure("N_eff", 2, 1.0, "Effective sample size 1 / Σ w², Kwak's eq. 4, before the renewal; "
                                     "mean over the scans that saw landmarks."),
    "distinct": Measure("Distinct", 2, 1.0, "Ancestors that survive since the first landmark, after the renewal; mean "
                        "over the scans that saw landmarks. Compensation rejects none, so the count says nothing of it."),
    "distinct_end": Measure("Distinct, end", 2, 1.0, "The same at the end of the drive."),
    "feature_error": Measure("Eq. 5 (m)", 4, 1.0, "RMS feature error, Kwak's eq. 5, mean over the drive: over all particles, "
                             "unweighted. It holds the error of the map and the spread of the particles: whatever pulls the "
                             "particles together lowers it, whether or not the map gets better."),
    "feature_error_end": Measure("Eq. 5, end (m)", 4, 1.0, "The same at the end."),
    "feature_error_drop_at_B": Measure("Fall of eq. 5 at B (m)", 4, 1.0, "Mean of eq. 5 over the second before the inner "
                                       "loop closes, minus its mean over the second from then on. A loop closes with the first "
                                       "scan that sees a landmark again that was out of view for long."),
    "feature_error_drop_at_C": Measure("Fall of eq. 5 at C (m)", 4, 1.0, "The same for the outer loop."),
    "position_error_drop_at_B": Measure("Fall of eq. 6 at B (m)", 4, 1.0, "The same of eq. 6."),
    "position_error_drop_at_C": Measure("Fall of eq. 6 at C (m)", 4, 1.0, "The same of eq. 6 for the outer loop."),
    "effective_sample_size_drop_at_B": Measure("Fall of N_eff at B", 2, 1.0, "The same of N_eff."),
    "effective_sample_size_drop_at_C": Measure("Fall of N_eff at C", 2, 1.0, "The same of N_eff for the outer loop."),
    "position_error": Measure("Eq. 6 (m)", 4, 1.0, "RMS position error, Kwak's eq. 6, mean over the drive: over all "
                              "particles, unweighted."),
    "map_error": Measure("Map (m)", 4, 1.0, "RMS error of the weighted-mean map, mean over the drive: what a user gets."),
    "map_error_aligned": Measure("Map, aligned (m)", 4, 1.0, "The same after the best turn and shift of the whole map."),
    "map_error_end": Measure("Map, end (m)", 4, 1.0, "Error of the weighted-mean map at the end."),
    "pose_error": Measure("Pose (m)", 4, 1.0, "Distance of the weighted-mean position from the true one, mean over the "
                          "drive."),
    "map_inside": Measure("Landmarks inside", 3, 1.0, "Share of the landmarks inside their 95 % ellipse. Of an honest filter "
                          "it is 0.95."),
    "pose_inside": Measure("Poses inside", 3, 1.0, "The same of the positions."),
    "map_nees": Measure("NEES, landmarks", 2, 1.0, "Squared error of the landmarks in units of the filter's own "
                        "covariance, median over the drive; of an honest filter 1.39."),
    "pose_nees": Measure("NEES, poses", 2, 1.0, "The same of the positions."),
    "processor_ms": Measure("Processor (ms)", 2, 1.0, "Processor time of the whole filter over a drive."),
    "step_ms": Measure("Step, per drive (ms)", 3, 1.0, "Processor time of the filter minus that of the same filter without "
                       "renewal, with the same seed: what renewing the particles costs over a drive."),
    "step_us_per_call": Measure("Step, per call (µs)", 2, 1.0, "The same divided by the number of calls.")}

PARTS = (("mean", "avg", "mean"), ("max", "max", "maximum"), ("std", "std", "standard deviation"))
AXES = (("cross_track", "XTE", "Cross-track error, orthogonal to the true heading"),
        ("along_track", "ATE", "Along-track error, in the direction of the true heading"),
        ("cartesian", "Cartesian", "Distance to the true position"))
OF_BEACONS = {
    **{f"{axis}_{part}": Measure(f"{name}_abs_{short} (m)", 4, 1.0, f"{title}: {words} of its absolute value, of the runs "
                                 f"that were not lost.")
       for axis, name, title in AXES for part, short, words in PARTS},
    **{f"heading_{part}": Measure(f"Heading_abs_{short} (°)", 2, 180.0 / math.pi, f"Error of the heading: {words} of its "
                                  f"absolute value, of the runs that were not lost.") for part, short, words in PARTS},
    "lost": Measure("Runs lost", 3, 1.0, "Share of the runs whose error is above a bound for more than a tenth of the time "
                    "that counts."),
    "lost_share": Measure("Error above the bound (% of the time)", 1, 100.0, "Share of the time that counts with an error "
                          "above that bound, of all runs."),
    "coverage95": Measure("Inside own 95 % region (%)", 1, 100.0, "Share of the time that the truth is inside the 95 % region "
                          "of the filter, of the runs that were not lost."),
    "converged_after": Measure("Converged after (s)", 1, 1.0, "Time from the start until the error first is below the bound."),
    "log_time": Measure("Time of one resampling (logarithm)", 3, 1.0, "Logarithm of the median time of one resampling; the "
                        "pairs are numbers of particles.")}
MEASURES = {**OF_FASTSLAM, **OF_BEACONS}


def measure(figure):
    return MEASURES.get(figure, Measure(figure, 4, 1.0, ""))


def digits_for(error, least):
    """As many digits as show the first one of the standard error, two more than asked for at most."""
    if not error > 0.0 or math.isinf(error):
        return least
    return max(least, min(least + 2, -math.floor(math.log10(error))))


def with_error(estimate, figure):
    """mean ± standard error; a dash without values."""
    if estimate is None:
        return "–"
    _, digits, factor, _ = measure(figure)
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
    """Difference ± standard error, with its sign."""
    if difference is None:
        return "–"
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
