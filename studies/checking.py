"""A rig's closed loop with designs from files, also over plants drawn from its uncertainty."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from controllers.design_file import parse_design
from controllers.on_measurement import OnMeasurement
from controllers.pressure import PressureControl
from estimators import ESTIMATORS
from estimators.per_mode import names_of
from estimators.raw import RAW
from linearize.standard import SHIFT_MODES, SLIDE_MODES
from studies.closed_loop_check import Check, check
from studies.closed_loop_figures import check_figures
from studies.controller_calls import fallbacks
from studies.figures.following import following_figures
from studies.figures.foot import LEG, foot_figures
from studies.figures.shifts import shift_figures
from studies.figures.style import styled
from studies.following import BENCHES
from studies.following_check import FollowingCheck, check_followed, tasks_of
from studies.sample_times import require_multiple
from studies.scenarios import SCENARIOS
from studies.shift_check import SHIFTS, ShiftCheck, check_shifts, valves_off
from studies.specification import Asked, Limit
from studies.text import shown
from workbench.contracts import Controller
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant, require
from workbench.rig import Rig
from workbench.rig_text import key_lines
from workbench.units import public_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Checked = Check | ShiftCheck | FollowingCheck
USUAL = "ekf"
DRAWS = 1000  # of one parameter until it lies within its bounds
MOST_NAMED = 5  # values that differ from those of a design


@dataclass(frozen=True)
class Loops:
    """All that one run of a check closes; :func:`loops_of` makes it and refuses what is wrong.

    Attributes
    ----------
    rig
        What designs and estimators know; the plant of a run may be another one.
    controllers
        By the name of their file.
    estimators
        By name; none for a plant that shifts, whose filter is its own.
    scenarios
        Of the plant, by name.
    asked
        Lines of a specification; time outside its limits counts on a slide, whose rows tell of it.
    """

    rig: Rig
    controllers: Mapping[str, Controller]
    estimators: tuple[str, ...]
    scenarios: tuple[str, ...]
    asked: tuple[Asked, ...] = ()

    def once(self, plant: Plant, seed: int) -> Checked:
        """Every controller with every estimator in every scenario on this plant.

        Raises
        ------
        ArithmeticError
            If a loop is lost.
        """
        believed, name = self.rig.plant, self.rig.plant.name
        if name in SHIFT_MODES:
            return check_shifts(
                plant,
                self.controllers,
                self.scenarios,
                believed=believed,
                seed=seed,
                strength=valves_off(self.rig),
            )
        every = plant, self.controllers, self.estimators, self.scenarios
        if name in BENCHES:
            return check_followed(*every, believed=believed, seed=seed)
        limits = [line for line in self.asked if isinstance(line, Limit)]
        return check(*every, believed=believed, seed=seed, limits=limits)

    @property
    def apart(self) -> tuple[Loops, ...]:
        """One estimator in one scenario each, in the order of the rows of one design."""
        estimators = [(name,) for name in self.estimators] or [()]
        return tuple(
            replace(self, estimators=estimator, scenarios=(scenario,))
            for estimator in estimators
            for scenario in self.scenarios
        )


def scenarios_of(plant: Plant) -> tuple[str, ...]:
    """What a plant's loops are run in, by name."""
    if plant.name in BENCHES:
        return tuple(tasks_of(plant))
    return tuple(SHIFTS if plant.name in SHIFT_MODES else SCENARIOS)


def loops_of(
    rig: Rig,
    designs: Mapping[Path, str],
    estimators: Iterable[str] = (),
    scenarios: Iterable[str] = (),
) -> Loops:
    """The loops of design files; warns where one is for other values than those of the rig.

    Parameters
    ----------
    designs
        Text by path.
    estimators, scenarios
        By default the extended Kalman filter, and all of the plant.

    Raises
    ------
    InputError
        If a scenario or an estimator does not exist, `raw` is for a law that needs more than is
        measured, the plant has no standard modes or brings its own estimator, or a design is for
        another plant.
    """
    name, wanted = rig.plant.name, tuple(estimators)
    known = (*SLIDE_MODES, *SHIFT_MODES, *BENCHES)
    if name not in known:
        expected = f"a rig of {listed(known)}"
        raise InputError(Message(f"{name} has no standard modes to control", rig.name, expected))
    if name in SHIFT_MODES and wanted:
        what = f"{rig.name} has an estimator of its own: leave --estimator out"
        raise InputError(Message(what))
    there = scenarios_of(rig.plant)
    chosen = tuple(scenarios) or there
    require(chosen, there, "the list of scenarios")
    controllers = _controllers(rig, designs)
    if name not in SHIFT_MODES:
        wanted = wanted or (USUAL,)
        named = [one for choice in wanted for one in names_of(choice)]
        require(named, (*ESTIMATORS, RAW), "the list of estimators")
        if RAW in named:
            _require_measured(rig.plant, controllers)
    return Loops(rig, controllers, wanted, chosen)


