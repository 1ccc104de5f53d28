#!/usr/bin/env python3
"""Whether the documents are true: links, pages, commands, options and parameters that they name exist."""

import pathlib
import re
import unittest
import xml.etree.ElementTree as ElementTree

import rosunit

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENTS = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'doc').rglob('*.md')),
             *sorted(ROOT.glob('*/README.md'))]


# "#map/frozen: false", behind its comment
PARAMETERS = {name for file in ('beacon_mcl.yaml', 'fastslam.yaml')
              for name in re.findall(r'^#([a-z][a-z_/0-9]*): ', (ROOT / 'config' / file).read_text(), re.MULTILINE)}
GROUPS = {name.split('/')[0] for name in PARAMETERS if '/' in name}
TESTS = {'.'.join(names) for source in (*ROOT.glob('test/**/*.cpp'), *ROOT.glob('pf_resampling_core/test/**/*.cpp'))
         for names in re.findall(r'^(?:TYPED_)?TEST(?:_[FP])?\((\w+), (\w+)\)', source.read_text(), re.MULTILINE)}
PROGRAM_SOURCES = '\n'.join(source.read_text() for room in ('tools', 'research') for source in sorted(
    (*(ROOT / room).rglob('*.?pp'), *(ROOT / room).rglob('*.py'), *(ROOT / room).glob('[a-z]*[a-z]'))) if source.is_file())


def first_of(*paths):
    return next((ROOT / path for path in paths if (ROOT / path).exists()), None)


def is_parameter(name):
    if name.endswith('/*'):
        return any(known.startswith(name[:-1]) for known in PARAMETERS)
    return name in PARAMETERS


def dead_links(text, folder):
    """Relative links whose file is missing; `folder` is that of the document."""
    links = re.findall(r'\]\(([^)\s]+)\)', text)
    return [link for link in links if not re.match(r'[a-z]+:|#', link)
            and not (folder / link.split('#')[0]).exists()]


def wrong_commands(text):
    """What commands of this package name and is not there."""
    wrong = []
    for program, rest in re.findall(r'rosrun pf_resampling ([a-z_]+)([^\n`]*)', text):
        if not first_of(f'tools/{program}.cpp', f'tools/{program}', f'research/{program}.cpp', f'research/{program}'):
            wrong.append(f'rosrun pf_resampling {program}')
        rest = re.split(r'\s#|&&|\|', rest)[0]
        for option in re.findall(r'\s--([a-z][a-z-]*)', rest):
            if option != 'help' and not re.search(rf'"(--)?{option}[",]', PROGRAM_SOURCES):
                wrong.append(f'rosrun pf_resampling {program} --{option}')
    for name, rest in re.findall(r'(?:roslaunch|rostest)(?: --ros-args)? pf_resampling ([a-z0-9_]+\.(?:launch|test))([^\n`]*)', text):
        file = first_of(f'launch/{name}', f'test/{name}')
        if not file:
            wrong.append(name)
            continue
        known = {argument.get('name') for argument in ElementTree.parse(str(file)).getroot().iter('arg')}
        wrong += [f'{name} {argument}:=' for argument in re.findall(r'\s([a-z][a-z_]*):=', rest.split(' #')[0])
                  if argument not in known]
    targets = set(re.findall(r'^([a-z-]+):', (ROOT / 'Makefile').read_text(), re.MULTILINE))
    wrong += [f'make {name}' for name in re.findall(r'(?:`|^    )make ([a-z-]+)', text, re.MULTILINE) if name not in targets]
    wrong += [name for name in re.findall(r'\b(scripts/[a-z_]+)', text) if not (ROOT / name).exists()]
    return wrong


def wrong_parameters(text):
    """Names like `map/frozen` in code, of a group of parameters that exists, which are no parameters."""
    named = re.findall(r'`([a-z_]+(?:/[a-z_*]+)+)(?::[^`]*)?`', text)
    named += re.findall(r'--set \'?([a-z_/]+)=', text)
    named += re.findall(r'dynparam [sg]et /\w+ ([a-z_/]+)', text)
    return [name for name in named if '/' in name and name.split('/')[0] in GROUPS and not is_parameter(name)]


