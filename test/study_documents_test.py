#!/usr/bin/env python3
"""Whether tables and numbers of the documents are those of the studies, and whether a difference would be found."""

import copy
import html
import unittest
from importlib.machinery import SourceFileLoader

import rosunit
from bags import ROOT

import report_measures  # of research, where bags has put it
from report_study import Estimate

make_tables, make_data = (SourceFileLoader(name, str(ROOT / 'research' / name)).load_module() for name in ('make_tables', 'make_data'))
DATA = make_tables.load_data()


def text_of(document):
    return (ROOT / document).read_text(encoding='utf-8')


class StudyDocuments(unittest.TestCase):
    maxDiff = None

    def test_tables_are_those_of_the_data(self):
        tables = make_tables.tables_of(DATA)
        text = '\n'.join(map(text_of, make_tables.DOCUMENTS))
        self.assertEqual([heading for heading, table in tables.items() if table not in text], [], 'run research/make_tables')

    def test_pages_of_the_papers_show_the_figures_of_the_data(self):
        for study in ('kwak', 'mahmoud'):
            page = html.unescape(text_of(f'doc/studies/{study}.html'))
            figures = [(problem, name, figure, report_measures.with_error(Estimate(**value), figure))
                       for problem, filters in DATA[study].items() if isinstance(filters, dict)
                       for name, of in filters.items() for figure, value in of.items() if isinstance(value, dict)]
            missing = [each for each in figures if f'>{each[-1]}<' not in page]
            # The data have six digits, so the last one on the page may be another.
            self.assertLess(len(missing), 0.005 * len(figures), missing[:20])
            self.assertGreater(len(figures), 500)

    def test_a_table_of_other_data_is_found(self):
        changed = copy.deepcopy(DATA)
        changed['faults']['plaza2']['summary'][0]['healthy'] -= 0.01
        text = text_of('doc/results.md')
        self.assertTrue(make_tables.with_tables(text, make_tables.tables_of(changed)) != text)

    def test_data_says_what_made_it(self):
        for name in make_data.STUDIES:
            self.assertEqual(DATA[name]['command'], f'research/make_data {name}')
            self.assertTrue(DATA[name]['made_by'])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_documents', StudyDocuments)
