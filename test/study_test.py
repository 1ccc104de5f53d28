#!/usr/bin/env python3
"""Whether `study` runs what a study's file says, keeps it whole, and says in one line what is wrong."""

import csv
import io
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest

import rosunit

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / 'research'), str(ROOT / 'tools')]

import report_faults  # noqa: E402
from report_study import StudyError  # noqa: E402
from study_definition import builtin_studies, load_study, parse_study  # noqa: E402

TABLES = ('trials.csv', 'curves.csv', 'paths.csv', 'places.csv')
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


def study(*arguments):
    """Exit code, output and error of the program."""
    run = subprocess.run(['rosrun', 'pf_resampling', 'study', *map(str, arguments)], stdout=subprocess.PIPE,
                         stderr=subprocess.PIPE, universal_newlines=True, check=False)
    return run.returncode, run.stdout, run.stderr


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text())))


class Definition(unittest.TestCase):
    def misread(self, old, new, *parts):
        self.assertIn(old, SMALL)
        with self.assertRaises(StudyError) as raised:
            parse_study(SMALL.replace(old, new), 'my.yaml')
        for part in ('my.yaml', *parts):
            self.assertIn(part, str(raised.exception))

    def test_is_what_the_file_says(self):
        small = parse_study(SMALL, 'my.yaml')
        self.assertEqual((small['title'], small['trials'], small['reference']), ('small', 5, 'RSR'))
        self.assertEqual([each['group'] for each in small['filters']], ['Both', 'Both', 'Gauss'])
        self.assertEqual(small['filters'][1]['settings']['population/compensation/ratio'], '0.20')
        self.assertEqual(small['problems'][0]['source'], 'indoor_two_loops')

    def test_files_are_beside_the_study(self):
        given = parse_study(SMALL.replace('world: indoor_two_loops, duration: 4', 'bag: my.bag, config: /etc/my.yaml'), 's', '/s')
        self.assertEqual((given['problems'][0]['source'], given['problems'][0]['config']), ('/s/my.bag', '/etc/my.yaml'))

    def test_every_filter_with_each_number_of_particles(self):
        given = parse_study(SMALL + 'particles: [50, 100]\n', 'my.yaml')
        self.assertEqual([each['name'] for each in given['filters']][:2], ['RSR M=50', 'RSR M=100'])
        self.assertEqual(given['filters'][3]['settings']['particles'], '100')

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
        self.misread('problems:', 'problems: [', 'not YAML')
        self.misread('trials: 5', 'trials: 5\nclip', 'not YAML')
        for name in ('weather', '/none/my.yaml'):
            self.assertRaises(StudyError, load_study, name)

    def test_those_of_the_papers_can_be_read(self):
        self.assertEqual({name: len(load_study(name)['filters']) >= least
                          for name, least in (('kwak', 90), ('mahmoud', 25))}, dict.fromkeys(builtin_studies(), True))


