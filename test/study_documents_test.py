#!/usr/bin/env python3
"""Whether tables and numbers of the documents are those of the studies, and whether a difference would be found."""

import copy
import html
import re
import unittest
from importlib.machinery import SourceFileLoader

import rosunit
from bags import ROOT

import report_measures  # of research, where bags has put it

# Pages that are made from a study's folder, and how many figures of all filters they show at least.
OF_PAPERS = {'kwak': 1000, 'mahmoud': 400}


make_tables, make_data = (SourceFileLoader(name, str(ROOT / 'research' / name)).load_module() for name in ('make_tables', 'make_data'))
DATA = make_tables.load_data()


def text_of(document):
    return (ROOT / document).read_text(encoding='utf-8')


def means_of(page):
    """Every mean that the page of a paper's study shows of all filters: (filter, heading, cell)."""
    for table in re.findall(r'<caption>[^<]*means ± s\.e\.</caption>.*?</table>', page, re.DOTALL):
        headings = re.findall(r'<th[^>]*>(.*?)</th>', table)
        for row in re.findall(r'<tr[^>]*>(<td.*?)</tr>', table):
            cells = [html.unescape(re.sub(r'<[^>]*>', '', cell)) for cell in re.findall(r'<td[^>]*>(.*?)</td>', row)]
            for heading, cell in zip(headings[1:], cells[1:]):
                yield cells[0], heading, cell


class StudyDocuments(unittest.TestCase):
    maxDiff = None

    def test_tables_are_those_of_the_data(self):
        tables = make_tables.tables_of(DATA)
        text = '\n'.join(map(text_of, make_tables.DOCUMENTS))
        self.assertEqual([heading for heading, table in tables.items() if table not in text], [], 'run research/make_tables')

    def test_pages_of_the_papers_show_the_figures_of_the_data(self):
        figures = {measure.heading: (name, measure.factor) for name, measure in report_measures.MEASURES.items()}
        for study, least in OF_PAPERS.items():
            shown = 0
            filters = [of_problem for of_problem in DATA[study].values() if isinstance(of_problem, dict)]
            for name, heading, cell in means_of(text_of(f'doc/studies/{study}.html')):
                number = re.match(r'−?\d+(?:\.(\d+))?', cell)
                if heading not in figures or not number:
                    continue
                figure, factor = figures[heading]
                found = [of_problem[name][figure] for of_problem in filters if figure in of_problem.get(name, {})]
                found = [factor * each['mean'] if isinstance(each, dict) else each for each in found]
                if not found:
                    continue  # by the clock, or of a difference
                value = float(number.group().replace('−', '-'))
                width = 0.5001 * 10.0 ** -len(number.group(1) or '')
                self.assertTrue(any(abs(value - each) <= width + 1e-5 * abs(each) for each in found),
                                f'{study}: {name}, {heading} is {cell}, in the data {found}')
                shown += 1
            self.assertGreater(shown, least, study)

    def test_a_table_of_other_data_is_found(self):
        changed = copy.deepcopy(DATA)
        changed['faults']['plaza2']['summary'][0]['healthy'] -= 0.01
        text = text_of('doc/results.md')
        self.assertTrue(make_tables.with_tables(text, make_tables.tables_of(changed)) != text)

    def test_data_times_of_a_quiet_machine_are_kept(self):
        new = {'rows': [{'name': 'RSR', 'processor_ms': 9.0, 'error': 1.0}, {'name': 'PR', 'processor_ms': 8.0}]}
        make_data.keep_times(new, {'rows': [{'name': 'RSR', 'processor_ms': 2.0, 'error': 5.0}]})
        self.assertEqual(new, {'rows': [{'name': 'RSR', 'processor_ms': 2.0, 'error': 1.0}, {'name': 'PR', 'processor_ms': 8.0}]})

    def test_data_says_what_made_it(self):
        for name in make_data.STUDIES:
            self.assertEqual(DATA[name]['command'], f'research/make_data {name}')
            self.assertTrue(DATA[name]['made_by'])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_documents', StudyDocuments)
