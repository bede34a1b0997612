"""What a gearbox actuator does under switching valves, and what that costs: three functions.

``judging`` runs plans through the model of :mod:`linearize.shift_sample` as it is, ``linearised``
gives its affine modes along one plan, and ``ranking`` the cost of every pair of plans under these
modes, in which the effects of the two valves add up.  The cost is :mod:`controllers.shift_cost`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import casadi as ca
import numpy as np

from controllers.judging import Judging
from controllers.ranking import Ranking
from controllers.shift_cost import ShiftCost, beyond_weights, end_cost, stage_cost
from linearize.shift_sample import half_stroke_m, one_sample, softened
from linearize.shifting import POSITION
from linearize.valve_sample import standing
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant

LONG_S, NEAREST_M = 0.3, 4e-3  # when a shift is over, and how far Neutral swings in the model


@dataclass(frozen=True)
class ShiftPrediction:
    """Compiled functions over N samples; what is asked for is a :func:`query`.

    linearised    (x, shares (4, N)) -> positions and velocities (2 N,), their slopes (2 N, 4 N)
                  in the shares: those of the first valve, of each sample both, then the second's
    ranking       the costs of every pair of plans under these modes
    judging       the costs of plans by the nonlinear model
    """

    linearised: ca.Function
    ranking: Ranking
    judging: Judging

    @cached_property
    def along(self) -> Callable[..., list[np.ndarray]]:
        """``linearised``, ready to be called at every sample."""
        return prepared(self.linearised)

    def __getstate__(self) -> dict[str, object]:
        """Without what another process makes anew."""
        return {key: value for key, value in self.__dict__.items() if key != "along"}


def shift_prediction(
    plant: Plant, cost: ShiftCost, sample_time_s: float, horizon: int, plans: int
) -> ShiftPrediction:
    """The functions for ``horizon`` samples, ``plans`` of each valve."""
    model, stroke_m = softened(plant), half_stroke_m(plant)
    stage, end = stage_cost(cost, stroke_m, sample_time_s), end_cost(cost, stroke_m, sample_time_s)
    weights = beyond_weights(cost, horizon)
    stopped = one_sample(model, stroke_m, sample_time_s, stops=True)
    free = one_sample(model, stroke_m, sample_time_s, stops=False)
    return ShiftPrediction(
        linearised=compiled(_linearised(free, horizon)),
        ranking=_ranking(stage, end, weights, plans),
        judging=_judging(stopped, stage, end, weights),
    )


def query(target_m: float, start_m: float, place_m: float, met: bool = False) -> np.ndarray:
    """What a shift is asked with on its way: (target, side, 1 at a stop and 0 at Neutral, left).

    ``side`` is the sign of the way from ``start_m`` to the target; a stop is met from inside,
    wherever the noise of a sensor sees the start.  ``left`` is the way that is left from
    ``place_m``, at a stop the least so far: none where it was ``met``.
    """
    side = np.sign(target_m) if target_m else (1.0 if start_m <= 0.0 else -1.0)
    at_stop, left_m = target_m != 0.0, side * (target_m - place_m)
    return np.array([target_m, side, at_stop, min(left_m, 0.0) if at_stop and met else left_m])


def drives(plant: Plant, sample_time_s: float) -> dict[float, tuple[int, int]]:
    """By dedicated position the commands of both valves that end there when they are held.

    Raises
    ------
    InputError
        If there is a position to which no commands lead from everywhere.
    """
    stroke_m, model = half_stroke_m(plant), softened(plant)
    step = one_sample(model, stroke_m, sample_time_s, stops=True).slice("step", [0, 1], [0])
    run = step.fold(round(LONG_S / sample_time_s))
    place = model.states.index(POSITION)
    places, found = (-stroke_m, 0.0, stroke_m), {}
    for commands in product((0, 1), repeat=2):
        x = np.tile(model.initial[:, None], 3)
        x[place] = places
        ends = [float(run(start, standing(commands))[place]) for start in x.T]
        for target_m in places:
            if max(abs(end - target_m) for end in ends) < NEAREST_M:
                found[target_m] = commands
    missing = [f"{1e3 * p:g} mm" for p in places if p not in found]
    if missing:
        what = f"no commands of {plant.name} lead to {listed(missing)} from everywhere"
        raise InputError(Message(what, expected="a supply that moves the piston"))
    return {p: found[p] for p in places}


def _linearised(step: ca.Function, horizon: int) -> ca.Function:
    x, share, now = ca.SX.sym("x", 4), ca.SX.sym("share", 4), ca.SX.sym("now", horizon)
    slopes = ca.SX.sym("slopes", 4, 4 * horizon)
    later = step(x, share)[0]
    A, B = ca.jacobian(later, x), ca.jacobian(later, share)
    pushed = A @ slopes + ca.horzcat(ca.kron(now.T, B[:, :2]), ca.kron(now.T, B[:, 2:]))
    one = ca.Function("one", [x, slopes, share, now], [later, pushed])
    start, shares = ca.MX.sym("x", 4), ca.MX.sym("shares", 4, horizon)
    way, slope = [], []
    at, grown = start, ca.MX(4, 4 * horizon)
    for k in range(horizon):
        at, grown = one(at, ca.densify(grown), shares[:, k], ca.DM(np.eye(horizon)[k]))
        way.append(at[2:])
        slope.append(grown[2:, :])
    places = ca.vertcat(*(v[0] for v in way), *(v[1] for v in way))
    steep = ca.vertcat(*(m[0, :] for m in slope), *(m[1, :] for m in slope))
    return ca.Function("linearised", [start, shares], [places, steep])


def _ranking(stage: ca.Function, end: ca.Function, weights: np.ndarray, plans: int) -> Ranking:
    horizon = len(weights)
    n = 2 * horizon
    begun, second = ca.SX.sym("begun", n), ca.SX.sym("second", n)
    query = ca.SX.sym("query", 4)
    at, total, far = begun + second, 0.0, query[3]
    for k in range(horizon):
        paid, far = stage(far, at[k], at[horizon + k], query, weights[k])
        total += paid
    total += end(far, at[n - 1], query)
    pair = ca.Function("pair", [begun, second, query], [ca.cse(total)])
    return Ranking(pair, plans)


def _judging(
    step: ca.Function, stage: ca.Function, end: ca.Function, weights: np.ndarray
) -> Judging:
    weight, total = ca.SX.sym("weight"), ca.SX.sym("total")
    x, share, query = ca.SX.sym("x", 4), ca.SX.sym("share", 4), ca.SX.sym("query", 4)
    far = ca.SX.sym("far")
    later, met_m_s = step(x, share)
    paid, left = stage(far, later[2], met_m_s, query, weight)
    memory = ca.vertcat(x, far, total)
    result = ca.vertcat(later, left, total + paid)
    sample = ca.Function("sample", [memory, share, query, weight], [result])
    last = ca.Function("last", [memory, query], [total + end(far, x[3], query)])
    return Judging(sample, last, weights)
