"""The gearbox actuator over one sample, as controllers and estimators predict it.

The model is the reduced one of :mod:`linearize.shifting` with dry friction, detent and wall heat,
state (p1, p2, x, v); its valves pass the share e of their charging flow and 1 - e of their venting
one, see :mod:`linearize.valve_response`.  A stop returns a share of the speed; a floating piston is
picked up at Neutral without rebound.  A sample is one step of ROS2, linearly implicit in the
velocity alone, which dry friction makes stiff.

Source: Verwer et al. 1999, "A second-order Rosenbrock method applied to photochemical dispersion
problems" (ROS2 keeps its order with any approximation of the Jacobian).
"""

from __future__ import annotations

import casadi as ca

from linearize.reduction import DesignModel
from linearize.shifting import (
    INSIDE_M,
    POSITION,
    PRESSURES,
    VELOCITY,
    carried_share,
    switched_shift_model,
)
from workbench.effects.forces import EndStops
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.plant import Plant
from workbench.plants.gearbox import MAIN

GAMMA = 1.0 - 0.5**0.5
STEEPNESS_S_M = 300.0  # of dry friction: full at 10 mm/s, and no faster than a sample resolves
LEAST_PA = 2e4  # a pressure that a step has missed; no gas is there
REBOUND = 0.2  # of the speed at a stop, read off the whole plant: the finger takes part in it


def softened(plant: Plant) -> DesignModel:
    """The reduced model with all that hinders a shift, its dry friction less steep."""
    frictions = (e.name for e in plant.effects if isinstance(e, StribeckFriction))
    steepness = {f"{name}.steepness_s_m": STEEPNESS_S_M for name in frictions}
    return switched_shift_model(plant.with_values(steepness), omitted=())


def half_stroke_m(plant: Plant) -> float:
    """From Neutral to either end."""
    stops = (e for e in plant.effects if isinstance(e, EndStops) and e.body == MAIN)
    return float(next(stops).upper_m)


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
    later[speed] *= ca.if_else(taken, carried_share(model), 1.0)
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
