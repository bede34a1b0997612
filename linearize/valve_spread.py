"""How solenoid valves of a kind differ in time, and the one number that says most of it.

Voltage, resistance, core, spring and masses of a valve are known to some per cent, and each shifts
the instants at which its seats open and close.  What they do to the shares of
:mod:`linearize.valve_sample` is nearly one and the same: a valve with more volts or fewer ohms
pulls in sooner, lets go later and bounces later.  So the principal direction among all that is
uncertain stands for the rest, and a valve has a *strength*: how many standard deviations it is off
in that direction.  A filter can learn it from the first rise of a pressure, before it has to brake.

Source: Jolliffe 2002, "Principal component analysis", ch. 2 (of the sensitivities by one standard
deviation each).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeVar

import casadi as ca
import numpy as np

from linearize.valve_sample import CHARGING, VALVES, valve_ends, valve_sample
from workbench.compiled import compiled
from workbench.plant import Plant

FIRST = 6  # samples of the first pulse of the trial
TRIAL = np.repeat([1.0, 0.0, 1.0, 0.0], [FIRST, 12, 20, 20])  # commands that tell valves apart
STRENGTHS = tuple(f"{valve}.strength" for valve in VALVES)
FLOW_GAINS = tuple(f"{valve}.flow_gain" for valve in VALVES)
LEAST = 1e-3  # of the shares over the trial: a direction that does less does nothing

Pair = tuple[Plant, Plant]
T = TypeVar("T")
Pick = Callable[[T, float], T]


class Learned(NamedTuple):
    """What a filter says of a valve.

    strength     see the module
    flow_gain    how much more its flows are than those of the plant, as a share
    """

    strength: float = 0.0
    flow_gain: float = 0.0


AS_DESIGNED = Learned()


def passed(
    shares: T, slopes: T, strength: T | float, flow_gain: T | float, least: Pick, most: Pick
) -> T:
    """Shares of a valve of this strength and flow gain.

    ``least`` and ``most`` are the minimum and maximum of two, of arrays or of expressions: a seat
    opens no further than wholly, however strong the valve.
    """
    return (1.0 + flow_gain) * most(least(shares + strength * slopes, 1.0), 0.0)


@dataclass(frozen=True)
class UncertainValve:
    """A valve beside those that it might be, each alone over one sample.

    begun        states (n_x n,) of n valves that have long been released
    parameters   of each, shape (n_p n,)
    step         (x, command, parameters) -> (x one sample later, shares (2,), what they gain by
                 strength (2,), deviations of what strength does not tell (2, m))
    """

    begun: np.ndarray
    parameters: np.ndarray
    step: ca.Function


def uncertain_valve(plant: Plant, valve: str, sample_time_s: float, most: int) -> UncertainValve:
    """The valve and those at either side of it in the first ``most`` directions."""
    plant = plant.lean()
    pairs = valve_spread(plant, valve, sample_time_s)[:most]
    plants = [plant, *(each for pair in pairs for each in pair)]
    begun = np.column_stack([valve_ends(each, valve)[:, 0] for each in plants])
    parameters = np.column_stack([each.nominal[2] for each in plants])
    one = valve_sample(plant, valve, sample_time_s)
    x, u = ca.MX.sym("x", *begun.shape), ca.MX.sym("u")
    p = ca.MX.sym("p", *parameters.shape)
    later, shares = one.map(len(plants))(x, ca.repmat(u, 1, len(plants)), p)
    gained, untold = ca.DM.zeros(2), ca.DM(2, 0)
    if pairs:
        ahead, behind = shares[:, 1::2], shares[:, 2::2]
        slopes, bent = 0.5 * (ahead - behind), 0.5 * (ahead[:, 0] + behind[:, 0]) - shares[:, 0]
        gained, untold = slopes[:, 0], ca.horzcat(slopes[:, 1:], bent)
    step = ca.Function("uncertain_valve", [x, u, p], [later, shares[:, 0], gained, untold])
    return UncertainValve(begun.ravel("F"), parameters.ravel("F"), compiled(step))


@lru_cache(maxsize=8)
def valve_spread(plant: Plant, valve: str, sample_time_s: float) -> tuple[Pair, ...]:
    """Plants whose valve is a standard deviation off, to either side of each principal direction.

    What does most comes first, and the first of a pair is the valve that opens sooner as it is
    energised at rest.
    """
    plant = plant.lean()
    spread = _deviations(plant, valve)
    each = [_moved(plant, {name: by * sd}) for name, sd in spread.items() for by in (1.0, -1.0)]
    if not each:
        return ()
    shares = _tried(each, valve, sample_time_s)
    ahead, behind = shares[::2], shares[1::2]
    slopes = 0.5 * (ahead - behind)
    directions, sizes, _ = np.linalg.svd(slopes.reshape(len(slopes), -1), full_matrices=False)
    found = []
    for direction, size in zip(directions.T, sizes, strict=True):
        if size < LEAST:
            break
        sooner = direction @ slopes[:, :FIRST, CHARGING].sum(axis=1)
        by = direction if sooner >= 0.0 else -direction
        step = {name: d * sd for d, (name, sd) in zip(by, spread.items(), strict=True)}
        back = {name: -value for name, value in step.items()}
        found.append((_moved(plant, step), _moved(plant, back)))
    return tuple(found)


def _deviations(plant: Plant, valve: str) -> dict[str, float]:
    """Standard deviation of each uncertain parameter of a valve."""
    values, known = plant.values, plant.parameters
    own = (name for name in values if name.startswith(f"{valve}."))
    spread = {name: known[name].standard_deviation(values[name]) for name in own}
    return {name: sd for name, sd in spread.items() if sd > 0.0}


def _moved(plant: Plant, by: dict[str, float]) -> Plant:
    """The plant with parameters changed by so much, within their bounds."""
    values, known = plant.values, plant.parameters
    return plant.with_values(
        {n: float(np.clip(values[n] + d, known[n].lower, known[n].upper)) for n, d in by.items()}
    )


def _tried(plants: list[Plant], valve: str, sample_time_s: float) -> np.ndarray:
    """Shares of each valve over the trial, shape (plants, samples, 2)."""
    step = compiled(valve_sample(plants[0], valve, sample_time_s)).map(len(plants))
    x = np.column_stack([valve_ends(each, valve)[:, 0] for each in plants])
    p = np.column_stack([each.nominal[2] for each in plants])
    found = []
    for command in TRIAL:
        x, shares = step(x, np.full((1, len(plants)), command), p)
        found.append(shares.full().T)
    return np.stack(found, axis=1)
