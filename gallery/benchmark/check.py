#!/usr/bin/env python3
"""Compares a program's answers with the reference numbers of this folder.

    python3 check.py ANSWERS

ANSWERS is a folder with tables of the same names and the same rows, in which the program wrote its
own numbers under the columns `result.*`; tables, rows and columns may be missing. Prints, for every
table, how many numbers were answered, the largest error and the median number of correct digits.
Needs Python 3.8 and nothing else. Ends with 1 if an answer is missing its number or has no row
here, or if there is no answer at all.
"""

import csv
import sys
from decimal import Decimal, InvalidOperation, getcontext
from pathlib import Path

getcontext().prec = 60
DIGITS = Decimal(40)  # more digits than the reference has are not counted


def read(path):
    """Rows by what was given, and the names of the columns that are asked for."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    names = rows[0].keys() if rows else []
    given = [name for name in names if not name.startswith("result.")]
    asked = [name for name in names if name.startswith("result.")]
    return {tuple(row[name] for name in given): row for row in rows}, asked


def digits(ours, truth):
    """Correct digits, relative to the number, or absolute where it is zero."""
    error = abs(ours - truth) / (abs(truth) or 1)
    return DIGITS if error == 0 else min(-error.log10(), DIGITS)


def compare(reference, answers):
    """Absolute errors and correct digits of all numbers of a table; what is wrong with it."""
    truth, asked = read(reference)
    ours, answered = read(answers)
    errors, correct, faults = [], [], []
    for name in answered:
        if name not in asked:
            faults.append(f"column {name} is not asked for")
    for key, row in ours.items():
        if key not in truth:
            faults.append(f"no row {','.join(key)}")
            continue
        for name in (name for name in answered if name in asked):
            try:
                value, exact = Decimal(row[name]), Decimal(truth[key][name])
            except (InvalidOperation, TypeError):
                faults.append(f"row {','.join(key)}: {name} is {row[name]!r}, no number")
                continue
            if not value.is_finite():
                faults.append(f"row {','.join(key)}: {name} is {value}")
                continue
            errors.append(abs(value - exact))
            correct.append(digits(value, exact))
    return errors, sorted(correct), faults, len(truth) * len(asked)


def main(folder):
    here = Path(__file__).resolve().parent
    print(f"{'table':38} {'answered':>12} {'largest error':>14} {'digits: least':>14} {'median':>7}")
    failed, any_answer = False, False
    for reference in sorted(here.rglob("*.csv")):
        name = reference.relative_to(here)
        if not (folder / name).exists():
            continue
        errors, correct, faults, total = compare(reference, folder / name)
        any_answer = any_answer or bool(errors)
        count = f"{len(errors)}/{total}"
        if errors:
            middle = correct[len(correct) // 2]
            print(f"{str(name):38} {count:>12} {float(max(errors)):14.1e} {correct[0]:14.1f} {middle:7.1f}")
        else:
            print(f"{str(name):38} {count:>12}")
        for fault in faults[:5]:
            print(f"    {fault}")
        if len(faults) > 5:
            print(f"    and {len(faults) - 5} more")
        failed = failed or bool(faults)
    if not any_answer:
        print(f"no answers in {folder}")
    return 1 if failed or not any_answer else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
