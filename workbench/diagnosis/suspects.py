"""The balances that may lack a flow, and a filter in which each may have an unknown one.

Every part declares what it balances (:attr:`workbench.part.Part.balances`).  Here each balance
gets a term of unknown size, a parameter that the filter lets wander: a missing force stands in N,
a missing flow in kg/s, a missing heat in W, whatever state rates it drives by the part's equations.

Source: diagnosis.md 1.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.effect import Conditions, Effect, Expression, Term, strength
from workbench.fitting.starts import guessed_states
from workbench.fitting.windows import Windows
from workbench.part import BalanceEquation
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs

PROCESS_SHARE = 0.3  # of the smaller size of a missing rate: what no model is without
MASS_SHARE = 0.01  # of the scale of a mass of gas, which nobody measures
SLOW = 0.1  # of that size: where a recording changes less in a second, its own pace counts
POINTS = 50  # of a recording at which flows are turned into rates


@dataclass(frozen=True, kw_only=True)
class MissingFlow(Effect):
    """A flow of unknown size into one balance of a part."""

    part: str
    equation: BalanceEquation
    flow: Expression = strength(typical=1.0, lower=-np.inf)

    def terms(self, now: Conditions) -> Iterator[Term]:
        yield self.equation.kind.of(self.part, self.flow, now)


@dataclass(frozen=True)
class Suspect:
    """A balance that may lack a flow.

    balance       its name, ``chamber_a.mass``
    term          the flow by name with its unit
    parameter     the flow in the plant of :func:`with_missing_flows`
    intensities   what the flow may gain per square root of a second, in its unit
    """

    balance: str
    term: str
    parameter: str
    intensities: tuple[float, ...]


def with_missing_flows(plant: Plant) -> tuple[Plant, tuple[MissingFlow, ...]]:
    """The plant with an unknown flow into every balance whose state it has, and these flows."""
    flows = tuple(
        MissingFlow(
            name=f"missing@{part.name}.{equation.balance.value}", part=part.name, equation=equation
        )
        for part in plant.parts
        for equation in part.balances
        if f"{part.name}.{equation.state}" in plant.state_list
    )
    return plant.with_effects(*flows), flows


def suspects(
    plant: Plant, flows: Sequence[MissingFlow], recording: Recording, pace: Pace
) -> list[Suspect]:
    """One for each flow, with intensities in its own unit.

    A flow is as large as the rate it makes: its intensity is that of the rate, times what the flow
    must be for a rate of one, which is the median over the recording (m for a force, V/(k R T) for
    a mass flow).  Where it moves nothing, there is nothing to suspect.
    """
    found = []
    for flow, answer in zip(flows, _answers(plant, flows, recording), strict=True):
        if answer <= 0.0:
            continue
        wandering = pace.wandering(f"{flow.part}.{flow.equation.state}")
        found.append(
            Suspect(
                balance=flow.place or "",
                term=flow.equation.term,
                parameter=f"{flow.name}.flow",
                intensities=tuple(wandering * rate / answer for rate in flow.equation.rates),
            )
        )
    return found


def _answers(plant: Plant, flows: Sequence[MissingFlow], recording: Recording) -> list[float]:
    """How much rate of its state a flow of one makes, median over the recording."""
    model, p = plant.model, plant.nominal[2]
    rows = [model.states.index(f"{flow.part}.{flow.equation.state}") for flow in flows]
    columns = [model.parameters.index(f"{flow.name}.flow") for flow in flows]
    slopes = [
        ca.jacobian(model.rates[row], model.symbols[3][column])
        for row, column in zip(rows, columns, strict=True)
    ]
    answer = ca.Function("answer", [*model.symbols], [ca.densify(ca.vertcat(*slopes))])
    at = np.unique(np.linspace(0, len(recording) - 1, POINTS).astype(int))
    u, d = (values[:, at] for values in inputs(plant, recording))
    x = guessed_states(plant, recording)[0][:, at]
    values = answer.map(len(at))(x, u, d, np.tile(p[:, None], len(at))).full()
    return [float(each) for each in np.median(np.abs(values), axis=1)]


@dataclass(frozen=True)
class Pace:
    """How slow recorded states are against what their balances take for small.

    shares     rate as recorded over the smaller rate of the balance, by state; a state that
               changes at least a tenth as fast as that does not stand here, and counts 1
    window_s   time over which slow states are seen to change
    """

    shares: Mapping[str, float]
    window_s: float

    def wandering(self, state: str) -> float:
        """Factor on a missing rate's intensity: a slow one takes a window to become as large."""
        return self.shares[state] / np.sqrt(self.window_s) if state in self.shares else 1.0


def pace_of(windows: Windows, plant: Plant) -> Pace:
    """The pace of a recording; a rate is the slope that gives the spread seen in the windows."""
    length_s = windows.length * windows.recordings[0].sample_time_s
    spread = np.sqrt(np.mean(windows.activity**2, axis=1))
    recorded = dict(zip(windows.plant.measured, np.sqrt(12.0) * spread / length_s, strict=True))
    shares = {
        name: recorded[name] / rate
        for name, rate in _smaller_rates(plant).items()
        if 0.0 < recorded.get(name, 0.0) < SLOW * rate
    }
    return Pace(shares, length_s)


def _smaller_rates(plant: Plant) -> dict[str, float]:
    """The smaller size of what a rate may lack, by state."""
    return {
        f"{part.name}.{equation.state}": equation.rates[0]
        for part in plant.parts
        for equation in part.balances
    }


def process_noise(plant: Plant, pace: Pace) -> dict[str, float]:
    """Standard deviation that each state gains per square root of a second in any model."""
    rates, found = _smaller_rates(plant), {}
    for name, state in plant.state_list.items():
        part, _, quantity = name.rpartition(".")
        if name in rates:
            found[name] = PROCESS_SHARE * pace.shares.get(name, 1.0) * rates[name]
        elif quantity == "mass_kg":
            share = pace.shares.get(f"{part}.pressure_pa", 1.0)
            found[name] = MASS_SHARE * share * state.scale
    return found
