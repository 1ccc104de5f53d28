"""Bugs that the tests of the core have to catch: the tables of scripts/check_tests_catch_bugs, by subject.

Each is (name, file, right, wrong, tests). `right` is a fragment of the source that occurs once in the
file, or, should the file have another name by now, once in the core; white space does not count.
`tests`: the test files that should notice.
"""

from . import beacon_mcl, fastslam, memory, odometry_and_health, population, resampling, smoothing, strategy

TABLES = (resampling, population, strategy, odometry_and_health, beacon_mcl, fastslam, memory, smoothing)
BUGS = [bug for table in TABLES for bug in table.BUGS]

# A few from different rooms, each caught by the first of its tests, which is built and run in seconds.
QUICK = (
    "survivors do not keep their own slots",
    "compensation: headings are blended as numbers",
    "excitation: the first copy is moved too",
    "strategy: due when",
    "weights: the last, fewer than eight",
    "odometry: the uncertainty so far",
    "lost detector: the wider Gaussian",
)
# Rooms that these do not need, which take most of the time to build.
QUICK_WITHOUT = ("benchmark", "filters", "simulation", "smoothing")
