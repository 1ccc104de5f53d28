#!/usr/bin/env python3
"""Whether tables and numbers of the documents are those of the studies, and whether a difference would be found."""

import copy
import importlib.machinery
import importlib.util
import pathlib
import re
import sys
import tempfile
import unittest

import rosunit

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / 'research'))

import report_measures  # noqa: E402

# Pages that are made from a study's folder: its data, and how many figures they show of all filters at least.
OF_PAPERS = {'doc/study_kwak.md': ('kwak', 1000), 'doc/study_mahmoud.md': ('mahmoud', 400)}


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


def means_of(document):
    """Every mean that the page of a paper's study shows of all filters: (problem or '', filter, heading, cell)."""
    for table in re.findall(r'means ± s\.e\.\*\*\n\n((?:\|.*\n)+)', text_of(document)):
        lines = [[cell.strip() for cell in line.strip('|').split('|')] for line in table.splitlines()]
        for row in lines[2:]:
            for heading, cell in zip(lines[0][1:], row[1:]):
                yield row[0].strip('`*'), heading, cell


class StudyDocuments(unittest.TestCase):
    def test_tables_are_those_of_the_data(self):
        for document in make_tables.DOCUMENTS:
            text = text_of(document)
            self.assertTrue(make_tables.with_tables(text, DATA) == text,
                            f'{document}: a table is not that of doc/data; run research/make_tables')

    def test_tables_for_the_front_pages_have_all_rows(self):
        for name, rows in (('readme', 5), ('results_ranges', 5), ('results_landmarks', 6)):
            made = make_tables.TABLES[name](DATA)
            self.assertEqual(len(made.splitlines()), 2 + rows, made)

    def test_numbers_are_those_of_the_data(self):
        for document in make_tables.DOCUMENTS:
            self.assertEqual(list(make_tables.wrong_numbers(text_of(document), DATA)), [], document)

    def test_every_number_of_a_study_says_which_figure_it_is(self):
        for document in make_tables.DOCUMENTS:
            # The pages of the papers' studies are made as a whole; the next test is about them.
            if 'study_' in document and document not in OF_PAPERS:
                found = re.findall(r'(?<![\d.])\d+\.\d+(?![\d.]*\d)', prose_of(text_of(document)))
                self.assertEqual(found, [], f'{document}: write a comment behind each, see research/make_tables')

    def test_pages_of_the_papers_show_the_figures_of_the_data(self):
        figures = {measure.heading: (name, measure.factor) for name, measure in report_measures.MEASURES.items()}
        for document, (study, least) in OF_PAPERS.items():
            shown = 0
            filters = [of_problem for of_problem in DATA[study].values() if isinstance(of_problem, dict)]
            for name, heading, cell in means_of(document):
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
                                f'{document}: {name}, {heading} is {cell}, in the data {found}')
                shown += 1
            self.assertGreater(shown, least, document)

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
            self.assertEqual((pathlib.Path(folder) / 'smoothing_scaling.png').read_bytes()[1:4], b'PNG')


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'study_documents', StudyDocuments)
