#!/usr/bin/env python3
"""Whether `study` runs what a study's file says, keeps it whole, and says in one line what is wrong."""

import csv
import functools
import importlib.util
import io
import json
import math
import shutil
import statistics
import unittest
from xml.etree import ElementTree

import numpy as np
import rosunit
from bags import InFolder, program

import study_calibration  # of research, where bags has put it
import study_faults
import study_relations
from command_line import Error
from evaluation.paths import Path
from study_definition import builtin_studies, load_study

TABLES = ('trials.csv', 'curves.csv')
SMALL = '''study: small
filter: fastslam
preset: kwak2008
settings: {particles: 20}
trials: 5
block: 2
problems:
  - {name: short, world: indoor_two_loops, duration: 4}
  - {name: longer, world: indoor_two_loops, duration: 14}
groups:
  - name: Both
    filters:
      - {name: RSR}
      - {name: compensation, settings: {population/renewal: compensation, population/compensation/ratio: 0.20}}
  - name: Gauss
    filters:
      - {name: EKF-SLAM, estimator: ekf_slam}
'''


study = functools.partial(program, 'study')  # exit code, output and error


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


class Definition(InFolder):
    def given(self, text):
        (self.folder / 'my.yaml').write_text(text)
        return load_study(str(self.folder / 'my.yaml'))

    def misread(self, old, new, *parts):
        self.assertIn(old, SMALL)
        with self.assertRaises(Error) as raised:
            self.given(SMALL.replace(old, new))
        for part in ('my.yaml', *parts):
            self.assertIn(part, str(raised.exception))

    def test_is_what_the_file_says(self):
        text = SMALL.replace('world: indoor_two_loops, duration: 14', 'bag: my.bag, config: /etc/my.yaml')
        small = self.given(text + 'particles: [50, 100]\n')
        self.assertEqual((small['title'], small['trials'], small['reference']), ('small', 5, 'RSR'))
        self.assertEqual([(each['name'], each['group']) for each in small['filters']][1:5], [
            ('RSR M=100', 'Both'), ('compensation M=50', 'Both'), ('compensation M=100', 'Both'), ('EKF-SLAM M=50', 'Gauss')])
        self.assertEqual(small['filters'][3]['settings']['population/compensation/ratio'], '0.20')
        self.assertEqual(small['filters'][3]['settings']['particles'], '100')
        # Files are beside the study.
        self.assertEqual([(each['source'], each['config']) for each in small['problems']],
                         [('indoor_two_loops', ''), (f'{self.folder}/my.bag', '/etc/my.yaml')])

    def test_what_makes_no_sense_is_named(self):
        self.misread('filter: fastslam', 'filter: amcl', 'filter', 'amcl')
        self.misread('trials: 5', 'trails: 5', 'trails', 'trials')
        self.misread('trials: 5', 'trials: many', 'trials', 'many', 'whole number')
        self.misread('trials: 5', 'trials: 0', 'trials is 0')
        self.misread('world: indoor_two_loops, duration: 4', 'world: a.yaml, bag: b.bag', 'either a world or a bag')
        self.misread('name: compensation,', 'name: RSR,', 'two of the name RSR')
        self.misread('name: compensation,', 'name: "a,b",', 'a,b', 'comma')
        self.misread('estimator: ekf_slam', 'estimator: ukf', 'ukf', 'ekf_slam')
        self.misread('trials: 5', 'reference: best', "reference is 'best'")
        self.misread('{name: RSR}', '{name: RSR, settings: [1]}', 'settings', 'map')
        self.misread('duration: 14', 'calibrated: true', 'beacon_mcl')
        self.misread('problems:', 'problems: [', 'cannot be read')
        self.misread('trials: 5', 'trials: 5\nclip', 'cannot be read')
        for name in ('weather', '/none/my.yaml'):
            self.assertRaises(Error, load_study, name)

    def test_those_of_the_papers_can_be_read(self):
        self.assertEqual({name: len(load_study(name)['filters']) >= least
                          for name, least in (('kwak', 90), ('mahmoud', 25))}, dict.fromkeys(builtin_studies(), True))


