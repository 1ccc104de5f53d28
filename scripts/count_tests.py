#!/usr/bin/env python3
"""Counts the JUnit results below a folder, names what failed, ends with 'N passed, N failed'."""

import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def outcome(case):
    """'failed', 'skipped' or 'passed' of one <testcase>, and the first line of the reason."""
    for tag in ('failure', 'error'):
        found = case.find(tag)
        if found is not None:
            reason = (found.get('message') or found.text or '').strip()
            return 'failed', reason
    skipped = case.find('skipped')
    if skipped is not None:
        return 'skipped', (skipped.get('message') or skipped.text or '').strip()
    if case.get('result') == 'skipped' or case.get('status') == 'notrun':
        return 'skipped', ''
    return 'passed', ''


def count(folder):
    """Outcomes of all results below `folder`: {'passed': [...], 'failed': [...], 'skipped': [...]}."""
    outcomes = {'passed': [], 'failed': [], 'skipped': []}
    for path in sorted(pathlib.Path(folder).rglob('*.xml')):
        try:
            root = ElementTree.parse(str(path)).getroot()
        except ElementTree.ParseError as error:
            outcomes['failed'].append((path.name, 'unreadable results: %s' % error))
            continue
        cases = list(root.iter('testcase'))
        if not cases:
            # A program that registers no test has nothing to show; that is a mistake.
            outcomes['failed'].append((path.name, 'no test in it'))
        for case in cases:
            result, reason = outcome(case)
            name = '%s: %s.%s' % (path.stem, case.get('classname', ''), case.get('name', ''))
            outcomes[result].append((name, reason))
    return outcomes


def show(title, cases):
    for name, reason in cases:
        lines = reason.splitlines()[:12]
        print('%s %s' % (title, name))
        for line in lines:
            print('    ' + line)


def main():
    if len(sys.argv) != 2:
        print('usage: count_tests.py FOLDER', file=sys.stderr)
        return 2
    outcomes = count(sys.argv[1])
    show('SKIPPED', outcomes['skipped'])
    show('FAILED', outcomes['failed'])
    passed, failed, skipped = (len(outcomes[key]) for key in ('passed', 'failed', 'skipped'))
    if passed + failed == 0:
        print('no test ran', file=sys.stderr)
    line = '%d passed, %d failed' % (passed, failed)
    if skipped:
        line += ', %d skipped' % skipped
    print(line)
    return 1 if failed or passed == 0 else 0


if __name__ == '__main__':
    sys.exit(main())
