#!/usr/bin/env python3
"""Whether the trials of FastSLAM and EKF-SLAM in a simulated world measure what they say."""

import types
import unittest

import bags  # which tells where research is
import numpy as np
import rosunit

import study_landmarks as landmarks
from command_line import Error
from study_definition import load_study

LOOPS = {'name': 'loops', 'source': 'indoor_two_loops', 'duration_given': 0.0}
KWAK = load_study('kwak')
FILTERS = {each['name']: each for each in KWAK['filters']}


def experiment(names, problem=None, **settings):
    """The study of Kwak with these of its filters; `settings`: of the last."""
    filters = [dict(FILTERS[name]) for name in names]
    filters[-1]['settings'] = {**filters[-1]['settings'], **settings}
    return landmarks.LandmarkExperiment({'preset': KWAK['preset'], 'settings': {}, 'filters': filters}, problem or LOOPS)


def run(names, seed):
    """{filter: ({figure: value}, {curve: values})}"""
    of = experiment(names)
    figures = of.about()['figures']
    return {name: (dict(zip(figures, trial[1])), dict(zip(landmarks.CURVES, trial[2])))
            for name, trial in zip(names, of.run(seed))}


# What a program of its own found, which was thrown away: the same world, 100 drives, code and random numbers of its own.
PROTOTYPE_FIGURES = ('calls', 'feature_error', 'map_error', 'position_error', 'map_inside', 'pose_inside')
PROTOTYPE = {'NR': (0.0, 0.357, 0.251, 0.468, 0.469, 0.369), 'RSR': (59.3, 0.286, 0.244, 0.349, 0.505, 0.565),
             'multinomial': (58.5, 0.274, 0.242, 0.333, 0.454, 0.516), 'PR': (60.6, 0.275, 0.229, 0.336, 0.538, 0.626),
             'RBR': (72.1, 0.288, 0.198, 0.367, 0.840, 0.880), 'RBR unbiased': (99.2, 0.276, 0.230, 0.345, 0.524, 0.584),
             'compensation': (55.6, 0.228, 0.215, 0.278, 0.384, 0.375), 'compensation 20 %': (71.1, 0.281, 0.208, 0.355, 0.788, 0.837),
             'compensation moment_matched': (54.9, 0.230, 0.216, 0.284, 0.559, 0.404),
             'compensation T_N=1': (180.2, 0.227, 0.226, 0.272, 0.255, 0.078),
             'compensation M=10': (48.0, 0.263, 0.255, 0.321, 0.296, 0.195)}


class Landmarks(unittest.TestCase):
    def test_filters_are_judged_on_the_same_drive(self):
        names = ['NR', 'RSR', 'systematic', 'compensation', 'compensation T_N=1', 'reset']
        runs = run(names, 2)
        of = {name: figures for name, (figures, _) in runs.items()}
        self.assertEqual((of['NR']['calls'], of['NR']['distinct'], of['compensation']['distinct'], of['reset']['distinct']),
                         (0.0, 100.0, 100.0, 100.0))
        self.assertLess(of['RSR']['distinct_end'], 100.0)
        # RSR and systematic resampling take the same particles for the same random number.
        self.assertEqual(of['RSR']['feature_error'], of['systematic']['feature_error'])
        self.assertLess(of['RSR']['map_error_aligned'], of['RSR']['map_error'])
        # Weights that are reset move no particle: eqs. 5 and 6 do not look at the weights.
        self.assertAlmostEqual(of['reset']['feature_error'], of['NR']['feature_error'], delta=1e-9)
        self.assertGreater(of['reset']['calls'], 0.0)
        # With equal weights, as after a compensation, eq. 5 is the error of the mean and the spread about it.
        self.assertGreater(of['compensation T_N=1']['feature_error'], of['compensation T_N=1']['map_error'])
        # Kwak (2008) section 5.2: T_N = 1 means after each observation.
        world = experiment(['RSR'])
        steps, _ = world.world.drive(2, world.odometry)
        self.assertEqual(of['compensation T_N=1']['calls'], sum(bool(step.seen) for step in steps))
        errors = runs['RSR'][1]['feature_error']
        self.assertEqual((len(errors), errors[-1]), (len(steps), of['RSR']['feature_error_end']))
        # By how much it falls where a loop closes: over the scans of a second before and after one.
        falls = errors[:-10].copy()
        for i in range(len(falls)):
            falls[i] = errors[i:i + 5].mean() - errors[i + 5:i + 10].mean()
        self.assertLess(np.abs(falls - of['RSR']['feature_error_drop_at_C']).min(), 1e-12)

    def test_a_loop_closes_where_old_landmarks_come_back(self):
        steps = [types.SimpleNamespace(time=float(t), seen=[(number, 1.0, 0.0)]) for t, number in
                 ((1, 0), (2, 1), (5, 2), (7, 1), (13, 0), (14, 2), (19, 1))]
        # On the way to B, 1 comes back after 5 s; on that to C, 0 after 12 s, and later others after less; on that to D nothing does.
        self.assertEqual(landmarks.closing_times(steps, {'B': 8.0, 'C': 18.5, 'D': 18.8}), {'B': 7.0, 'C': 13.0, 'D': 18.8})

    def test_agrees_with_an_independent_program(self):
        """66 differences, each over its standard error, of 20 drives here and 100 there: one beyond 5 of Student's distribution
        with 19 degrees of freedom has a probability of .005, and the drives are always the same."""
        drives = 20
        of = experiment(list(PROTOTYPE))
        trials = np.array([[figures for _, figures, _ in of.run(seed)] for seed in range(1, drives + 1)])
        for name, theirs, values in zip(PROTOTYPE, PROTOTYPE.values(), trials.transpose(1, 2, 0)):
            for figure, their in zip(PROTOTYPE_FIGURES, theirs):
                ours = values[landmarks.FIGURES.index(figure)]
                error = np.sqrt(ours.var(ddof=1) * (1.0 / drives + 1.0 / 100.0))
                # Figures are rounded to three digits after the point. In their drives a scan more or less may see nothing.
                self.assertAlmostEqual(ours.mean(), their, delta=5.0 * error + (0.5 if figure == 'calls' else 5e-4),
                                       msg=f'{name}, {figure}')

    def test_what_makes_no_sense_names_its_filter(self):
        for name, value in (('nothing', '1'), ('particles', '-1'), ('association/method', 'maximum_likelihood'),
                            ('odometry/slip_per_distance', '0.3')):  # all are given the same odometry
            with self.assertRaisesRegex(Error, 'filter compensation 20 %: '):
                experiment(['RSR', 'compensation 20 %'], **{name: value})
        with self.assertRaisesRegex(Error, 'no landmarks'):
            experiment(['RSR'], dict(LOOPS, source='beacons_circle'))


