"""A shift from Low to Neutral, the same mass flows into every model of the gearbox actuator.

Paper 003, Fig. 4, feeds the flows of its nonlinear model into its state-space model: the pressure
in chamber 1 comes out smaller, and the piston starts earlier, is slower and does not reach Neutral.
The paper blames the Coulomb friction that is left out.  Here the same is done with all that its
linear model differs in: signs, dry friction, detent, operating points.

The paper does not say where it linearised.  MIDDLE is chosen: of the points tried it comes nearest
to what the paper tells of its figure (physics.md section 7).

Source: S003-3 of physics.md section 5.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import casadi as ca
import numpy as np

from linearize.discrete import sampled
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.modes import Box, Interval, Mode, hybrid_modes, placed_at
from linearize.reduction import DesignModel
from linearize.shift_modes import SLIDING_M_S, held_at_neutral, side_cut
from linearize.shifting import FLOWS, OMITTED, POSITION, STATES, VELOCITY, Omission, shift_model
from studies.printed_signs import as_printed
from workbench.plants.gearbox import COMMANDS, STROKE_M, gearbox
from workbench.recording import Recording
from workbench.rosenbrock import controlled_step
from workbench.simulation import simulate

STEP_S, WINDOW_S = 2e-5, 0.03
MOVED_M = 1e-4
PIECES = 6  # operating points along the way
TOLERANCES = np.array([20.0, 20.0, 2e-8, 2e-3])  # of one step of (p1, p2, x, v)
MIDDLE = {
    **dict(zip(STATES, (4e5, 2e5, -STROKE_M / 2, 1.0), strict=True)),
    **dict.fromkeys(FLOWS, 0.0),
}
START, X, V = -STROKE_M, 2, 3


@dataclass(frozen=True)
class Shift:
    """The plant's own shift: its flows, and its state (p1, p2, x, v) at every sample.

    flows      into chambers 1 and 2, held over each step, kg/s, shape (2, n)
    states     shape (4, n + 1)
    """

    flows: np.ndarray
    states: np.ndarray

    @property
    def time_s(self) -> np.ndarray:
        """Time of every state, shape (n + 1,)."""
        return STEP_S * np.arange(self.states.shape[1])

    @cached_property
    def arrival(self) -> int:
        """First sample at Neutral; 0 where there is none."""
        return arrival(self.states)

    def at(self, place_m: float) -> dict[str, float]:
        """State and flows where the piston first passes a place."""
        k = int(np.argmax(self.states[X] >= place_m))
        values = (*self.states[:, k], *self.flows[:, k])
        return dict(zip((*STATES, *FLOWS), map(float, values), strict=True))


def arrival(states: np.ndarray) -> int:
    """First sample at Neutral of states (4, n); 0 where there is none."""
    return int(np.argmax(states[X] >= 0.0))


def shift() -> Shift:
    """The plant with its valves: both energised at Low, vented and at rest."""
    plant, n = gearbox(START).lean(), round(WINDOW_S / STEP_S)
    on = np.ones((len(COMMANDS), n + 1))
    run = simulate(plant, Recording("L to N", STEP_S, dict(zip(COMMANDS, on, strict=True))))
    model = plant.model
    passed = [model.flows[f"valve_{k}", "MassFlow", f"chamber_{k}"] for k in (1, 2)]
    f = ca.Function("flows", [*model.symbols], [ca.vertcat(*passed)])
    x, p = run.rows(model.states), np.tile(plant.nominal[2][:, None], n + 1)
    flows = f(x, on, np.zeros((0, n + 1)), p).full()
    return Shift(0.5 * (flows[:, 1:] + flows[:, :-1]), run.rows(STATES))


def fed(seen: Shift) -> np.ndarray:
    """The plant with all its effects, but the flows for valves: states, shape (4, n + 1)."""
    plant = shift_model(gearbox(START)).plant
    flows = np.column_stack([seen.flows, seen.flows[:, -1]])
    run = simulate(plant, Recording("fed", STEP_S, dict(zip(FLOWS, flows, strict=True))))
    return run.rows(STATES)


def reduced(*kept: Omission) -> DesignModel:
    """The paper's reduced model, these left in."""
    return shift_model(gearbox(START), tuple(each for each in OMITTED if each not in kept))


