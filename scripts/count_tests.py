#!/usr/bin/env python3
"""Counts the JUnit results below a folder, names what failed or was skipped, ends with 'N passed, N failed'."""

import collections
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def outcomes_in(path):
    """Of each <testcase>: 'failed', 'skipped' or 'passed', its name, and the reason."""
    try:
        cases = list(ElementTree.parse(str(path)).getroot().iter('testcase'))
    except ElementTree.ParseError as error:
        yield 'failed', path.name, 'unreadable results: %s' % error
        return
    if not cases:  # a program that registers no test has nothing to show; that is a mistake
        yield 'failed', path.name, 'no test in it'
    for case in cases:
        found = {each.tag: (each.get('message') or each.text or '').strip() for each in case}
        is_skipped = 'skipped' in found or case.get('result') == 'skipped' or case.get('status') == 'notrun'
        result = 'failed' if found.keys() & {'failure', 'error'} else 'skipped' if is_skipped else 'passed'
        yield (result, '%s: %s.%s' % (path.stem, case.get('classname', ''), case.get('name', '')),
               next((found[tag] for tag in ('failure', 'error', 'skipped') if tag in found), ''))


def main(folder):
    outcomes = [each for path in sorted(pathlib.Path(folder).rglob('*.xml')) for each in outcomes_in(path)]
    for result, name, reason in sorted(outcomes, key=lambda outcome: outcome[0], reverse=True):
        if result != 'passed':
            print('\n    '.join(['%s %s' % (result.upper(), name), *reason.splitlines()[:12]]))
    count = collections.Counter(result for result, _, _ in outcomes)
    print('%d passed, %d failed' % (count['passed'], count['failed']) + (', %d skipped' % count['skipped'] if count['skipped'] else ''))
    return 1 if count['failed'] or not count['passed'] else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
