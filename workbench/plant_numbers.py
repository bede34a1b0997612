"""Whether a user's own plant is made of numbers, and its own effects of nothing at their null."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import isfinite, isnan
from typing import Any

import casadi as ca
import numpy as np

from workbench.cause_checks import own
from workbench.effect import AddedMass, Effect, Expression, Force, HeatFlow, MassFlow, Torque
from workbench.errors import Message
from workbench.model import Model
from workbench.plant import Plant, Signal

UNITS = {Force: " N", Torque: " N m", MassFlow: " kg/s", HeatFlow: " W", AddedMass: " kg"}
QUESTION = " (is there a math.sin where a ca.sin belongs?)"
STATES, SPREAD = 8, 0.5  # where what is absent is looked at: so many, so many scales off the start
SAMPLES = 50  # of a sequence that what is absent must not move


def not_numbers(plant: Plant) -> Iterator[Message]:
    """What is not finite at the start, or with one cause at its typical size; the first of it."""
    everything = _everything(plant)
    function = _function(plant, [value for _, value in everything])
    for size, p in _sizes(plant):
        found = np.array(function(plant.initial, *plant.nominal[:2], p)).ravel()
        for (label, _), number in zip(everything, found, strict=True):
            if not isfinite(number):
                expected = "a finite number" + (QUESTION if isnan(number) else "")
                yield Message(f"{label} is {number:g} at the start{size}", expected=expected)
                return


def _sizes(plant: Plant) -> Iterator[tuple[str, np.ndarray]]:
    """Parameters, shape (n_p,), as they are and with each cause at its typical size, with words."""
    names, values = list(plant.values), plant.nominal[2]
    yield "", values
    for candidate in plant.candidates.values():
        p, typical = values.copy(), plant.parameters[candidate.strength].typical
        p[names.index(candidate.strength)] = typical
        yield f" with {candidate.strength} at its typical {typical:g}", p


def _everything(plant: Plant) -> list[tuple[str, Expression]]:
    """All that may fail to be a number, with what to call it.

    A user's own members come first, and what follows from the states before what follows from that.
    """
    model = plant.model
    found = [(_member(name), name, model.conditions.read(name)) for name in derived(plant)]
    found += [
        (member.name, f"{member.name}: what it makes of {name}", value)
        for member in filter(own, plant.members)
        for name, value in altered(model, member)
    ]
    found += [
        (source, f"{source}: its {kind} on {balance}", value)
        for (source, kind, balance), value in model.flows.items()
    ]
    found += [(_member(name), name, value) for name, value in model.conditions.named()]
    rates = [model.rates[k] for k in range(len(model.states))]
    for names, values in ((model.states, rates), (model.measured, ca.vertsplit(model.outputs))):
        word = "the rate of " if names is model.states else ""
        pairs = zip(names, values, strict=True)
        found += [(_member(name), word + name, value) for name, value in pairs]
    mine = {member.name for member in filter(own, plant.members)}
    return [(label, value) for _, label, value in sorted(found, key=lambda e: e[0] not in mine)]


def derived(plant: Plant) -> list[str]:
    """Full names of the quantities that follow from the states at once."""
    now = plant.model.conditions.copied()
    return [f"{part.name}.{quantity}" for part in plant.parts for quantity in part.derive(now)]


def altered(model: Model, member: Effect) -> Iterator[tuple[str, Expression]]:
    """The signals that a member does not pass on as they are, and what it makes of them."""
    now = model.conditions.copied()  # it may place something there
    for name, value in model.conditions.named():
        changed = member.alter(name, value, now)
        if changed is not value:
            yield name, changed


def not_absent(plant: Plant) -> Iterator[Message]:
    """What a user's own effects do with all their strengths at null.

    One that is there all the same, a valve whatever its flaws, says so: its ``absent`` is False.
    """
    for effect in filter(own, plant.effects):
        nulls: dict[str, Any] = {
            k: v.null for k, v in effect.parameters().items() if v.null is not None
        }
        silent = replace(effect, **nulls)
        if silent.absent:
            for done in _done(plant, silent):
                what = f"{effect.name} {done} with all its strengths at null"
                yield Message(what, "", "exactly nothing, or a property absent that says False")


def _done(plant: Plant, silent: Effect) -> Iterator[str]:
    """In words what an effect does to balances, to signals, and to samples of them."""
    model = plant.model
    known = dict(model.conditions.named())
    moved = [
        (f"puts a {type(term).__name__} of", f"{UNITS.get(type(term), '')} into {term.balance}",
         term.value)
        for term in silent.terms(model.conditions)
    ]  # fmt: skip
    moved += [(f"moves {n} by", "", value - known[n]) for n, value in altered(model, silent)]
    sizes = _largest(plant, [value for *_, value in moved])
    for (before, behind, _), size in zip(moved, sizes, strict=True):
        if size:
            yield f"{before} {size:.4g}{behind}"
    ramp = np.arange(float(SAMPLES))
    for name in (*model.commands, *model.measured):
        if not np.array_equal(silent.resample(name, ramp, 1e-3), ramp):
            yield f"moves samples of {name}"


def _largest(plant: Plant, values: list[Expression]) -> np.ndarray:
    """The largest size of each at a few states around the start, with its sign, shape (n,)."""
    if not values:
        return np.zeros(0)
    rng, function = np.random.default_rng(1), _function(plant, values)
    found = []
    for _ in range(STATES):
        x = plant.initial + SPREAD * plant.scale * rng.uniform(-1.0, 1.0, len(plant.scale))
        u, d = (
            [_drawn(s, rng) for s in group] for group in (plant.commands, plant.measured_inputs)
        )
        found.append(np.array(function(x, u, d, plant.nominal[2])).ravel())
    sizes = np.nan_to_num(np.array(found), nan=0.0, posinf=0.0, neginf=0.0)
    return sizes[np.abs(sizes).argmax(axis=0), range(len(values))]


def _drawn(signal: Signal, rng: np.random.Generator) -> float:
    """A value of an input: within its range, or near its nominal value where it has none."""
    if isfinite(signal.lower) and isfinite(signal.upper):
        return float(signal.lower + (signal.upper - signal.lower) * rng.random())
    return signal.nominal + (0.3 * abs(signal.nominal) or 0.1) * float(rng.uniform(-1.0, 1.0))


def _function(plant: Plant, values: list[Expression]) -> ca.Function:
    """(x, u, d, p) -> these values, one under the other."""
    return ca.Function("values", [*plant.model.symbols], [ca.vertcat(*values)])


def _member(name: str) -> str:
    return name.rpartition(".")[0]
