#!/usr/bin/env python3
"""Whether the report of a study gives the verdicts that made-up trials deserve, and shows every table and figure."""

import csv
import json
import math
import random
import re
import urllib.parse
import xml.etree.ElementTree as ElementTree

import numpy as np
import rosunit
import scipy.stats
from bags import InFolder, program

import report_claims  # of research, where bags has put it
import report_document
import report_measures
import report_statistics
import report_study
from report_page import report_of
from study_definition import load_study

PAPERS = {name: report_measures.read_data(f'paper_{name}') for name in ('kwak', 'mahmoud')}
CURVES = ('feature_error', 'position_error', 'map_error', 'distinct', 'effective_sample_size', 'map_inside', 'calls')
FIGURES = list(report_measures.MEASURES)
KWAK_FIGURES, MAHMOUD_FIGURES = FIGURES[:FIGURES.index('processor_ms')], FIGURES[FIGURES.index('cross_track_mean'):-1]
SCHEMES = ('RSR', 'Stratified', 'Residual', 'Systematic', 'Multinomial')


def scatter(*of_what):
    """A number between -1 and 1 that follows from what it is for, the same on every machine."""
    return random.Random(repr(of_what)).uniform(-1.0, 1.0)


def write_rows(path, header, rows):
    with open(path, 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(header)
        writer.writerows(rows)


def write_study(folder, groups, figures, runs, times=None, **about):
    """A folder as `study` fills it. `runs` are {(problem, filter): {figure: [of seed 1, of seed 2, ...]}}."""
    study = {'format': 1, 'study': 'made', 'title': 'A study made up', 'filter': 'fastslam', 'preset': 'kwak2008', 'settings': {},
             'parameters': {}, 'trials': 3, 'reference': 'RSR', 'figures': list(figures), 'curves': [],
             'problems': [{'name': problem, 'kind': 'world'} for problem in dict.fromkeys(key[0] for key in runs)],
             'filters': [{'name': name, 'group': group, 'settings': settings}
                         for group, filters in groups.items() for name, settings in filters.items()]}
    study.update(about)
    (folder / 'study.json').write_text(json.dumps(study), encoding='utf-8')
    rows = [[problem, name, seed, *(values[figure][seed - 1] if figure in values else '' for figure in figures)]
            for (problem, name), values in runs.items() for seed in range(1, len(next(iter(values.values()))) + 1)]
    write_rows(folder / 'trials.csv', ['problem', 'filter', 'seed', *figures], rows)
    if times:
        write_rows(folder / 'times.csv', ['problem', 'filter', 'seed', 'processor_ms'], times)
    return folder


def write_paper(folder, name, count=12, without=(), problems=None):
    """A study of all filters of a paper but some, with all that a study may have. In range-beacon localization every third run of a
    scheme without excitation is lost."""
    of_beacons = name == 'mahmoud'
    figures = MAHMOUD_FIGURES if of_beacons else KWAK_FIGURES
    problems = problems or (('circle', 'figure8') if of_beacons else ('indoor_two_loops',))
    filters = [each for each in load_study(name)['filters'] if each['name'] not in without]
    names = [each['name'] for each in filters] + ['dead reckoning'] * of_beacons
    trials = {}
    for key in ((problem, each) for problem in problems for each in names):
        trials[key] = {figure: [0.2 + 0.05 * scatter(key, figure) + 0.01 * scatter(seed, figure, key) for seed in range(count)]
                       for figure in figures}
        if of_beacons:
            trials[key]['lost'] = [float(seed % 3 == 0 and key[1] in SCHEMES) for seed in range(count)]
    problem = {'kind': 'world', 'duration': 36.0, 'closures': {'B': 14.0, 'C': 30.0}, 'clip': 0.2, 'lost_error': 1.0}
    write_study(folder, {}, figures, trials, [(*key, seed + 1, 2.0 + 0.3 * scatter(key)) for key in trials for seed in range(count)],
                study=name, title=name, filter='beacon_mcl' if of_beacons else 'fastslam', trials=count, filters=filters, curves=CURVES,
                reference='Systematic' if of_beacons else 'RSR', parameters={'particles': 100, 'population/threshold': 0.75},
                settings={'population/threshold': 0.5}, problems=[dict(problem, name=each) for each in problems])
    write_rows(folder / 'curves.csv', ['problem', 'filter', 'time', *(f'{curve}_{part}' for curve in CURVES for part in (
        'count', 'mean', 'sd'))], [[*key, time, *(count, 0.3 + 0.1 * scatter(key, time), 0.05) * len(CURVES)]
                                   for key in trials for time in range(0, 36, 2)])
    write_rows(folder / 'scheme_times.csv', ['scheme', 'particles', 'microseconds'], [
        [scheme, size, (1.0 + i) * 0.01 * size * (1.0 + 0.01 * scatter(scheme, size))]
        for i, scheme in enumerate(('systematic', 'stratified', 'residual_then_systematic', 'residual', 'multinomial'))
        for size in (100, 1000, 10000, 100000)])
    return folder


def below(first, second):
    return {'figure': 'feature_error', 'terms': [[1, first], [-1, second]], 'is': 'below'}


class StudyReport(InFolder):
    def study(self, **values):
        """A study of one figure, {filter: [of seed 1, of seed 2, ...]}."""
        trials = {('world', name): {'feature_error': list(numbers)} for name, numbers in values.items()}
        write_study(self.folder, {'All': {name: {} for _, name in trials}}, ['feature_error'], trials)
        return report_study.Study(self.folder)

    # ---- statistics

    def test_holm_corrects_as_in_the_textbook(self):
        # Four hypotheses: 4 x 0.005, 3 x 0.01, 2 x 0.03, and 0.04, which may not be below its predecessor.
        for corrected, right in zip(report_statistics.holm([0.01, 0.04, 0.03, 0.005]), (0.03, 0.06, 0.06, 0.02)):
            self.assertAlmostEqual(corrected, right)
        self.assertEqual(report_statistics.holm([0.7, 0.8]), [1.0, 1.0])

    def test_mcnemar_counts_the_pairs_that_differ(self):
        found = report_statistics.lost_difference(np.arange(20) < 8, np.arange(20) == 8)
        self.assertEqual(found.discordant, (8, 1))
        self.assertAlmostEqual(found.mean, 7.0 / 20.0)
        self.assertAlmostEqual(found.p, 2.0 * (1.0 + 9.0) / 512.0)  # 1 and 8 of 9
        # Bonett and Price: (9 - 2) / 22 ± 2.5758 sqrt((11 / 22 - (7 / 22)²) / 22).
        reach = 2.575829 * math.sqrt((0.5 - (7.0 / 22.0) ** 2) / 22.0)
        self.assertAlmostEqual(found.low, 7.0 / 22.0 - reach, places=5)
        nothing = report_statistics.lost_difference(np.zeros(20, bool), np.zeros(20, bool))
        self.assertEqual(nothing.p, 1.0)
        self.assertLess(nothing.low, 0.0)
        self.assertGreater(nothing.high, 0.0)

    def test_paired_difference_is_that_of_pairs(self):
        found = report_statistics.t_difference([-0.12, -0.08, -0.12, -0.08])
        self.assertAlmostEqual(found.mean, -0.1)
        self.assertAlmostEqual(found.standard_error, 0.02 / math.sqrt(3.0))
        self.assertAlmostEqual(found.p, scipy.stats.ttest_1samp([-0.12, -0.08, -0.12, -0.08], 0.0).pvalue, places=12)
        self.assertAlmostEqual(found.high - found.low, 2.0 * 5.841 * found.standard_error, places=4)

    def test_equal_differences_are_certain_and_none_decides_nothing(self):
        self.assertEqual(report_statistics.t_difference([0.1 + 0.2, 0.3, 0.3]).p, 0.0)
        self.assertEqual(report_statistics.t_difference([0.0, 0.0]).p, 1.0)
        self.assertEqual(report_statistics.t_difference([5.0]).p, 1.0)
        self.assertIsNone(report_statistics.t_difference([]))

    # ---- verdicts

    def findings(self, *claims, **values):
        """Of claims, each a list of parts, on such a study."""
        claims = [{'claim': str(number), 'where': 'here', 'parts': parts} for number, parts in enumerate(claims)]
        return report_claims.findings(self.study(**values), 'mine', claims, 'world')

    def test_conjunction_is_as_certain_as_its_least_certain_part(self):
        make = report_statistics.t_difference
        below_, above, against = make([-1.0, -1.1]), make([1.0, 1.3]), make([0.1, 0.2, 0.15])
        parts = [{'is': 'below'}, {'is': 'below'}, {'is': 'above'}]
        self.assertEqual(report_claims.judged(parts, [below_, below_, above]), (above.p, 2, 'holds'))
        # One on the other side counts as many times as there are parts.
        self.assertEqual(report_claims.judged(parts, [below_, against, above]), (min(1.0, 3.0 * against.p), 1, 'does not hold'))
        self.assertEqual(report_claims.judged(parts, [below_, make([0.0, 0.0]), above]), (1.0, 1, 'no difference found'))
        # Nor is one on the claimed side that is fewer standard errors away than is claimed.
        for mean, side in ((-0.31, 1), (-0.29, 0), (0.1, -1)):
            difference = report_statistics.Difference(mean, 0.1, 50, 0.003, 0.0, 0.0, None)
            self.assertEqual(report_claims.side({'is': 'below', 'standard_errors': 3}, difference), side)

    def test_verdict_is_that_of_the_corrected_p(self):
        base = [0.3 + 0.01 * scatter(seed) for seed in range(8)]
        # A mean of 1.417 with deviations of 1 and -1: 1.417 sqrt(7) = 3.75 standard errors, 7 degrees of freedom, p = 0.0072.
        better = [value - 0.01 * (1.417 + (1.0 if seed % 2 else -1.0)) for seed, value in enumerate(base)]
        claim = [below('A', 'B')]
        for part, verdict in (claim, 'holds'), ([below('B', 'A')], 'does not hold'), ([below('A', 'C')], 'not in this study'):
            self.assertEqual(self.findings(part, A=better, B=base)[0].verdict, verdict)
        found = self.findings(claim, claim, A=better, B=base)
        for each in found:
            self.assertAlmostEqual(each.p, 0.0072, places=4)
            self.assertAlmostEqual(each.corrected, 0.0144, delta=0.0001)
            self.assertEqual(each.verdict, 'no difference found')
        # Alone the interval would not hold zero: 3.499 standard errors for 99 %. With the level halved it does.
        self.assertLess(found[0].differences[0].high, 0.0)
        self.assertRegex(report_claims.verdict_text(found[0]), r'99 % interval −0\.0\d+ to \+0\.00\d')

    def test_parts_may_have_a_factor_and_a_bound(self):
        part = {'figure': 'feature_error', 'terms': [[1, 'A'], [-2, 'B']], 'is': 'above'}
        bounded = {'figure': 'feature_error', 'terms': [[1, 'B']], 'is': 'above', 'bound': 10.0}
        found = self.findings([part], [bounded], A=[30.0, 32.5, 31.0], B=[10.0, 11.0, 10.5])
        self.assertAlmostEqual(found[0].differences[0].mean, 93.5 / 3.0 - 2.0 * 10.5)
        self.assertAlmostEqual(found[1].differences[0].mean, 0.5)
        text = report_claims.part_text(part)
        self.assertEqual(text, 'Eq. 5 (m): `A` − 2 × `B` >\u00a00')

    # ---- the study

    def test_step_is_timed_against_no_renewal_with_the_same_seed(self):
        trials = {('world', name): {'calls': [10.0, 20.0]} for name in ('NR', 'RSR', 'RSR M=50')}
        times = [('world', 'NR', 1, 1.0), ('world', 'NR', 2, 2.0), ('world', 'RSR', 1, 1.2), ('world', 'RSR', 2, 2.6),
                 ('world', 'RSR M=50', 1, 0.5), ('world', 'RSR M=50', 2, 0.5)]
        groups = {'All': {'NR': {'population/renewal': 'none'}, 'RSR': {}, 'RSR M=50': {'particles': 50}}}
        study = report_study.Study(write_study(self.folder, groups, ['calls'], trials, times))
        np.testing.assert_allclose(study.values('world', 'RSR', 'step_ms'), (0.2, 0.6))
        np.testing.assert_allclose(study.values('world', 'RSR', 'step_us_per_call'), (20.0, 30.0))
        self.assertEqual(len(study.values('world', 'RSR M=50', 'step_ms')), 0)  # there is no NR with 50 particles

    def test_errors_are_of_the_runs_that_are_not_lost_and_pairs_of_both(self):
        trials = {('circle', 'A'): {'lost': [1.0, 0.0, 0.0], 'cartesian_mean': [9.0, 0.2, 0.4]},
                  ('circle', 'B'): {'lost': [0.0, 0.0, 1.0], 'cartesian_mean': [0.1, 0.1, '']}}
        study = report_study.Study(write_study(self.folder, {'All': {'A': {}, 'B': {}}}, ['lost', 'cartesian_mean'], trials))
        self.assertAlmostEqual(study.estimate('circle', 'A', 'cartesian_mean').mean, 0.3)
        difference = study.difference('circle', 'cartesian_mean', [(1.0, 'A'), (-1.0, 'B')])
        self.assertEqual(difference.count, 1)
        self.assertAlmostEqual(difference.mean, 0.1)
        self.assertEqual(study.difference('circle', 'lost', [(1.0, 'A'), (-1.0, 'B')]).discordant, (1, 1))

    def test_damaged_study_is_named_in_one_line(self):
        for name, content in (('study.json', '{"format": 2}'), ('study.json', '[' * 100000), ('study.json', '{"format": 1, "study": "a"}'),
                              ('trials.csv', 'problem\nhall\n'), ('trials.csv', 'problem,filter,seed,mine\nhall,RSR,1,x\n')):
            write_study(self.folder, {'Mine': {'A': {}}}, ['mine'], {('hall', 'A'): {'mine': [1.0, 2.0, 4.0]}})
            (self.folder / name).write_text(content, encoding='utf-8')
            with self.subTest(content=content[-300:]), self.assertRaisesRegex(report_study.Error, rf'\A{self.folder / name}: .*\Z'):
                report_study.Study(self.folder)

    # ---- the page

    def check_page(self, document):
        """That a page is well-formed, loads nothing, and leads nowhere but to itself."""
        text = document.html()
        parts = list(ElementTree.fromstring(text).iter())
        self.assertEqual({part.tag for part in parts} & {'script', 'link', 'iframe', 'object'}, set())
        ids = [part.get('id') for part in parts if part.get('id')]
        self.assertEqual(len(ids), len(set(ids)))
        for part in parts:
            if part.tag == 'a':
                self.assertIn(part.get('href').lstrip('#'), ids)
        self.assertNotRegex(re.sub(r'src="data:image/svg[^"]*"', '', text), r'https?://|@import|url\(')
        for source in (part.get(name) for part in parts for name in ('src', 'srcset', 'data') if part.get(name)):
            svg = urllib.parse.unquote(source.split(',', 1)[1])
            ElementTree.fromstring(svg)
            self.assertEqual(re.findall(r'href="(?!#)[^"]*"|url\((?!#)', svg), [])
            self.assertNotIn('<metadata', svg)
        return text.replace('\u00a0', ' ')

    def assert_has(self, part, text):
        """That a page has this part; a page is too long for a message."""
        self.assertTrue(part in text, part)

    def report(self, measures=()):
        return report_of(report_study.Study(self.folder), measures)

    def check_page_of_paper(self, name):
        """That it has all tables with their printed numbers, all figures and claims; returns the page."""
        document = self.report()
        text = self.check_page(document)
        wanted = [of['name'] for block in PAPERS[name]['page'] if isinstance(block, dict) for of in block.values() if 'name' in of]
        self.assertEqual(list(document.pictures), wanted)
        for number, table in PAPERS[name]['tables'].items():
            self.assert_has(f'Table {number} of the paper', text)
            for row in table['rows'].values():
                for value in row:
                    self.assertRegex(text, f'class="paper">{re.escape(value)}(</td>| )')
        for claims in PAPERS[name]['claims'].values():
            for claim in claims:
                self.assert_has(report_document.to_html(claim['claim']), text)
        self.assertFalse('not in this study' in text.lower())
        return text

    def test_pages_of_papers_have_all_tables_and_figures(self):
        write_paper(self.folder, 'kwak')
        text = self.check_page_of_paper('kwak')
        for part in ('2296 / 50 = 45.92', 'particles: 100</code>', 'population/threshold: 0.5</code>', 'split at the median weight'):
            self.assert_has(part, text)
        for control in ('reset', 'RSR tempered 0.3', 'redraw', 'EKF-SLAM'):
            self.assertGreaterEqual(text.count(f'<code>{control}</code>'), 4, control)
        write_paper(self.folder, 'mahmoud')
        text = self.check_page_of_paper('mahmoud')
        # A share of the time, not 0.2 s; lost, of seeds 0, 3, 6, 9; with excitation and without.
        for part in ('the first 20 % of the time are left out of the errors', '<td>4 of 12</td>', '<td>0 : 4</td>'):
            self.assert_has(part, text)
        # Systematic resampling is the fastest by construction.
        table = text[text.index('3. Systematic resampling takes'):]
        self.assert_has('>holds</td>', table[:table.index('</tr>')])
        # Bytes do not depend on when and where a page is made.
        self.assertEqual(program('study', 'report', self.folder)[0], 0)
        self.assertTrue((self.folder / 'report.html').read_text(encoding='utf-8').replace('\u00a0', ' ') == text)

    def test_what_a_study_lacks_is_a_dash(self):
        for name, without, problems in (('mahmoud', ['RSR gaussian', 'shipped'], ['circle', 'plaza2']), ('kwak', ['PR', 'reset'], ())):
            write_paper(self.folder, name, without=without, problems=problems)
            (self.folder / 'curves.csv').unlink()
            self.assertRegex(self.check_page(self.report()), 'not in this study</td>')

    def test_page_of_any_other_study(self):
        """Two filters with two numbers of particles each, in a hall and on a bag, which have a measure each."""
        filters = [{'name': f'{name} M={size}', 'of': name, 'particles': size, 'group': 'Mine', 'settings': {}}
                   for name in ('RSR', 'A') for size in (10, 100)]
        values = {each['name']: [each['particles'] + (each['of'] == 'A') + seed for seed in range(4)] for each in filters}
        measured = {'hall': 'feature_error', 'bag': 'mine'}
        trials = {(problem, name): {measured[problem]: values[name]} for problem in measured for name in values}
        write_study(self.folder, {}, ['feature_error', 'mine'], trials, filters=filters, curves=['feature_error'])
        write_rows(self.folder / 'curves.csv', ['problem', 'filter', 'time', *(f'feature_error_{of}' for of in ('count', 'mean', 'sd'))],
                   [['hall', name, time, 3, 0.1 * time, 0.02] for name in values for time in range(5)])
        document = self.report()
        self.assertEqual(list(document.pictures), ['feature_error_1_1', 'curve_feature_error_1_1', 'mine_2_1'])
        text = self.check_page(document)
        self.assertRegex(text, '(?s)>On hall</h2>.*>11.500 ± 0.645</td>.*>On bag</h2>.*>11.500 ± 0.645</td>')
        # The reference is that of as many particles.
        self.assertEqual((text.count('+1.000 ± 0.000'), text.count('+90')), (4, 0))
        # Cut to two digits, as coordinates are, letters were a third too small.
        self.assert_has('scale(0.015625)', document.pictures['mine_2_1'])
        self.assertEqual(list(self.report(['mine']).pictures), ['mine_2_1'])
        with self.assertRaisesRegex(report_study.Error, 'mein is no measure of this study; known: feature_error, mine'):
            self.report(['mein'])

    def test_text_is_escaped(self):
        document = report_document.Document('a < b')
        document.add_rows('rows', ['x'], [['`p < 0.1 | q` & <b>']])
        self.assert_has('<title>a &lt; b</title>', document.html())
        self.assert_has('<code>p &lt; 0.1 | q</code> &amp; &lt;b&gt;', document.html())


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_report', StudyReport)