class Ekf(unittest.TestCase):
    def test_is_the_information_filter_on_the_same_data(self):
        """Moves, finds a landmark and sees it again after another motion: the information form, with derivatives by differences,
        says the same of the whole state."""
        motion, noise = np.array((0.5, 0.1, 0.2)), np.diag((0.1 ** 2, 0.02 ** 2))
        spread = np.array(((0.01, 0.001, 0.002), (0.001, 0.0064, -0.001), (0.002, -0.001, 0.0025)))

        def derivative(function, at):
            steps = 1e-6 * np.eye(len(at))
            return np.column_stack([(function(at + step) - function(at - step)) / 2e-6 for step in steps])

        def seen_from(state):
            x, y = state[3:] - state[:2]
            return np.array((np.hypot(x, y), np.arctan2(y, x) - state[2]))

        def found(drawn):  # from the motion, and what is then seen
            return np.array((*drawn[:3], drawn[0] + drawn[3] * np.cos(drawn[2] + drawn[4]),
                             drawn[1] + drawn[3] * np.sin(drawn[2] + drawn[4])))

        def driven(both):  # the state, and the motion
            c, s = np.cos(both[2]), np.sin(both[2])
            return both[:5] + (c * both[5] - s * both[6], s * both[5] + c * both[6], both[7], 0.0, 0.0)

        def step_with(number, distance, bearing):
            return types.SimpleNamespace(motion=motion, motion_covariance=spread, seen=[(number, distance, bearing)])

        def block(a, b):
            return np.block([[a, np.zeros((len(a), len(b)))], [np.zeros((len(b), len(a))), b]])

        ekf = landmarks.EkfSlam(0.1, 0.0, 0.02)
        ekf.take(step_with(7, 4.0, 0.7))
        drawn = np.array((*motion, 4.0, 0.7))
        state, by_drawn = found(drawn), derivative(found, drawn)
        covariance = by_drawn @ block(spread, noise) @ by_drawn.T
        np.testing.assert_allclose(ekf.state, state, atol=1e-12)
        np.testing.assert_allclose(ekf.covariance, covariance, atol=1e-9)

        both = np.array((*state, *motion))
        state, by_both = driven(both), derivative(driven, both)
        covariance = by_both @ block(covariance, spread) @ by_both.T
        off = np.array((0.05, -0.01))
        ekf.take(step_with(7, *(seen_from(state) + off)))
        by_state = derivative(seen_from, state)
        posterior = np.linalg.inv(np.linalg.inv(covariance) + by_state.T @ np.linalg.inv(noise) @ by_state)
        np.testing.assert_allclose(ekf.state, state + posterior @ by_state.T @ np.linalg.inv(noise) @ off, atol=1e-7)
        np.testing.assert_allclose(ekf.covariance, posterior, atol=1e-7)
        self.assertEqual(list(ekf.landmarks()['id']), [7])
        np.testing.assert_allclose(ekf.landmarks()['covariance'][0], posterior[3:, 3:], atol=1e-7)


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_trials', '__main__')