class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.directory)
        cls.yaml = cls.directory / 'small.yaml'
        cls.yaml.write_text(SMALL)
        cls.whole = cls.directory / 'whole'
        cls.run_in(cls.whole, '--jobs', 1)

    @classmethod
    def run_in(cls, folder, *arguments):
        code, out, error = study(cls.yaml, folder, *arguments)
        assert code == 0, error
        return out

    def refused(self, *arguments, code=1, says=''):
        got, _, error = study(*arguments)
        self.assertEqual(got, code, error)
        self.assertRegex(error, r'\Astudy: [^\n]+\n\Z')
        self.assertIn(says, error)

    def assert_same_tables(self, folder):
        for table in TABLES:
            self.assertGreater((self.whole / table).stat().st_size, 50)
            self.assertEqual((folder / table).read_bytes(), (self.whole / table).read_bytes(), table)

    def copy(self, name):
        folder = self.directory / name
        shutil.copytree(self.whole, folder)
        return folder

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
        def of(table):
            return [row for row in rows_of(self.whole / table) if (row['problem'], row['filter']) == ('short', 'RSR')]

        ends = [float(row['feature_error_end']) for row in of('trials.csv')]
        last = of('curves.csv')[-1]
        self.assertEqual(last['feature_error_count'], '5')
        self.assertAlmostEqual(float(last['feature_error_mean']), statistics.mean(ends), delta=1e-7)
        self.assertAlmostEqual(float(last['feature_error_sd']), statistics.stdev(ends), delta=1e-7)

    def test_is_the_same_from_shards_in_any_order(self):
        folder = self.directory / 'shards'
        for shard in (3, 1, 2):
            out = self.run_in(folder, '--shard', f'{shard}/3', '--jobs', 2)
            if shard != 2:
                self.assertIn(f'study merge {folder}', out)
                self.refused('merge', folder, says='blocks are missing')
        self.assertEqual(study('merge', folder)[0], 0)
        self.assert_same_tables(folder)

    def test_goes_on_where_it_was_interrupted_and_keeps_its_trials(self):
        folder = self.directory / 'resumed'
        self.run_in(folder, '--trials', 2)
        before = {path: path.read_bytes() for path in (folder / 'blocks').iterdir()}
        self.assertEqual(len(before), 2)
        self.run_in(folder)
        self.assert_same_tables(folder)
        self.assertEqual({path: path.read_bytes() for path in before}, before)  # not run again
        (folder / 'blocks/longer-0000003-0000004').unlink()
        self.run_in(folder, '--trials', 2)  # no fewer than there were
        self.assert_same_tables(folder)

    def test_any_row_is_run_again_alone(self):
        trials = (self.whole / 'trials.csv').read_text()
        for name in ('RSR', 'compensation', 'EKF-SLAM'):
            code, row, error = study('trial', self.whole, 'longer', name, 4)
            self.assertEqual(code, 0, error)
            self.assertIn('\n' + row, trials)
        self.refused('trial', self.whole, 'longer', 'best', 4, says='known: RSR')
        self.refused('trial', self.whole, 'far', 'RSR', 4, says='known: short, longer')
        self.refused('trial', self.whole, 'longer', 'RSR', 0, code=2)

    def test_refuses_a_folder_of_another_study(self):
        for old, new, says in (('0.20', '0.3', 'filters differ'), ('duration: 4', 'duration: 5', 'problems differ')):
            other = self.directory / 'other.yaml'
            other.write_text(SMALL.replace(old, new))
            self.refused(other, self.whole, says=says)
        full = self.directory / 'full'
        full.mkdir()
        (full / 'mine.txt').write_text('keep')
        self.refused(self.yaml, full, says='neither empty')
        self.refused(self.yaml, full / 'mine.txt', says='neither empty')
        self.refused('merge', full, says='no study')
        self.refused('report', full, says='no study')

    def test_begins_a_folder_that_another_shard_is_beginning(self):
        begun = self.directory / 'begun'
        (begun / 'blocks').mkdir(parents=True)
        (begun / 'study.json.part-1-1').write_text('{')
        self.run_in(begun, '--shard', '6/6')

    def test_refuses_what_was_damaged(self):
        folder = self.copy('damaged')
        block = folder / 'blocks/short-0000001-0000002'
        good = json.loads(block.read_text())
        for text in ('', '{}', block.read_text()[:1000], json.dumps(dict(good, trials=good['trials'][:1])),
                     json.dumps(dict(good, sums=[]))):
            block.write_text(text)
            self.refused('merge', folder, says=str(block))
        about = json.loads((folder / 'study.json').read_text())
        for key, value in (('trials', 0), ('problems', 1), ('format', 2), ('filters', None)):
            (folder / 'study.json').write_text(json.dumps(dict(about, **{key: value})))
            self.refused('merge', folder, says='study.json')

    def test_writes_through_no_link(self):
        folder, elsewhere = self.directory / 'linked', self.directory / 'elsewhere'
        folder.mkdir()
        elsewhere.mkdir()
        os.symlink(elsewhere, folder / 'blocks')
        self.refused(self.yaml, folder, says='symbolic link')
        self.assertEqual(list(elsewhere.iterdir()), [])
        self.assertFalse((folder / 'study.json').exists())

    def test_paths_are_judged_beside_dead_reckoning(self):
        mine = self.directory / 'mine.yaml'
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
        folder = self.directory / 'mine'
        code, _, error = study(mine, folder)
        self.assertEqual(code, 0, error)
        rows = rows_of(folder / 'trials.csv')
        self.assertEqual([row['filter'] for row in rows], 2 * ['dead reckoning', 'mine', 'blind'])
        self.assertEqual(rows[0]['lost'], '')
        means = [row['cartesian_mean'] for row in rows]
        self.assertNotIn(means[1], (means[2], means[4]))
        self.refused(mine, self.directory / 'bad', '--bag', self.directory / 'none.bag', says='none.bag')

    def test_misuse_is_one_line(self):
        for arguments in (('weather', self.whole), (self.yaml, self.whole, '--trials', 0), (self.yaml, self.whole, '--jobs', 0)):
            self.refused(*arguments)
        for arguments in ((), ('kwak',), (self.yaml, self.whole, '--shard', '3/2'), (self.yaml, self.whole, '--shard', 'one'),
                          (self.yaml, self.whole, '--speed', '3')):
            self.refused(*arguments, code=2)
        wrong = self.directory / 'wrong.yaml'
        wrong.write_text(SMALL.replace('particles: 20', 'particels: 20'))
        self.refused(wrong, self.directory / 'wrong', says='did you mean particles?')


