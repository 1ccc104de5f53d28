#!/usr/bin/env python3
"""Whether tables and numbers of the documents are those of the studies, and whether a difference would be found."""

import collections
import copy
import importlib.machinery
import importlib.util
import math
import pathlib
import re
import sys
import tempfile
import unittest

import rosunit

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / 'research'))

import claims  # noqa: E402


def program(name):
    """A program of research/ as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / 'research' / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


make_tables = program('make_tables')
make_data = program('make_data')
DATA = make_tables.load_data()


def text_of(document):
    return (ROOT / document).read_text(encoding='utf-8')


def prose_of(text):
    """A document without tables, code, comments, links and pictures; a number that names its figure is left out."""
    text = make_tables.NUMBER.sub('', text)
    text = re.sub(r'<!-- table: .*?<!-- end -->|<!--.*?-->|`[^`]*`|\]\([^)]*\)|section [\d.]+', '', text, flags=re.DOTALL)
    return '\n'.join(line for line in text.splitlines() if not line.startswith(('|', '#', '    ')))


def runs_of(**errors):
    """Runs with 10 calls and this feature_error, {filter: [of seed 1, of seed 2, ...]}; all other figures are zero."""
    return [collections.defaultdict(float, filter=name, seed=seed, feature_error=value, calls=10.0)
            for name, values in errors.items() for seed, value in enumerate(values, 1)]


class StudyDocuments(unittest.TestCase):
    def test_tables_are_those_of_the_data(self):
        for document in make_tables.DOCUMENTS:
            text = text_of(document)
            self.assertTrue(make_tables.with_tables(text, DATA) == text,
                            f'{document}: a table is not that of doc/data; run research/make_tables')

    def test_tables_for_the_front_pages_have_all_rows(self):
        for name, rows in (('readme', 5), ('results_ranges', 5), ('results_landmarks', 4)):
            made = make_tables.TABLES[name](DATA)
            self.assertEqual(len(made.splitlines()), 2 + rows, made)

    def test_numbers_are_those_of_the_data(self):
        for document in make_tables.DOCUMENTS:
            self.assertEqual(list(make_tables.wrong_numbers(text_of(document), DATA)), [], document)

    def test_every_number_of_a_study_says_which_figure_it_is(self):
        for document in make_tables.DOCUMENTS:
            if 'study_' in document:
                found = re.findall(r'(?<![\d.])\d+\.\d+(?![\d.]*\d)', prose_of(text_of(document)))
                self.assertEqual(found, [], f'{document}: write a comment behind each, see research/make_tables')

    def test_wrong_numbers_and_tables_are_found(self):
        data = {'study': {'summary': [{'filter': 'RSR', 'error': {'mean': 0.25, 'standard_error': 0.01, 'count': 9}}]}}
        good = ('<!-- figures: study/summary -->0.25<!-- RSR/error --> m, 25<!-- 100 * RSR/error --> %, '
                '-0.25<!-- - RSR/error -->, 0.010<!-- RSR/error/standard_error -->, 2<!-- /study/summary/0/error / 0.125 -->')
        self.assertEqual(list(make_tables.wrong_numbers(good, data)), [])
        for wrong in ('0.26<!-- /study/summary/RSR/error -->', '0.251<!-- /study/summary/RSR/error -->',
                      '0.25<!-- /study/summary/PR/error -->', '0.25<!-- /study/summary/RSR/eror -->'):
            self.assertEqual(len(list(make_tables.wrong_numbers(wrong, data))), 1, wrong)
        changed = copy.deepcopy(DATA)
        changed['faults']['plaza2']['summary'][0]['before'] += 0.01
        text = text_of('doc/study_faults.md')
        self.assertTrue(make_tables.with_tables(text, changed) != text)
        with self.assertRaises(ValueError):
            make_tables.with_tables('<!-- table: weather -->\n<!-- end -->', DATA)

    def verdict(self, group, index, runs):
        found = claims.differences_of(group, runs)[index]
        return claims.verdict(claims.claim_groups()[group][index], found['differences']), found['differences']

    def test_claims_hold_by_sign_and_by_standard_errors(self):
        # Differences of -0.12, -0.08, -0.12, -0.08: mean -0.1, standard error 0.02 sqrt(4/3 / 4).
        verdict, found = self.verdict('five_points', 1, runs_of(RSR=[0.3, 0.4, 0.3, 0.4],
                                                               compensation=[0.18, 0.32, 0.18, 0.32]))
        self.assertAlmostEqual(found[0]['mean'], -0.1)
        self.assertAlmostEqual(found[0]['standard_error'], 0.02 / math.sqrt(3.0))
        self.assertAlmostEqual(claims.standard_errors(found[0]), -5.0 * math.sqrt(3.0))
        self.assertEqual(verdict, 'holds')
        # -0.2 and 0.0: one standard error below zero, where more than three are asked for.
        self.assertEqual(self.verdict('five_points', 1, runs_of(RSR=[0.3, 0.3], compensation=[0.1, 0.3]))[0],
                         'does not hold, but chance is not ruled out')
        self.assertEqual(self.verdict('five_points', 1, runs_of(RSR=[0.3, 0.3], compensation=[0.4, 0.41]))[0],
                         'does not hold')

    def test_claims_without_three_standard_errors_chance_is_not_ruled_out(self):
        runs = runs_of(**{'RSR': [0.3, 0.3], 'compensation M=50': [0.1, 0.299]})
        self.assertEqual(self.verdict('five_points', 4, runs)[0], 'holds, but chance is not ruled out')

    def test_claims_of_equal_filters_hold_nothing(self):
        runs = runs_of(**{'RSR': [0.3, 0.4], 'compensation M=50': [0.3, 0.4]})
        self.assertEqual(self.verdict('five_points', 4, runs)[0], 'does not hold, but chance is not ruled out')
        # Calls of 10 are not more than twice 10.
        runs = runs_of(**{'compensation': [0.3, 0.4], 'compensation T_N=1': [0.3, 0.4]})
        verdict, found = self.verdict('five_points', 3, runs)
        self.assertAlmostEqual(found[0]['mean'], -10.0)
        self.assertEqual(verdict, 'does not hold')

    def test_claims_say_what_the_study_lacks(self):
        for i in range(5):
            self.assertEqual(self.verdict('five_points', i, runs_of(RSR=[0.3, 0.4]))[0], 'not in this study')

    def test_data_times_of_a_quiet_machine_are_kept(self):
        new = {'summary': [{'filter': 'RSR', 'processor_ms': 9.0, 'error': 1.0}, {'filter': 'PR', 'processor_ms': 8.0}]}
        make_data.keep_times(new, {'summary': [{'filter': 'RSR', 'processor_ms': 2.0, 'error': 5.0}]})
        self.assertEqual(new, {'summary': [{'filter': 'RSR', 'processor_ms': 2.0, 'error': 1.0},
                                           {'filter': 'PR', 'processor_ms': 8.0}]})

    def test_data_says_what_made_it(self):
        for name in make_data.STUDIES:
            self.assertEqual(DATA[name]['command'], f'research/make_data {name}')
            self.assertTrue(DATA[name]['made_by'])

    def test_pictures_are_drawn(self):
        try:
            import pictures
        except SystemExit as missing:
            self.skipTest(str(missing))
        with tempfile.TemporaryDirectory() as folder:
            pictures.draw_all(DATA, pathlib.Path(folder))
            for name in ('compensation_courses', 'compensation_tradeoff', 'smoothing_scaling'):
                self.assertEqual((pathlib.Path(folder) / f'{name}.png').read_bytes()[1:4], b'PNG')


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_documents', StudyDocuments)
