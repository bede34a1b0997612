"""Whether a user's own plant is made of numbers, and its own effects of nothing at their null."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from math import isfinite, isnan
from numbers import Real
from typing import Any

import casadi as ca
import numpy as np

from workbench.cause_checks import own
from workbench.effect import AddedMass, Effect, Expression, Force, HeatFlow, MassFlow, Term, Torque
from workbench.errors import Message
from workbench.model import Model
from workbench.plant import Plant, Signal

UNITS = {Force: " N", Torque: " N m", MassFlow: " kg/s", HeatFlow: " W", AddedMass: " kg"}
QUESTION = " (is there a math.sin where a ca.sin belongs?)"
STATES, SPREAD = 8, 0.5  # where a plant is looked at: so many, so many scales off the start
FAR = 5.0  # and where runs may begin at a recorded state, far off the start
SAMPLES, SHIFT = 4000, 1e-6  # of a sequence, in steps: what is absent must not move it
ROUNDING = 1e-9  # of the size of an effect: so much may be left of it where it is absent


Point = tuple[np.ndarray, np.ndarray, np.ndarray]  # states, commands and measured inputs


def is_number(value: object) -> bool:
    """True for a number or an expression of one; parts may also give vectors and texts."""
    return isinstance(value, Real) or (isinstance(value, ca.SX | ca.DM) and value.is_scalar())


def with_symbols(plant: Plant) -> Plant:
    """The plant with the symbols of its model in place of its numbers.

    Where a number is 0, a guarded division by it raises; by a symbol it does not.
    """
    names, p = plant.model.parameters, plant.model.symbols[3]
    return plant.with_values({name: p[k] for k, name in enumerate(names)})


def not_numbers(plant: Plant) -> Iterator[Message]:
    """What is nowhere finite, as it is or with one cause at its typical size; the first of it.

    The start alone tells little: runs start at states that are recorded.
    """
    everything = _everything(plant)
    function = _function(plant, [value for _, value in everything])
    points = [*_points(plant, SPREAD), *_points(plant, FAR)]
    for size, p in _sizes(plant):
        found = _at(function, [(plant.initial, *plant.nominal[:2]), *points], p)
        for (label, _), numbers in zip(everything, found.T, strict=True):
            if not np.isfinite(numbers).any():
                expected = "a finite number" + (QUESTION if isnan(numbers[0]) else "")
                yield Message(f"{label} is {numbers[0]:g} at the start{size}", expected=expected)
                return


def _sizes(plant: Plant) -> Iterator[tuple[str, np.ndarray]]:
    """Parameters, shape (n_p,), as they are and with each cause at its typical size, with words.

    What a cause needs is there too: without it nobody asks for the cause.
    """
    values, known = plant.nominal[2], plant.parameters
    yield "", values
    for candidate in plant.candidates.values():
        there = dict(plant.values)
        needed = candidate.needed
        if needed in there and there[needed] == known[needed].null:
            there[needed] = known[needed].typical
        there[candidate.strength] = typical = known[candidate.strength].typical
        p = np.array([*there.values()], dtype=float)
        yield f" with {candidate.strength} at its typical {typical:g}", p


def _everything(plant: Plant) -> list[tuple[str, Expression]]:
    """All that may fail to be a number, with what to call it.

    A user's own members come first, and what follows from the states before what follows from that.
    """
    model = plant.model
    found = [(_member(name), name, model.conditions.read(name)) for name in derived(plant)]
    found += [
        (member.name, f"{member.name}: what it makes of {name}", value)
        for member in filter(own, with_symbols(plant).members)
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
    found = [each for each in found if is_number(each[-1])]
    return [(label, value) for _, label, value in sorted(found, key=lambda e: e[0] not in mine)]


def derived(plant: Plant) -> list[str]:
    """Full names of the quantities that follow from the states at once."""
    now = plant.model.conditions.copied()
    parts = with_symbols(plant).parts
    return [f"{part.name}.{quantity}" for part in parts for quantity in part.derive(now)]


def altered(model: Model, member: Effect) -> Iterator[tuple[str, Expression]]:
    """The signals that a member with symbols does not pass on as they are, and what it makes."""
    now = model.conditions.copied()  # it may place something there
    for name, value in model.conditions.named():
        changed = member.alter(name, value, now) if is_number(value) else value
        if changed is not value:
            yield name, changed


def not_absent(plant: Plant) -> Iterator[Message]:
    """What a user's own effects do with all their strengths at null.

    One that is there all the same, a valve whatever its flaws, says so: its ``absent`` is False.
    """
    pairs = zip(plant.effects, with_symbols(plant).effects, strict=True)
    for effect, symbolic in ((e, s) for e, s in pairs if own(e)):
        nulls: dict[str, Any] = {
            k: v.null for k, v in effect.parameters().items() if v.null is not None
        }
        silent = replace(effect, **nulls)
        if silent.absent:
            for done in (*_moved(plant, symbolic), *_resampled(plant, silent)):
                what = f"{effect.name} {done} with all its strengths at null"
                yield Message(what, "", "exactly nothing, or a property absent that says False")


def _moved(plant: Plant, symbolic: Effect) -> Iterator[str]:
    """In words what an effect does at null to balances and signals.

    What is left of it by rounding is nothing, next to its terms and to what it typically does.
    """
    model, known = plant.model, dict(plant.model.conditions.named())
    sums: dict[tuple[type[Term], str], list[Expression]] = {}
    for term in symbolic.terms(model.conditions):
        sums.setdefault((type(term), term.balance), []).append(term.value)
    moved = [
        (f"puts a {kind.__name__} of", f"{UNITS.get(kind, '')} into {balance}", sum(values), values)
        for (kind, balance), values in sums.items()
    ]
    shifts = altered(model, symbolic)
    moved += [(f"moves {n} by", "", value - known[n], [known[n]]) for n, value in shifts]
    for before, behind, value, beside in moved:
        function = _function(plant, [value, *beside])
        there, *sizes = _largest(plant, function, _strengths(plant, symbolic, "null"))
        usual = _largest(plant, function, _strengths(plant, symbolic, "typical"))[0]
        if abs(there) > ROUNDING * max(map(abs, (*sizes, usual))):
            yield f"{before} {there:.4g}{behind}"


def _strengths(plant: Plant, effect: Effect, size: str) -> np.ndarray:
    """Parameters, shape (n_p,), with all strengths of an effect at null or at typical size."""
    known = {f"{effect.name}.{k}": v for k, v in effect.parameters().items() if v.null is not None}
    there = plant.values | {name: getattr(each, size) for name, each in known.items()}
    return np.array([*there.values()], dtype=float)


def _resampled(plant: Plant, silent: Effect) -> Iterator[str]:
    """In words what an effect does to samples; one that cannot be asked is not asked in a run."""
    ramp = np.arange(float(SAMPLES))
    for name in (*plant.model.commands, *plant.model.measured):
        with suppress(Exception):  # in a user's own code
            if not np.allclose(silent.resample(name, ramp, 1e-3), ramp, rtol=0.0, atol=SHIFT):
                yield f"moves samples of {name}"


def _largest(plant: Plant, function: ca.Function, p: np.ndarray) -> np.ndarray:
    """The largest size of each value at a few states around the start, with its sign."""
    sizes = np.nan_to_num(_at(function, _points(plant, SPREAD), p), posinf=0.0, neginf=0.0)
    return sizes[np.abs(sizes).argmax(axis=0), range(sizes.shape[1])]


def _points(plant: Plant, spread: float) -> Iterator[Point]:
    """States so many scales around the start, with inputs."""
    rng = np.random.default_rng(1)
    for _ in range(STATES):
        x = plant.initial + spread * plant.scale * rng.uniform(-1.0, 1.0, len(plant.scale))
        u, d = (
            np.array([_drawn(s, rng) for s in group])
            for group in (plant.commands, plant.measured_inputs)
        )
        yield x, u, d


def _at(function: ca.Function, points: Iterable[Point], p: np.ndarray) -> np.ndarray:
    """Values at each point, shape (n_points, n)."""
    return np.array([np.array(function(*point, p)).ravel() for point in points])


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
