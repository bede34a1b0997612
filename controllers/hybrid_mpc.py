"""Hybrid MPC of a gearbox actuator: which valve switches when, searched over all blocked sequences.

Two valves are on or off, each for a least time.  At every sample

1. the last plan, shifted, is run through the reduced model, which is linearised along it;
2. under these affine modes every pair of plans of the two valves is ranked, exactly;
3. the best of them, the last plan with one switch moved, and no switch at all are run through the
   nonlinear model, and the best is taken.

So the search is exhaustive over the blocked sequences on the affine modes, and its work is the same
at every sample.  What the affine modes miss (a stop, the side of Neutral, flows that turn subsonic)
is judged by the nonlinear model: a plan is only changed for one that this prefers.

A shift is fast and lands softly by its cost, see :mod:`controllers.shift_cost`; a switch has
a price, and what lies within the tolerance costs nothing, so that at rest nothing switches.

Without an estimate that is finite the last plan goes on.

Source: paper 003 Sec. V for the modes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from controllers.shift_cost import ShiftCost
from controllers.shift_prediction import (
    ShiftPrediction,
    drives,
    shift_prediction,
)
from controllers.spec import ranged
from controllers.switching_plans import Plans, plans, switching_times
from linearize.modes import HybridModel
from linearize.shifting import STATES
from linearize.valve_response import MASK, ValveResponse, age, packed, valve_response
from workbench.called import prepared
from workbench.contracts import Command, Estimate
from workbench.errors import InputError, Message

VALVES = ("valve_1", "valve_2")
NEAR_M = 1e-3  # a reference this near to a dedicated position means that position


@dataclass(frozen=True, kw_only=True)
class HybridMpcSpec:
    """Numbers of a hybrid MPC design.

    Attributes
    ----------
    horizon
        Samples ahead: a shift is braked in about 15 ms.
    hold_s
        Least time between two switches of a valve.
    within_m, beyond_m, beyond_weight, landing_m_s, neutral_m_s, landing_s, end_s
        See :class:`controllers.shift_cost.ShiftCost`.
    switch_s
        Price of a switch: how long the whole way may take longer to save it.
    judged
        Pairs of plans that the nonlinear model judges at each sample.
    """

    sample_time_s: float = ranged(1e-3, least=1e-3, most=2e-3)
    horizon: int = ranged(26, least=16, most=60)
    hold_s: float = ranged(4e-3, least=3e-3, most=2e-2)
    within_m: float = 1e-4
    beyond_m: float = 2.5e-4
    beyond_weight: float = 240.0
    landing_m_s: float = 0.6
    neutral_m_s: float = 0.4
    landing_s: float = 0.04
    end_s: float = 5e-3
    brake_m_s2: float = 400.0
    brake_after_s: float = 5e-3
    switch_s: float = 1.5e-4
    judged: int = ranged(31, least=1, most=400)

    @property
    def cost(self) -> ShiftCost:
        """The part that is the cost of a shift."""
        names = ShiftCost.__dataclass_fields__
        return ShiftCost(**{name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class ShiftMemory:
    """What has been sent and what is planned.

    sent        the last commands of each valve as integers, the newest lowest
    plan        commands ahead, shape (2, N), the first of them sent
    target_m    where the shift goes, and ``side``, the sign of the way
    """

    sent: tuple[int, int] = (0, 0)
    plan: np.ndarray | None = None
    target_m: float | None = None
    side: float = 1.0


@dataclass(frozen=True)
class HybridMpc:
    """Shifts to the dedicated position that the reference names; see the module.

    ``drives`` are the commands that end there when they are held, by position.
    """

    spec: HybridMpcSpec
    responses: tuple[ValveResponse, ValveResponse]
    prediction: ShiftPrediction
    drives: Mapping[float, tuple[int, int]]
    preview: int = 1

    @property
    def sample_time_s(self) -> float:
        return self.spec.sample_time_s

    def start(self) -> Command:
        return Command(np.zeros(2), ShiftMemory())

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        x = estimate.pick(STATES)
        memory = self._towards(self._dedicated(float(reference[0, 0])), last.memory, float(x[2]))
        shifted = np.column_stack([memory.plan[:, 1:], memory.plan[:, -1:]])
        query = np.array([memory.target_m, memory.side, float(memory.target_m != 0.0)])
        plan, notes = self._best(x, query, memory.sent, shifted)
        sent = tuple((s << 1 | int(u)) & MASK for s, u in zip(memory.sent, plan[:, 0], strict=True))
        kept = replace(memory, sent=sent, plan=plan)
        return Command(plan[:, 0].astype(float), kept, notes)

    def _towards(self, target_m: float, memory: ShiftMemory, place_m: float) -> ShiftMemory:
        """The memory with this target; a new one begins with the plan to drive there at once."""
        if target_m == memory.target_m:
            return memory
        ahead, hold = np.arange(-1, self.spec.horizon - 1), self.responses[0].hold
        rows = [
            np.where(ahead < hold - age(sent), sent & 1, level)
            for sent, level in zip(memory.sent, self.drives[target_m], strict=True)
        ]
        side = 1.0 if target_m >= place_m else -1.0
        return replace(memory, plan=np.array(rows), target_m=target_m, side=side)

    def _dedicated(self, wanted_m: float) -> float:
        for place_m in self.drives:
            if abs(wanted_m - place_m) < NEAR_M:
                return place_m
        places = " or ".join(f"{1e3 * place_m:g}" for place_m in self.drives)
        what = f"hybrid-mpc cannot hold the main piston at {1e3 * wanted_m:g} mm"
        raise InputError(Message(what, expected=places))

    def _best(
        self, x: np.ndarray, query: np.ndarray, sent: tuple[int, int], before: np.ndarray
    ) -> tuple[np.ndarray, Mapping[str, float]]:
        """The plan, shape (2, N), and what is noted of the search."""
        if not np.isfinite(x).all():
            return before, {"fallback": 1.0}
        held = np.repeat([[[s & 1] for s in sent]], self.spec.horizon, axis=2)
        near = np.concatenate([before[None], held, self._moved(sent, before)])[: self.spec.judged]
        ranked = self._ranked(x, query, sent, before)[: self.spec.judged + 1 - len(near)]
        asked = np.concatenate([near, ranked])
        shares = self._shares(sent, asked.transpose(1, 0, 2))
        every = np.reshape(shares, (2, -1)).T.ravel()
        (costs,) = self._calls[2](x, every, query)
        standing = np.broadcast_to([[s & 1] for s in sent], (len(asked), 2, 1))
        switches = np.abs(np.diff(asked, axis=2, prepend=standing)).sum(axis=(1, 2))
        costs = costs + self._price * switches
        costs[~np.isfinite(costs)] = np.inf
        best = int(np.argmin(costs))
        cost_s = float(costs[best]) * self.sample_time_s
        return asked[best], {"cost_s": cost_s, "changed": float(best > 0), "fallback": 0.0}

    def _ranked(
        self, x: np.ndarray, query: np.ndarray, sent: tuple[int, int], before: np.ndarray
    ) -> np.ndarray:
        """The best pairs of plans under the modes along the last plan, shape (judged, 2, N)."""
        N, both = self.spec.horizon, [self.plans(s) for s in sent]
        along = np.array(self._shares(sent, before))
        way, columns = self._calls[0](x, along.T.ravel())
        by_share = columns.reshape(2 * N, 2 * N)  # a row for each share, as CasADi stores columns
        moved = [
            ((response.ahead(s, p.packed) - along[v]) @ by_share[N * v : N * (v + 1)]).ravel()
            for v, (response, s, p) in enumerate(zip(self.responses, sent, both, strict=True))
        ]
        (costs,) = self._calls[1](way, *moved, query, x)
        costs += self._price * np.add.outer(*(p.switches for p in both)).ravel()
        costs[~np.isfinite(costs)] = np.inf
        chosen = np.argpartition(costs, self.spec.judged)[: self.spec.judged]
        chosen = chosen[np.argsort(costs[chosen])]
        picked = np.divmod(chosen, len(both[0].switches))
        pairs = [p.commands[k] for p, k in zip(both, picked, strict=True)]
        return np.stack(pairs, axis=1)

    def _moved(self, sent: tuple[int, int], before: np.ndarray) -> np.ndarray:
        """The last plan with one switch a sample or two earlier or later, shape (n, 2, N)."""
        found = []
        for valve, (response, s) in enumerate(zip(self.responses, sent, strict=True)):
            flipped = before[valve] ^ flips(self.spec.horizon)
            rows = flipped[response.keeps(s, packed(flipped))]
            plans_of_both = np.repeat(before[None], len(rows), axis=0)
            plans_of_both[:, valve] = rows
            found.append(plans_of_both)
        return np.concatenate(found)

    def _shares(self, sent: tuple[int, int], commands: np.ndarray) -> list[np.ndarray]:
        """Shares of each valve under commands of shape (2, ..., N)."""
        pairs = zip(self.responses, sent, commands, strict=True)
        return [response.ahead(s, packed(ahead)) for response, s, ahead in pairs]

    @cached_property
    def _calls(self) -> tuple[Callable[..., list[np.ndarray]], ...]:
        """The functions of the prediction, ready to be called at every sample."""
        found = self.prediction
        return tuple(prepared(f) for f in (found.linearised, found.ranked, found.judged))

    def __getstate__(self) -> dict[str, object]:
        """Without what another process makes anew."""
        return {key: value for key, value in self.__dict__.items() if key != "_calls"}

    def plans(self, sent: int) -> Plans:
        """What one valve may do after these commands."""
        hold = self.responses[0].hold
        return plans(sent & 1, max(hold - age(sent), 0), hold, self.spec.horizon)

    @property
    def _price(self) -> float:
        """Of a switch, in samples of the whole way."""
        return self.spec.switch_s / self.sample_time_s


@cache
def flips(horizon: int) -> np.ndarray:
    """One command and two following ones, 1 where they change, shape (2 N - 1, N)."""
    one = np.eye(horizon, dtype=int)
    return np.concatenate([one, one[:-1] + one[1:]])


def hybrid_mpc(hybrid: HybridModel, spec: HybridMpcSpec | None = None) -> HybridMpc:
    """The design for the gearbox actuator of a hybrid model.

    Raises
    ------
    InputError
        If more pairs are to be judged than there are.
    """
    spec, plant = spec or HybridMpcSpec(), hybrid.plant
    hold = int(np.ceil(spec.hold_s / spec.sample_time_s - 1e-9))
    number = len(switching_times(0, hold))
    if spec.judged >= number**2:
        raise InputError(Message(f"hybrid-mpc.judged is {spec.judged}", expected=f"< {number**2}"))
    sizes = spec.sample_time_s, spec.horizon, number, spec.judged + 1
    return HybridMpc(
        spec=spec,
        responses=tuple(valve_response(plant, v, spec.sample_time_s, hold) for v in VALVES),
        prediction=shift_prediction(plant, spec.cost, *sizes),
        drives=drives(plant, spec.sample_time_s),
    )
