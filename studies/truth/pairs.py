"""Two hidden effects at once, put together from stored cases that hide one each.

Both sizes are those of the stored cases, so each effect can be seen alone.  Of the two draws of
every small difference the smaller one is taken: it stays below a fifth of what it is measured
against in both cases, as the misfit rule asks (misfit goes with the square of the amplitude).

python -m studies.truth.pairs --pair coulomb_friction chamber_leak --seed 1 -o DIR
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.truth.case import Case, Difference, generator
from studies.truth.cases import read_cases
from studies.truth.draw import EFFECTS, HIDDEN, drive_of
from studies.truth.drive import Drive
from studies.truth.manoeuvre import training_reference, validation_reference
from studies.truth.record import Table, table, write_csv
from studies.truth.run import closed_loop

# Ten pairs for the study: (effect, effect, seed).  Every effect stands in one or two of them, in
# one balance or in two, and no pair is one that a recording cannot tell from a single effect.
PAIRS = (
    ("coulomb_friction", "chamber_leak", 1),
    ("valve_dead_zone", "constant_force", 1),
    ("exhaust_restriction", "stiction", 1),
    ("valve_lag", "piston_leak", 1),
    ("sensor_offset", "coulomb_friction", 2),
    ("spool_leak", "friction_asymmetry", 2),
    ("supply_droop", "chamber_leak", 2),
    ("stiction", "valve_dead_zone", 3),
    ("friction_asymmetry", "exhaust_restriction", 3),
    ("constant_force", "valve_lag", 3),
)


@dataclass(frozen=True)
class Pair:
    """Two cases of one seed whose hidden effects act together in one drive."""

    first: Case
    second: Case

    @property
    def hidden(self) -> tuple[str, str]:
        """The names of both effects."""
        return str(self.first.hidden), str(self.second.hidden)

    @property
    def seed(self) -> int:
        """The seed of both cases."""
        return self.first.seed

    @property
    def supply_recorded(self) -> bool:
        """False if one of the effects is a drooping supply."""
        return self.first.supply_recorded and self.second.supply_recorded

    @property
    def drive(self) -> Drive:
        """The true drive: both effects, and the smaller one of each small difference."""
        hidden_fields = {f for name in self.hidden for f in EFFECTS[name].fields}
        drawn: dict[str, list[Difference]] = {}
        for difference in (*self.first.differences, *self.second.differences):
            if difference.field not in hidden_fields:
                drawn.setdefault(difference.field, []).append(difference)
        smaller = tuple(min(each, key=lambda d: abs(d.change)) for each in drawn.values())
        return drive_of(self.first, differences=smaller, beside=self.second)


def stored_pair(first: str, second: str, seed: int) -> Pair:
    """The pair of two stored cases.

    Raises KeyError if there is no such case, ValueError if both act on one quantity.
    """
    cases = read_cases()
    pair = Pair(cases[first, seed], cases[second, seed])
    shared = set(EFFECTS[first].fields) & set(EFFECTS[second].fields)
    if shared:
        raise ValueError(f"truth: {first} and {second} both set {', '.join(sorted(shared))}")
    return pair


def record_pairs(pairs: Sequence[Pair]) -> list[tuple[Table, Table]]:
    """Training and validation table of every pair, all integrated in one batch (10 s, 1 kHz)."""
    drives, references, generators = [], [], []
    for pair in pairs:
        name = "+".join(pair.hidden)
        for purpose, reference in (
            ("training", training_reference),
            ("validation", validation_reference),
        ):
            drives.append(pair.drive)
            references.append(reference(generator(name, pair.seed, purpose)))
            generators.append(generator(name, pair.seed, purpose + " noise"))
    run = closed_loop(drives, np.stack(references, axis=1), generators)
    return [
        (table(run, 2 * i, pair.supply_recorded), table(run, 2 * i + 1, pair.supply_recorded))
        for i, pair in enumerate(pairs)
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write train.csv and validation.csv of one pair; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.truth.pairs", description=__doc__)
    parser.add_argument("--pair", nargs=2, choices=HIDDEN, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args(arguments)
    training, validation = record_pairs([stored_pair(*options.pair, options.seed)])[0]
    options.output.mkdir(parents=True, exist_ok=True)
    write_csv(training, options.output / "train.csv")
    write_csv(validation, options.output / "validation.csv")


if __name__ == "__main__":
    main()
