#!/usr/bin/env python3
"""The library as a Python module: what arrives in it and comes back, and what it refuses."""

import pathlib
import tempfile
import unittest

import numpy as np
import rosunit

import pf_resampling_core as pf

WEIGHTS = np.random.default_rng(1).exponential(size=200)
LANDMARKS = np.array([(6.0 * np.sin(a), 5.0 - 6.0 * np.cos(a)) for a in 2.0 * np.pi * np.arange(8) / 8.0])
BEACONS = {1: (-2.0, -2.0), 2: (9.0, -1.0), 3: (3.0, 12.0), 4: (-8.0, 6.0)}


def drive_circle(filter_, look, steps):
    """A circle about (0, 5) in 0.25 m steps: `look(filter, position, heading)` updates. The last pose."""
    x, y, heading = 0.0, 0.0, 0.0
    for _ in range(steps):
        x, y, heading = x + 0.25 * np.cos(heading + 0.025), y + 0.25 * np.sin(heading + 0.025), heading + 0.05
        filter_.predict((0.25 * np.cos(0.025), 0.25 * np.sin(0.025), 0.05), 0.5)
        look(filter_, np.array((x, y)), heading)
    return x, y


def see_landmarks(slam, position, heading):
    offsets = LANDMARKS - position
    ids = np.flatnonzero(np.hypot(*offsets.T) < 7.0)
    angles = np.arctan2(offsets[ids, 1], offsets[ids, 0]) - heading
    slam.update(np.hypot(*offsets[ids].T), (angles + np.pi) % (2.0 * np.pi) - np.pi, ids)


def hear_beacons(mcl, position, _):
    places = np.array([BEACONS[number] for number in sorted(BEACONS)])
    mcl.update(np.hypot(*(places - position).T), sorted(BEACONS))


def map_slam(steps=120, **more):
    slam = pf.FastSlam({'preset': 'fast', 'particles': 100}, seed=3, **more)
    drive_circle(slam, see_landmarks, steps)
    return slam


class Resampling(unittest.TestCase):
    def test_every_scheme_gives_as_many_copies_as_it_says(self):
        for scheme in pf.resampling_schemes():
            resampler = pf.Resampler(scheme=scheme)
            drawn = resampler.resample(WEIGHTS, pf.RandomStream(7))
            self.assertTrue((np.bincount(drawn.ancestors, minlength=200) == drawn.counts).all(), scheme)
            self.assertAlmostEqual(np.exp(drawn.log_weights).sum(), 1.0)
            again = resampler.resample(3.0 * WEIGHTS, pf.RandomStream(7))
            self.assertTrue((again.counts == drawn.counts).all(), scheme)

    def test_parameters_size_and_layout_arrive(self):
        resampler = pf.Resampler(scheme='rank_based', rank_max=1.0)  # all ranks alike
        self.assertTrue((resampler.resample(WEIGHTS, pf.RandomStream(1)).counts == 1).all())
        columns = np.stack([WEIGHTS, np.ones(200)], axis=1)
        for weights in (list(WEIGHTS), columns[:, 0]):  # neither is an array as the library has it
            drawn = pf.Resampler().resample(weights, pf.RandomStream(1), 1000)
            self.assertEqual(drawn.ancestors.size, 1000)
            self.assertLess(np.abs(drawn.counts - 1000 * WEIGHTS / WEIGHTS.sum()).max(), 1.0)

    def test_what_was_drawn_stays(self):
        resampler = pf.Resampler()
        drawn = resampler.resample(WEIGHTS, pf.RandomStream(1))
        before = drawn.counts.copy()
        resampler.resample(WEIGHTS[::-1], pf.RandomStream(2))
        del resampler
        self.assertTrue((drawn.counts == before).all())

    def test_weights_are_normalized_in_place(self):
        log_weights = np.log([1.0, 2.0, 5.0])
        weights = pf.normalize(log_weights)
        np.testing.assert_allclose(weights, [0.125, 0.25, 0.625])
        np.testing.assert_allclose(log_weights, np.log(weights))
        self.assertAlmostEqual(pf.effective_sample_size(weights), 1.0 / 0.46875)

    def test_compensation_and_excitation_change_poses_in_place(self):
        x, y, heading = (np.array([0.0, 4.0]) for _ in range(3))
        compensation = pf.compensate([0.25, 0.75], pf.RandomStream(1))
        np.testing.assert_allclose(compensation.pairs, [[0, 1, 0.25]])
        compensation.blend_poses(x, y, heading)
        np.testing.assert_allclose(x, [3.0, 4.0])
        pf.excite([0.5, 0.5], pf.RandomStream(1), x, y, heading, method='gaussian', sigma_position=0.0)
        np.testing.assert_allclose(x, [3.0, 4.0])
        self.assertNotEqual(heading[1], 4.0)

    def test_a_scheme_in_python_serves_a_filter_like_one_of_the_library(self):
        seen = []

        def systematic(weights, size, stream):
            seen.append(weights)
            return pf.Resampler().resample(weights, stream, size).counts

        ours, theirs = map_slam(own_scheme=systematic), map_slam()
        self.assertGreater(len(seen), 0)
        self.assertEqual(len(seen), theirs.status()['renewals'])
        for name, values in theirs.particles().items():
            self.assertTrue((ours.particles()[name] == values).all(), name)


