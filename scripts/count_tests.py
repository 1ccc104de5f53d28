#!/usr/bin/env python3
"""Counts the JUnit results below a folder, names what failed or was skipped, ends with 'N passed, N failed'."""

import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def outcome(program, case):
    """Of one <testcase>: 'failed', 'skipped' or 'passed', its name, and the reason."""
    name = '%s: %s.%s' % (program, case.get('classname', ''), case.get('name', ''))
    for tag, result in (('failure', 'failed'), ('error', 'failed'), ('skipped', 'skipped')):
        found = case.find(tag)
        if found is not None:
            return result, name, (found.get('message') or found.text or '').strip()
    is_skipped = case.get('result') == 'skipped' or case.get('status') == 'notrun'
    return 'skipped' if is_skipped else 'passed', name, ''


def outcomes_in(path):
    try:
        cases = ElementTree.parse(str(path)).getroot().iter('testcase')
    except ElementTree.ParseError as error:
        return [('failed', path.name, 'unreadable results: %s' % error)]
    # A program that registers no test has nothing to show; that is a mistake.
    return [outcome(path.stem, case) for case in cases] or [('failed', path.name, 'no test in it')]


def main():
    if len(sys.argv) != 2:
        sys.exit('usage: count_tests.py FOLDER')
    outcomes = [each for path in sorted(pathlib.Path(sys.argv[1]).rglob('*.xml')) for each in outcomes_in(path)]
    for wanted in ('skipped', 'failed'):
        for result, name, reason in outcomes:
            if result == wanted:
                print('\n    '.join(['%s %s' % (wanted.upper(), name), *reason.splitlines()[:12]]))
    passed, failed, skipped = (sum(each[0] == result for each in outcomes) for result in ('passed', 'failed', 'skipped'))
    if passed + failed == 0:
        print('no test ran', file=sys.stderr)
    print('%d passed, %d failed' % (passed, failed) + (', %d skipped' % skipped if skipped else ''))
    return 1 if failed or passed == 0 else 0


if __name__ == '__main__':
    sys.exit(main())
