"""The balances that may lack a flow, and a filter in which each may have an unknown one.

Every part declares what it balances (:attr:`workbench.effect.Part.balances`).  Here each balance
gets a term of unknown size, a parameter that the filter lets wander: a missing force stands in N,
a missing flow in kg/s, a missing heat in W, whatever state rates it drives by the part's equations.

Source: diagnosis.md 1.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.balances import BalanceEquation
from workbench.effect import (
    Conditions,
    Effect,
    Expression,
    State,
    Term,
    strength,
)
from workbench.fitting.starts import guessed_states
from workbench.fitting.window_length import moves
from workbench.fitting.windows import Windows
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs

PROCESS_SHARE = 0.3  # of the smaller size of a missing rate: what no model is without
MASS_SHARE = 0.01  # of the scale of a mass of gas, which nobody measures
RECORDED_SHARES = (0.01, 0.1, 1.0, 10.0)  # of a recorded rate, to be sought where nothing moves
MASS = "mass_kg"
POINTS = 50  # of a recording at which flows are turned into rates


@dataclass(frozen=True, kw_only=True)
class MissingFlow(Effect):
    """A flow of unknown size into one balance of a part."""

    part: str
    equation: BalanceEquation
    flow: Expression = strength(typical=1.0, lower=-np.inf)

    def terms(self, now: Conditions) -> Iterator[Term]:
        yield self.equation.missing(self.part, self.flow, now)


@dataclass(frozen=True)
class Suspect:
    """A balance that may lack a flow.

    balance       its name, ``chamber_a.mass``
    term          the flow by name with its unit
    state         whose rate the flow drives
    parameter     the flow in the plant of :func:`with_missing_flows`
    intensities   what the flow may gain per square root of a second, in its unit
    """

    balance: str
    term: str
    state: str
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
    plant: Plant, flows: Sequence[MissingFlow], recording: Recording, astray: Wandering
) -> list[Suspect]:
    """One for each flow, with intensities in its own unit.

    A flow is as large as the rate it makes: its intensity is that of the rate, times what the flow
    must be for a rate of one, which is the median over the recording (m for a force, V/(k R T) for
    a mass flow).  Where it moves nothing, there is nothing to suspect.
    """
    return [
        Suspect(
            balance=flow.place or "",
            term=flow.equation.term,
            state=f"{flow.part}.{flow.equation.state}",
            parameter=f"{flow.name}.flow",
            intensities=tuple(
                rate / answer for rate in astray.rates[f"{flow.part}.{flow.equation.state}"]
            ),
        )
        for flow, answer in zip(flows, _answers(plant, flows, recording), strict=True)
        if answer > 0.0
    ]


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
class Wandering:
    """How fast states go astray, by name: what the filter takes for possible.

    rates      sizes of a missing rate per square root of a second that are tried
    process    standard deviation that a state gains per square root of a second in any model
    """

    rates: Mapping[str, tuple[float, ...]]
    process: Mapping[str, float]


def wandering(plant: Plant, windows: Windows) -> Wandering:
    """As the balances declare it; where nothing moves, as fast as the recording shows.

    What moves is much alike from one drive to the next.  A vessel fills in a tenth of a second or
    loses its gas in hours: there a missing rate is sought from a hundredth of the recorded one to
    ten times that, as what it may become within a window, and in a window the model may go astray
    by the sensor's noise.
    """
    rates = {f"{p.name}.{e.state}": e.rates for p in plant.parts for e in p.balances}
    process = {name: PROCESS_SHARE * rates[name][0] for name in plant.state_list if name in rates}
    masses = {name: MASS_SHARE * s.scale for name, s in _masses(plant).items()}
    if not moves(plant):
        root_s = np.sqrt(windows.length * windows.recordings[0].sample_time_s)
        noise = dict(zip(windows.plant.measured, windows.noise, strict=True))
        for name, rate in _recorded_rates(windows).items():
            if name in rates and rate > 0.0:
                rates[name] = tuple(share * rate / root_s for share in RECORDED_SHARES)
                slower = noise[name] / root_s / process[name]
                process[name] *= slower
                mass = name.replace("pressure_pa", MASS)
                masses |= {mass: slower * masses[mass]} if mass in masses else {}
    return Wandering(rates, process | masses)


def _recorded_rates(windows: Windows) -> dict[str, float]:
    """How fast each output changes: the slope that gives the spread seen in the windows."""
    spread = np.sqrt(12.0 * np.mean(windows.activity**2, axis=1))
    length_s = windows.length * windows.recordings[0].sample_time_s
    return dict(zip(windows.plant.measured, (spread / length_s).tolist(), strict=True))


def _masses(plant: Plant) -> dict[str, State]:
    return {name: s for name, s in plant.state_list.items() if name.endswith(f".{MASS}")}