class Filters(unittest.TestCase):
    def test_fastslam_makes_the_map(self):
        slam = map_slam()
        self.assertLess(np.abs(slam.estimate()[0][:2] - slam.path()[-1, :2]).max(), 1e-9)
        landmarks = slam.landmarks()
        self.assertEqual(sorted(landmarks['id']), list(range(8)))
        self.assertLess(np.hypot(*(landmarks['mean'] - LANDMARKS[landmarks['id']]).T).max(), 0.5)
        weight = slam.particles()['weight']
        np.testing.assert_allclose(weight @ slam.landmarks_of_particles()[3],
                                   landmarks['mean'][list(landmarks['id']).index(3)])

    def test_sensor_and_variances_of_a_scan_arrive(self):
        slam = pf.FastSlam()
        slam.update([2.0], [0.0], [7], sensor=(1.0, 0.0, 0.0), range_variances=[0.25], bearing_variances=[0.01])
        landmarks = slam.landmarks()  # straight ahead
        np.testing.assert_allclose(landmarks['mean'], [[3.0, 0.0]])
        np.testing.assert_allclose(landmarks['covariance'], [[[0.25, 0.0], [0.0, 2.0 ** 2 * 0.01]]], atol=1e-12)

    def test_antenna_and_variances_of_ranges_arrive(self):
        def hear_by_antenna(mcl, position, heading):
            turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
            places = np.array(list(BEACONS.values()))
            mcl.update(np.hypot(*(places - position - turn @ (1.0, 0.5)).T), list(BEACONS), [0.01] * 4, (1.0, 0.5, 0.0))

        mcl = pf.BeaconMcl(BEACONS, {'preset': 'fast', 'noise_estimation/ranges': False}, seed=1)
        mcl.set_pose((0.0, 0.0, 0.0), np.diag((0.01, 0.01, 0.001)))
        end = drive_circle(mcl, hear_by_antenna, 40)
        mean, covariance = mcl.estimate()
        self.assertLess(np.hypot(*(mean[:2] - end)), 0.2)
        self.assertLess(covariance[0, 0], 0.01)  # as no range of the usual 1 m could make it

    def test_a_saved_map_goes_on_to_the_bit(self):
        slam = map_slam()
        with tempfile.TemporaryDirectory() as folder:
            path = str(pathlib.Path(folder) / 'circle.map')
            slam.save_map(path)
            resumed = pf.FastSlam({'preset': 'fast', 'particles': 100}, seed=3)
            resumed.load_map(path)
        for each in (slam, resumed):
            drive_circle(each, see_landmarks, 10)
        self.assertTrue((slam.particles()['x'] == resumed.particles()['x']).all())

    def test_the_memory_smooths_and_finds_the_noise(self):
        slam = pf.FastSlam({'particles': 100}, seed=3)
        self.assertFalse(slam.smooth())
        drive_circle(slam, see_landmarks, 300)
        self.assertTrue(slam.smooth())
        self.assertLess(slam.noise()['motion'], 0.5)  # the odometry has none
        self.assertFalse(map_slam().smooth())  # which has no memory

    def test_beacon_mcl_finds_the_robot_and_the_beacon_that_is_elsewhere(self):
        listed = dict(BEACONS)
        listed[3] = (3.0, 15.0)
        mcl = pf.BeaconMcl(listed, {'particles': 500}, seed=1)
        with self.assertRaisesRegex(pf.Error, 'no population yet'):
            mcl.estimate()
        end = drive_circle(mcl, hear_beacons, 240)
        self.assertLess(np.hypot(*(mcl.estimate()[0][:2] - end)), 0.5)
        radios = {radio['id']: radio for radio in mcl.radios()}
        self.assertEqual([number for number in radios if not radios[number]['as_listed']], [3])
        self.assertLess(np.hypot(*(radios[3]['places'][0][0] - BEACONS[3])), 0.5)

    def test_parameters_are_read_and_changed(self):
        mcl = pf.BeaconMcl(BEACONS, {'preset': 'fast', 'recovery/enabled': False})
        self.assertEqual(mcl.parameters()['population/renewal'], 'resampling')
        self.assertEqual(mcl.parameters()['recovery/enabled'], 'false')
        mcl.set_parameters({'population/renewal': 'compensation', 'recovery/enabled': True})
        self.assertEqual(mcl.parameters()['population/renewal'], 'compensation')
        self.assertEqual(mcl.parameters()['recovery/enabled'], 'true')


