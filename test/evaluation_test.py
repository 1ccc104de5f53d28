#!/usr/bin/env python3
"""Errors of paths and maps: closed forms, and what does not change when all is turned and shifted."""

import math
import unittest

import bags  # which tells where the tools are
import numpy as np
import rosunit

from command_line import Error
from evaluation import maps, paths, report
from evaluation.paths import Path, evaluate_aligned_path, evaluate_path, interpolate

DIRECTION = 0.6  # rad
FRAME = np.array([100.0, -50.0, 1.0])


def straight_truth(with_heading=True):
    """100 s at 10 Hz along 60 m: a robot that is more than 2 m off is lost."""
    way = np.linspace(0.0, 60.0, 1001)
    heading = np.full(1001, DIRECTION if with_heading else np.nan)
    return Path(0.1 * np.arange(1001), np.column_stack([way * math.cos(DIRECTION), way * math.sin(DIRECTION), heading]))


def displaced(truth, along=0.0, left=0.0, covariance=None):
    """The truth, moved along and to the left of the way."""
    pose = np.column_stack([truth.pose[:, :2], np.full(len(truth), DIRECTION)])
    covariance = np.eye(3) if covariance is None else covariance
    return Path(truth.time, paths.compose(pose, np.array([along, left, 0.0])), np.tile(covariance, (len(truth), 1, 1)))


def curved_truth(with_heading=True):
    way = 0.05 * np.arange(400)
    heading = np.arctan(0.2 * way) if with_heading else np.full(400, np.nan)
    return Path(0.1 * np.arange(400), np.column_stack([7 + way, 2 + 0.1 * way**2, heading]))


