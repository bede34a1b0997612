"""A first-order lag that vanishes with its time constant.

    T_e dz/dt = u - z,   T_e = T + shortest exp(-T / shortest)
    out = u + g (z - u),   g = 1 - exp(-T / shortest)

For T well above the shortest time this is the plain lag; at T = 0 it passes u unchanged.  A small
lag shows by -T du/dt alone, and g T_e is T there: no share is left to be fitted beside the time.

Source: share form of architecture.md section 4.
"""

from __future__ import annotations

import casadi as ca

from workbench.effect import Expression


def behind_lag(
    entering: Expression, lagged: Expression, time_constant_s: Expression, shortest_s: Expression
) -> Expression:
    """What comes out where ``entering`` goes in; ``lagged`` is the state."""
    share = 1.0 - ca.exp(-time_constant_s / shortest_s)
    return entering + share * (lagged - entering)


def lagged_rate(
    entering: Expression, lagged: Expression, time_constant_s: Expression, shortest_s: Expression
) -> Expression:
    """Rate of the lagged state, per second."""
    return (entering - lagged) / (
        time_constant_s + shortest_s * ca.exp(-time_constant_s / shortest_s)
    )
