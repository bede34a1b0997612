"""What a gearbox actuator does under switching valves, and what that costs: three functions.

The model is the reduced one of :mod:`linearize.shifting` with dry friction, detent and wall heat,
state (p1, p2, x, v); its valves pass the share e of their charging flow and 1 - e of their venting
one.  ``judged`` runs it as it is, ``linearised`` gives the affine modes along one plan, ``ranked``
the cost of every pair of plans under these modes, in which the effects of the two valves add up.

A stop returns a share of the speed; a floating piston is picked up at Neutral without rebound.
A sample is one step of ROS2, linearly implicit in the velocity alone, which dry friction makes
stiff.

Source: Verwer et al. 1999, "A second-order Rosenbrock method applied to photochemical dispersion
problems" (ROS2 keeps its order with any approximation of the Jacobian).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import casadi as ca
import numpy as np

from controllers.shift_cost import ShiftCost, end_cost, stage_cost
from linearize.reduction import DesignModel
from linearize.shifting import POSITION, PRESSURES, VELOCITY, switched_shift_model
from workbench.compiled import compiled
from workbench.effects.forces import EndStops
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant
from workbench.plants.gearbox import MAIN

GAMMA = 1.0 - 0.5**0.5
STEEPNESS_S_M = 300.0  # of dry friction: full at 10 mm/s, and no faster than a sample resolves
LEAST_PA = 2e4  # a pressure that a step has missed; no gas is there
INSIDE_M = 1e-6
REBOUND = 0.2  # of the speed at a stop, read off the whole plant: the finger takes part in it
LONG_S, NEAREST_M = 0.3, 4e-3  # when a shift is over, and how far Neutral swings in the model


@dataclass(frozen=True)
class ShiftPrediction:
    """Compiled functions over N samples; a query is (target, side, 1 at a stop and 0 at Neutral).

    ``side`` is the sign of the way to the target.

    linearised    (x, shares (2, N)) -> positions and velocities (2 N,), their slopes (2 N, 2 N)
    ranked        (way (2 N,), D1, D2 (2 N, n), query, x) -> cost of plan i and j at n i + j
    judged        (x, shares (2, N k), query) -> cost (k,)
    """

    linearised: ca.Function
    ranked: ca.Function
    judged: ca.Function


def shift_prediction(
    plant: Plant, cost: ShiftCost, sample_time_s: float, horizon: int, plans: int, kept: int
) -> ShiftPrediction:
    """The functions for ``horizon`` samples, ``plans`` of each valve, ``kept`` pairs to judge."""
    model, stroke_m = softened(plant), half_stroke_m(plant)
    stage, end = stage_cost(cost, stroke_m, sample_time_s), end_cost(cost, stroke_m, sample_time_s)
    stopped = one_sample(model, stroke_m, sample_time_s, stops=True)
    free = one_sample(model, stroke_m, sample_time_s, stops=False)
    return ShiftPrediction(
        linearised=compiled(_linearised(free, horizon)),
        ranked=compiled(_ranked(stage, end, horizon, plans)),
        judged=compiled(_judged(stopped, stage, end, horizon, kept)),
    )


def softened(plant: Plant) -> DesignModel:
    """The reduced model with all that hinders a shift, its dry friction less steep."""
    frictions = (e.name for e in plant.effects if isinstance(e, StribeckFriction))
    steepness = {f"{name}.steepness_s_m": STEEPNESS_S_M for name in frictions}
    return switched_shift_model(plant.with_values(steepness), omitted=())


def half_stroke_m(plant: Plant) -> float:
    """From Neutral to either end."""
    stops = (e for e in plant.effects if isinstance(e, EndStops) and e.body == MAIN)
    return float(next(stops).upper_m)


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
        ends = [float(run(start, list(commands))[place]) for start in x.T]
        for target_m in places:
            if max(abs(end - target_m) for end in ends) < NEAREST_M:
                found[target_m] = commands
    missing = [f"{1e3 * p:g} mm" for p in places if p not in found]
    if missing:
        what = f"no commands of {plant.name} lead to {listed(missing)} from everywhere"
        raise InputError(Message(what, expected="a supply that moves the piston"))
    return {p: found[p] for p in places}


def one_sample(model: DesignModel, stroke_m: float, dt: float, *, stops: bool) -> ca.Function:
    """(x, share (2,)) -> (x one sample later, velocity before what it met at the end of it).

    Without stops the piston goes on beyond, in a volume that no longer shrinks: what an affine mode
    needs, since a stopped piston has no slope.
    """
    x, share = model.symbols[0], ca.SX.sym("share", 2)
    place, speed = model.states.index(POSITION), model.states.index(VELOCITY)
    rates = _rates(model, stroke_m)
    slope = ca.jacobian(rates(x, share)[speed], x[speed])
    hindered = ca.Function("hindered", [x, share], [slope])

    def damped(at: ca.SX, right: ca.SX) -> ca.SX:
        unit = [1.0] * len(model.states)
        unit[speed] = 1.0 / (1.0 - GAMMA * dt * hindered(at, share))
        return ca.vertcat(*unit) * right

    k1 = damped(x, rates(x, share))
    k2 = damped(x, rates(x + dt * k1, share) - 2.0 * k1)
    later = x + dt * (1.5 * k1 + 0.5 * k2)
    for name in PRESSURES:
        row = model.states.index(name)
        later[row] = ca.fmax(later[row], LEAST_PA)
    met_m_s = later[speed]
    taken = ca.logic_and(x[place] <= 0.0, later[place] > 0.0)
    later[speed] *= ca.if_else(taken, _carried(model), 1.0)
    if stops:
        outwards = ca.fabs(later[place]) >= stroke_m
        outwards = ca.logic_and(outwards, later[place] * later[speed] > 0.0)
        later[speed] *= ca.if_else(outwards, -REBOUND, 1.0)
        later[place] = ca.fmin(ca.fmax(later[place], -stroke_m), stroke_m)
    return ca.Function("one_sample", [x, share], [later, met_m_s])


def _rates(model: DesignModel, stroke_m: float) -> ca.Function:
    """(x, share) -> dx/dt, mixed of both ends of each valve; inside the stops, which act apart."""
    x, share = model.symbols[0], ca.SX.sym("share", 2)
    place, end_m = model.states.index(POSITION), stroke_m - INSIDE_M
    inside = ca.SX(x)
    inside[place] = ca.fmin(ca.fmax(x[place], -end_m), end_m)
    f = ca.Function("f", [*model.symbols], [model.f(*model.symbols)[0]])
    none, first, second = (f(inside, u) for u in ([0, 0], [1, 0], [0, 1]))
    mixed = none + share[0] * (first - none) + share[1] * (second - none)
    return ca.Function("rates", [x, share], [ca.cse(mixed)])


def _carried(model: DesignModel) -> float:
    """Share of its speed that the main piston keeps as it picks the floating one up.

    That is the ratio of the moving masses, seen in what one pressure does on either side.
    """
    return _push(model, INSIDE_M) / _push(model, -INSIDE_M)


def _push(model: DesignModel, place_m: float) -> float:
    """Acceleration by the pressure of chamber 1, at rest at a place, m/s2 per Pa."""
    x = model.initial.copy()
    x[model.states.index(POSITION)] = place_m
    row, column = model.states.index(VELOCITY), model.states.index(PRESSURES[0])
    return float(model.jacobians(x, [0.0, 0.0])[0][row, column])


def _linearised(step: ca.Function, horizon: int) -> ca.Function:
    x, share, now = ca.SX.sym("x", 4), ca.SX.sym("share", 2), ca.SX.sym("now", horizon)
    slopes = ca.SX.sym("slopes", 4, 2 * horizon)
    later = step(x, share)[0]
    A, B = ca.jacobian(later, x), ca.jacobian(later, share)
    pushed = A @ slopes + ca.horzcat(B[:, 0] @ now.T, B[:, 1] @ now.T)
    one = ca.Function("one", [x, slopes, share, now], [later, pushed])
    start, shares = ca.MX.sym("x", 4), ca.MX.sym("shares", 2, horizon)
    way, slope = [], []
    at, grown = start, ca.MX(4, 2 * horizon)
    for k in range(horizon):
        at, grown = one(at, ca.densify(grown), shares[:, k], ca.DM(np.eye(horizon)[k]))
        way.append(at[2:])
        slope.append(grown[2:, :])
    places = ca.vertcat(*(v[0] for v in way), *(v[1] for v in way))
    steep = ca.vertcat(*(m[0, :] for m in slope), *(m[1, :] for m in slope))
    return ca.Function("linearised", [start, shares], [places, steep])


def _ranked(stage: ca.Function, end: ca.Function, horizon: int, plans: int) -> ca.Function:
    n = 2 * horizon
    way, first, second = (ca.SX.sym(k, n) for k in ("way", "first", "second"))
    query, x = ca.SX.sym("query", 3), ca.SX.sym("x", 4)
    at, total = way + first + second, 0.0
    far = query[1] * (query[0] - x[2])
    for k in range(horizon):
        paid, far = stage(far, at[k], at[horizon + k], query)
        total += paid
    pair = ca.Function(
        "pair", [way, first, second, query, x], [ca.cse(total + end(far, at[n - 1], query))]
    )
    sizes = ((n, 1), (n, plans), (n, plans), (3, 1), (4, 1))
    inputs = [ca.MX.sym(f"i{k}", *size) for k, size in enumerate(sizes)]
    left = np.repeat(np.arange(plans), plans).tolist()
    right = np.tile(np.arange(plans), plans).tolist()
    many = pair.map("pairs", "serial", plans**2, [0, 3, 4], [])
    costs = many(inputs[0], inputs[1][:, left], inputs[2][:, right], *inputs[3:])
    return ca.Function("ranked", inputs, [costs.T])


def _judged(
    step: ca.Function, stage: ca.Function, end: ca.Function, horizon: int, kept: int
) -> ca.Function:
    x, share, query = ca.SX.sym("x", 4), ca.SX.sym("share", 2), ca.SX.sym("query", 3)
    far, total = ca.SX.sym("far"), ca.SX.sym("total")
    later, met_m_s = step(x, share)
    paid, left = stage(far, later[2], met_m_s, query)
    memory = ca.vertcat(x, far, total)
    result = ca.vertcat(later, left, total + paid)
    one = ca.Function("one", [memory, share, query], [result])
    start, shares = ca.MX.sym("x", 4), ca.MX.sym("shares", 2, horizon)
    asked = ca.MX.sym("query", 3)
    begun = ca.vertcat(start, asked[1] * (asked[0] - start[2]), 0.0)
    done = one.fold(horizon)(begun, shares, ca.repmat(asked, 1, horizon))
    plan = ca.Function("plan", [start, shares, asked], [done[5] + end(done[4], done[3], asked)])
    many = plan.map("plans", "serial", kept, [0, 2], [])
    inputs = [start, ca.MX.sym("all", 2, horizon * kept), asked]
    return ca.Function("judged", inputs, [many(*inputs).T])
