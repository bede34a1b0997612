"""One run of a check, or a thousand over drawn plants: a row of numbers for each, worked anywhere.

A row depends on the set-up and the number of the run alone, and holds no record of a loop, so that
memory does not grow with the runs; a figure closes its few loops again.  The key of a row is a hash
of all that decides it: what is kept of another rig, design or specification is never mixed in.
"""

from __future__ import annotations

import json
import pickle
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from studies.checking import Checked, Loops, drawn_plant, loops_of
from studies.controller_calls import fallbacks
from studies.kept import Kept, Row
from studies.specification import Asked
from studies.verdicts import drawn_values
from studies.versions import code_of_loops
from studies.workers import Workers
from workbench.errors import InputError, Message
from workbench.law_range import beyond
from workbench.plant import Plant
from workbench.plant_files import plant_named
from workbench.rig import Rig

NOT_FINITE = ("inf", "-inf", "nan")
MOST_WARNED = 3  # runs whose warnings are told in full


@dataclass(frozen=True, eq=False)
class Setup:
    """What decides the runs of a check; equal where its :attr:`key` is.

    Attributes
    ----------
    path, design
        Of the design file, and its text: every process reads the same.
    estimators, scenarios
        As in :func:`~studies.checking.loops_of`.
    asked
        Lines of a specification, if there is one.
    """

    rig: Rig
    path: Path
    design: str
    estimators: tuple[str, ...] = ()
    scenarios: tuple[str, ...] = ()
    asked: tuple[Asked, ...] = ()

    @cached_property
    def key(self) -> str:
        """A hash of code, plant and what is known of it, design, all names and all lines."""
        rig = self.rig
        origin = rig.plant.origin.rpartition(":")[0]
        decides = {
            "code": code_of_loops(),
            "plant": rig.plant.name,
            "file": Path(origin).read_text(encoding="utf-8") if origin else "",
            "members": [f"{member.name}: {type(member).__name__}" for member in rig.plant.members],
            "values": rig.plant.values,
            "deviations": {name: rig.standard_deviation(name) for name in rig.plant.values},
            "fixed": sorted(rig.fixed),
            "seen": dict(rig.seen),
            "design": self.design,
            "estimators": self.estimators,
            "scenarios": self.scenarios,
            "lines": [[type(a).__name__, *map(repr, vars(a).values())] for a in self.asked],
        }
        return sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:16]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Setup) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    def __reduce__(self) -> tuple[Any, ...]:
        """With the plant's own file first: classes of it are unknown to another process."""
        content = (self.path, self.design, self.estimators, self.scenarios, self.asked)
        return _unpacked, (self.key, self.rig.plant.origin, pickle.dumps(self.rig), *content)

    @property
    def loops(self) -> Loops:
        """What one run closes, built once in every process; that warns and refuses."""
        return _built(self)


def _unpacked(key: str, origin: str, rig: bytes, *content: Any) -> Setup:
    if origin:
        plant_named(origin)
    setup = Setup(pickle.loads(rig), *content)
    vars(setup)["key"] = key  # of the process that asked; it takes a moment
    return setup


@lru_cache(maxsize=1)
def _built(setup: Setup) -> Loops:
    designs = {setup.path: setup.design}
    loops = loops_of(setup.rig, designs, setup.estimators, setup.scenarios)
    return replace(loops, asked=setup.asked)


@dataclass(frozen=True)
class Piece:
    """One run of a set-up, counted from 0."""

    setup: Setup
    number: int


