"""Hybrid MPC of a gearbox actuator: which valve switches when, searched over all blocked sequences.

Two valves are on or off, each for a least time.  At every sample

1. the last plan, shifted, is run through the reduced model, which is linearised along it;
2. under these affine modes every pair of plans of the two valves is ranked, exactly;
3. the best of them and plans near the last ones, see :mod:`controllers.plan_search`, are run
   through the nonlinear model, and the best is taken.

So the search is exhaustive over the blocked sequences on the affine modes, and its work is bounded.
What the affine modes miss (a stop, the side of Neutral, flows that turn subsonic) is judged by the
nonlinear model; on the way to Neutral, where that is most, every second sample judges more plans
instead of ranking any.  A shift from rest begins with plans that are searched with the design, see
:mod:`controllers.launches`.

No two valves switch at the same instants.  Where the estimator tells the strength and the flow gain
of each, as :class:`estimators.shift_filter.ShiftFilter` does, plans are predicted with these.

A shift is fast and lands softly by its cost, see :mod:`controllers.shift_cost`; a switch has
a price, and what lies within the tolerance costs nothing, so that at rest nothing switches.

Without an estimate that is finite the last plan goes on; a new target waits for one.

Source: paper 003 Sec. V for the modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from controllers.launches import Launches, launches
from controllers.plan_search import PlanSearch
from controllers.shift_cost import ShiftCost
from controllers.shift_prediction import drives, query, shift_prediction
from controllers.spec import ranged
from controllers.switching_plans import switching_times
from linearize.modes import HybridModel
from linearize.shift_sample import softened
from linearize.shifting import POSITION, STATES, VELOCITY
from linearize.valve_response import MASK, age, valve_responses
from linearize.valve_sample import VALVES
from linearize.valve_spread import AS_DESIGNED, FLOW_GAINS, STRENGTHS, Learned
from workbench.contracts import Command, Estimate
from workbench.errors import InputError, Message

SURE = 3.0  # standard deviations beyond which a speed is no noise
LOST_M = 2e-3  # no bounce goes as far: what is further off a position that it met has left it
STRONGEST, MOST_GAIN = 2.5, 0.25  # of what a filter learns of a valve: no further off is likely
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
    within_m, beyond_m, beyond_weight, beyond_later, bounced, landing_m_s, neutral_m_s, arriving_m_s
        See :class:`controllers.shift_cost.ShiftCost`.
    landing_s, end_s, brake_m_s2, brake_after_s
        See there.
    switch_s
        Price of a switch: how long the whole way may take longer to save it.
    judged
        Pairs of plans that the nonlinear model judges at a sample that ranks others, besides the
        last plan; twice as many at one that does not.
    """

    sample_time_s: float = ranged(1e-3, least=1e-3, most=2e-3)
    horizon: int = ranged(26, least=16, most=60)
    hold_s: float = ranged(4e-3, least=3e-3, most=1.9e-2)
    within_m: float = 1e-4
    beyond_m: float = 2e-4
    beyond_weight: float = 240.0
    beyond_later: float = ranged(0.2, most=1.0)
    bounced: float = ranged(0.1, most=1.0)
    landing_m_s: float = 0.6
    neutral_m_s: float = 0.35
    arriving_m_s: float = 0.3
    landing_s: float = 0.04
    end_s: float = 5e-3
    brake_m_s2: float = 400.0
    brake_after_s: float = 5e-3
    switch_s: float = ranged(1.5e-4, most=0.05, above=True)
    judged: int = ranged(28, least=8, most=400)

    @property
    def held(self) -> int:
        """Samples for which a command stays: none is cut, so they may take longer than asked."""
        return int(np.ceil(self.hold_s / self.sample_time_s - 1e-9))

    @property
    def cost(self) -> ShiftCost:
        """The part that is the cost of a shift."""
        names = ShiftCost.__dataclass_fields__
        return ShiftCost(**{name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class ShiftMemory:
    """What has been sent and what is planned.

    sent        the last commands of each valve as integers, the newest lowest
    plans       commands from the last sample on, shape (k, 2, N), the best first
    start_m, target_m    where the shift was seen to begin and where it ends
    turn        its samples so far
    met         whether the piston was at the target, as near as tolerated
    """

    sent: tuple[int, int] = (0, 0)
    plans: np.ndarray | None = None
    start_m: float = 0.0
    target_m: float | None = None
    turn: int = 0
    met: bool = False

    @property
    def plan(self) -> np.ndarray:
        """The best plan, whose first commands have been sent, shape (2, N)."""
        return self.plans[0]


@dataclass(frozen=True)
class HybridMpc:
    """Shifts to the dedicated position that the reference names; see the module.

    ``drives`` are the commands that end there when they are held, by position in m; ``launches``
    the plans with which a shift begins, by where it begins and ends, in m.
    """

    spec: HybridMpcSpec
    search: PlanSearch
    drives: Mapping[float, tuple[int, int]]
    launches: Launches
    preview: int = 1

    @property
    def sample_time_s(self) -> float:
        return self.spec.sample_time_s

    def start(self) -> Command:
        return Command(np.zeros(2), ShiftMemory())

    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        target_m = self._dedicated(float(reference[0, 0]))
        x = self._seen(estimate, target_m)
        if not np.isfinite(x).all():
            return self._sent(self._blind(last.memory), {"fallback": 1.0})
        place_m = float(x[STATES.index(POSITION)])
        memory = self._towards(target_m, last.memory, place_m)
        full, shifted = self._full_drive(target_m, memory.sent), _shifted(memory.plans)
        asked_for = query(target_m, memory.start_m, place_m, memory.met)
        search = replace(self.search, learned=_learned(estimate))
        plans, costs = search.best(x, asked_for, memory.sent, shifted, full, memory.turn)
        changed = float((plans[0] != shifted[0]).any())
        cost_s = float(costs[0]) * self.sample_time_s
        notes = {"cost_s": cost_s, "changed": changed, "fallback": 0.0}
        return self._sent(replace(memory, plans=plans), notes)

    def _sent(self, memory: ShiftMemory, notes: Mapping[str, float]) -> Command:
        """The first commands of the best plan."""
        now = memory.plan[:, 0]
        sent = tuple((s << 1 | int(u)) & MASK for s, u in zip(memory.sent, now, strict=True))
        return Command(now.astype(float), replace(memory, sent=sent, turn=memory.turn + 1), notes)

    def _blind(self, memory: ShiftMemory) -> ShiftMemory:
        """The old plans go on, to the old target; before any the valves stay as they are."""
        if memory.plans is not None:
            return replace(memory, plans=_shifted(memory.plans))
        return replace(memory, plans=self.search.held(memory.sent)[None])

    def _seen(self, estimate: Estimate, target_m: float) -> np.ndarray:
        """The state; on the target a speed that may be noise is none, so that nothing switches."""
        x = np.array(estimate.pick(STATES))
        place, speed = STATES.index(POSITION), STATES.index(VELOCITY)
        row = estimate.names.index(VELOCITY)
        noise_m_s = SURE * np.sqrt(estimate.covariance[row, row])
        if abs(x[place] - target_m) < self.spec.within_m and abs(x[speed]) < noise_m_s:
            x[speed] = 0.0
        return x

    def _towards(self, target_m: float, memory: ShiftMemory, place_m: float) -> ShiftMemory:
        """The memory with this target and whether it was met.

        What bounces off an end has met it; what is pushed away further is on its way again.  A new
        target begins with the plans from the nearest position.  Full drive is the last of them: it
        is what is left if valves have just been switched.
        """
        off_m = abs(place_m - target_m)
        near = off_m < self.spec.within_m
        if target_m == memory.target_m:
            return replace(memory, met=near or (memory.met and off_m < LOST_M))
        full = self._full_drive(target_m, memory.sent)[None]
        nearest_m = min(self.drives, key=lambda start_m: abs(start_m - place_m))
        known = np.concatenate([self.launches.get((nearest_m, target_m), full[:0]), full])
        plans = known[self.search.keep(memory.sent, known)]
        last = np.broadcast_to(self.search.held(memory.sent)[:, :1], (len(plans), 2, 1))
        plans = np.concatenate([last, plans[:, :, :-1]], axis=2)
        return replace(memory, plans=plans, start_m=place_m, target_m=target_m, turn=0, met=near)

    def _full_drive(self, target_m: float, sent: tuple[int, int]) -> np.ndarray:
        """Both valves as soon as they may as they end at the target, shape (2, N)."""
        ahead, hold = np.arange(self.spec.horizon), self.search.responses[0].hold
        rows = [
            np.where(ahead < hold - age(s), s & 1, level)
            for s, level in zip(sent, self.drives[target_m], strict=True)
        ]
        return np.array(rows)

    def _dedicated(self, wanted_m: float) -> float:
        for place_m in self.drives:
            if abs(wanted_m - place_m) < NEAR_M:
                return place_m
        places = " or ".join(f"{1e3 * place_m:g}" for place_m in self.drives)
        what = f"hybrid-mpc cannot hold the main piston at {1e3 * wanted_m:g} mm"
        raise InputError(Message(what, expected=places))


def _learned(estimate: Estimate) -> tuple[Learned, Learned]:
    """What is known of each valve; of an estimator that does not tell, nothing."""
    if STRENGTHS[0] not in estimate.names:
        return AS_DESIGNED, AS_DESIGNED
    strengths = np.clip(estimate.pick(STRENGTHS), -STRONGEST, STRONGEST).tolist()
    gains = np.clip(estimate.pick(FLOW_GAINS), -MOST_GAIN, MOST_GAIN).tolist()
    first, second = map(Learned, strengths, gains)
    return first, second


def _shifted(plans: np.ndarray) -> np.ndarray:
    """Plans a sample later, shape (k, 2, N); the last commands go on."""
    return np.concatenate([plans[:, :, 1:], plans[:, :, -1:]], axis=2)


def hybrid_mpc(hybrid: HybridModel, spec: HybridMpcSpec | None = None) -> HybridMpc:
    """The design for the gearbox actuator of a hybrid model.

    Raises
    ------
    InputError
        If more pairs are to be judged than there are, or no pulse ends within the horizon.
    """
    spec, plant = spec or HybridMpcSpec(), hybrid.plant
    hold = spec.held
    if hold >= spec.horizon:
        found = f"is {spec.hold_s:g}, {hold} of {spec.horizon} samples ahead"
        expected = "a pulse that ends within the horizon"
        raise InputError(Message(found, "hybrid-mpc.hold_s", expected))
    number = len(switching_times(0, hold))
    if spec.judged >= number**2:
        raise InputError(Message(f"is {spec.judged}", "hybrid-mpc.judged", f"< {number**2}"))
    sizes = spec.sample_time_s, spec.horizon, number
    search = PlanSearch(
        responses=valve_responses(plant, VALVES, spec.sample_time_s, hold),
        prediction=shift_prediction(plant, spec.cost, *sizes),
        horizon=spec.horizon,
        judged=spec.judged,
        price=spec.switch_s / spec.sample_time_s,
    )
    ends = drives(plant, spec.sample_time_s)
    return HybridMpc(spec, search, ends, launches(search, softened(plant).initial, ends))
