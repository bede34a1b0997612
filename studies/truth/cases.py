"""Drawn cases kept in a file: the misfit rule is dear, and a test wants the same case every time.

python -m studies.truth.cases --plant servo_drive --seeds 1 2 3

draws every hidden effect, the laws outside the catalogue and the case with nothing hidden, and
applies the misfit rule (a few minutes a seed).  What is stored stays as it is, to the byte, and
what is not there yet comes behind it.
"""

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path

from studies.truth.case import Case, Difference
from studies.truth.plants import SERVO_DRIVE, TRUTHS

STORED = SERVO_DRIVE.stored
NOTHING = "nothing"  # how a case without a hidden effect is called


def read_cases(path: Path = STORED) -> dict[tuple[str | None, int], Case]:
    """Stored cases by hidden effect (None for nothing hidden) and seed."""
    cases = [_case(numbers) for numbers in json.loads(path.read_text())]
    return {(case.hidden, case.seed): case for case in cases}


def write_cases(cases: Iterable[Case], path: Path) -> None:
    """Store cases, one per line."""
    lines = ",\n".join(json.dumps(_numbers(case)) for case in cases)
    path.write_text(f"[\n{lines}\n]\n")


def _numbers(case: Case) -> dict:
    """All numbers of a case; the plant that a case has by default goes without saying."""
    numbers = asdict(case)
    if case.plant == Case.plant:
        del numbers["plant"]
    return numbers


def _case(numbers: dict) -> Case:
    differences = tuple(Difference(**each) for each in numbers.pop("differences"))
    pairs = {key: tuple((k, v) for k, v in numbers.pop(key)) for key in ("accessories", "shrunk")}
    return Case(differences=differences, **pairs, **numbers)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw and store; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.truth.cases", description=__doc__)
    parser.add_argument("--plant", choices=TRUTHS, default=SERVO_DRIVE.plant)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="instead of all; or nothing")
    parser.add_argument("-o", "--output", type=Path, help="instead of the plant's stored cases")
    asked = parser.parse_args(arguments)
    truth = TRUTHS[asked.plant]
    file = asked.output or truth.stored
    stored = read_cases(file) if file.exists() else {}
    names = [n for n in truth.names if asked.only is None or (n or NOTHING) in asked.only]
    missing = [(n, seed) for seed in asked.seeds for n in names if (n, seed) not in stored]
    drawn = truth.scaled([truth.draw(*each) for each in missing])
    write_cases([*stored.values(), *drawn], file)


if __name__ == "__main__":
    main()
