"""A rig's closed loop with designs from files, also over plants drawn from its uncertainty."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from controllers.design_file import read_design
from linearize.standard import SHIFT_MODES, SLIDE_MODES
from studies.closed_loop_check import Check, check
from studies.closed_loop_figures import check_figures
from studies.figures.following import following_figures
from studies.figures.shifts import shift_figures
from studies.figures.style import styled
from studies.following import BENCHES
from studies.following_check import FollowingCheck, check_followed, tasks_of
from studies.scenarios import SCENARIOS
from studies.shift_check import SHIFTS, ShiftCheck, check_shifts
from studies.text import shown
from workbench.contracts import Controller
from workbench.errors import InputError, Message, listed
from workbench.law_range import warn_beyond
from workbench.plant import Plant, require
from workbench.rig import Rig
from workbench.units import public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS = 1000  # of one parameter until it lies within its bounds
MOST_NAMED = 5  # values that differ from those of a design


def check_rig(
    rig: Rig,
    designs: Iterable[Path],
    estimators: Iterable[str],
    scenarios: Iterable[str] = (),
    runs: int = 1,
    progress: Callable[[str], None] = lambda message: None,
) -> Check:
    """Designs of files against the rig's plant; from the second run on, against drawn ones.

    Raises
    ------
    InputError
        If a scenario or an estimator does not exist, the plant has no standard modes, or a design
        is for another plant.
    """
    names = tuple(scenarios) or tuple(SCENARIOS)
    require(names, SCENARIOS, "the list of scenarios")
    controllers = _controllers(rig, designs)
    rows, records = [], []
    for number, plant in enumerate(drawn_plants(rig, runs)):
        progress(f"closed loop, run {number + 1} of {runs}")
        found = check(plant, controllers, estimators, names, believed=rig.plant, seed=number)
        for row, record in zip(found.rows, found.records, strict=True):
            run = f"{row.scenario} with {row.design}"
            warn_beyond(rig, replace(record.recording, name=run))
        mark = f" {number + 1}" if runs > 1 else ""
        rows += [replace(row, design=row.design + mark) for row in found.rows]
        records += found.records
    return Check(tuple(rows), tuple(records))


def shifts_gears(rig: Rig) -> bool:
    """True for a plant that shifts between dedicated positions, which is checked in shifts."""
    return rig.plant.name in SHIFT_MODES


def check_gears(
    rig: Rig,
    designs: Iterable[Path],
    scenarios: Iterable[str] = (),
    runs: int = 1,
    progress: Callable[[str], None] = lambda message: None,
) -> ShiftCheck:
    """As :func:`check_rig` for an actuator that shifts; its estimator is the shift filter.

    Raises
    ------
    InputError
        If a shift does not exist, or a design is for another plant.
    """
    names = tuple(scenarios) or tuple(SHIFTS)
    require(names, SHIFTS, "the list of shifts")
    controllers = _controllers(rig, designs)
    rows, records = [], []
    for number, plant in enumerate(drawn_plants(rig, runs)):
        progress(f"shifts, run {number + 1} of {runs}")
        found = check_shifts(plant, controllers, names, believed=rig.plant, seed=number)
        mark = f" {number + 1}" if runs > 1 else ""
        rows += [replace(row, design=row.design + mark) for row in found.rows]
        records += found.records
    return ShiftCheck(tuple(rows), tuple(records))


def follows(rig: Rig) -> bool:
    """True for a plant that is checked on a bench of its own: rig, arm, leg, soft joint."""
    return rig.plant.name in BENCHES


def check_follower(
    rig: Rig,
    designs: Iterable[Path],
    estimators: Iterable[str],
    scenarios: Iterable[str] = (),
    runs: int = 1,
    progress: Callable[[str], None] = lambda message: None,
) -> FollowingCheck:
    """As :func:`check_rig` for a plant with a bench of its own, see :mod:`studies.following`.

    Raises
    ------
    InputError
        If a task or an estimator does not exist, or a design is for another plant.
    """
    tasks = tasks_of(rig.plant)
    names = tuple(scenarios) or tuple(tasks)
    require(names, tasks, "the list of scenarios")
    controllers = _controllers(rig, designs)
    rows, records = [], []
    for number, plant in enumerate(drawn_plants(rig, runs)):
        progress(f"closed loop, run {number + 1} of {runs}")
        found = check_followed(
            plant, controllers, estimators, names, believed=rig.plant, seed=number
        )
        mark = f" {number + 1}" if runs > 1 else ""
        rows += [replace(row, design=row.design + mark) for row in found.rows]
        records += found.records
    return FollowingCheck(tuple(rows), tuple(records))


def _controllers(rig: Rig, designs: Iterable[Path]) -> dict[str, Controller]:
    """The controllers of design files by the file's name; warns where they are for other values."""
    name = rig.plant.name
    known = (*SLIDE_MODES, *SHIFT_MODES, *BENCHES)
    if name not in known:
        expected = f"a rig of {listed(known)}"
        raise InputError(Message(f"{name} has no standard modes to control", rig.name, expected))
    read = {path: read_design(path) for path in designs}
    wrong = [
        Message(f"is a design for {found.plant.name}", expected=f"one for {name}", file=str(path))
        for path, found in read.items()
        if found.plant.name != name
    ]
    if wrong:
        raise InputError(*wrong)
    for path, found in read.items():
        if differing := differences(found.plant, rig.plant):
            what = f"{path}: designed for other values than those of {rig.name}: "
            warnings.warn(what + listed(differing, MOST_NAMED), stacklevel=3)
    return {path.stem: found.controller for path, found in read.items()}


def differences(designed: Plant, real: Plant) -> list[str]:
    """Values that a design was made for where the plant has others, and effects it lacked."""
    theirs, ours = designed.values, real.values
    lacking = {e.name for e in real.lean().effects} - {e.name for e in designed.effects}
    return [f"without {name}" for name in sorted(lacking)] + [
        f"{public_name(name)} {shown(theirs[name], name, 6)} (here {shown(value, name, 6)})"
        for name, value in ours.items()
        if name in theirs and not isclose(theirs[name], value, rel_tol=1e-9)
    ]


def drawn_plants(rig: Rig, runs: int) -> tuple[Plant, ...]:
    """The plants of so many runs, the same at every call: the rig's own, then drawn ones."""
    rng = np.random.default_rng(0)
    return (rig.plant, *(drawn(rig, rng) for _ in range(runs - 1)))


def drawn(rig: Rig, rng: np.random.Generator) -> Plant:
    """The plant with every uncertain parameter drawn anew, within its bounds."""
    plant, values = rig.plant, {}
    for name, value in plant.values.items():
        known, deviation = plant.parameters[name], rig.standard_deviation(name)
        absent = known.null is not None and value == known.null
        if deviation <= 0.0 or absent or name in rig.fixed:
            continue
        draws = value + deviation * rng.standard_normal(DRAWS)
        inside = draws[(draws >= known.lower) & (draws <= known.upper)]
        values[name] = float(inside[0]) if len(inside) else value
    return plant.with_values(values)


def styled_figures(found: Check | ShiftCheck | FollowingCheck) -> dict[str, Figure]:
    """The figures of a check in the common style."""
    with styled():
        if isinstance(found, FollowingCheck):
            return following_figures(found)
        return shift_figures(found) if isinstance(found, ShiftCheck) else check_figures(found)
