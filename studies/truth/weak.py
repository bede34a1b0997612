"""Recordings too weak to tell: an effect is hidden, and the manoeuvre does not excite it.

The drives are those of stored cases, so each effect shows in an ordinary recording.  Here it adds
less than the sensors' noise in any window (`misfits`; the rule of the others asks for more).

python -m studies.truth.weak        prints by how much, in noise variances
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth.batch import stack
from studies.truth.case import Case, generator
from studies.truth.cases import read_cases
from studies.truth.draw import drive_of
from studies.truth.drive import Drive
from studies.truth.manoeuvre import SAMPLES
from studies.truth.misfit import of_run
from studies.truth.record import Table, table
from studies.truth.replay import STARTS
from studies.truth.rule import Misfit
from studies.truth.run import Run, closed_loop, commanded

SEED = 1
STEP_SAMPLES = 500
PURPOSES = ("training", "validation")


@dataclass(frozen=True)
class Rest:
    """A position loop holds the slide where it is."""

    place_m: float


@dataclass(frozen=True)
class InsideDeadZone:
    """Random steps of the command that leave the valve shut, up to a share of the dead zone."""

    place_m: float
    share: float


Manoeuvre = Rest | InsideDeadZone

# Training and validation of what each case hides.
WEAK: dict[str, tuple[Manoeuvre, Manoeuvre]] = {
    "exhaust_restriction": (Rest(0.06), Rest(0.20)),
    "valve_lag": (Rest(0.145), Rest(0.08)),
    "discharge_asymmetry": (InsideDeadZone(0.10, 0.5), InsideDeadZone(0.19, 0.5)),
    "supply_restriction": (InsideDeadZone(0.06, 0.7), InsideDeadZone(0.145, 0.3)),
    "viscous_friction": (InsideDeadZone(0.19, 0.4), Rest(0.10)),
    "wall_heat": (Rest(0.20), InsideDeadZone(0.12, 0.3)),
}


def stored_weak() -> list[Case]:
    """The stored cases that stand here in weak recordings."""
    stored = read_cases()
    return [stored[hidden, SEED] for hidden in WEAK]


def record_weak(cases: Sequence[Case]) -> list[tuple[Table, Table]]:
    """Training and validation table of each case, in its weak manoeuvres (10 s, 1 kHz)."""
    columns = {key: (run, column) for keys, run in _runs(cases) for column, key in enumerate(keys)}
    tables = {
        key: table(run, column, cases[key[0]].supply_recorded)
        for key, (run, column) in columns.items()
    }
    return [(tables[i, 0], tables[i, 1]) for i in range(len(cases))]


def misfits(cases: Sequence[Case]) -> list[tuple[Misfit, Misfit]]:
    """Misfit of the hidden effect and of every difference, in training and validation."""
    found = {}
    for keys, run in _runs(cases):
        found.update(zip(keys, of_run([cases[i] for i, _ in keys], run), strict=True))
    return [(found[i, 0], found[i, 1]) for i in range(len(cases))]


Keys = list[tuple[int, int]]  # case, and training (0) or validation (1), of each column


def _runs(cases: Sequence[Case]) -> Iterator[tuple[Keys, Run]]:
    """One batch in position loops, and one whose commands are played as they are."""
    wanted = {(i, k): WEAK[str(case.hidden)][k] for i, case in enumerate(cases) for k in (0, 1)}
    for kind, run in ((Rest, _held), (InsideDeadZone, _played)):
        keys = [key for key, manoeuvre in wanted.items() if isinstance(manoeuvre, kind)]
        if keys:
            drives = [drive_of(cases[i]) for i, _ in keys]
            generators = [
                generator(cases[i].hidden, cases[i].seed, f"weak {PURPOSES[k]}") for i, k in keys
            ]
            yield keys, run(drives, [wanted[key] for key in keys], generators)


def _held(
    drives: Sequence[Drive], asked: Sequence[Rest], generators: Sequence[np.random.Generator]
) -> Run:
    places_m = np.array([each.place_m for each in asked])
    references = np.repeat(places_m[None], SAMPLES, axis=0)
    return closed_loop(drives, references, generators, STARTS, places_m)


def _played(
    drives: Sequence[Drive],
    asked: Sequence[InsideDeadZone],
    generators: Sequence[np.random.Generator],
) -> Run:
    steps = [g.uniform(-1.0, 1.0, SAMPLES // STEP_SAMPLES) for g in generators]
    held = np.repeat(np.stack(steps, axis=1), STEP_SAMPLES, axis=0)
    batch = stack(drives)
    half_v = batch.dead_zone_half_width_v * np.array([each.share for each in asked])
    places_m = np.array([each.place_m for each in asked])
    commands = batch.dead_zone_centre_v + half_v * held
    return commanded(drives, commands, generators, places_m, STARTS)


if __name__ == "__main__":
    weak = stored_weak()
    for case, (train, validation) in zip(weak, misfits(weak), strict=True):
        print(f"{case.hidden:<22}{case.size:>10.3g}{train.hidden:>9.3f}{validation.hidden:>9.3f}")