class Errors(unittest.TestCase):
    def test_what_cannot_be_used_is_refused_in_the_words_of_the_library(self):
        stream = pf.RandomStream(1)
        three = [np.zeros(3) for _ in range(3)]
        for call, words in (
                (lambda: pf.Resampler(scheme='magic'), 'population/resampling/scheme is .magic., has to be one of'),
                (lambda: pf.Resampler(rank_maxi=1.0), 'did you mean population/resampling/rank_max'),
                (lambda: pf.Resampler().resample([1.0, -1.0], stream), 'weight 1 of 2 is -1'),
                (lambda: pf.FastSlam({'preset': 'magic'}), 'unknown preset .magic.'),
                (lambda: pf.BeaconMcl({1: (2.0,)}), r'give \(x, y\) or \(x, y, z\)'),
                (lambda: pf.BeaconMcl(BEACONS).update([1.0], [9]), '9'),
                (lambda: pf.BeaconMcl(BEACONS).update([1.0], [1], variances=[]), 'give arrays of one size'),
                (lambda: pf.FastSlam().update([1.0, 2.0], [0.0]), 'give arrays of one size'),
                (lambda: pf.FastSlam().predict((np.inf, 0.0, 0.0), 1.0), 'give finite numbers'),
                (lambda: pf.FastSlam().predict((0.0, 0.0, 0.0), -1.0), 'no negative time'),
                (lambda: pf.excite([0.5, 0.5], stream, *three), 'give arrays of one size')):
            with self.assertRaisesRegex(pf.Error, words):
                call()
        self.assertTrue(issubclass(pf.Error, ValueError))

    def test_odometry_is_taken_once(self):
        slam = pf.FastSlam({'preset': 'fast', 'odometry/heading_per_time': 0.0}, own_scheme=lambda *_: 1 / 0)
        slam.predict((1.0, 0.0, 0.0), 1.0)
        with self.assertRaises(pf.Error):
            slam.update([-1.0], [0.0], [1])  # refused: the robot has not moved yet
        slam.update([], [], [])
        self.assertAlmostEqual(slam.estimate()[0][0], 1.0, delta=0.1)
        slam.set_parameters({'population/schedule': 'always'})
        slam.predict((1.0, 0.0, 0.0), 1.0)
        with self.assertRaises(ZeroDivisionError):  # after it has moved
            slam.update([2.0], [0.0], [1])
        slam.update([], [], [])
        self.assertAlmostEqual(slam.estimate()[0][0], 2.0, delta=0.2)

    def test_a_scheme_that_gives_other_counts_is_refused(self):
        for scheme, words in ((lambda w, n, s: [n], 'counts of the scheme'), (lambda w, n, s: np.zeros(len(w)), 'sum')):
            with self.assertRaisesRegex(pf.Error, words):
                pf.Resampler(own_scheme=scheme).resample(WEIGHTS, pf.RandomStream(1))


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'python_module', '__main__')
