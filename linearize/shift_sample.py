"""The gearbox actuator over one sample, as controllers and estimators predict it.

The model is the reduced one of :mod:`linearize.shifting` with dry friction, detent and wall heat,
state (p1, p2, x, v).  Each valve passes a share of its charging flow and one of its venting flow,
see :mod:`linearize.valve_sample`; shares are (charging 1, venting 1, charging 2, venting 2).  A
stop returns a share of the speed; a floating piston is picked up at Neutral without rebound.  A
sample is one step of ROS2, linearly implicit in the velocity alone, which dry friction makes stiff.

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
    shift_model,
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
    """(x, shares (4,)) -> (x one sample later, velocity before what it met at the end of it).

    Without stops the piston goes on beyond, in a volume that no longer shrinks: what an affine mode
    needs, since a stopped piston has no slope.
    """
    x, shares = model.symbols[0], ca.SX.sym("shares", 4)
    place, speed = model.states.index(POSITION), model.states.index(VELOCITY)
    rates = _rates(model, stroke_m)
    slope = ca.jacobian(rates(x, shares)[speed], x[speed])
    hindered = ca.Function("hindered", [x, shares], [slope])

    def damped(at: ca.SX, right: ca.SX) -> ca.SX:
        unit = [1.0] * len(model.states)
        unit[speed] = 1.0 / (1.0 - GAMMA * dt * hindered(at, shares))
        return ca.vertcat(*unit) * right

    k1 = damped(x, rates(x, shares))
    k2 = damped(x, rates(x + dt * k1, shares) - 2.0 * k1)
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
    return ca.Function("one_sample", [x, shares], [later, met_m_s])


def _rates(model: DesignModel, stroke_m: float) -> ca.Function:
    """(x, shares) -> dx/dt; inside the stops, which act apart.

    Both valves held at an end pass all that this end passes, a model without valves nothing.
    """
    x, shares = model.symbols[0], ca.SX.sym("shares", 4)
    place, end_m = model.states.index(POSITION), stroke_m - INSIDE_M
    inside = ca.SX(x)
    inside[place] = ca.fmin(ca.fmax(x[place], -end_m), end_m)
    rates = shift_model(model.plant, omitted=()).f(inside, [0.0, 0.0])[0]
    charging, venting = (model.f(inside, [u, u])[0] - rates for u in (1.0, 0.0))
    for k, name in enumerate(PRESSURES):
        row = model.states.index(name)
        rates[row] += shares[2 * k] * charging[row] + shares[2 * k + 1] * venting[row]
    return ca.Function("rates", [x, shares], [ca.cse(rates)])