def _require_measured(plant: Plant, controllers: Mapping[str, Controller]) -> None:
    """Refuse `raw` for laws that ask for states which no sensor of the plant measures.

    Raises
    ------
    InputError
        With the names of their designs.
    """
    unseen = [
        name
        for name, law in controllers.items()
        if not isinstance(law, OnMeasurement)
        and not (isinstance(law, PressureControl) and {*law.model.states} <= {*plant.measured})
    ]
    if unseen:
        what = f"{RAW} gives what is measured, and {listed(unseen)} asks for more"
        raise InputError(Message(what, expected=f"one of {listed(ESTIMATORS)}"))


def _controllers(rig: Rig, designs: Mapping[Path, str]) -> dict[str, Controller]:
    """The controllers of design files by the file's name; warns where they are for other values."""
    name = rig.plant.name
    read = {path: parse_design(text, path) for path, text in designs.items()}
    wrong = [
        Message(f"is a design for {found.plant.name}", expected=f"one for {name}", file=str(path))
        for path, found in read.items()
        if found.plant.name != name
    ]
    if wrong:
        raise InputError(*wrong)
    for path, found in read.items():
        line = key_lines(designs[path]).get(("spec", "sample_time_s"), 0)
        require_multiple(
            rig.plant, found.controller.sample_time_s, "sample_time_s", file=str(path), line=line
        )
        if differing := differences(found.plant, rig.plant):
            what = f"{path}: designed for other values than those of {rig.name}: "
            warnings.warn(what + listed(differing, MOST_NAMED), stacklevel=4)
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


def drawn_plant(rig: Rig, number: int) -> Plant:
    """The plant of one run, counted from 0: the rig's own, then drawn ones, each by its number."""
    return drawn(rig, np.random.default_rng((0, number))) if number else rig.plant


def apart(rig: Rig, plant: Plant, most: int = 3) -> str:
    """What sets a drawn plant apart from its rig, in standard deviations, farthest first."""
    values, own = plant.values, rig.plant.values
    spread = {name: rig.standard_deviation(name) for name in values}
    far = {n: (v - own[n]) / spread[n] for n, v in values.items() if spread[n] and v != own[n]}
    farthest = sorted(far, key=lambda n: -abs(far[n]))[:most]
    return ", ".join(f"{public_name(n)} {far[n]:+.1f} sd" for n in farthest)


def drawn(rig: Rig, rng: np.random.Generator) -> Plant:
    """The plant with every uncertain parameter drawn anew, within its bounds.

    What belongs to an absent cause stays as it is: it changes no run, and would be told of the
    worst one.  Its numbers are drawn all the same, so that those of the others do not move.
    """
    plant, values, idle = rig.plant, {}, idle_parameters(rig.plant)
    for name, value in plant.values.items():
        known, deviation = plant.parameters[name], rig.standard_deviation(name)
        absent = known.null is not None and value == known.null
        if deviation <= 0.0 or absent or name in rig.fixed:
            continue
        draws = value + deviation * rng.standard_normal(DRAWS)
        inside = draws[(draws >= known.lower) & (draws <= known.upper)]
        if len(inside) and name not in idle:
            values[name] = float(inside[0])
    return plant.with_values(values)


def idle_parameters(plant: Plant) -> frozenset[str]:
    """Parameters that change nothing: the forms of absent causes, and all of absent effects."""
    values, parameters = plant.values, plant.parameters
    idle: set[str] = set()
    needed: set[str] = set()
    for cause in plant.candidates.values():
        absent = values[cause.strength] == parameters[cause.strength].null
        (idle if absent else needed).update(cause.forms)
    gone = {f"{e.name}.{key}" for e in plant.effects if e.absent for key in e.parameters()}
    return frozenset(idle - needed | gone)


def recorded_runs(loops: Loops, runs: int, say: Callable[[str], None]) -> Checked:
    """A few runs in this process with their records, to be judged and drawn again later."""
    rows, records = [], []
    for number in range(runs):
        say(f"run {number + 1} of {runs}")
        found = loops.once(drawn_plant(loops.rig, number), number)
        mark = f" {number + 1}" if runs > 1 else ""
        rows += [replace(row, design=row.design + mark) for row in found.rows]
        records += found.records
    for said in fallbacks(rows):
        warnings.warn(said, stacklevel=2)
    return replace(found, rows=tuple(rows), records=tuple(records))


def styled_figures(found: Checked, plant: Plant | None = None) -> dict[str, Figure]:
    """The figures of a check in the common style; of a leg also those of its foot, where given."""
    with styled():
        if isinstance(found, FollowingCheck):
            foot = foot_figures(found, plant) if plant and plant.name == LEG else {}
            return {**following_figures(found), **foot}
        return shift_figures(found) if isinstance(found, ShiftCheck) else check_figures(found)