class Paths(unittest.TestCase):
    def assert_near(self, found, expected, tolerance=1e-9):
        np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)

    def test_poses_between_stamps_are_on_the_shorter_arc_and_none_is_in_a_gap_or_beyond_the_ends(self):
        path = Path(np.array([0.0, 0.0, 1.0, 4.0]), np.array([[9.0, 0, 0], [1, 2, 3.0], [3, -2, -3.0], [6, 0, 0]]),
                    np.array([np.eye(3), np.eye(3), 2 * np.eye(3), np.eye(3)]))
        is_known, there = interpolate(path, np.array([-0.1, 0.0, 0.5, 1.0, 2.0, 4.0, 4.1]), 2.0)
        self.assertEqual(is_known.tolist(), [False, True, True, True, False, True, False])
        self.assert_near(there.pose[:, :2], [[1, 2], [2, 0], [3, -2], [6, 0]])  # the last of equal stamps
        self.assert_near(abs(there.pose[1, 2]), np.pi)
        self.assert_near(there.covariance[1], 1.5 * np.eye(3))
        self.assertTrue(interpolate(path, np.array([2.0]), 3.0)[0].all())
        self.assertEqual((paths.usual_gap(path), paths.usual_gap(Path(2.0 * np.arange(4), path.pose))), (3.0, 6.0))

    def test_an_offset_is_split_along_and_across_the_way(self):
        for truth in (straight_truth(), straight_truth(with_heading=False)):
            errors = evaluate_path(truth, displaced(truth, 3.0, -4.0), 0.0)
            figures = errors.figures
            self.assert_near([figures[name]['mean'] for name in ('along_track', 'cross_track', 'cartesian')], [3, 4, 5])
            self.assert_near(errors.samples['cross_track'][7], -4.0)  # to the right
            self.assertEqual((figures['cartesian']['count'], figures['uncovered'], figures['lost']), (1001, 0, True))
        self.assertEqual((figures['heading']['count'], figures['coverage95_pose']), (0, None))
        sideways = straight_truth()
        sideways.pose[:, 2] += 0.5 * np.pi
        self.assert_near(evaluate_path(sideways, displaced(sideways, 3.0, 4.0), 0.0).figures['along_track']['mean'], 4.0)

    def test_errors_are_of_absolute_values(self):
        # Mean square 50 / 4; deviations of the absolute values from 3 are -2, -1, 0 and 3.
        found = paths.absolute_errors(np.array([1.0, -2.0, np.nan, 3.0, -6.0]))
        self.assertEqual(found, {'mean': 3.0, 'max': 6.0, 'std': math.sqrt(3.5), 'rms': math.sqrt(12.5), 'median': 2.5,
                                 'count': 4})

    def test_regions_are_those_of_the_covariance(self):
        truth = straight_truth()
        turn = paths.rotation(DIRECTION, 3)
        narrow = turn @ np.diag([1.0, 0.01, 0.01]) @ turn.T  # along the way, and across
        for along, left, inside in ((2.0, 0.0, (1, 1, 1)), (2.7, 0.0, (0, 1, 1)), (0.0, 2.0, (0, 0, 0))):
            errors = evaluate_path(truth, displaced(truth, along, left, narrow), 0.0)
            names = 'coverage95', 'coverage_3sigma', 'coverage95_pose'
            self.assertEqual(tuple(errors.figures[name] for name in names), inside)
        self.assert_near([errors.samples[name + '_sigma'][5] for name in ('along_track', 'cross_track', 'position', 'heading')],
                         [1.0, 0.1, 1.0, 0.1])
        self.assertIsNone(evaluate_path(truth, displaced(truth, 0, 0, 0 * narrow), 0.0).figures['coverage95'])
        singular = np.diag([1.0, 0.0, 0.0])
        self.assertEqual(evaluate_path(truth, displaced(truth, 0, 0, singular), 0.0).figures['coverage95'], 0.0)

    def off_between(self, ranges, clip=0.0, by=(30.0, 0.0, 0.0)):
        estimate = displaced(straight_truth())
        for begin, end in ranges:
            estimate.pose[begin:end] += by
        return evaluate_path(straight_truth(), estimate, clip).figures

    def test_it_has_converged_when_place_and_heading_are_known_for_ten_seconds_or_to_the_end(self):
        for ranges, by, expected in (([], (0, 0, 0), 0.0), ([(0, 50), (131, 150), (600, 650)], (10, 0, 0), 15.0),
                                     ([(0, 950)], (10, 0, 0), 95.0), ([(0, 950), (1000, 1001)], (10, 0, 0), None),
                                     ([(0, 220)], (0, 0, 0.6), 22.0)):
            self.assertEqual(self.off_between(ranges, by=by)['converged_after'], expected if expected is None else
                             straight_truth().time[round(10 * expected)])
        truth = straight_truth()
        self.assert_near(evaluate_path(truth, displaced(truth).part(slice(123, None)), 0.0).figures['converged_after'], 12.3)

    def test_it_is_lost_when_it_is_off_for_more_than_a_tenth_after_the_first_fifth(self):
        for begin, end, clip, lost in ((0, 280, 0.0, False), (0, 281, 0.0, True), (500, 580, 0.0, False),
                                       (500, 581, 0.0, True), (0, 550, 0.5, False), (0, 551, 0.5, True)):
            found = self.off_between([(begin, end)], clip)
            self.assertEqual(found['lost'], lost, (begin, end))
        self.assert_near(found['lost_share'], 51 / 501)
        truth = straight_truth()
        self.assert_near(found['lost_error'], 2.0)
        self.assertTrue(evaluate_path(truth, displaced(truth).part(slice(900)), 0.0).figures['lost'])

    def test_clocks_that_do_not_meet_are_an_error(self):
        truth = straight_truth()
        later = Path(truth.time + 1000, truth.pose)
        for judge in (lambda: evaluate_path(truth, later, 0.0), lambda: evaluate_aligned_path(truth, later, 0.0),
                      lambda: paths.align_at_start(later, truth)):
            self.assertRaises(Error, judge)

    def test_the_shape_alone_counts_after_alignment(self):
        truth = curved_truth()
        elsewhere = paths.moved(truth, FRAME)
        elsewhere.pose[:20] += 5000.0
        alignment, errors = evaluate_aligned_path(truth, elsewhere, 0.1)
        self.assert_near(alignment, paths.inverse(FRAME), 1e-7)
        self.assert_near(errors['max'], 0.0)

    def test_directions_of_travel_follow_a_circle_and_hold_while_the_robot_stands(self):
        angle = np.linspace(0.0, 2 * np.pi, 2001)
        circle = Path(0.1 * np.arange(2001), np.column_stack([5 * np.cos(angle), 5 * np.sin(angle), np.full(2001, np.nan)]))
        off = np.abs(paths.wrapped(paths.track_directions(circle) - angle - 0.5 * np.pi))
        self.assertLess(off[30:-30].max(), 0.004)  # the step of the truth
        self.assertLess(off.max(), 0.09)
        noise = 0.01 * np.array([(i % 3 - 1, i % 5 - 2, np.nan) for i in range(100)])
        ahead = np.column_stack([0.1 * np.arange(100), np.zeros(100), np.full(100, np.nan)])
        stands = Path(0.1 * np.arange(200), np.concatenate([ahead, [10, 0, 0] + noise]))
        self.assertLess(np.abs(paths.track_directions(stands)).max(), 0.1)
        self.assertTrue(np.isnan(paths.track_directions(Path(stands.time, 0 * stands.pose))).all())

    def test_odometry_is_laid_on_the_first_true_pose(self):
        for truth in (curved_truth(), curved_truth(with_heading=False)):
            odometry = paths.moved(curved_truth(), FRAME).part(slice(50, None))
            if np.isnan(truth.pose[0, 2]):
                odometry.pose[:, 2] += 0.7  # it may drive sideways: positions alone decide,
                odometry.pose[200:, 0] += 100.0  # those of the first tenth
            there = paths.moved(odometry, paths.align_at_start(odometry, truth))
            self.assert_near(there.pose[:100, :2], truth.pose[50:150, :2])

    def test_errors_of_the_heading_move_what_sits_on_the_robot(self):
        # The antenna, 2 m ahead and 1 m to the right, is at (1, 2) from the robot: a turn by a radian moves it by (-2, 1).
        robot = Path(np.zeros(1), np.array([[10.0, 20.0, 0.5 * np.pi]]), np.diag([0.1, 0.2, 0.3])[None])
        antenna = paths.path_of_place(robot, np.array([2.0, -1.0, 0.0]))
        self.assert_near(antenna.pose[0], [11.0, 22.0, 0.5 * np.pi])
        self.assert_near(antenna.covariance[0], [[1.3, -0.6, -0.6], [-0.6, 0.5, 0.3], [-0.6, 0.3, 0.3]])

    def test_healthy_is_wrong_where_the_truth_is_outside_three_sigma(self):
        samples = {'time': np.arange(10.0), 'clipped': np.arange(10) == 0, 'normalized_squared': np.tile([1.0, 9.5], 5)}
        errors = paths.PathErrors({'coverage_3sigma': 0.5}, samples)
        found = report.health_of([(1.5, 'healthy', 1), (5.0, 'lost', 2)], errors)
        self.assertEqual(found, {'shares': {'starting': 1 / 9, 'healthy': 3 / 9, 'lost': 5 / 9}, 'wrong_when_healthy': 1 / 3,
                                 'several_places': 5 / 9})
        self.assertIsNone(report.health_of([], errors))


