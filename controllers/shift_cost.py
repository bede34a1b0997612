"""What a shift of a gearbox actuator costs, as CasADi functions of one sample and of the last.

    cost = sum dt (d_k + w_k over_k) + T_end d_N + T_land (sum off_k^2 + fast^2)
    off_k = max(|v_k| - v_land, v_arr - |v_k|, 0)
    fast = max(v_N - v_safe, 0),  v_safe = v_land - a t + sqrt((a t)^2 + 2 a far_N)

d grows with the distance that is left of a shift and is 1 for the way from Neutral to an end, and
``over`` is what is gone further than tolerated past Neutral, or a share of what is bounced off an
end; the second sum is over the samples at which the target is reached, and v_safe the speed that a
brake with deceleration a after a delay t still takes away.

An end that is to be met with less than v_arr is easily missed: a piston whose friction is a little
larger stands short of it until the pressure has built up again.  At Neutral v_arr is 0.  An end is
met once, however often the piston bounces off it, pushed by the pressure that has braked it: d_N
and far_N are there of the least distance so far, and what it bounces is in ``over`` alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

HIT = 1e-9
LAST_BIT, LAST_BIT_TO_STOP = 0.25, 0.6
"""Share of the cost that goes with the root of the distance, at Neutral and at a stop: a shift ends
when it is there.  With less a stop is braked for so early that the piston stands short of it."""


@dataclass(frozen=True, kw_only=True)
class ShiftCost:
    """Numbers of the cost; times say what one sample of the whole way is worth.

    within_m            distance from the target that costs nothing
    beyond_m            tolerated past Neutral, and off an end that was met
    beyond_weight       w_1, of what is gone further; ``beyond_later`` the share w_N of it
    bounced             share of what the piston bounces off its end that counts as gone past it
    landing_m_s         v_land at an end; ``neutral_m_s`` at Neutral
    arriving_m_s        v_arr, with which an end is to be met at least
    landing_s           T_land, s per (m/s)^2
    end_s               T_end
    brake_m_s2          a
    brake_after_s       t
    """

    within_m: float
    beyond_m: float
    beyond_weight: float
    beyond_later: float
    bounced: float
    landing_m_s: float
    neutral_m_s: float
    arriving_m_s: float
    landing_s: float
    end_s: float
    brake_m_s2: float
    brake_after_s: float


def stage_cost(cost: ShiftCost, stroke_m: float, dt: float) -> ca.Function:
    """(far before, position, velocity, query, w of the sample) -> (cost in samples, far).

    At a stop the latter is the least so far: an end is met once.  The query is that of
    :func:`controllers.shift_prediction.query`; what was left when it was asked is not read here.
    """
    names = ("before", "x", "v", "w")
    before, at, speed, weight = (ca.SX.sym(name) for name in names)
    query = ca.SX.sym("q", 4)
    target, side, at_stop, _ = ca.vertsplit(query)
    far = side * (target - at)
    distance = _distance(cost, stroke_m, far, at_stop)
    back_m = (before <= HIT) * far  # of a piston that has met its end
    gone_m, counted = ca.if_else(at_stop, back_m, -far), ca.if_else(at_stop, cost.bounced, 1.0)
    beyond = counted * ca.fmax(gone_m - cost.beyond_m, 0.0) / stroke_m
    reached = ca.logic_and(before > HIT, far <= HIT)
    returned = ca.logic_and(ca.logic_and(before < -HIT, far >= -HIT), 1.0 - at_stop)
    gentle_m_s = ca.if_else(at_stop, cost.landing_m_s, cost.neutral_m_s)
    faint_m_s, met_m_s = at_stop * cost.arriving_m_s, ca.fabs(speed)
    off_m_s = ca.fmax(ca.fmax(met_m_s - gentle_m_s, faint_m_s - met_m_s), 0.0)
    met = ca.logic_or(reached, returned) * (cost.landing_s / dt) * off_m_s**2
    paid = distance + weight * beyond + met
    # as if_else(at_stop, fmin(far, before), far), in fewer operations: a sample asks for thousands
    nearest = ca.fmin(far, before + (1.0 - at_stop) * stroke_m * 10.0)
    return ca.Function("stage", [before, at, speed, query, weight], [paid, nearest])


def beyond_weights(cost: ShiftCost, horizon: int) -> np.ndarray:
    """The weight w of each sample of the horizon, shape (N,).

    It falls: what is seen to go past Neutral, or to bounce, later can still be mended.
    """
    return cost.beyond_weight * np.linspace(1.0, cost.beyond_later, horizon)


def end_cost(cost: ShiftCost, stroke_m: float, dt: float) -> ca.Function:
    """(far, velocity, query) -> cost in samples of what is left at the end of the horizon."""
    far, speed, query = ca.SX.sym("far"), ca.SX.sym("v"), ca.SX.sym("q", 4)
    lost_m_s, way_m = cost.brake_m_s2 * cost.brake_after_s, ca.fmax(far, 0.0)
    gentle_m_s = ca.if_else(query[2], cost.landing_m_s, cost.neutral_m_s)
    safe_m_s = gentle_m_s - lost_m_s + ca.sqrt(lost_m_s**2 + 2.0 * cost.brake_m_s2 * way_m)
    fast = ca.fmax(query[1] * speed - safe_m_s, 0.0) ** 2 * (far > HIT)
    left = _distance(cost, stroke_m, far, query[2])
    paid = (cost.end_s * left + cost.landing_s * fast) / dt
    return ca.Function("end", [far, speed, query], [paid])


def _distance(cost: ShiftCost, stroke_m: float, far: ca.SX, at_stop: ca.SX) -> ca.SX:
    """What is left of a shift, 1 for the whole way; past a stop nothing is."""
    left = ca.if_else(at_stop, far, ca.fabs(far))
    share = ca.fmax(left - cost.within_m, 0.0) / stroke_m
    last = ca.if_else(at_stop, LAST_BIT_TO_STOP, LAST_BIT)
    return (1.0 - last) * share + last * ca.sqrt(share)