@unittest.skipUnless(importlib.util.find_spec('pf_resampling_core'), 'needs the Python module')
class Folder(InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.yaml = cls.shared / 'small.yaml'
        cls.yaml.write_text(SMALL)
        cls.whole = cls.shared / 'whole'
        cls.run_in(cls.whole, '--jobs', 1)

    @classmethod
    def run_in(cls, folder, *arguments):
        code, _, error = study(cls.yaml, folder, *arguments)
        assert code == 0, error

    def refused(self, *arguments, code=1, says=''):
        got, _, error = study(*arguments)
        self.assertEqual(got, code, error)
        self.assertRegex(error, r'\Astudy: [^\n]+\n\Z')
        self.assertIn(says, error)

    def assert_same_tables(self, folder):
        for table in TABLES:
            self.assertGreater((self.whole / table).stat().st_size, 50)
            self.assertEqual((folder / table).read_bytes(), (self.whole / table).read_bytes(), table)

    def test_has_a_row_for_every_trial(self):
        rows = rows_of(self.whole / 'trials.csv')
        self.assertEqual(len(rows), 2 * 5 * 3)
        self.assertEqual([rows[29][key] for key in ('problem', 'filter', 'seed', 'calls')], ['longer', 'EKF-SLAM', '5', ''])
        self.assertNotEqual(rows[27]['feature_error'], rows[24]['feature_error'])  # another drive
        # The first problem ends before its loop closes: B is a figure of the second alone.
        self.assertEqual(rows[0]['feature_error_drop_at_B'], '')
        self.assertNotEqual(rows[27]['feature_error_drop_at_B'], '')
        self.assertEqual(len(rows_of(self.whole / 'times.csv')), 30)

    def test_curves_are_means_and_deviations_of_the_trials(self):
        of_rsr = [[row for row in rows_of(self.whole / table) if (row['problem'], row['filter']) == ('short', 'RSR')] for table in TABLES]
        ends, last = [float(row['feature_error_end']) for row in of_rsr[0]], of_rsr[1][-1]
        self.assertEqual(last['feature_error_count'], '5')
        for part, function in ('mean', statistics.mean), ('sd', statistics.stdev):
            self.assertAlmostEqual(float(last[f'feature_error_{part}']), function(ends), delta=1e-7)

    def test_goes_on_where_it_was_interrupted_and_keeps_its_trials(self):
        folder = self.folder / 'resumed'
        self.run_in(folder, '--trials', 2)
        before = {path: path.read_bytes() for path in (folder / 'blocks').iterdir()}
        self.assertEqual(len(before), 2)
        self.run_in(folder)
        self.assert_same_tables(folder)
        self.assertEqual({path: path.read_bytes() for path in before}, before)  # not run again
        (folder / 'blocks/longer-0000003-0000004').unlink()
        self.run_in(folder)
        self.assert_same_tables(folder)

    def test_only_what_differs_is_run_anew(self):
        folder, other = self.folder / 'other', self.folder / 'other.yaml'
        removed = next(line for line in SMALL.splitlines(True) if 'name: compensation,' in line)
        other.write_text(SMALL.replace(removed, '').replace('duration: 4', 'duration: 5'))
        self.assertEqual(study(other, folder)[0], 0)
        times = rows_of(folder / 'times.csv')
        self.run_in(folder)
        self.assert_same_tables(folder)
        longer = [row for row in times if row['problem'] == 'longer']
        self.assertEqual([row for row in rows_of(folder / 'times.csv') if row in longer], longer)
        self.assertEqual(study(other, folder)[0], 0)
        self.assertEqual(rows_of(folder / 'times.csv'), times)

    def test_refuses_a_folder_of_something_else(self):
        full = self.folder / 'full'
        full.mkdir()
        (full / 'mine.txt').write_text('keep')
        self.refused(self.yaml, full, says='neither empty')
        self.refused(self.yaml, full / 'mine.txt', says='neither empty')
        self.refused('report', full, says='no study')

    def test_refuses_what_was_damaged(self):
        folder = self.folder / 'damaged'
        shutil.copytree(self.whole, folder)
        block = folder / 'blocks/short-0000001-0000002'
        block.write_text(block.read_text()[:1000])
        self.refused(self.yaml, folder, says=str(block))

    def test_paths_are_judged_beside_dead_reckoning(self):
        mine = self.folder / 'mine.yaml'
        mine.write_text('''study: my
filter: beacon_mcl
settings: {particles: 50}
trials: 2
problems: [{name: circle, world: beacons_circle, duration: 60, calibrated: true}]
groups:
  - name: All
    filters:
      - {name: mine}
      - {name: blind, calibrated: false, settings: {calibration/estimation: off}}
''')
        folder = self.folder / 'mine'
        code, _, error = study(mine, folder)
        self.assertEqual(code, 0, error)
        rows = rows_of(folder / 'trials.csv')
        self.assertEqual([row['filter'] for row in rows], 2 * ['dead reckoning', 'mine', 'blind'])
        self.assertEqual(rows[0]['lost'], '')
        means = [row['cartesian_mean'] for row in rows]
        self.assertNotIn(means[1], (means[2], means[4]))
        self.refused(mine, self.folder / 'bad', '--bag', self.folder / 'none.bag', says='none.bag')

    def test_misuse_is_one_line(self):
        for arguments in (('weather', self.whole), (self.yaml, self.whole, '--trials', 0), (self.yaml, self.whole, '--jobs', 0)):
            self.refused(*arguments)
        for arguments in ((), ('kwak',), (self.yaml, self.whole, '--speed', '3')):
            self.refused(*arguments, code=2)


class Faults(InFolder):
    """What is done to a recording, and what comes of it."""
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.bag = cls.shared / 'a.bag'
        assert program('simulate_bag', 'beacons_circle', cls.bag, '--duration', 120)[0] == 0
        cls.drive = study_faults.Drive(cls.bag)

    def odometry(self, messages):
        return np.array([study_faults.pose_of(message) for topic, message, _ in messages if topic == '/odom'])

    def test_steps_that_are_not_changed_join_on(self):
        given = self.odometry(self.drive.messages)
        np.testing.assert_allclose(self.odometry(self.drive.with_steps(math.inf, lambda step, _: step)), given, atol=1e-6)
        stands = self.odometry(self.drive.with_steps(self.drive.at(0.5), lambda *_: (0.0, 0.0, 0.0)))
        steps = [np.hypot(*np.diff(path[:, :2], axis=0).T) for path in (given, stands)]
        self.assertAlmostEqual(sum(steps[0] - steps[1]), 12.0, delta=1.0)  # m, at 1 m/s

    def test_nobody_measures_a_kidnapping(self):
        messages = list(study_faults.kidnapped(self.drive, 10.0))
        steps = np.hypot(*np.diff(self.odometry(messages)[:, :2], axis=0).T)
        self.assertLess(steps.max(), 0.3)
        truth = np.array([study_faults.position(message) for topic, message, _ in messages if topic == '/ground_truth'])
        self.assertAlmostEqual(np.hypot(*np.diff(truth, axis=0).T).max(), 10.0, delta=0.3)
        stamps = [message.header.stamp for topic, message, _ in messages if topic in ('/odom', '/ground_truth')]
        self.assertEqual(stamps, sorted(stamps))

    def test_each_fault_is_run_and_judged(self):
        out = self.folder / 'faults.json'
        fast = ('--set', 'particles=300', '--set', 'population/renewal=resampling')
        code, text, error = study('faults', self.bag, '--seeds', 1, '--json', out, *fast)
        self.assertEqual((code, error), (0, ''))
        report = json.loads(out.read_text())
        self.assertEqual(report['recording'], 'a.bag')
        rows = {row['fault']: row for row in report['summary']}
        self.assertEqual(len(rows), len(list(study_faults.faults(self.drive))))
        nothing = rows['nothing']
        self.assertLess(nothing['largest'], 1.0)
        self.assertEqual((nothing['recovered'], nothing['runs']), (1, 1))
        self.assertAlmostEqual(rows['every message comes twice']['mean'], nothing['mean'])
        carried = next(row for name, row in rows.items() if name.startswith('kidnapped'))
        self.assertGreater(carried['largest'], 5.0 * nothing['largest'])
        self.assertLess(carried['healthy'], nothing['healthy'])
        self.assertIn('one message in ten', text)

    def test_poses_follow_what_leaves_the_drive_as_it_is(self):
        code, text, error = study('relations', self.bag, '--seeds', 1)
        self.assertEqual((code, error), (0, ''))
        self.assertEqual(text.count('  yes\n'), len(list(study_relations.relations(self.drive))))

    def test_poses_that_do_not_follow_are_found(self):
        there = Path(np.arange(10.0), np.array([(i, 0.0, 0.0) for i in range(10)]), np.tile(0.01 * np.eye(3), (10, 1, 1)))
        apart, inside = study_relations.compared(there, Path(there.time, there.pose + (0.0, 0.5, 0.0)))
        np.testing.assert_allclose(apart, 8 * [0.5])
        self.assertFalse(inside.any())
        for name, messages, *_ in study_relations.relations(self.drive):
            self.assertEqual(list(messages) == self.drive.messages, name == 'another seed', name)


class Calibration(InFolder):
    def test_beliefs_are_judged_by_the_truth(self):
        values = np.random.default_rng(1).normal(size=1000)
        for scale, offset, expected in ((1.0, 0.0, 'calibrated'), (1.3, 0.0, 'TOO SURE'), (0.7, 0.0, 'too unsure'), (1.0, 0.3, 'biased')):
            row = study_calibration.row_of('landmarks', 'heading', 0.3, scale * values + offset)
            self.assertEqual(row['belief'], expected)
            self.assertEqual(sum(row['histogram']), 1000)

    # Of 58 rows one in a thousand has a p-value that is no chance, of a calibrated filter: after a change that moves all figures,
    # a false alarm in 6 % of all cases at most.
    def test_no_belief_is_too_sure(self):
        picture, out = self.folder / 'calibration.png', self.folder / 'calibration.json'
        code, text, error = study('calibration', '--drives', 10, '--only', 'landmarks', '--only', 'beacons', '--picture', picture,
                                  '--json', out)
        self.assertEqual((code, error), (0, ''))
        self.assertNotIn('TOO SURE', text)
        self.assertNotIn('biased', text)
        rows = json.loads(out.read_text())['summary']
        self.assertEqual({row['number'] for row in rows}, {10})
        self.assertEqual(len(rows), 58)
        self.assertTrue(picture.read_bytes().startswith(b'\x89PNG'))

    # In the first a turn was taken for another, after several radios were taken to be on the wrong side; in the second the noise of
    # ranges fell to a hundredth at once.
    def test_unknown_beacons_do_not_stay_where_a_few_ranges_put_them(self):
        for seed in (317, 395):
            deviations, beyond = study_calibration.drive('unknown beacons', seed, [], self.folder, lambda command: program(*command))
            self.assertLess(max(abs(deviation) for _, share, deviation in deviations if share > 0.1), 4.0, seed)
            self.assertLess(np.mean(beyond), 0.01, seed)

    def test_a_filter_that_forgets_the_drive_is_too_sure(self):
        code, text, error = study('calibration', '--drives', 10, '--only', 'landmarks', '--set', 'preset=fast')
        self.assertEqual((code, error), (0, ''))
        self.assertIn('TOO SURE', text)


SCENARIOS = '''- {name: loops, filter: fastslam, world: indoor_two_loops, settings: {preset: fast}, criteria: [{position_error: below 5}]}
- {name: kidnapped, filter: fastslam, world: indoor_two_loops, fault: kidnapped, criteria: [{after: 30, healthy: above 0.99, finding: none}]}
- {name: far away, filter: fastslam, recording: mrclam nowhere}
'''


class Scenarios(InFolder):
    def setUp(self):
        super().setUp()
        self.file, self.figures = self.folder / 's.yaml', self.folder / 's.csv'
        self.file.write_text(SCENARIOS)

    def test_say_what_does_not_hold(self):
        code, text, _ = study('scenarios', self.file, f'--gtest_output=xml:{self.folder}/s.xml', '__name:=scenarios')
        self.assertEqual(code, 1)
        self.assertRegex(text, 'loops: holds\\nkidnapped: fails\\n  healthy after 30 s is .*, has to be above 0.99\\n'
                         '  findings are .*wheels_slipped; needed: none\\nfar away: skipped, needs --datasets\\n1 hold, 1 fail')
        cases = ElementTree.parse(self.folder / 's.xml').findall('testcase')
        self.assertEqual([[each.tag for each in case] for case in cases], [[], ['failure'], ['skipped']])

    def test_a_figure_that_has_moved_is_named_until_the_table_is_renewed(self):
        def loops(*more):
            return study('scenarios', self.file, '--only', 'loops', '--figures', self.figures, *more)

        self.assertIn('loops: fails\n  is not in the table', loops()[1])
        self.assertEqual(loops('--renew')[0], 0)
        table = self.figures.read_text()
        self.assertEqual(loops()[:2], (0, 'loops: holds\n1 hold, 0 fail\n'))
        drive, digest = table.strip().split(',')[-2:]
        self.figures.write_text(table.replace(digest, 'other'))
        self.assertIn(f'digest was other, is {digest}', loops()[1])
        self.figures.write_text(table.replace(digest, 'other').replace(drive, 'other'))  # of another machine
        self.assertEqual(loops()[0], 0)
        self.file.write_text(SCENARIOS.replace('fast}', 'fast, particles: 900}'))
        code, text, _ = loops()
        self.assertEqual(code, 1)
        self.assertRegex(text, r'position_error was [\d.]+, is [\d.]+ \([+-][\d.e+]+ %\)')
        self.assertEqual(loops('--renew')[0], 0)
        now = self.figures.read_text().strip().split(',')[-2:]
        self.assertEqual(now[0], drive)  # although the filter speaks on /tf, too
        self.assertNotEqual(now[1], digest)

    def test_what_makes_no_sense_is_named(self):
        for right, wrong, says in (('below 5', 'under 5', 'position_error is "under 5", needed: below or above a number'),
                                   ('world: ', 'bag: a.bag, world: ', 'loops needs one of world, bag and recording'),
                                   ('fault: kid', 'fault: cat', 'has to be part of one of: nothing; kidnapped by')):
            self.file.write_text(SCENARIOS.replace(right, wrong, 1))
            code, text, error = study('scenarios', self.file)
            self.assertEqual(code, 1)
            self.assertIn(says, text + error)


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study', '__main__')