def map_of(ids, places, variance=0.0):
    return maps.Map(np.array(ids), np.array(places, float).reshape(-1, 2), np.tile(variance * np.eye(2), (len(ids), 1, 1)))


TRUE_MAP = map_of([10, 11, 12, 13, 14], [(0, 0), (8, 0), (8, 6), (0, 6), (4, 3)])  # all are 5 m from the last


class Maps(unittest.TestCase):
    def judged(self, estimated, matching='auto', first=(0, 0, 0), truth=TRUE_MAP):
        return maps.evaluate_map(estimated, truth, matching, np.array(first, float))

    def test_a_map_that_is_turned_and_shifted_has_its_shape(self):
        there = maps.moved(TRUE_MAP, np.array([1.0, 0.5, 0.3]))  # the far corner by 3 m, beyond the gate
        raw = math.sqrt(np.mean(np.sum((there.position - TRUE_MAP.position)**2, axis=1)))
        for ids, expected in (([14, 13, 12, 11, 10], 'nearest'), (range(5), 'nearest'), (TRUE_MAP.id, 'id')):
            estimated = map_of([*ids, 77], [*there.position, (50, 50)])
            figures, _, alignment = self.judged(estimated, first=paths.inverse(np.array([1.0, 0.5, 0.3])) + [0.5, 0, 0])
            self.assertEqual([figures[name] for name in ('matched_by', 'landmarks', 'matched', 'false_landmarks', 'missed')],
                             [expected, 6, 5, 1, 0])
            np.testing.assert_allclose((figures['rms'], figures['rms_aligned'], figures['gate']), (raw, 0, 2.5), atol=1e-9)
            np.testing.assert_allclose(paths.inverse(alignment), (1.0, 0.5, 0.3))

    def test_the_nearest_come_first_and_each_once(self):
        estimated = map_of([1, 2], [(1.8, 1.2), (0.1, 0.0)])  # both nearest to (0, 0)
        self.assertEqual(maps.match_by_nearest(estimated, TRUE_MAP, 3.0).tolist(), [[0, 4], [1, 0]])
        self.assertEqual(maps.match_by_nearest(estimated, TRUE_MAP, 2.0).tolist(), [[1, 0]])
        self.assertEqual(maps.match_by_id(map_of([14, 99, 14], np.zeros((3, 2))), TRUE_MAP).tolist(), [[0, 4]])
        self.assertEqual(maps.usual_gate(map_of([1, 2], [(0, 0), (0.2, 0)])), 0.5)

    def test_errors_are_compared_with_covariances(self):
        # Off by 2, 2.4 and 2.5 sigma: 4 and 5.76 are below 5.991, 6.25 is above; with the truth's own variance half of it.
        estimated = map_of([10, 11, 12], [(0.2, 0), (8, 0.24), (8.25, 6)], 0.01)
        for truth, inside, part in ((TRUE_MAP, 2 / 3, 1.0), (map_of(TRUE_MAP.id, TRUE_MAP.position, 0.01), 1.0, 0.5)):
            figures = self.judged(estimated, truth=truth)[0]
            np.testing.assert_allclose((figures['coverage95'], figures['normalized_error']), (inside, part * 16.01 / 3))
        self.assertIsNone(self.judged(TRUE_MAP)[0]['coverage95'])

    def test_without_matches_there_are_no_errors_and_without_truth_nothing_to_judge(self):
        for matching in ('id', 'nearest', 'auto'):
            figures = self.judged(map_of([], []), matching)[0]
            self.assertEqual((figures['missed'], figures['rms']), (5, None))
        self.assertEqual([self.judged(map_of([10], [(1, 0)]), 'id')[0][name] for name in ('rms', 'rms_aligned')], [1.0, None])
        with self.assertRaises(Error):
            self.judged(TRUE_MAP, truth=map_of([], []))


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'evaluation', '__main__')
