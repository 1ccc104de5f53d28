#!/usr/bin/env python3
"""From what gcovr found: a table of lines and branches by file, with totals; what is missing goes into a file.

    coverage_table.py coverage.json not_covered.txt
"""

import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Parts of the sources, in the order of the table.
PARTS = ('pf_resampling_core', 'src', 'beacon_mcl_node', 'fastslam_node')


def percent(covered, total):
    return 100.0 * covered / total if total else 100.0


def row(name, counts):
    lines, lines_run, branches, branches_taken = counts
    return '%-72s %6d %6d %6.1f %9d %6d %6.1f' % (
        name, lines, lines_run, percent(lines_run, lines), branches, branches_taken, percent(branches_taken, branches))


def examine(file):
    """Counts of one file, and its lines with what is missing there: (line, 'not run' or '1 of 2 branches')."""
    counts = [0, 0, 0, 0]
    missing = []
    for line in sorted(file['lines'], key=lambda entry: entry['line_number']):
        if line.get('gcovr/noncode'):
            continue
        branches = line['branches']
        taken = sum(1 for branch in branches if branch['count'] > 0)
        for index, more in enumerate((1, line['count'] > 0, len(branches), taken)):
            counts[index] += more
        if line['count'] == 0:
            missing.append((line['line_number'], 'not run'))
        elif taken < len(branches):
            missing.append((line['line_number'], '%d of %d branches' % (taken, len(branches))))
    return counts, missing


def main():
    if len(sys.argv) != 3:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    found = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding='utf-8'))
    files = {file['file']: examine(file) for file in found['files']}
    if not files:
        print('coverage_table.py: no file of the sources is in %s' % sys.argv[1], file=sys.stderr)
        return 1
    print('%-72s %6s %6s %6s %9s %6s %6s' % ('file', 'lines', 'run', '%', 'branches', 'taken', '%'))
    total = [0, 0, 0, 0]
    sums = []
    for part in PARTS:
        of_part = [0, 0, 0, 0]
        for name in sorted(files):
            if name.split('/')[0] != part:
                continue
            counts = files[name][0]
            of_part = [a + b for a, b in zip(of_part, counts)]
            print(row(name, counts))
        sums.append(row(part, of_part))
        total = [a + b for a, b in zip(total, of_part)]
    print('\n' + '\n'.join(sums))
    print(row('core and pipelines', total))
    with open(sys.argv[2], 'w', encoding='utf-8') as output:
        for name in sorted(files):
            source = (ROOT / name).read_text(encoding='utf-8').splitlines()
            for number, what in files[name][1]:
                output.write('%s:%d: %s: %s\n' % (name, number, what, source[number - 1].strip()))
    print('\nWhat is missing: %s' % sys.argv[2])
    return 0


if __name__ == '__main__':
    sys.exit(main())