def nonlinear(model: DesignModel, seen: Shift) -> np.ndarray:
    """The reduced model before it is linearised, held once it is at Neutral; shape (4, n + 1)."""
    x, u, none = ca.SX.sym("x", 4), ca.SX.sym("u", 2), ca.SX(0, 1)
    step = controlled_step((x, u, none, none), model.f(x, u)[0], STEP_S, TOLERANCES)
    return _held(model, seen, lambda state, flow: step(state, flow, [], []).full().ravel())


def one_point(model: DesignModel) -> tuple[Mode, ...]:
    """One linear model for the whole way, at a point in mid travel with the flows at zero."""
    (whole,) = (part for part in side_cut(model) if part.upper <= 0.0)
    cut = {POSITION: [replace(whole, point=MIDDLE[POSITION])]}
    return hybrid_modes(model.plant, cut, placed_at(MIDDLE), model).modes


def along(model: DesignModel, seen: Shift, pieces: int = PIECES) -> tuple[Mode, ...]:
    """As many modes below Neutral, each over an equal time of the plant's way.

    The cut is one of places: where the piston is at those times.  Each point is what the plant
    passes in the middle of its time.
    """
    first = int(np.argmax(np.diff(seen.states[X]) > 0.0))
    marks = np.linspace(first, seen.arrival, 2 * pieces + 1).round().astype(int)
    places_m = seen.states[X, marks]
    edges_m = [-inf, *map(float, places_m[2:-1:2]), 0.0]
    cut = [
        Interval(f"piece {k + 1}", *edges_m[k : k + 2], float(places_m[2 * k + 1]))
        for k in range(pieces)
    ]

    def placed(model: DesignModel, box: Box) -> OperatingPoint:
        return operating_point(model, sliding(seen.at(box[POSITION].point)))

    return hybrid_modes(model.plant, {POSITION: cut}, placed, model).modes


def sliding(at: dict[str, float]) -> dict[str, float]:
    """The same point at a speed at which dry friction is all there."""
    return {**at, VELOCITY: max(at[VELOCITY], SLIDING_M_S)}


def printed(model: DesignModel, modes: Iterable[Mode]) -> tuple[Mode, ...]:
    """The modes with the signs of the paper."""
    return tuple(as_printed(model, mode) for mode in modes)


def linear(model: DesignModel, modes: tuple[Mode, ...], seen: Shift) -> np.ndarray:
    """The modes, each in its piece of the way, held once at Neutral; shape (4, n + 1).

    A piston at rest that dry friction would drive backwards stays where it is.
    """
    steps = [sampled(mode, STEP_S) for mode in modes]

    def advanced(state: np.ndarray, flow: np.ndarray) -> np.ndarray:
        inside = (k for k, m in enumerate(modes) if m.box[POSITION].contains(state[X]))
        k = next(inside, len(modes) - 1)
        rest = np.array([*state[:X], state[X], 0.0])
        rates = modes[k].rates(rest, flow)
        if state[V] <= 0.0 and rates[V] <= 0.0:
            return np.array([*(rest + STEP_S * rates)[:X], *rest[X:]])
        return steps[k].F @ state + steps[k].G @ flow + steps[k].offset

    return _held(model, seen, advanced)


def _held(model: DesignModel, seen: Shift, advanced) -> np.ndarray:
    """Run from the start; from Neutral on only the pressures go on, by the ninth mode."""
    neutral = sampled(held_at_neutral(model), STEP_S)
    rows, there = [seen.states[:, 0]], False
    for flow in seen.flows.T:
        last = rows[-1]
        there = there or last[X] >= 0.0
        if there:
            rows.append(np.array([*(neutral.F @ last[:X] + neutral.G @ flow), 0.0, 0.0]))
        else:
            rows.append(advanced(last, flow))
    return np.array(rows).T