def worked(piece: Piece) -> Row:
    """The row of one run: what came out of each loop, how far parameters were off, warnings.

    A loop that was lost says why instead of its metrics.
    """
    setup, number = piece.setup, piece.number
    with warnings.catch_warnings():  # the process that asks for rows has built it before
        warnings.simplefilter("ignore")
        loops = setup.loops
    plant = _plant(setup, number)
    off = {name: deviations for name, (_, deviations) in drawn_values(setup.rig, plant).items()}
    rows, said = [], []
    for part, found in zip(loops.apart, closed(setup, number), strict=True):
        (scenario,), estimator = part.scenarios, "".join(part.estimators)
        row: Row = {"scenario": scenario, "estimator": estimator}
        if isinstance(found, str):
            rows.append({**row, "lost": found})
            continue
        (metrics,), (record,) = found.rows, found.records
        lines = {a.name: a.found(metrics, record) for a in setup.asked if scenario in a.scenarios}
        rows.append({**row, "metrics": _written(vars(metrics)), "lines": _written(lines)})
        said += fallbacks(found.rows)
        name = f"{scenario} with {metrics.design}"
        said += beyond(setup.rig.plant, setup.rig.seen, replace(record.recording, name=name))
    return {"loops": rows, "deviations": off, "warnings": said}


@lru_cache(maxsize=1)
def closed(setup: Setup, number: int) -> tuple[Checked | str, ...]:
    """The loops of one run, one estimator in one scenario each; of one that was lost, the reason.

    The last run is remembered, so that its figures need no other.
    """
    plant = _plant(setup, number)
    return tuple(_once(part, plant, number) for part in setup.loops.apart)


@lru_cache(maxsize=1)
def _plant(setup: Setup, number: int) -> Plant:
    return drawn_plant(setup.rig, number)


def _once(part: Loops, plant: Plant, number: int) -> Checked | str:
    try:
        return part.once(plant, number)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        return str(error) or type(error).__name__
    except RuntimeError as error:
        if (
            type(error) is not RuntimeError
        ):  # CasADi's word for a solver that failed is the bare one
            raise
        return str(error).strip().splitlines()[0]


def _written(values: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers as JSON knows them; what is not finite as a word, see :func:`read`."""
    return {key: _word(value) for key, value in values.items()}


def _word(value: Any) -> Any:
    if isinstance(value, Mapping):
        return _written(value)
    if isinstance(value, str):
        return value
    return float(value) if isfinite(value) else str(float(value))


def read(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values that :func:`worked` wrote."""
    return {
        key: read(v) if isinstance(v, Mapping) else float(v) if v in NOT_FINITE else v
        for key, v in values.items()
    }


def rows_of(
    setup: Setup,
    runs: int,
    workers: Workers,
    keep: Path | None = None,
    say: Callable[[str], None] = lambda message: None,
) -> list[Row]:
    """A row for every run, in their order; with ``keep`` only of those that are not there yet.

    Raises
    ------
    InputError
        As :func:`~studies.checking.loops_of`; or if the file to keep rows in holds something else.
    """
    _built.cache_clear()  # so that whoever asks again is warned again
    closed.cache_clear()
    setup.loops  # noqa: B018  refuses before anything runs
    pieces = {f"{setup.key} {number + 1}": Piece(setup, number) for number in range(runs)}

    def tell(done: int, of: int) -> None:
        if done:
            say(f"run {done} of {of}")

    if keep is None:
        found: dict[str, Row] = {}
        for key, row in workers.results(worked, pieces):
            found[key] = row
            tell(len(found), runs)
        rows = [found[key] for key in pieces]
    else:
        rows = workers.keep(_kept(keep), worked, pieces, tell)
    _warn(rows)
    return rows


def _kept(path: Path) -> Kept:
    begins = '{"key": '
    if path.exists():
        with path.open(encoding="utf-8", errors="replace") as file:
            there = file.read(len(begins))
        if not begins.startswith(there):
            expected = "a new file, or one that --keep wrote"
            raise InputError(Message("holds no runs of a check", str(path), expected))
    return Kept(path)


def _warn(rows: list[Row]) -> None:
    """What runs warned of, in full for the first few."""
    warned = [row["warnings"] for row in rows if row["warnings"]]
    for said in dict.fromkeys(text for texts in warned[:MOST_WARNED] for text in texts):
        warnings.warn(said, stacklevel=3)
    if len(warned) > MOST_WARNED:
        warnings.warn(f"and likewise in {len(warned) - MOST_WARNED} more runs", stacklevel=3)
