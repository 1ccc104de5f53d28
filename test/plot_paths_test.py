#!/usr/bin/env python3
"""What the plot of evaluate_bag marks."""

import math
import pathlib
import sys
import unittest

import rosunit

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / 'tools'))

import plot_paths  # noqa: E402


def drive(points):
    return {'x': [x for x, _ in points], 'y': [y for _, y in points], 'time': list(range(len(points)))}


def circle(middle, turns):
    angles = [0.01 * step for step in range(round(200 * math.pi * turns))]
    return [(middle + 10.0 - 10.0 * math.cos(angle), 10.0 * math.sin(angle)) for angle in angles]


class LoopClosures(unittest.TestCase):
    def test_a_loop_is_closed_once_however_often_it_is_driven(self):
        for turns in (1.2, 5.0):
            closures = plot_paths.loop_closures(drive(circle(0.0, turns)))
            self.assertEqual(len(closures), 1)
            self.assertAlmostEqual(closures[0][1], 200 * math.pi, delta=20.0)

    def test_each_loop_is_marked(self):
        # The second begins where the first ends, and lies beyond it.
        points = circle(0.0, 1.5) + circle(20.0, 1.2)
        self.assertEqual(len(plot_paths.loop_closures(drive(points))), 2)

    def test_a_robot_that_stands_or_goes_on_closes_none(self):
        for points in ([], [(1.0, 2.0)] * 50, [(0.1 * step, 0.0) for step in range(500)]):
            self.assertEqual(plot_paths.loop_closures(drive(points)), [])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'plot_paths', LoopClosures)