def wrong_tests(text):
    """Names like `Suite.Test` in code which are no tests."""
    return [name for name in re.findall(r'`([A-Z]\w+\.[A-Z]\w+)`', text) if name not in TESTS]


class Documents(unittest.TestCase):
    maxDiff = None

    def check_each(self, findings_of):
        findings = {str(document.relative_to(ROOT)): findings_of(document) for document in DOCUMENTS}
        self.assertEqual({name: found for name, found in findings.items() if found}, {})

    def test_readme_is_short(self):
        lines = (ROOT / 'README.md').read_text().splitlines()
        self.assertLessEqual(len(lines), 120)

    def test_links_lead_somewhere(self):
        self.check_each(lambda document: dead_links(document.read_text(), document.parent))

    def test_every_page_is_in_the_index(self):
        index = (ROOT / 'README.md').read_text()
        pages = {page.name for page in (ROOT / 'doc').glob('*.md')}
        self.assertEqual({page for page in pages if f'(doc/{page})' not in index}, set())
        self.assertLessEqual(len(pages), 15)

    def test_headers_for_users_are_installed(self):
        core = ROOT / 'pf_resampling_core'
        inner = set(re.search(r'set\(INNER_HEADERS([^)]*)', (core / 'CMakeLists.txt').read_text()).group(1).split())
        self.assertEqual(inner - {path.name for path in core.rglob('*.hpp')}, set())
        rows = re.findall(r'^\| (?:`([a-z_/]*)`)?[^|]*\| (`[^|]*\.hpp`) \|$', (ROOT / 'doc' / 'library.md').read_text(), re.MULTILINE)
        reached, waiting = set(), [core / folder / name for folder, names in rows for name in re.findall(r'`([a-z_]+\.hpp)`', names)]
        self.assertGreater(len(waiting), 25)
        while waiting:
            header = waiting.pop()
            if header not in reached:
                reached.add(header)
                waiting += [ROOT / name for name in re.findall(r'#include "(.*\.hpp)"', header.read_text())]
        self.assertEqual({header.name for header in reached} & inner, set())

    def test_commands_exist(self):
        self.check_each(lambda document: wrong_commands(document.read_text()))

    def test_parameters_exist(self):
        self.check_each(lambda document: wrong_parameters(document.read_text()))

    def test_tests_exist(self):
        self.check_each(lambda document: wrong_tests(document.read_text()))

    def test_mistakes_are_found(self):
        self.assertEqual(wrong_tests('`Weights.AreNone` `MapFile.RefusesWhatIsNoFile` `MapFile.cpp`'), ['Weights.AreNone'])
        self.assertEqual(dead_links('[a](no.md) [b](nodes.md#in) [c](https://x.example)', ROOT / 'doc'), ['no.md'])
        self.assertEqual(wrong_commands('rosrun pf_resampling run_bug a.bag\nrosrun pf_resampling run_bag x --seat 1 --seed 1'),
                         ['rosrun pf_resampling run_bug', 'rosrun pf_resampling run_bag --seat'])
        self.assertEqual(wrong_commands('roslaunch pf_resampling fastslam.launch beg:=a bag:=b\nroslaunch pf_resampling slam.launch'),
                         ['fastslam.launch beg:=', 'slam.launch'])
        self.assertEqual(wrong_commands('`make tests` `make test` scripts/tests scripts/test'), ['make tests', 'scripts/tests'])
        self.assertEqual(wrong_parameters('`map/frosen` `map/frozen` `odometry/*` `map/x*` --set population/renew=1 `a/b`'),
                         ['map/frosen', 'map/x*', 'population/renew'])


if __name__ == '__main__':
    rosunit.unitrun('pf_resampling', 'documents', Documents)