def sample(time, error, lost=0.2, inside=True, healthy=True):
    return [time, error, lost, inside, healthy]


class Faults(unittest.TestCase):
    """The figures of `study faults`, by hand."""

    def test_area_under_the_curve(self):
        # Of the four pairs of a lost and a good second, three are in order, one is a tie.
        run = {'samples': [sample(0, 0.1, 0.2), sample(1, 0.1, 0.6), sample(2, 9.0, 0.6), sample(3, 9.0, 0.9)]}
        self.assertEqual(report_faults.lost_of([run], 1.0), {'area': 3.5 / 4.0, 'detected': 1.0, 'false_alarms': 0.5,
                                                             'lost_samples': 2, 'good_samples': 2})
        self.assertEqual(report_faults.lost_of([run], 10.0)['area'], 0.0)

    def test_health_is_wrong_in_both_ways(self):
        # One is healthy and outside, one is not healthy but inside; where the frame is laid nothing can be judged.
        runs = [{'samples': [sample(0, 0.0, inside=None)]}, {'samples': [sample(0, 0.1), sample(1, 5.0, inside=False)]},
                {'samples': [sample(0, 0.1, healthy=False), sample(1, 5.0, inside=False, healthy=False)]}]
        self.assertEqual(report_faults.health_of(runs), {'healthy': 0.5, 'wrong_when_healthy': 0.25, 'right_when_not': 0.25})

    def test_good_again_is_ten_seconds_below_the_limit(self):
        samples = [sample(second, 5.0 if 10 <= second < 20 or second == 25 else 0.1) for second in range(60)]
        self.assertEqual(report_faults.back_after(samples, 10.0, 1.0), 16.0)
        self.assertIsNone(report_faults.back_after(samples, 55.0, 1.0))

    def test_the_summary_has_medians_and_what_most_runs_said(self):
        def run(error, **said):
            return dict({'samples': [sample(second, error) for second in range(200)], 'all_finite': True}, **said)

        runs = [run(0.25), run(0.5, alarm='b', alarm_delay=3.0), run(9.0, alarm='b', alarm_delay=1.0)]
        report = report_faults.report_of([
            {'recording': 'a.bag', 'lost_error': 1.0, 'is_in_map': False,
             'faults': [{'fault': name, 'begin': 50.0, 'end': 60.0, 'last': 199.0, 'run': of_seed}
                        for name in ('nothing', 'kidnapped')]} for of_seed in runs])
        self.assertEqual(report['seeds'], 3)
        row = report['summary'][1]
        self.assertEqual((row['during'], row['recovered'], row['good_after']), (0.5, 2, 0.0))
        self.assertEqual((row['alarms'], row['alarm_delay'], row['alarm']), (2, 2.0, 'b'))
        self.assertEqual(len(report['runs']), 6)
        self.assertIn('kidnapped', report_faults.text_of(report).splitlines()[-1])


class All(Definition, Folder, Faults):
    """Both, for rosunit, which takes one."""


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study', All)
